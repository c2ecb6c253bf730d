//! The samples that stand in recordings, field by field.

use super::{
    FieldDescription, Malformed, Message, Origin, Shape, Value as _, Wire, message, message_of,
    put_part, shape_of, wire,
};
use messages::{
    Command, Fault, Feedback, GateEdge, Given, LaserCycle, MAX_EDGES, OperatorRequest, Sample as _,
    Setpoint,
};

message! {
    Feedback {
        1 epoch epoch "run of drives, against that of the cycle",
        2 cycle cycle "cycle that starts with this measurement, against that of the message",
        3 deadline stamp "deadline of the cycle [ns after the log time]",
        4 measured stamp "when the measurement was taken [ns after the log time]",
        5 published stamp "when drives published it [ns after the log time]",
        6 exchange plain "how long the exchange with hardware or plant took [ns]",
        7 command_cycle cycle "cycle that the command in force answers, against that of the message",
        8 command_received stamp "when that command reached drives [ns after the log time]",
        9 command_published stamp "when the controller published that command [ns after the log time]",
        10 command_applied stamp "when that command was applied [ns after the log time]",
        11 missed plain "cycles so far without a fresh command",
        12 overruns plain "cycles so far whose work did not end in time",
        13 status plain "1 powered, 2 tool known, 4 command missed, 8 watchdog tripped, 16 slipping, 32 gate inhibited",
        14 skipped plain "cycles left out since the feedback before",
        15 homing plain "actuators whose drives look for their references by themselves, one bit each",
        16 inputs plain "digital inputs, one bit each",
        17 counts plain "encoder counts by actuator",
        18 position plain "motor position by actuator [rad]",
        19 velocity plain "motor velocity by actuator [rad/s]",
        20 current plain "motor current by actuator [A]",
        21 tool plain "tool centre point in the machine frame [m]",
        22 laser message "what the laser did since the feedback before",
        23 fault message "the fault of the drives",
    }
}

message! {
    Command {
        1 epoch epoch "run of drives that it answers, against that of the cycle",
        2 cycle cycle "feedback that it answers, against the cycle of the message",
        3 reset plain "ticket of the newest reset that a person asked for",
        4 stream plain "stream being played, 0 for none",
        5 stroke plain "stroke being marked when it acts, from 1; 0 for none",
        6 received stamp "when the controller read the feedback [ns after the log time]",
        7 published stamp "when the controller published it [ns after the log time]",
        8 setpoint_published stamp "when the planner published the newest setpoint used [ns after the log time]",
        9 mode plain "0 disabled, 4 driven, 5 quick stop",
        10 state plain "state of the controller",
        11 outputs plain "digital outputs, one bit each",
        12 stream_time plain "stream time at the deadline [s]",
        13 rate plain "rate at which the stream is played, 1 as planned",
        14 tool plain "where the plan has the tool, machine frame [m]",
        15 reference plain "position reference by actuator [rad at the motor]",
        16 following_error plain "reference minus feedback by actuator [rad at the motor]",
        17 position plain "target position at the end of the next cycle by actuator [rad at the motor]",
        18 velocity plain "target velocity in the next cycle by actuator [rad/s at the motor]",
        19 effort plain "target torque in the next cycle by actuator [N m at the motor]",
        20 voltage plain "motor voltage in the next cycle by actuator [V]",
        21 laser message "the laser in the next cycle",
        22 fault message "the latched fault",
        23 homing plain "actuators whose drives shall look for their references by themselves, one bit each",
        24 number plain "answers of this controller so far, this one included",
        25 given message "what it was made of, beside feedback and setpoints",
    }
}

message! {
    Given {
        1 newest stamp "when the newest setpoint was published that was taken [ns after the log time]",
        2 setpoints plain "how many setpoints were taken",
        3 lost plain "peers that were lost: 1 planner, 2 drives, 4 supervisor",
        4 slow plain "inputs that slow devices made active, one bit each",
        5 request message "the request that was carried out or refused",
    }
}

message! {
    Fault {
        1 code plain "what is wrong; 0 nothing",
        2 axis plain "axis from 1, 0 for none",
        3 actuator plain "actuator from 1, 0 for none",
        4 quantity plain "what value and limit measure",
        5 limited plain "1 when there is a limit",
        6 value plain "the offending value [SI]",
        7 limit plain "the limit that it broke [SI]",
        8 at plain "when it was found [ns on the clock of the log time]",
    }
}

