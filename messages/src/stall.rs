//! Stalls: times in which the control cycle stood still, how long, and why as far as the kernel says.

use crate::{Cycle, Nanoseconds, sample};

/// Why a cycle stood still. Discriminants are the bits in samples, and the places in
/// [`Stalls::causes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum StallCause {
    /// The hypervisor ran something else on this CPU: steal time was counted.
    Steal = 0,
    /// Memory that the thread used was not there.
    PageFault = 1,
    /// The thread was ready to run and waited for its CPU: the kernel, an interrupt, a task of higher
    /// priority, or the limit of real-time tasks.
    Preempted = 2,
    /// The control group had used up its share of CPU time.
    Throttled = 3,
    /// The CPU was slowed down because it was too hot.
    Heat = 4,
    /// The process was stopped by a signal and continued.
    Stopped = 5,
    /// Drives was in time, and the controller's answer came too late or not at all.
    LateAnswer = 6,
}

impl StallCause {
    /// All of them, in the order of their bits.
    pub const ALL: [Self; 7] = [
        Self::Steal,
        Self::PageFault,
        Self::Preempted,
        Self::Throttled,
        Self::Heat,
        Self::Stopped,
        Self::LateAnswer,
    ];

    /// Its bit in [`Stalls::longest_causes`].
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }

    /// Those whose bits are in `causes`.
    pub fn of(causes: u32) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |cause| causes & cause.bit() != 0)
    }

    /// The name in summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Steal => "steal",
            Self::PageFault => "page_fault",
            Self::Preempted => "preempted",
            Self::Throttled => "throttled",
            Self::Heat => "heat",
            Self::Stopped => "stopped",
            Self::LateAnswer => "late_answer",
        }
    }

    /// What happened, in words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Steal => "the hypervisor took the CPU (steal time)",
            Self::PageFault => "memory was not there (page faults)",
            Self::Preempted => "the CPU was busy with something else",
            Self::Throttled => "the control group's share of CPU time was used up",
            Self::Heat => "the CPU was slowed down by its heat",
            Self::Stopped => "drives was stopped by a signal",
            Self::LateAnswer => "the controller answered too late",
        }
    }
}

/// Places in [`Stalls::causes`]: one for each cause, and the last for stalls that nothing explains.
pub const CAUSES: usize = StallCause::ALL.len() + 1;

sample! {
    /// The stalls since the newest stream began to be played.
    ///
    /// With strict deadlines, a stall is a run of cycles without a fresh command, and its length the
    /// time of those cycles; with a clock that may slip, it is a deadline that came at least one
    /// period late, and its length by how much.
    Stalls = "graver.Stalls.v1" {
        /// The stream, 0 before the first.
        stream: u64,
        /// How many.
        count: u64,
        /// How long all of them together.
        total: Nanoseconds,
        /// How long the longest.
        longest: Nanoseconds,
        /// The first cycle of the longest.
        longest_cycle: Cycle,
        /// Why the longest: bits of [`StallCause`], 0 where nothing is known.
        longest_causes: u32,
        /// Always 0.
        reserved: u32,
        /// How many by cause, in the order of [`StallCause`]; a stall may have several. The last
        /// counts those without any.
        causes: [u64; CAUSES],
    }
}

#[cfg(test)]
mod tests {
    use super::{CAUSES, StallCause};

    #[test]
    fn each_cause_has_its_own_place_and_name() {
        for (place, cause) in StallCause::ALL.into_iter().enumerate() {
            assert_eq!((cause as usize, cause.bit()), (place, 1 << place));
            assert_eq!(StallCause::of(cause.bit()).collect::<Vec<_>>(), [cause]);
        }
        assert_eq!(StallCause::of(u32::MAX).count(), CAUSES - 1);
        let mut names = StallCause::ALL.map(StallCause::name);
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
