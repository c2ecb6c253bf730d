//! The hub: everything that the services say, received always and handed on to whoever wants it.
//!
//! The machine does not wait for a hub: its buffers are deep, and what it was too slow for is
//! counted. Setpoints are between planner and controller alone; the planner tells them once more for the one hub that
//! records.

use messages::{
    Command, ControllerReport, DrivesReport, Feedback, JobOffer, PlannerReport, Progress,
    SentSetpoint, Setpoint,
};
use runtime::channel::{Channel, ChannelError};
use runtime::{Domain, Samples, ServiceError, Subscriber};
use std::time::{Duration, Instant};

/// What arrived since the poll before, each kind in order.
#[derive(Debug, Default)]
pub struct Batch {
    /// From drives, one a cycle.
    pub feedbacks: Vec<Feedback>,
    /// From the controller, one a cycle.
    pub commands: Vec<Command>,
    /// From the planner, for the hub that records: those that the commands are made of, and what follows them.
    pub setpoints: Vec<Setpoint>,
    /// From the controller, every few cycles.
    pub progress: Vec<Progress>,
    /// From the controller, every second and at the end of a stream.
    pub controller_reports: Vec<ControllerReport>,
    /// From drives, some times a second.
    pub drives_reports: Vec<DrivesReport>,
    /// From the planner, some times a second.
    pub planner_reports: Vec<PlannerReport>,
    /// From the domain's holder: a job that is offered, or withdrawn.
    pub offers: Vec<JobOffer>,
    /// What was too slow to be received.
    pub lost: Lost,
}

/// Samples that a hub never saw because it was away for too long.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lost {
    /// Feedback.
    pub feedbacks: u64,
    /// Commands.
    pub commands: u64,
}

/// Somebody to whom a hub hands on what it receives. A sink that fails ends whoever polls.
pub trait Sink {
    /// A job is offered, or withdrawn; what the batch has besides is handed on afterwards.
    ///
    /// # Errors
    /// What the process shall end with.
    fn offer(&mut self, offer: &JobOffer, batch: &Batch) -> Result<(), ServiceError> {
        let _ = (offer, batch);
        Ok(())
    }

    /// Samples were lost before this batch.
    fn lose(&mut self, lost: Lost) {
        let _ = lost;
    }

    /// Takes what arrived; called with every poll, also when nothing did.
    ///
    /// # Errors
    /// What the process shall end with.
    fn take(&mut self, batch: &Batch) -> Result<(), ServiceError>;

    /// Nothing more comes.
    ///
    /// # Errors
    /// What the process shall end with.
    fn end(&mut self) -> Result<(), ServiceError> {
        Ok(())
    }
}

/// All channels that can be listened to.
#[derive(Debug)]
pub struct Hub {
    feedbacks: Subscriber<Feedback>,
    commands: Subscriber<Command>,
    progress: Subscriber<Progress>,
    controller_reports: Subscriber<ControllerReport>,
    drives_reports: Subscriber<DrivesReport>,
    planner_reports: Subscriber<PlannerReport>,
    offers: Subscriber<JobOffer>,
    /// `None` for a hub that does not record.
    setpoints: Option<Subscriber<SentSetpoint>>,
    batch: Batch,
    lost: Lost,
    /// When feedback and commands came last.
    heard: [Instant; 2],
}

impl Hub {
    /// The same, with the setpoints that were sent: for the process that records.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn recording(domain: &Domain) -> Result<Self, ChannelError> {
        Ok(Self { setpoints: Some(domain.subscriber(Samples::All)?), ..Self::open(domain)? })
    }

    /// Listens to everything in `domain`, of which the process may be any member.
    ///
    /// # Errors
    /// A channel that has no room for one more reader, or fails.
    pub fn open(domain: &Domain) -> Result<Self, ChannelError> {
        Ok(Self {
            feedbacks: domain.subscriber(Samples::All)?,
            commands: domain.subscriber(Samples::All)?,
            progress: domain.subscriber(Samples::Latest)?,
            controller_reports: domain.subscriber(Samples::Latest)?,
            drives_reports: domain.subscriber(Samples::Latest)?,
            planner_reports: domain.subscriber(Samples::Latest)?,
            offers: domain.subscriber(Samples::Latest)?,
            setpoints: None,
            batch: Batch::default(),
            lost: Lost::default(),
            heard: [Instant::now(); 2],
        })
    }

    /// Receives what waits and hands it to every sink. Never waits itself: call it some hundred
    /// times a second.
    ///
    /// # Errors
    /// A channel or a sink that fails.
    pub fn poll(&mut self, sinks: &mut [&mut dyn Sink]) -> Result<(), ServiceError> {
        let batch = &mut self.batch;
        // Reports before offers: whether an offered job is over already is known by them.
        receive(&mut self.progress, &mut batch.progress)?;
        receive(&mut self.controller_reports, &mut batch.controller_reports)?;
        receive(&mut self.drives_reports, &mut batch.drives_reports)?;
        receive(&mut self.planner_reports, &mut batch.planner_reports)?;
        receive(&mut self.offers, &mut batch.offers)?;
        receive(&mut self.feedbacks, &mut batch.feedbacks)?;
        receive(&mut self.commands, &mut batch.commands)?;
        if let Some(setpoints) = &mut self.setpoints {
            // After the commands: a setpoint is told before the controller can take it.
            batch.setpoints.clear();
            while let Some(sent) = setpoints.receive()? {
                batch.setpoints.push(sent.setpoint);
            }
        }
        let [feedback_heard, command_heard] = &mut self.heard;
        if !batch.feedbacks.is_empty() {
            *feedback_heard = Instant::now();
        }
        if !batch.commands.is_empty() {
            *command_heard = Instant::now();
        }
        let all = Lost { feedbacks: self.feedbacks.lost(), commands: self.commands.lost() };
        batch.lost = Lost {
            feedbacks: all.feedbacks - self.lost.feedbacks,
            commands: all.commands - self.lost.commands,
        };
        self.lost = all;
        for sink in sinks {
            for offer in &batch.offers {
                sink.offer(offer, batch)?;
            }
            if batch.lost != Lost::default() {
                sink.lose(batch.lost);
            }
            sink.take(batch)?;
        }
        Ok(())
    }

    /// How long feedback or commands have stayed away, whichever for longer.
    pub fn silence(&self) -> Duration {
        self.heard.iter().map(Instant::elapsed).max().unwrap_or_default()
    }

    /// Makes believe that nothing was heard for a time.
    #[cfg(test)]
    pub(crate) fn silence_for(&mut self, time: Duration) {
        let then = Instant::now().checked_sub(time);
        self.heard = self.heard.map(|heard| then.unwrap_or(heard));
    }
}

/// Empties a channel into `samples`, in place of what was there.
fn receive<T: Channel>(
    subscriber: &mut Subscriber<T>,
    samples: &mut Vec<T>,
) -> Result<(), ChannelError> {
    samples.clear();
    while let Some(sample) = subscriber.receive()? {
        samples.push(sample);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