message! {
    Setpoint {
        1 stream plain "stream that it belongs to",
        2 sequence plain "position in the stream, from 0",
        4 flags plain "1 last, 2 pause, 4 lit for a frame, 8 rapid",
        5 outputs plain "what the job has switched on, one bit each",
        6 stroke plain "stroke being marked from here on, from 1; 0 for none",
        7 tool plain "tool centre point in the machine frame [m]",
        8 path_velocity plain "speed along the path [m/s]",
        9 path_acceleration plain "acceleration of the tool [m/s^2]",
        10 path_jerk plain "jerk of the tool [m/s^3]",
        11 position plain "joint position by axis [m or rad]",
        12 velocity plain "joint velocity by axis [m/s or rad/s]",
        13 acceleration plain "joint acceleration by axis [m/s^2 or rad/s^2]",
        14 jerk plain "joint jerk by axis [m/s^3 or rad/s^3]",
        15 lead plain "motor side ahead of the load by actuator [m or rad]",
        16 static_lead plain "the part of it that does not move with the rate [m or rad]",
        17 lead_momentum plain "lead per unit of rate change by actuator [m s or rad s]",
        18 effort plain "motor torque without friction by actuator [N m]",
        19 static_effort plain "the part of it that does not move with the rate [N m]",
        20 momentum plain "motor torque per unit of rate change by actuator [N m s]",
        21 laser message "the laser from here to the next setpoint",
        22 line plain "line of the job file where the motion begins, from 1; 0 where it has none",
        23 published stamp "when the planner published it [ns after the log time]",
    }
}

message! {
    OperatorRequest {
        1 verb plain "what is asked for",
        2 ticket plain "number of the request",
        3 axis plain "axis from 1, or bits of axes",
        4 reserved plain "always 0",
        5 value plain "argument of the verb [SI]",
        6 second plain "its second argument [SI]",
    }
}

/// The edges are told as lists by what they have, which takes less than a list of edges.
impl Message for LaserCycle {
    const TITLE: &'static str = "LaserCycle";

    fn description() -> Vec<FieldDescription> {
        let field =
            |(number, name, shape, meaning)| FieldDescription { number, name, shape, meaning };
        [
            (
                1,
                "gate",
                Shape::Number,
                "stroke being marked when the cycle starts, from 1; 0 is dark",
            ),
            (2, "edge_count", Shape::Number, "how many edges count"),
            (3, "power", Shape::Double, "power when the cycle starts, 0 to 1"),
            (4, "frequency", Shape::Double, "pulse repetition rate [1/s], 0 as the source is set"),
            (
                5,
                "edge_offset",
                Shape::Signeds,
                "time of each edge from the start of the cycle [ns]",
            ),
            (6, "edge_gate", Shape::Signeds, "stroke being marked from each edge on; 0 is dark"),
            (7, "edge_power", Shape::Doubles, "power from each edge on, 0 to 1"),
        ]
        .map(field)
        .into()
    }

    fn put(&self, _: &Origin, out: &mut Vec<u8>) {
        self.gate.put(1, out);
        self.edge_count.put(2, out);
        self.power.put(3, out);
        self.frequency.put(4, out);
        self.edges.map(|edge| i64::from(edge.offset)).put(5, out);
        self.edges.map(|edge| i64::from(edge.gate)).put(6, out);
        self.edges.map(|edge| edge.power).put(7, out);
    }

    fn absent(_: &Origin) -> Self {
        Self::zeroed()
    }

    fn take(&mut self, number: u32, wire: Wire<'_>, _: &Origin) -> Result<(), Malformed> {
        let mut whole = [0_i64; MAX_EDGES];
        let part = |value: i64| u32::try_from(value).map_err(|_| Malformed);
        let mut edges = |set: &dyn Fn(&mut GateEdge, i64) -> Result<(), Malformed>| {
            whole.take(wire)?;
            self.edges.iter_mut().zip(whole).try_for_each(|(edge, value)| set(edge, value))
        };
        match number {
            1 => self.gate.take(wire),
            2 => self.edge_count.take(wire),
            3 => self.power.take(wire),
            4 => self.frequency.take(wire),
            5 => edges(&|edge, value| part(value).map(|offset| edge.offset = offset)),
            6 => edges(&|edge, value| part(value).map(|gate| edge.gate = gate)),
            7 => {
                let mut powers = self.edges.map(|edge| edge.power);
                powers.take(wire)?;
                self.edges.iter_mut().zip(powers).for_each(|(edge, power)| edge.power = power);
                Ok(())
            }
            _ => Ok(()),
        }
    }
}
