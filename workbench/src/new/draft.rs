//! A machine before its motors are known, and its file with and without them.

use super::drive::Drive;
use super::text::{about, comment, lengths, line, quantity};
use super::{LESS, Request, Short, TOLERANCE};

/// Time in which the acceleration of the tool may come up [s]: 10 m/s² and 500 m/s³ of the shipped files.
const RISE: f64 = 0.02;

/// By what every need is multiplied at first, as `graver size` does, and at most.
const MARGIN: f64 = 1.25;
const LARGEST_MARGIN: f64 = 3.0;

/// Inertia of the load that a rotor may feel at first, in its own: source 003 eq. 5.17.
const MOST_LOAD: f64 = 10.0;

/// Speed of free moves where marks are slower [m/s].
const RAPID: f64 = 0.1;

/// What is asked of a draft: what the request says, lowered where that could not be met.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Asked {
    /// Speed of the tool while it marks [m/s].
    pub(super) speed: f64,
    /// Its speed between marks [m/s]: what the joints are made for.
    pub(super) rapid: f64,
    /// The rapid speed that the screws are made for [m/s]: a shorter lead for what motors cannot do
    /// would only ask more of them.
    pub(super) screws: f64,
    /// Acceleration of the tool [m/s²].
    pub(super) acceleration: f64,
    /// By what every need is multiplied before it is compared with what a motor gives.
    pub(super) margin: f64,
    /// Inertia of the load that a rotor may feel, in its own.
    pub(super) most_load: f64,
    /// Force of a planar motor [N]; `None` of a kind without.
    pub(super) planar: Option<f64>,
    /// What the request says of speed and acceleration.
    wished: [f64; 2],
    /// Why each of them was lowered; empty where it was not.
    because: [String; 2],
    /// Times that it was lowered.
    rounds: usize,
}

impl Asked {
    /// All that `request` asks for.
    pub(super) fn new(request: &Request) -> Self {
        Self {
            speed: request.speed,
            rapid: request.speed.max(RAPID),
            screws: request.speed.max(RAPID),
            acceleration: request.acceleration,
            margin: MARGIN,
            most_load: MOST_LOAD,
            planar: request.kind.has_planar_motors().then_some(80.0),
            wished: [request.speed, request.acceleration],
            because: [String::new(), String::new()],
            rounds: 0,
        }
    }

    /// Asks for less, as `short` says, and gives the reason.
    pub(super) fn lower(&mut self, short: Short) -> String {
        /// No load is asked to be less than this many rotor inertias.
        const LEAST_LOAD: f64 = 0.02;
        match short {
            Short::Acceleration(part, because) => self.accelerate_less(part, because),
            // The load was asked to be light for the sample's sake: rather let it do less.
            Short::Slower(_, because) if self.most_load < MOST_LOAD => {
                self.most_load = MOST_LOAD;
                self.accelerate_less(LESS, because)
            }
            Short::Slower(part, because) => {
                self.screws = part * self.rapid;
                self.slow_down(part * self.rapid, &because);
                because
            }
            Short::Motor(because) if self.margin < LARGEST_MARGIN => {
                self.margin *= MARGIN;
                because
            }
            Short::Inertia(because) if self.most_load > LEAST_LOAD => {
                self.most_load /= 2.0;
                because
            }
            Short::Motor(because) | Short::Inertia(because) => self.accelerate_less(LESS, because),
            Short::Speed(speed, because) => {
                self.screws = speed;
                self.slow_down(speed, &because);
                because
            }
            Short::Force(force) => {
                self.planar = Some(force);
                "the planar motors are too weak".to_owned()
            }
        }
    }

    /// Asks for this part of the acceleration; for less speed where that did not help.
    fn accelerate_less(&mut self, part: f64, because: String) -> String {
        /// Times that only the acceleration is lowered; from then on speed and acceleration take turns.
        const PATIENCE: usize = 5;
        /// Below this only the speed is lowered [m/s²].
        const LEAST: f64 = 0.02;
        self.rounds += 1;
        let is_turn = self.rounds <= PATIENCE || self.rounds.is_multiple_of(2);
        if is_turn && self.acceleration > LEAST {
            self.acceleration *= part;
            self.because[1].clone_from(&because);
        } else {
            self.slow_down(LESS * self.rapid, &because);
        }
        because
    }

    /// Asks for no more than `speed` [m/s].
    fn slow_down(&mut self, speed: f64, because: &str) {
        self.rapid = speed;
        if self.speed > speed {
            self.speed = speed;
            because.clone_into(&mut self.because[0]);
        }
    }

    /// Whether so little is left that it is no machine any more.
    pub(super) fn is_hopeless(&self) -> bool {
        self.speed < 1e-3
    }

    /// What was lowered, a sentence each.
    pub(super) fn lowered(&self) -> Vec<String> {
        let words = [("speed", "m/s", self.speed), ("acceleration", "m/s^2", self.acceleration)];
        words
            .iter()
            .zip(self.wished)
            .zip(&self.because)
            .filter(|(_, because)| !because.is_empty())
            .map(|(((name, unit, now), wished), because)| {
                format!(
                    "{name} {} {unit} instead of {} {unit}, because {because}",
                    about(*now),
                    about(wished)
                )
            })
            .collect()
    }
}

/// What a joint's place is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    Length,
    Angle,
}

/// Between which places a joint may go.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Travel {
    /// It follows from the area: no key.
    OfArea,
    /// These [m or rad], with the reason.
    Given([f64; 2], &'static str),
    /// Without end.
    Unlimited,
    /// What the area needs, found within these [m or rad], and this much beyond [m or rad].
    Found([f64; 2], f64),
}

