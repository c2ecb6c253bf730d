//! The pen of the interpreter: moves become steps of a drawing, and their extent is summed up.

use machine::gcode_settings::ZMeaning;
use messages::math;
use nalgebra::Vector3;

use super::arc::{Arc, SAME_POINT};
use super::settings::ReaderSettings;
use super::survey::ProgramFacts;
use crate::drawing::{Action, Curve, Power, Step};

/// A projection whose second direction spans less than this is folded onto a line [m].
const FLAT: f64 = 1e-6;

/// How fast to follow a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Pace {
    /// [m/s].
    Speed(f64),
    /// For the whole move [s].
    Time(f64),
}

/// A feed: pace, and the laser's power unless it is dark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feed {
    pub(super) pace: Pace,
    pub(super) power: Option<Power>,
}

/// Where a program is, what it has drawn, and its extent so far.
#[derive(Debug)]
pub(super) struct Tracer {
    /// Where programs start [m].
    home: Vector3<f64>,
    /// The height of everything drawn when Z is ignored [m].
    height: Option<f64>,
    /// Line of the file that asks for what comes, from 1.
    pub(super) line: u64,
    /// Where the program is, machine frame, Z as programmed [m].
    pub(super) position: Vector3<f64>,
    /// Where the last step ended; a move too short to draw leaves it behind [m].
    tool: Vector3<f64>,
    /// Steps that have been drawn; who reads a program as a stream takes them away.
    pub(super) steps: Vec<Step>,
    pub(super) facts: ProgramFacts,
    /// Time so far, as if no corner and no start took any [s].
    pub(super) time: f64,
    /// The largest distance from the drawn line that is allowed at corners so far [m].
    pub(super) tolerance: f64,
    /// Largest speeds of a mark and in the dark [m/s].
    fastest: [f64; 2],
}

impl Tracer {
    pub(super) fn new(settings: &ReaderSettings) -> Self {
        let home = settings.home;
        Self {
            home,
            height: (settings.gcode.z == ZMeaning::Ignored).then_some(home.z),
            line: 0,
            position: home,
            tool: home,
            steps: Vec::new(),
            facts: ProgramFacts::at(home),
            time: 0.0,
            tolerance: 0.0,
            fastest: [settings.mark_speed, settings.rapid],
        }
    }

    /// Forgets what has been drawn, and goes from home to the present place instead, after what `set_up`
    /// adds.
    pub(super) fn begin_here(&mut self, set_up: impl FnOnce(&mut Self)) {
        let to = self.position;
        self.steps.clear();
        (self.facts, self.time, self.tolerance) = (ProgramFacts::at(self.home), 0.0, 0.0);
        self.jump(self.home);
        set_up(self);
        self.rapid(to);
    }

    /// Adds a step that belongs to the line being read.
    pub(super) fn push(&mut self, action: Action) {
        self.steps.push(Step { action, line: self.line });
    }

    /// Stands still for `time` [s].
    pub(super) fn dwell(&mut self, time: f64, lit: Option<f64>) {
        if time > 0.0 {
            self.time += time;
            if let Some(level) = lit {
                self.light(level);
            }
            self.push(Action::Dwell { time, lit });
        }
    }

    /// G0 to `to`.
    pub(super) fn rapid(&mut self, to: Vector3<f64>) {
        let length = (to - self.position).norm();
        self.facts.rapid_length += length;
        self.time += length / self.fastest[1];
        self.reach(to);
        self.position = to;
        let to = self.drawn(to);
        if (to - self.tool).norm() >= SAME_POINT {
            self.tool = to;
            self.push(Action::Rapid { to });
        }
    }

    /// Takes `to` for the place where it is, without a step.
    pub(super) fn jump(&mut self, to: Vector3<f64>) {
        self.position = to;
        self.tool = self.drawn(to);
    }

    /// G1 to `to`.
    pub(super) fn line(&mut self, to: Vector3<f64>, feed: Feed) {
        self.count((to - self.position).norm(), feed);
        self.reach(to);
        self.position = to;
        let to = self.drawn(to);
        let length = (to - self.tool).norm();
        self.straight(to, feed.power, speed(feed.pace, length));
    }

    /// G2 or G3 along `arc` to `to`. Says whether it had to be folded onto a line.
    pub(super) fn arc(&mut self, arc: &Arc, to: Vector3<f64>, feed: Feed) -> bool {
        self.count(arc.length(), feed);
        for axis in 0..3 {
            for phi in arc.turning_angles(axis).take(2) {
                self.reach(arc.point(phi));
            }
        }
        self.reach(to);
        self.position = to;
        let to = self.drawn(to);
        let (major, minor) = (self.level(arc.major), self.level(arc.minor));
        if major == arc.major && minor == arc.minor {
            let arc = Arc { centre: self.drawn(arc.centre), rise: self.level(arc.rise), ..*arc };
            if arc.sagitta() < SAME_POINT {
                let length = (to - self.tool).norm();
                self.straight(to, feed.power, speed(feed.pace, length));
            } else {
                self.curve(arc.curve(), to, feed.power, speed(feed.pace, arc.length()));
            }
            return false;
        }
        self.projection(arc, to, feed)
    }

