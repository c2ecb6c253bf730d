//! The motor and the gear of an axis, as they stand in the file.

use super::choose::{Search, friction};
use super::draft::{AxisDraft, Travel, Unit};
use super::text::{about, comment, exact, line, number, quantity};
use super::worst::Worst;
use super::{Short, TOLERANCE};
use crate::size::Options;
use crate::size::candidate::Candidate;
use crate::size::checks::Use;
use core::f64::consts::TAU;
use machine::{Friction, Motor, StepperMotor};

/// Loops of position and velocity [1/s, rad/s]: those of the shipped files.
const LOOPS: [f64; 2] = [40.0, 160.0];

/// Counts or pulses that the tolerance of the path must hold.
const COUNTS: f64 = 8.0;

/// A motor with its gear on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drive {
    /// What was chosen, and why, above the motor's table.
    why: String,
    gear: f64,
    gear_name: String,
    efficiency: f64,
    motor: Motor,
    /// Inertia of the rotor, and of the gear at its shaft [kg·m²].
    inertia: [f64; 2],
    friction: Friction,
    friction_why: String,
    /// [N·m]
    brake: Option<(f64, String)>,
    /// Counts of the encoder in a turn.
    counts: f64,
    /// Travel of the tool per count [m].
    count: f64,
    range: [f64; 2],
    following: f64,
    /// Largest speed and acceleration, where the file has them.
    own: Option<[f64; 2]>,
}

impl Drive {
    pub(super) fn new(
        axis: &AxisDraft,
        worst: &Worst,
        search: &Search<'_>,
        candidate: &Candidate,
        uses: &[Use],
    ) -> Self {
        let Search { need, options: Options { margin, .. }, .. } = search;
        let Candidate { ratio, motor, .. } = candidate;
        let mut motor = *motor;
        let own = need.stiff_inertia / (candidate.gear_ratio * candidate.gear_ratio);
        let gear_inertia = motor.rotor_inertia() - candidate.rotor_inertia - own;
        let load = ratio * ratio * need.load;
        if let Motor::Stepper(stepper) = &mut motor {
            // 0.3 of what is critical.
            let inertia = stepper.rotor_inertia + load;
            stepper.damping = 0.6 * (stepper.stiffness() * inertia).sqrt();
        }
        let friction = friction(&motor, candidate);
        let friction_why = match &motor {
            Motor::Dc(_) => "the motor's own, and 5 % of its continuous torque",
            Motor::Stepper(_) => "2 % of the holding torque",
        };
        let mut counts = 4096.0;
        let count = |counts: f64| TAU / counts * ratio * worst.lever;
        while count(counts) > TOLERANCE / COUNTS && counts < 1e9 {
            counts *= 4.0;
        }
        if let Motor::Stepper(stepper) = &motor {
            counts = stepper.pulses_per_turn();
        }
        let hold = worst.gravity * ratio;
        let weight = 2.0 * hold;
        let brake = (hold > friction.coulomb * 0.9)
            .then(|| (weight, format!("twice the weight, {} mN m here", about(hold * 1e3))));
        let uses: Vec<String> = sorted(uses)
            .iter()
            .take(4)
            .map(|it| format!("{} {:.0} %", it.check.replace('_', " "), it.share * 100.0))
            .collect();
        let joint = match axis.unit {
            Unit::Length => format!(
                "{} m/s, {} m/s^2 and {} N",
                about(worst.speed),
                about(worst.acceleration),
                about(worst.effort)
            ),
            Unit::Angle => format!(
                "{} rad/s, {} rad/s^2 and {} N m",
                about(worst.speed),
                about(worst.acceleration),
                about(worst.effort)
            ),
        };
        let mut why = comment(&format!(
            "{}{}: the lightest that meets {joint} of load, the worst of the whole area, at a duty cycle of \
             50 %. With a margin of {margin}, use of its limits: {}.",
            candidate.name,
            candidate
                .gear
                .as_ref()
                .map_or_else(String::new, |gear| format!(" with the gear {gear}")),
            uses.join(", ")
        ));
        for source in &candidate.sources {
            why += &comment(&format!("Data: {}.", source.trim_end_matches('.')));
        }
        let gear_name = match (&candidate.gear, candidate.gear_ratio) {
            (Some(gear), _) => gear.clone(),
            (None, 1.0) => "no gear".to_owned(),
            (None, _) => "a gear of no catalogue: to be found or made".to_owned(),
        };
        Self {
            why,
            gear: candidate.gear_ratio,
            gear_name,
            efficiency: candidate.efficiency.dynamic.min(axis.efficiency.0),
            inertia: [candidate.rotor_inertia, gear_inertia.max(0.0)],
            friction,
            friction_why: friction_why.to_owned(),
            brake,
            count: count(counts),
            counts,
            range: worst.range,
            following: following(axis, worst, TAU / counts * ratio),
            own: axis.own.map(|[speed, acceleration]| {
                [speed.min(0.95 * motor.largest_speed() * ratio), acceleration]
            }),
            motor,
        }
    }

