//! Random cases: a machine of the tree with limits of its own, and a short drawing in its area.
//!
//! A case consists of plain numbers, so that it shrinks and prints well; what it means on a machine
//! is made of it by [`Case::machine`] and [`Case::job`].

use std::path::Path;
use std::sync::LazyLock;

use machine::{CornerMode, JointUnit, Machine, Motor};
use messages::math::{cos, pow, sin};
use messages::random::SplitMix64;
use nalgebra::Vector3;
use planner::Job;
use planner::drawing::{Action, Corners, Curve, Drawing, Power, Step};
use proptest::collection::vec;
use proptest::prelude::*;

/// Joints that are straight lines of the tool.
pub const LINEAR: [&str; 3] = ["corexy", "cartesian", "cartesian_steppers"];

/// All others.
pub const CURVED: [&str; 7] =
    ["five_bar", "polar", "serial", "twin_actuator", "prrrp", "mcm", "tri_planar"];

static MACHINES: LazyLock<Vec<Machine>> = LazyLock::new(|| {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../machines"));
    let load = |name: &&str| Machine::load(&folder.join(format!("{name}.toml")), &[]).unwrap();
    LINEAR.iter().chain(&CURVED).map(load).collect()
});

/// Limits as powers of ten of what the machine file has, 0 for the file's own.
#[derive(Debug, Clone)]
pub struct Limits {
    pub speed: f64,
    pub rapid: f64,
    pub acceleration: f64,
    pub jerk: f64,
    pub axis_velocity: f64,
    /// Of the path's acceleration and jerk; `None` for none.
    pub axis_acceleration: Option<f64>,
    pub axis_jerk: Option<f64>,
    /// Shares of the motors' current and voltage.
    pub current: f64,
    pub voltage: f64,
}

/// One element of a drawing. Places are shares of the half-width of what is drawn on, from its
/// centre.
#[derive(Debug, Clone)]
pub enum Element {
    /// A straight mark.
    Line(f64, f64),
    /// A straight mark of this length [m] and direction [rad].
    Tiny(f64, f64),
    /// An arc of this radius, as a share, this heading and this sweep [rad].
    Arc(f64, f64, f64),
    /// Chords: how many, how long each is [m], heading, turn of each [rad], noise [m] and its seed.
    Chords(usize, f64, f64, f64, f64, u64),
    /// There and back.
    Reverse(f64, f64),
    Rapid(f64, f64),
    /// A dark feed at this power of ten of the speed limit.
    Feed(f64, f64, f64),
    /// Light at rest [s].
    Dot(f64),
    /// A stop between marks.
    Stop,
    /// An output that is switched, and whether on.
    Output(u32, bool),
    /// How corners are passed from here on: `None` at rest, or within this power of ten [m].
    Corners(Option<f64>),
    /// How is marked from here on: level, whether it follows the speed, and a power of ten of the
    /// speed limit.
    Power(f64, bool, Option<f64>),
}

/// A machine and a drawing.
#[derive(Debug, Clone)]
pub struct Case {
    /// Which machine.
    pub machine: usize,
    pub limits: Limits,
    pub exact: bool,
    /// Delays of the laser source [s].
    pub delays: [f64; 2],
    /// Half the width of what is drawn on, a power of ten of the area's.
    pub size: f64,
    pub elements: Vec<Element>,
}

fn limits() -> impl Strategy<Value = Limits> {
    let decades = |low: f64, high: f64| prop_oneof![2 => Just(0.0), 3 => low..high];
    let axis = || prop_oneof![3 => Just(None), 2 => (-1.0..1.0).prop_map(Some)];
    let share = || prop_oneof![2 => Just(1.0), 1 => 0.3..1.0];
    (
        [decades(-1.5, 0.7), decades(-1.0, 0.7), decades(-1.5, 1.5), decades(-1.5, 1.5)],
        decades(-1.0, 0.0),
        axis(),
        axis(),
        share(),
        share(),
    )
        .prop_map(|(path, axis_velocity, axis_acceleration, axis_jerk, current, voltage)| {
            let [speed, rapid, acceleration, jerk] = path;
            Limits {
                speed,
                rapid,
                acceleration,
                jerk,
                axis_velocity,
                axis_acceleration,
                axis_jerk,
                current,
                voltage,
            }
        })
}

