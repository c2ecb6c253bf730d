//! The control loops of an actuator: how fast they may be.

mod stability;

use super::tables::{AxisTable, LoopsTable};
use crate::actuator::{Actuator, LoopGains};
use crate::document::{Decode, Diagnostics, Span, Spanned};
use crate::drives::ActuatorMode;
use crate::motor::{DcMotor, Motor};
use messages::Nanoseconds;
use messages::time::Period;

/// How much longer a loop may wait for its answer that reckons with those which are on their way: as sure not to swing as
/// others where the inertia is a third of what the file has, to three times as much.
const PREDICTED: f64 = 2.0;

/// What a loop waits for its own answer.
#[derive(Debug, Clone, Copy)]
struct DeadTime {
    period: Period,
    latency: Nanoseconds,
    /// How old the measurement is.
    age: Nanoseconds,
    /// How long the drive's current loop takes, around which this loop is closed.
    torque_delay: Nanoseconds,
    /// How much longer than others it may wait.
    borne: f64,
}

impl DeadTime {
    /// In cycles of `period`, with a drive that measures and acts at the deadline.
    fn at_once(period: Period) -> Self {
        let none = Nanoseconds(0);
        Self { period, latency: none, age: none, torque_delay: none, borne: 1.0 }
    }

    /// In cycles of `period`, with the drive of `actuator`.
    fn of(period: Period, actuator: &Actuator) -> Self {
        let Actuator { latency, age, torque_delay, .. } = *actuator;
        match actuator.mode {
            ActuatorMode::Torque => Self { period, latency, age, torque_delay, borne: PREDICTED },
            // What is inside the drive's own velocity loop is the drive's.
            _ => Self { latency, age, ..Self::at_once(period) },
        }
    }

    /// From a measurement to the start of the cycle in which its answer acts [s].
    fn seconds(self) -> f64 {
        let late = self.latency + self.age + self.torque_delay;
        self.period.seconds() + late.seconds()
    }

    /// What makes a loop swing, in words.
    fn words(self) -> String {
        let milliseconds = |time: f64| format!("{} ms", time * 1e3);
        let cycle = milliseconds(self.period.seconds());
        let late = [self.latency, self.age, self.torque_delay];
        let [latency, age, delay] = late.map(|time| milliseconds(time.seconds()));
        let mut words = format!("in a control cycle of {cycle}");
        if self.latency != Nanoseconds(0) {
            words += &format!(" with a drive that acts {latency} after it is told");
        }
        if self.age != Nanoseconds(0) {
            words += &format!(" and measures {age} before it tells");
        }
        if self.torque_delay != Nanoseconds(0) {
            words += &format!(" and has a torque {delay} after it is asked for");
        }
        words
    }
}

/// What each loop waits.
#[derive(Debug, Clone, Copy)]
pub(super) struct DeadTimes {
    position: DeadTime,
    velocity: DeadTime,
    current: DeadTime,
}

impl DeadTimes {
    /// In cycles of `period`, with drives that act at once.
    pub(super) fn at_once(period: Period) -> Self {
        let dead = DeadTime::at_once(period);
        Self { position: dead, velocity: dead, current: dead }
    }
}

/// Slows the loops of `actuator`, whose axis has `table`, down by the latency of its drive: those that the drive
/// does not close.
pub(super) fn slow_down(
    actuator: &mut Actuator,
    table: &AxisTable,
    period: Period,
    diagnostics: &mut Diagnostics,
) {
    let Motor::Dc(motor) = actuator.motor else { return };
    if actuator.latency + actuator.age + actuator.torque_delay == Nanoseconds(0) {
        return;
    }
    let by_drive = DeadTime::at_once(period);
    let here = DeadTime::of(period, actuator);
    let [position, velocity, current] = match actuator.mode {
        ActuatorMode::Position => [by_drive; 3],
        ActuatorMode::Velocity => [here, by_drive, by_drive],
        ActuatorMode::Torque => [here, here, by_drive],
        ActuatorMode::Voltage => [here; 3],
    };
    let dead = DeadTimes { position, velocity, current };
    // What the period makes of written loops has been told already.
    let driven = Driven { motor: &motor, mode: actuator.mode, tells: false };
    if let Some(gains) = gains(table, &driven, actuator.gains.inertia, dead, diagnostics) {
        actuator.gains = gains;
    }
}