    /// Tables of an axis that can do anything, to ask the mechanism.
    pub(super) fn bare(axis: &AxisDraft) -> String {
        let motor = if axis.transmission.contains("planar") {
            "stepper]\nfull_steps = 4\nmicrosteps = 1000\nholding_torque = \"1e4 N m\"\n\
             rotor_inertia = \"1e-12 kg m^2\"\ncurrent = \"1 A\"\nresistance = \"1 ohm\"\n\
             inductance = \"1e-8 H\"\nvoltage = \"1e5 V\"\npulse_rate = \"1e6 kHz\""
        } else {
            "dc]\nvoltage = \"1e5 V\"\ncurrent = \"1e5 A\"\nresistance = \"1 ohm\"\n\
             inductance = \"1 mH\"\ntorque_constant = \"1 N m/A\"\nrotor_inertia = \"1e-12 kg m^2\""
        };
        let mut text = format!("[axis.{0}.motor.{motor}\n\n[axis.{0}.friction]\n", axis.name);
        text += "coulomb = \"0 N m\"\nviscous = \"0 N m s/rad\"\n\n";
        if !axis.transmission.contains("planar") {
            text +=
                &format!("[axis.{}.encoder]\nresolution = \"1000000 counts/rev\"\n\n", axis.name);
        }
        let position = position(axis, None);
        text + &format!("[axis.{}.limits]\n{position}\n", axis.name)
    }

    /// The tables of the axis; what is the same for every axis is explained at the first.
    pub(super) fn tables(&self, axis: &AxisDraft, is_first: bool) -> String {
        let AxisDraft { name, transmission, output, efficiency, .. } = axis;
        let first = |text: &'static str| if is_first { text } else { "" };
        let is_planar = self.motor.stepper().is_some_and(StepperMotor::is_planar);
        let mut text = "\n".to_owned();
        if !axis.about.is_empty() {
            text += &comment(&axis.about);
        }
        text += &format!("[axis.{name}]\n");
        if !is_planar {
            let turns = format!("turns of the motor per turn of {output}: {}", self.gear_name);
            text += &line("gear", &number(self.gear), &turns);
            text += &line(
                "efficiency",
                &number(self.efficiency),
                &format!("for sizing: {}", efficiency.1),
            );
        }
        text.push('\n');
        text += transmission;
        text += &self.why;
        text += &self.motor_table(name, is_first);
        text += &format!("\n[axis.{name}.friction]\n");
        text +=
            &line("coulomb", &quantity(self.friction.coulomb * 1e3, "mN m"), &self.friction_why);
        let tenth = first("a tenth of that at the motor's largest speed");
        text += &line("viscous", &quantity(self.friction.viscous, "N m s/rad"), tenth);
        if let Some((brake, why)) = &self.brake {
            text += &line("brake", &quantity(*brake * 1e3, "mN m"), why);
            text += &line("brake_release", "\"20 ms\"", first("of the brake: see its data sheet"));
        }
        if self.motor.dc().is_some() {
            text += &format!("\n[axis.{name}.encoder]\n");
            let count = format!("{} um at the tool", about(self.count * 1e6));
            text += &line("resolution", &format!("\"{} counts/rev\"", self.counts), &count);
        }
        text += &format!("\n[axis.{name}.limits]\n");
        text += &position(axis, Some(self.range));
        let [length, speed, acceleration] = match axis.unit {
            Unit::Length => ["mm", "m/s", "m/s^2"],
            Unit::Angle => ["mrad", "rad/s", "rad/s^2"],
        };
        if let Some([most, rise]) = self.own {
            text += &line("velocity", &quantity(most, speed), first("of the joint"));
            text += &line("acceleration", &quantity(rise, acceleration), "");
        }
        let stops = first("setpoint minus feedback that stops the machine");
        text += &line("following_error", &quantity(self.following * 1e3, length), stops);
        if self.motor.dc().is_some() {
            if is_first {
                text += "\n# Bandwidths; the gains follow from the data above.";
            }
            text += &format!(
                "\n[axis.{name}.loops]\nposition = \"{} 1/s\"\nvelocity = \"{} rad/s\"\n\
                 current = \"349 rad/s\"\n",
                LOOPS[0], LOOPS[1]
            );
        }
        text
    }

