//! How often the machine held a job by itself, for its summary: such a job has other commands than its
//! simulation.

use super::{JobRun, Stage};
use messages::HoldCause;

/// Holds that nobody asked for and that end by themselves.
#[derive(Debug, Default)]
pub(super) struct OwnHolds {
    /// Setpoints had run out.
    setpoints: u32,
    /// Light was not given where it was due.
    light: u32,
    /// The cause that was heard of last.
    last: HoldCause,
}

impl OwnHolds {
    fn hear(&mut self, cause: HoldCause) {
        if cause != self.last {
            match cause {
                HoldCause::Setpoints => self.setpoints += 1,
                HoldCause::Light => self.light += 1,
                _ => {}
            }
        }
        self.last = cause;
    }

    /// In words, for a person.
    fn told(&self) -> Vec<String> {
        let times = |count: u32| if count == 1 { "once".into() } else { format!("{count} times") };
        let of = [
            (self.setpoints, "waited", "for setpoints: the planner was behind"),
            (self.light, "went back", "for light that a late command or a stall had cost"),
        ];
        let held = of.into_iter().filter(|(count, ..)| *count > 0);
        held.map(|(count, did, why)| format!("the machine {did} {} {why}", times(count))).collect()
    }
}

impl JobRun<'_> {
    /// Counts the holds while the job is played.
    pub(super) fn note_holds(&mut self) {
        if matches!(self.stage, Stage::Playing) {
            self.holds.hear(HoldCause::from_wire(self.pipeline.latest.progress.hold_cause));
        }
    }

    /// Tells them in the summary's warnings.
    pub(super) fn tell_holds(&mut self) {
        self.run_outcome.warnings.extend(self.holds.told());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_hold_of_its_own_is_counted_once() {
        let mut holds = OwnHolds::default();
        assert_eq!(holds.told(), Vec::<String>::new());
        let heard = [
            HoldCause::None,
            HoldCause::Light,
            HoldCause::Light,
            HoldCause::None,
            HoldCause::Person,
            HoldCause::Setpoints,
            HoldCause::None,
            HoldCause::Setpoints,
        ];
        heard.into_iter().for_each(|cause| holds.hear(cause));
        assert_eq!(
            holds.told(),
            [
                "the machine waited 2 times for setpoints: the planner was behind",
                "the machine went back once for light that a late command or a stall had cost",
            ]
        );
    }
}