/// What the loops close over.
pub(super) struct Driven<'a> {
    pub(super) motor: &'a DcMotor,
    pub(super) mode: ActuatorMode,
    /// Whether a warning tells of written loops that are slowed down.
    pub(super) tells: bool,
}

/// The gains of the loops. Defaults suit 1 ms without latency; with a longer dead time they are slower by as
/// much, those that reckon with their answers on the way from twice that time on. What is written stays as it is, unless the loops that are closed here would swing in a period of more than
/// 1 ms: then it is slower in proportion to that, with a warning. A loop that answers within its dead time swings without
/// end: it is refused.
pub(super) fn gains(
    table: &AxisTable,
    driven: &Driven<'_>,
    inertia: f64,
    dead: DeadTimes,
    diagnostics: &mut Diagnostics,
) -> Option<LoopGains> {
    let defaults;
    let loops = match &table.loops {
        Some(loops) => loops,
        None => {
            defaults = LoopsTable::absent(table.span, diagnostics)?;
            &defaults
        }
    };
    let usual = DeadTime::at_once(Period::OF_SETPOINTS).seconds();
    let slower = slower_by_period(loops, driven, dead.velocity.period, diagnostics);
    // The place of a default is that of its table.
    let in_time = |value: f64, span: Span, dead: DeadTime| Spanned {
        value: if span == loops.span {
            value * (dead.borne * usual / dead.seconds()).min(1.0)
        } else {
            value * slower
        },
        span,
    };
    let position = in_time(loops.position.value, loops.position.span, dead.position);
    let velocity = in_time(loops.velocity.value, loops.velocity.span, dead.velocity);
    let current = in_time(loops.current.value, loops.current.span, dead.current);
    for (bandwidth, word, dead) in
        [(velocity, "velocity", dead.velocity), (current, "current", dead.current)]
    {
        if bandwidth.value * dead.seconds() >= 1.0 {
            let safe = 1.0 / 3.0 / dead.seconds();
            diagnostics.contradict(
                bandwidth.span,
                format!(
                    "a {word} loop of {} rad/s swings without end {}",
                    bandwidth.value,
                    dead.words()
                ),
                &format!("lower `loops.{word}`: {safe:.0} rad/s is safe; or shorten the period"),
            );
        }
    }
    for (inner, outer, words) in [
        (velocity, position, ["velocity", "position"]),
        (current, velocity, ["current", "velocity"]),
    ] {
        if outer.value >= inner.value {
            // The place of a default is that of its table: what was written is what is wrong.
            let span = if outer.span == loops.span { inner.span } else { outer.span };
            diagnostics.contradict(
                span,
                format!(
                    "the {} loop ({} rad/s) must be faster than the {} loop around it ({} rad/s)",
                    words[0], inner.value, words[1], outer.value
                ),
                &format!("raise `loops.{}` or lower `loops.{}`", words[0], words[1]),
            );
        }
    }
    Some(LoopGains {
        position: position.value,
        velocity: velocity.value,
        current: current.value,
        inertia,
    })
}

/// By what written loops are slower for a control cycle of `period`: 1 where those that are closed here bear it, a quarter
/// of it longer too.
fn slower_by_period(
    loops: &LoopsTable,
    driven: &Driven<'_>,
    period: Period,
    diagnostics: &mut Diagnostics,
) -> f64 {
    /// What must be left of the way to loops that swing: springs and friction take some of it.
    const RESERVE: f64 = 1.25;
    let LoopsTable { position, velocity, current, span } = loops;
    let written = [position.span, velocity.span, current.span].into_iter().find(|it| it != span);
    let is_closed_here = matches!(driven.mode, ActuatorMode::Voltage | ActuatorMode::Torque);
    let (Some(written), true, true) = (written, is_closed_here, period > Period::OF_SETPOINTS)
    else {
        return 1.0;
    };
    let (usual, time) = (Period::OF_SETPOINTS.seconds(), period.seconds());
    let all = [position.value, velocity.value, current.value];
    let pole = driven.motor.resistance / driven.motor.inductance;
    if stability::is_stable(all, pole, RESERVE * time) {
        return 1.0;
    }
    let slower = usual / time;
    if driven.tells {
        let [position, velocity, current] = all.map(|it| it * slower);
        diagnostics.warn(
            written,
            format!(
                "these loops are made for a control cycle of 1 ms and would swing in one of {} ms: they are {position:.1}, \
                 {velocity:.1} and {current:.1} rad/s in it; write loops that it bears, or leave them out",
                time * 1e3
            ),
        );
    }
    slower
}
