//! How long a controller step takes: plays a long stream with motors that follow exactly.
//!
//! `cargo run --release -p controller --example step_time`

use std::time::Instant;

use controller::{Controller, Inputs, Outputs, Peers};
use machine::Machine;
use signals::feedback::status;
use signals::{
    CommandMode, ControllerState, Cycle, Feedback, Nanoseconds, OperatorRequest, OperatorVerb,
    Setpoint, math,
};

const SETPOINTS: u64 = 200_000;

fn main() {
    let machine = Machine::builtin();
    let home = [machine.home[0] + machine.home[1], machine.home[0] - machine.home[1]];
    let stream: Vec<Setpoint> = (0..SETPOINTS)
        .map(|sequence| {
            let angle = sequence as f64 * 0.01;
            let mut setpoint = Setpoint { stream: 1, sequence, ..Setpoint::default() };
            for (index, home) in home.iter().enumerate() {
                setpoint.position[index] = home + 0.005 * (1.0 - math::cos(angle));
                setpoint.velocity[index] = 0.05 * math::sin(angle);
                setpoint.acceleration[index] = 0.5 * math::cos(angle);
                setpoint.effort[index] = 0.001 * math::cos(angle);
            }
            setpoint.laser.gate = 1;
            setpoint.laser.power = 0.5;
            setpoint
        })
        .collect();
    // Rates off 1 interpolate between setpoints.
    for rate in [1.0, 0.9] {
        let mut controller = Controller::new(&machine);
        let mut outputs = Outputs::default();
        let mut feedback = Feedback { status: status::POWERED, ..Feedback::default() };
        for (index, axis) in machine.axes.iter().enumerate() {
            feedback.position[index] = home[index] / axis.ratio;
        }
        let (mut sent, mut steps, mut cycle) = (0, 0_u32, 0);
        let mut since = Instant::now();
        while sent < stream.len() {
            cycle += 1;
            let request = match cycle {
                2 => Some((OperatorVerb::Enable, 0.0)),
                3 => Some((OperatorVerb::Override, rate)),
                40 => Some((OperatorVerb::Start, 1.0)),
                _ => None,
            };
            let request = request.map(|(verb, value)| OperatorRequest {
                verb: verb as u32,
                ticket: cycle,
                value,
            });
            feedback.cycle = Cycle(u64::from(cycle));
            if outputs.command.mode() == CommandMode::Voltage {
                feedback.position = outputs.command.reference;
            }
            let end = (sent + controller.room().min(2)).min(stream.len());
            let inputs = Inputs {
                feedback: &feedback,
                received: Nanoseconds(0),
                setpoints: &stream[sent..end],
                request,
                peers: Peers::default(),
            };
            controller.step(Nanoseconds(0), &inputs, &mut outputs);
            sent = end;
            if outputs.command.state() == ControllerState::Running {
                if steps == 0 {
                    since = Instant::now();
                }
                steps += 1;
            }
        }
        let each = since.elapsed().as_secs_f64() / f64::from(steps) * 1e9;
        println!("rate {rate}: {each:.0} ns a step over {steps} steps of two axes");
    }
}