fn element() -> impl Strategy<Value = Element> {
    let share = || -1.0..1.0;
    let angle = || -3.2..3.2;
    prop_oneof![
        6 => (share(), share()).prop_map(|(x, y)| Element::Line(x, y)),
        2 => (1e-6..1e-3, angle()).prop_map(|(length, angle)| Element::Tiny(length, angle)),
        4 => (0.002..0.5, angle(), -6.2..6.2).prop_map(|(r, h, sweep)| Element::Arc(r, h, sweep)),
        4 => (2..20_usize, 2e-5..5e-4, angle(), -0.3..0.3, 0.0..1e-5, any::<u64>())
            .prop_map(|(n, l, h, t, noise, seed)| Element::Chords(n, l, h, t, noise, seed)),
        2 => (share(), share()).prop_map(|(x, y)| Element::Reverse(x, y)),
        2 => (share(), share()).prop_map(|(x, y)| Element::Rapid(x, y)),
        1 => (share(), share(), -1.0..0.5).prop_map(|(x, y, s)| Element::Feed(x, y, s)),
        1 => (0.001..0.01).prop_map(Element::Dot),
        1 => Just(Element::Stop),
        1 => (0..64_u32, any::<bool>()).prop_map(|(bit, on)| Element::Output(bit, on)),
        2 => prop::option::of(-6.0..-4.0).prop_map(Element::Corners),
        3 => (0.05..1.0, any::<bool>(), prop::option::of(-1.5..0.3))
            .prop_map(|(level, follows, speed)| Element::Power(level, follows, speed)),
    ]
}

/// Cases on machines `first` to before `end`.
pub fn case(machines: std::ops::Range<usize>) -> impl Strategy<Value = Case> {
    let delay = || prop_oneof![4 => Just(0.0), 1 => 0.0..5e-4];
    (machines, limits(), any::<bool>(), [delay(), delay()], -2.0..0.0, vec(element(), 1..=5))
        .prop_map(|(machine, limits, exact, delays, size, elements)| Case {
            machine,
            limits,
            exact,
            delays,
            size,
            elements,
        })
}

fn ten(power: f64) -> f64 {
    pow(10.0, power)
}

impl Case {
    /// Whether something is marked at one speed, entered from a run-in.
    pub fn marks_at_one_speed(&self) -> bool {
        let mut follows = false;
        let mut found = false;
        for element in &self.elements {
            match element {
                Element::Power(_, now, _) => follows = *now,
                Element::Line(..)
                | Element::Tiny(..)
                | Element::Arc(..)
                | Element::Chords(..)
                | Element::Reverse(..) => found |= !follows,
                _ => {}
            }
        }
        found
    }

    /// The machine with the case's limits.
    pub fn machine(&self) -> Machine {
        let mut machine = MACHINES[self.machine].clone();
        let Limits { speed, rapid, acceleration, jerk, .. } = self.limits;
        let path = &mut machine.path;
        path.speed *= ten(speed);
        path.rapid *= ten(rapid);
        path.acceleration *= ten(acceleration);
        path.jerk *= ten(jerk);
        machine.corners = if self.exact { CornerMode::Exact } else { CornerMode::Blend };
        [machine.laser.on_delay, machine.laser.off_delay] = self.delays;
        for axis in &mut machine.axes {
            // An angle stands for an arm of a tenth of a metre.
            let arm = if axis.unit == JointUnit::Angle { 10.0 } else { 1.0 };
            axis.limits.velocity *= ten(self.limits.axis_velocity);
            if let Some(power) = self.limits.axis_acceleration {
                axis.limits.acceleration = arm * machine.path.acceleration * ten(power);
            }
            if let Some(power) = self.limits.axis_jerk {
                axis.limits.jerk = arm * machine.path.jerk * ten(power);
            }
        }
        for actuator in &mut machine.actuators {
            if let Motor::Dc(motor) = &mut actuator.motor {
                motor.current *= self.limits.current;
                motor.voltage *= self.limits.voltage;
            }
        }
        machine
    }

    /// Half the width of what is drawn on [m]: small enough for a quick test.
    fn half_width(&self, machine: &Machine) -> f64 {
        let (area, home) = (&machine.area, machine.home);
        let room = |axis: usize| (area.upper[axis] - home[axis]).min(home[axis] - area.lower[axis]);
        (0.4 * room(0).min(room(1)) * ten(self.size)).min(0.005)
    }

