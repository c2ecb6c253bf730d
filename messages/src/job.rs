//! Domain to planner and back: which job to plan, and how that went.

use crate::{Nanoseconds, sample};

/// The longest path of a run folder that a job offer can carry [bytes].
pub const MAX_PATH: usize = 1024;

/// What the planner is doing. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum PlannerPhase {
    /// Nothing to do.
    #[default]
    Idle = 0,
    /// Reading the job, and planning and checking its first window.
    Planning = 1,
    /// Sending setpoints, and planning what follows.
    Streaming = 2,
    /// All setpoints of the stream have been sent.
    Sent = 3,
    /// The job was refused; `refused.json` in the run folder says why and where.
    Refused = 4,
}

impl PlannerPhase {
    /// The phase with this number in a sample; an unknown number reads as [`Self::Idle`].
    pub fn from_wire(value: u32) -> Self {
        match value {
            1 => Self::Planning,
            2 => Self::Streaming,
            3 => Self::Sent,
            4 => Self::Refused,
            _ => Self::Idle,
        }
    }
}

sample! {
    /// A job to plan and stream. The job itself is in `request.json` in the run folder.
    ///
    /// An offer without a folder cancels the stream of its number, planned or half sent.
    JobOffer = "graver.JobOffer.v2" {
        /// The stream number the job gets; each job of a domain a new one, from 1.
        stream: u64,
        /// 1 in an offer without a folder when nothing more of the stream will be played; 0 when
        /// what is being played goes on until the axes rest.
        is_over: u64,
        /// Bytes of `folder` that count.
        folder_length: u64,
        /// Path of the run folder, UTF-8.
        folder: [u8; MAX_PATH],
    }
}

impl JobOffer {
    /// An offer of the job in `folder`; `None` when the path is longer than [`MAX_PATH`].
    pub fn new(stream: u64, folder: &str) -> Option<Self> {
        let bytes = folder.as_bytes();
        let mut offer = Self { stream, folder_length: bytes.len() as u64, ..Self::default() };
        offer.folder.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(offer)
    }

    /// The run folder; `None` when the bytes are not a path.
    pub fn folder(&self) -> Option<&str> {
        core::str::from_utf8(self.folder.get(..self.folder_length as usize)?).ok()
    }
}

sample! {
    /// How planning and streaming go.
    PlannerReport = "graver.PlannerReport.v2" {
        /// When it was published.
        published: Nanoseconds,
        /// The stream it speaks of, 0 for none.
        stream: u64,
        /// Setpoints that were planned and handed over to be sent; all of the stream once it is
        /// complete.
        samples: u64,
        /// Setpoints sent so far.
        sent: u64,
        /// Strokes in them.
        strokes: u64,
        /// Time from offer to the first setpoint [s].
        plan_time: f64,
        /// Stream time at the end of what was planned [s]; of the whole motion once it is complete.
        duration: f64,
        /// Stream time at the end of the job [s]: an estimate from the first reading, corrected by what
        /// has been planned.
        estimate: f64,
        /// Length to be marked [m], 0 while unknown.
        length: f64,
        /// A [`PlannerPhase`].
        phase: u32,
        /// 1 once the plan is complete, else 0.
        is_complete: u32,
    }
}

#[cfg(test)]
mod tests {
    use super::{JobOffer, MAX_PATH, PlannerPhase};

    #[test]
    fn an_offer_carries_its_folder() {
        for folder in ["", "/tmp/run", "/tmp/Grüße aus Köln", &"x".repeat(MAX_PATH)] {
            let offer = JobOffer::new(7, folder);
            assert_eq!(offer.as_ref().and_then(JobOffer::folder), Some(folder));
            assert_eq!(offer.map(|offer| offer.stream), Some(7));
        }
        assert_eq!(JobOffer::new(7, &"x".repeat(MAX_PATH + 1)), None);
        assert_eq!(JobOffer::default().folder(), Some(""), "no folder withdraws the stream");
    }

    #[test]
    fn bytes_that_are_no_path_are_none() {
        let mut offer = JobOffer { folder_length: MAX_PATH as u64 + 1, ..JobOffer::default() };
        assert_eq!(offer.folder(), None);
        offer.folder_length = u64::MAX;
        assert_eq!(offer.folder(), None);
        (offer.folder_length, offer.folder[0]) = (1, 0xFF);
        assert_eq!(offer.folder(), None);
    }

    #[test]
    fn phases_keep_their_numbers() {
        for number in 0..=4 {
            assert_eq!(PlannerPhase::from_wire(number) as u32, number);
        }
        assert_eq!(PlannerPhase::from_wire(99), PlannerPhase::Idle);
    }
}