    fn motor_table(&self, name: &str, is_first: bool) -> String {
        let first = |text: &'static str| if is_first { text } else { "" };
        let [rotor, gear] = self.inertia;
        let inertia = if gear > 1e-6 * rotor {
            format!("{} of the rotor, the rest of the gear", about(rotor))
        } else {
            String::new()
        };
        let total = exact(rotor + gear, "kg m^2");
        match &self.motor {
            Motor::Dc(motor) => {
                let mut text = format!("[axis.{name}.motor.dc]\n");
                text += &line("voltage", &exact(motor.voltage, "V"), "");
                text +=
                    &line("current", &exact(motor.current, "A"), first("limit of the power stage"));
                if let Some(continuous) = motor.continuous_current {
                    let what = first("rated continuous current of the winding");
                    text += &line("continuous_current", &exact(continuous, "A"), what);
                }
                text += &line("resistance", &exact(motor.resistance, "ohm"), "");
                text += &line("inductance", &exact(motor.inductance * 1e3, "mH"), "");
                text += &line("torque_constant", &exact(motor.torque_constant, "N m/A"), "");
                text + &line("rotor_inertia", &total, &inertia)
            }
            Motor::Stepper(motor) => {
                let mut text = format!("[axis.{name}.motor.stepper]\n");
                text += &line("full_steps", &number(motor.full_steps), "");
                text += &line("microsteps", &number(motor.microsteps), "");
                text += &line("holding_torque", &exact(motor.holding_torque, "N m"), "");
                text += &line("detent_torque", &exact(motor.detent_torque, "N m"), "");
                text += &line("rotor_inertia", &total, &inertia);
                text += &line("current", &exact(motor.current, "A"), first("peak of a phase"));
                text += &line("resistance", &exact(motor.resistance, "ohm"), "");
                text += &line("inductance", &exact(motor.inductance * 1e3, "mH"), "");
                text += &line("voltage", &exact(motor.voltage, "V"), "");
                let damping = first("of the driver: 0.3 of what is critical");
                text += &line("damping", &quantity(motor.damping, "N m s/rad"), damping);
                let rate = first("of the driver");
                text + &line("pulse_rate", &exact(motor.pulse_rate * 1e-3, "kHz"), rate)
            }
        }
    }
}

/// The line with the soft limits, from where the joint goes where that is known.
fn position(axis: &AxisDraft, range: Option<[f64; 2]>) -> String {
    let write = |[from, to]: [f64; 2], why: &str| {
        let text = match axis.unit {
            Unit::Length => super::text::lengths(&[from, to]),
            Unit::Angle => {
                let degrees = |value: f64| (value.to_degrees() * 10.0).round() / 10.0;
                format!("[\"{} deg\", \"{} deg\"]", degrees(from), degrees(to))
            }
        };
        line("position", &text, why)
    };
    match (&axis.travel, range) {
        (Travel::OfArea, _) => String::new(),
        (Travel::Given(range, why), _) => write(*range, why),
        (Travel::Unlimited, _) => line("position", "\"unlimited\"", "it turns without end"),
        (Travel::Found(wide, _), None) => write(*wide, ""),
        (Travel::Found(_, beyond), Some([from, to])) => {
            write([from - beyond, to + beyond], "what the area needs, and some more")
        }
    }
}

/// The following error that stops the machine: 1 mm at the tool, and no less than twenty counts.
fn following(axis: &AxisDraft, worst: &Worst, count: f64) -> f64 {
    const ERROR: f64 = 1e-3;
    match axis.unit {
        Unit::Length => ERROR.max(20.0 * count),
        Unit::Angle => (ERROR / worst.lever.max(1e-3)).clamp(1e-3, 0.1).max(20.0 * count),
    }
}

/// `uses`, the largest first.
fn sorted(uses: &[Use]) -> Vec<&Use> {
    let mut sorted: Vec<&Use> = uses.iter().collect();
    sorted.sort_by(|one, other| other.share.total_cmp(&one.share));
    sorted
}

/// The planar motor of `axis` with a holding force [N].
pub(super) fn planar(axis: &AxisDraft, worst: &Worst, force: f64) -> Result<Drive, Short> {
    super::kinds::tri_planar::motor(worst, force).map(|(motor, why)| {
        let ratio = super::kinds::tri_planar::PITCH / TAU;
        let pulse = TAU / motor.pulses_per_turn() * ratio;
        Drive {
            why,
            gear: 1.0,
            gear_name: String::new(),
            efficiency: 1.0,
            inertia: [motor.rotor_inertia, 0.0],
            friction: Friction { coulomb: 0.0, viscous: 1e-8 },
            friction_why: "it floats on air".to_owned(),
            brake: Some((
                1.25 * motor.holding_torque,
                "the magnets clamp the motor while its air is off".to_owned(),
            )),
            counts: motor.pulses_per_turn(),
            count: pulse,
            range: worst.range,
            following: following(axis, worst, pulse),
            own: None,
            motor: Motor::Stepper(motor),
        }
    })
}