/// An axis before its motor is known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AxisDraft {
    pub(super) name: String,
    /// A sentence above its table; empty where there is nothing to say.
    pub(super) about: String,
    pub(super) unit: Unit,
    /// What the gear turns, for the comment beside the ratio.
    pub(super) output: &'static str,
    /// Its tables of the transmission; empty where the gear turns the joint.
    pub(super) transmission: String,
    /// What gear and transmission pass on of the power, and of what that is usual.
    pub(super) efficiency: (f64, &'static str),
    pub(super) travel: Travel,
    /// Speed and acceleration that it is given, where they are not those that the path asks for
    /// [m/s, m/s² or rad/s, rad/s²].
    pub(super) own: Option<[f64; 2]>,
}

/// A machine before its motors are known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Draft {
    /// What the machine is, for the top of the file.
    pub(super) about: String,
    pub(super) description: String,
    /// The line with `home` or `home_axes`.
    pub(super) home: String,
    /// A sentence above the area; empty where there is nothing to say.
    pub(super) area_about: &'static str,
    /// Area in x and y [m].
    pub(super) area: [[f64; 2]; 2],
    /// Area in z [m]; `None` of a kind that does not move in z.
    pub(super) z: Option<[f64; 2]>,
    /// The tables of the mechanism.
    pub(super) mechanism: String,
    pub(super) axes: Vec<AxisDraft>,
    /// The sample job.
    pub(super) sample: String,
}

impl Draft {
    /// The file with motors that can do anything, to ask the mechanism.
    pub(super) fn bare(&self, request: &Request, asked: &Asked, sample: &str) -> String {
        let mut text = self.top(request, asked);
        for axis in &self.axes {
            text += &format!("\n[axis.{}]\n\n{}", axis.name, axis.transmission);
            text += &Drive::bare(axis);
        }
        text + &self.bottom(sample)
    }

    /// The file with `drives`, one for each axis.
    pub(super) fn file(
        &self,
        request: &Request,
        asked: &Asked,
        sample: &str,
        drives: &[Drive],
    ) -> String {
        let mut text = self.top(request, asked);
        for (index, (axis, drive)) in self.axes.iter().zip(drives).enumerate() {
            text += &drive.tables(axis, index == 0);
        }
        text + &self.bottom(sample)
    }

    fn top(&self, request: &Request, asked: &Asked) -> String {
        let Request { name, area, head, .. } = request;
        let z = if self.z.is_some() {
            format!(", {} mm in z", about(request.z * 1e3))
        } else {
            String::new()
        };
        let wish = format!(
            "Asked for: {} mm by {} mm{z}, a head of {} kg, {} m/s, {} m/s^2{}.",
            about(area[0] * 1e3),
            about(area[1] * 1e3),
            about(*head),
            about(request.speed),
            about(request.acceleration),
            if request.steppers { ", steppers" } else { "" }
        );
        let mut text = comment(&format!(
            "{} Made by `graver machine new {}`.",
            self.about,
            request.kind.name()
        ));
        text += "#\n";
        text += &comment(&wish);
        text += "#\n";
        text += &comment(
            "Motors, gears and their numbers are of the catalogues named; masses, inertias, friction \
             and efficiencies are estimates: put in what you measure, and run `graver check`.",
        );
        text +=
            "#\n# Every quantity is a text with its unit. What is left out has its default.\n\n";
        let [name, description] =
            [name, &self.description].map(|text| toml_edit::Value::from(text.as_str()));
        text += &format!("name = {name}\ndescription = {description}\n\n");
        text += "# Where the tool rests, before and after a job.\n";
        text += &self.home;
        text += "\n# Where the tool may go.";
        if !self.area_about.is_empty() {
            text += " ";
            text += self.area_about;
        }
        text += "\n[area]\n";
        text += &line("x", &lengths(&self.area[0]), "");
        text += &line("y", &lengths(&self.area[1]), "");
        if let Some(z) = self.z {
            text += &line("z", &lengths(&z), "");
        }
        text += "\n# Limits of the tool's motion: lengths of the vectors, along and across the path together.\n";
        for sentence in asked.lowered() {
            text += &comment(&format!("Lowered: {sentence}."));
        }
        text += "[path]\n";
        text += &line("speed", &quantity(asked.speed, "m/s"), "while marking");
        text += &line("rapid", &quantity(asked.rapid, "m/s"), "between marks");
        text += &line("acceleration", &quantity(asked.acceleration, "m/s^2"), "");
        let jerk = asked.acceleration / RISE;
        text += &line("jerk", &quantity(jerk, "m/s^3"), "the acceleration comes up in 20 ms");
        let tolerance = quantity(TOLERANCE * 1e6, "um");
        text += &line("tolerance", &tolerance, "a fifth of a line of 0.1 mm");
        text.push('\n');
        text + &self.mechanism
    }

    fn bottom(&self, sample: &str) -> String {
        let mut text =
            "\n# From the gate to light and to darkness: of your laser source.\n[laser]\n\
                        on_delay = \"0 us\"\noff_delay = \"0 us\"\n\n[gcode]\n"
                .to_owned();
        text += &line("full_scale", "1000", "the S word of full power");
        let (z, what) = match self.z {
            Some(_) => ("\"focus\"", "Z moves the focus"),
            None => ("\"ignored\"", "the head does not move up and down"),
        };
        text += &line("z", z, what);
        text += &line("air_assist", "true", "M7, M8 and M9 switch it");
        text += &format!("\n[job]\nsample = {}\n", toml_edit::Value::from(sample));
        text
    }
}
