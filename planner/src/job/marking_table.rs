//! The job file's table of how to mark, whatever is marked.

use machine::document::{
    Diagnostics, Either, Fraction, Number, Positive, ProblemKind, Quantity, Spanned,
};
use machine::quantity::{Length, PulseRate, Speed};
use machine::{Machine, table};

use super::whole::whole;
use super::{Frame, Marking, MarkingSpeed, frequency};
use crate::drawing::Turns;
use crate::light::Policy;

table! {
    /// How to mark.
    pub struct MarkingTable {
        /// "optimum", or a speed: constant while the laser is on.
        pub speed: Option<Either<Optimum, Quantity<Speed, Positive>>>,
        /// Largest speed while the laser is on.
        pub max_speed: Option<Quantity<Speed, Positive>>,
        /// How far a smoothed join may lie from the drawn line, and the tool from its path between two
        /// setpoints.
        pub tolerance: Option<Quantity<Length, Positive>>,
        /// Power of the laser, full power when left out.
        pub power: Option<Fraction<Positive>>,
        /// Pulse repetition rate of the laser, within `laser.frequency` of the machine; as the source is
        /// set when left out.
        pub frequency: Option<Quantity<PulseRate, Positive>>,
        /// How the light goes with the speed along lines: `constant` marks at one speed and comes to it
        /// in the dark, `proportional` lights from rest to rest with power in proportion to the speed.
        /// When left out, a G-code program's M3 and M4 say it, and other jobs are `constant`.
        pub policy: Option<Spanned<Policy>>,
        /// The stroke to begin with, from 1, as after a job that was stopped.
        pub from_stroke: Number<Positive> = 1.0,
        /// The place on that stroke to begin with, from its beginning: what is marked already.
        pub from_along: Option<Quantity<Length, Positive>>,
        /// The line of a G-code program to begin with, from 1: with all that the lines before it leave in
        /// force, and by a free move to the place where it begins.
        pub from_line: Option<Number<Positive>>,
        /// The same motion, never lit.
        pub dry_run: Spanned<bool> = false,
        /// Goes round the box around all that would be marked instead of marking it, in the dark.
        pub frame: Spanned<bool> = false,
        /// Lights the frame, within `safety.frame_power` of the machine.
        pub frame_power: Option<Fraction<Positive>>,
        /// How often the frame is gone round.
        pub frame_passes: Number<Positive> = 3.0,
    }
}

/// The word for the speed with the least time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Optimum {
    /// The speed that minimises the drawing's time.
    Optimum,
}

machine::keyword! {
    Optimum, "a speed",
    "optimum" => Self::Optimum,
}

/// The most strokes of a job, and the most lines.
const MOST: u64 = 1 << 53;

/// The most rounds of a frame.
const MOST_PASSES: u64 = 1000;

impl MarkingTable {
    /// Notes what is wrong with it on `machine`.
    pub(super) fn check(&self, machine: &Machine, diagnostics: &mut Diagnostics) {
        frequency::asked(self.frequency.as_ref(), &machine.laser, diagnostics);
        whole(&self.from_stroke, 1..=MOST, "from_stroke", diagnostics);
        whole(&self.frame_passes, 1..=MOST_PASSES, "frame_passes", diagnostics);
        self.check_frame(machine, diagnostics);
        let Some(line) = &self.from_line else { return };
        whole(line, 1..=MOST, "from_line", diagnostics);
        if let Some(along) = &self.from_along {
            let text = "`from_line` and `from_along` both say where to begin".to_owned();
            diagnostics.contradict(along.span, text, "keep one of them");
        }
        if self.from_stroke.value > 1.0 {
            let text = "`from_line` and `from_stroke` both say where to begin".to_owned();
            diagnostics.contradict(line.span, text, "keep one of them");
        }
    }

    fn check_frame(&self, machine: &Machine, diagnostics: &mut Diagnostics) {
        let Some(power) = &self.frame_power else { return };
        if !self.frame.value {
            let text = "`frame_power` is for the frame, and none is shown".to_owned();
            diagnostics.contradict(power.span, text, "write `frame = true`, or leave it out");
        }
        check_frame_power(power, machine, diagnostics);
    }

    /// The frame that is shown instead of marking, if one is.
    pub(super) fn frame(&self) -> Option<Frame> {
        let power = self.frame_power.as_ref().map(|power| power.value);
        let passes = self.frame_passes.value as u32;
        self.frame.value.then_some(Frame { power, passes })
    }

    /// Notes that a job without a program has no lines to begin with.
    pub(super) fn refuse_line(&self, diagnostics: &mut Diagnostics) {
        if let Some(line) = &self.from_line {
            let text = "`from_line` is for G-code programs, and this job has none".to_owned();
            diagnostics.contradict(line.span, text, "write `from_stroke` to begin with a stroke");
        }
    }

    /// The line of a program to begin with, if not the first.
    pub(super) fn first_line(&self) -> Option<u64> {
        let line = self.from_line.as_ref().map(|line| line.value as u64);
        line.filter(|line| *line > 1)
    }

    /// How a job is marked that has no say of its own.
    pub(super) fn marking(&self) -> Marking {
        Marking {
            speed: self.speed.as_ref().map(|speed| match speed {
                Either::Word(_) => MarkingSpeed::Optimum,
                Either::Value(speed) => MarkingSpeed::Constant(speed.value),
            }),
            max_speed: self.max_speed.as_ref().map(|speed| speed.value),
            tolerance: self.tolerance.as_ref().map(|tolerance| tolerance.value),
            policy: self.policy.as_ref().map(|policy| policy.value),
            turns: Turns::default(),
            frequency: self.frequency.as_ref().map(frequency::of),
            from_stroke: self.from_stroke.value as u64,
            from_along: self.from_along.as_ref().map_or(0.0, |along| along.value),
            is_dry: self.dry_run.value,
            frame: self.frame(),
        }
    }

    /// Fraction of full scale.
    pub(super) fn level(&self) -> f64 {
        self.power.as_ref().map_or(1.0, |power| power.value)
    }
}

/// Refuses a power of a frame beyond what the machine allows, and one that its source does not give.
pub(super) fn check_frame_power(
    power: &Fraction<Positive>,
    machine: &Machine,
    diagnostics: &mut Diagnostics,
) {
    let percent = |share: f64| format!("{} %", (share * 1e5).round() / 1e3);
    let (most, least) = (machine.operating.safety.frame_power, machine.laser.min_power);
    let found = percent(power.value);
    let (text, help) = if power.value > most {
        let most = percent(most);
        let help = format!(
            "write at most {most}, or allow more by `safety.frame_power` of the machine file"
        );
        (format!("a frame is shown with {most} of full power at most, not {found}"), help)
    } else if power.value < least {
        let least = percent(least);
        let help = format!("write at least {least}, or leave it out: the frame is dark then");
        (format!("the laser gives no less than {least} (`laser.min_power`), not {found}"), help)
    } else {
        return;
    };
    diagnostics.refuse(ProblemKind::OutOfRange, power.span, text, Some(help));
}