    /// The drawing on its machine.
    pub fn job(&self, machine: &Machine) -> Job {
        let home = Vector3::from(machine.home);
        let drawing = Drawing {
            name: "case".to_owned(),
            start: home,
            steps: Pen::new(home, self.half_width(machine), machine.path.speed)
                .draw(&self.elements),
            notes: Vec::new(),
        };
        Job::of(drawing)
    }
}

/// Turns elements into steps.
struct Pen {
    home: Vector3<f64>,
    half_width: f64,
    place: Vector3<f64>,
    top: f64,
    power: Power,
    speed: Option<f64>,
    steps: Vec<Step>,
}

impl Pen {
    fn new(home: Vector3<f64>, half_width: f64, top: f64) -> Self {
        let power = Power { level: 0.5, follows_speed: false };
        Self { home, half_width, place: home, top, power, speed: None, steps: Vec::new() }
    }

    fn draw(mut self, elements: &[Element]) -> Vec<Step> {
        for element in elements {
            self.add(element);
        }
        self.steps
    }

    fn add(&mut self, element: &Element) {
        match *element {
            Element::Line(x, y) => self.line(self.at(x, y)),
            Element::Tiny(length, angle) => self.line(self.place + towards(angle) * length),
            Element::Arc(radius, heading, sweep) => {
                self.arc(radius * self.half_width, heading, sweep);
            }
            Element::Chords(count, length, heading, turn, noise, seed) => {
                let mut random = SplitMix64::new(seed);
                let mut drawn = self.place;
                for chord in 0..count {
                    drawn += towards(heading + turn * chord as f64) * length;
                    let mut off = || random.between(-noise, noise);
                    self.line(drawn + Vector3::new(off(), off(), 0.0));
                }
            }
            Element::Reverse(x, y) => {
                let from = self.place;
                self.line(self.at(x, y));
                self.line(from);
            }
            Element::Rapid(x, y) => {
                let to = self.at(x, y);
                self.place = to;
                self.push(Action::Rapid { to });
            }
            Element::Feed(x, y, speed) => {
                let to = self.at(x, y);
                let curve = Curve::Line { from: self.place, to };
                self.place = to;
                self.push(Action::Feed { curve, speed: self.top * ten(speed) });
            }
            Element::Dot(time) => self.push(Action::Dwell { time, lit: Some(0.3) }),
            Element::Stop => self.push(Action::Dwell { time: 0.0, lit: None }),
            Element::Output(bit, on) => self.push(Action::Output { bit, on }),
            Element::Corners(None) => self.push(Action::Corners(Corners::Exact)),
            Element::Corners(Some(power)) => {
                self.push(Action::Corners(Corners::Blend(Some(ten(power)))));
            }
            Element::Power(level, follows_speed, speed) => {
                self.power = Power { level, follows_speed };
                self.speed = speed.map(|power| self.top * ten(power));
            }
        }
    }

    /// A place on what is drawn on.
    fn at(&self, x: f64, y: f64) -> Vector3<f64> {
        self.home + Vector3::new(x, y, 0.0) * self.half_width
    }

    fn push(&mut self, action: Action) {
        let line = self.steps.len() as u64 + 1;
        self.steps.push(Step { action, line });
    }

    fn mark(&mut self, curve: Curve) {
        self.place = curve.to();
        self.push(Action::Mark { curve, speed: self.speed, power: self.power });
    }

    fn line(&mut self, to: Vector3<f64>) {
        self.mark(Curve::Line { from: self.place, to });
    }

    fn arc(&mut self, radius: f64, heading: f64, sweep: f64) {
        let left = towards(heading + core::f64::consts::FRAC_PI_2 * sweep.signum());
        let major = -left * radius;
        let minor = Vector3::new(-major.y, major.x, 0.0);
        let centre = self.place - major;
        // An arc that goes nowhere is no arc.
        let sweep = if sweep.abs() < 1e-6 { 1e-6 } else { sweep };
        self.mark(Curve::Arc { centre, major, minor, start: 0.0, sweep, rise: Vector3::zeros() });
    }
}

fn towards(angle: f64) -> Vector3<f64> {
    Vector3::new(cos(angle), sin(angle), 0.0)
}