    /// Draws an arc of a plane that stands upright, as seen along Z.
    ///
    /// Both semi-axes fall on one line, `A·cos φ + B·sin φ = R·cos(φ − φ₀)`: with a helix it is a
    /// wave, without one the tool goes to and fro.
    fn projection(&mut self, arc: &Arc, to: Vector3<f64>, feed: Feed) -> bool {
        let axis = if arc.major.x != 0.0 || arc.minor.x != 0.0 { 0 } else { 1 };
        let (cosine, sine) = (arc.major[axis], arc.minor[axis]);
        let rise = self.level(arc.rise);
        if rise[1 - axis].abs() > FLAT {
            let mut major = Vector3::zeros();
            major[axis] = math::hypot(cosine, sine);
            let wave = Curve::Arc {
                centre: self.drawn(arc.centre),
                major,
                minor: Vector3::zeros(),
                start: -math::atan2(sine, cosine),
                sweep: arc.sweep,
                rise,
            };
            self.curve(wave, to, feed.power, speed(feed.pace, length(&wave)));
            return false;
        }
        let turns = arc.turning_angles(axis).map(|phi| self.drawn(arc.point(phi)));
        let corners: Vec<_> = turns.chain([to]).collect();
        let mut total = 0.0;
        let mut from = self.tool;
        for &corner in &corners {
            total += (corner - from).norm();
            from = corner;
        }
        let speed = speed(feed.pace, total);
        for corner in corners {
            self.straight(corner, feed.power, speed);
        }
        true
    }

    /// A straight feed between two points of the drawing.
    fn straight(&mut self, to: Vector3<f64>, power: Option<Power>, speed: f64) {
        if (to - self.tool).norm() >= SAME_POINT {
            self.curve(Curve::Line { from: self.tool, to }, to, power, speed);
        }
    }

    fn curve(&mut self, curve: Curve, to: Vector3<f64>, power: Option<Power>, speed: f64) {
        self.tool = to;
        self.push(match power {
            Some(power) => Action::Mark { curve, speed: Some(speed), power },
            None => Action::Feed { curve, speed },
        });
    }

    /// Where an arc from here starts: where the drawing is, at the height of the program.
    pub(super) fn arc_start(&self) -> Vector3<f64> {
        Vector3::new(self.tool.x, self.tool.y, self.height.map_or(self.tool.z, |_| self.position.z))
    }

    /// Where `point` is in the drawing.
    fn drawn(&self, point: Vector3<f64>) -> Vector3<f64> {
        self.height.map_or(point, |height| Vector3::new(point.x, point.y, height))
    }

    /// What is left of a direction in the drawing.
    fn level(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.height.map_or(direction, |_| Vector3::new(direction.x, direction.y, 0.0))
    }

    fn count(&mut self, length: f64, feed: Feed) {
        self.facts.feed_length += length;
        let fastest = if let Some(power) = feed.power {
            self.facts.mark_length += length;
            if length > 0.0 {
                self.light(power.level);
            }
            self.fastest[0]
        } else {
            self.fastest[1]
        };
        self.time += match feed.pace {
            Pace::Speed(speed) => length / speed.min(fastest),
            Pace::Time(time) => time.max(length / fastest),
        };
    }

    fn light(&mut self, level: f64) {
        let [least, most] = self.facts.power.unwrap_or([level; 2]);
        self.facts.power = Some([least.min(level), most.max(level)]);
    }

    fn reach(&mut self, point: Vector3<f64>) {
        for axis in 0..3 {
            self.facts.lower[axis] = self.facts.lower[axis].min(point[axis]);
            self.facts.upper[axis] = self.facts.upper[axis].max(point[axis]);
        }
    }
}

fn speed(pace: Pace, length: f64) -> f64 {
    match pace {
        Pace::Speed(speed) => speed,
        Pace::Time(time) => length / time,
    }
}

/// Length of a wave by chords, to about 1e-6 of itself [m].
fn length(wave: &Curve) -> f64 {
    let Curve::Arc { sweep, .. } = *wave else { return 0.0 };
    const CHORDS_PER_RADIAN: f64 = 256.0;
    let chords = (sweep.abs() * CHORDS_PER_RADIAN).ceil().max(1.0);
    let mut from = wave.from();
    (1..=chords as u64).fold(0.0, |sum, index| {
        let to = wave.point(index as f64 / chords);
        let chord = (to - from).norm();
        from = to;
        sum + chord
    })
}
