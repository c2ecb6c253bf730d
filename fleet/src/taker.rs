//! Takes jobs of a group from the fleet, one when the machine has nothing else to do.
//!
//! No job is lost and none is done twice, whoever dies when. A job is written to this machine's disk, then claimed: the record of a
//! job is written by the first alone, which the server sees to. Whoever claimed it has it from then on, puts it into the queue of the
//! machine, and takes it off the fleet's queue. A machine that dies before its claim never had the job: the server gives it to
//! another. One that dies after it finds it in its spool at its next start. A job that is delivered once more has a record, and is
//! no more than acknowledged.

use crate::connection::{Connection, Unpublished};
use crate::error::words;
use crate::now;
use crate::pipeline::{Verdict, busy};
use crate::publisher::Shared;
use crate::spool::{Spool, check_name};
use crate::station::ask;
use crate::{name, streams};
use async_nats::jetstream::consumer::{Consumer, pull};
use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::{AckKind, Message};
use futures_util::StreamExt;
use operator::fleet::{JobRecord, JobRefusal, JobTicket, VERSION};
use operator::{Queue, QueuedJob};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

/// The headers of a job, and of one that was refused.
pub(crate) const TICKET: &str = "Graver-Job";
pub(crate) const REFUSAL: &str = "Graver-Refusal";

/// States of a record before its job has ended.
const TAKEN: &str = "taken";
const QUEUED: &str = "queued";
const REFUSED: &str = "refused";

/// How long a job that cannot be taken just now is left to the others.
const LATER: Duration = Duration::from_secs(10);

/// The longest refusal that goes into a header [characters].
const LONGEST_REFUSAL: usize = 2000;

/// Takes the jobs of one group.
pub(crate) struct Taker {
    shared: Arc<Shared>,
    connection: Connection,
    group: String,
    spool: Spool,
    /// Jobs whose records say that they are in the queue.
    recorded: BTreeSet<String>,
    /// What people were told last of what does not go.
    told: String,
}

impl Taker {
    pub(crate) fn new(shared: Arc<Shared>, connection: Connection, group: String) -> Self {
        let spool = Spool::new(shared.options.spool.clone());
        Self { shared, connection, group, spool, recorded: BTreeSet::new(), told: String::new() }
    }

    /// Takes jobs for as long as it is polled.
    pub(crate) async fn run(mut self) {
        let pace = self.shared.options.pace;
        loop {
            match self.round(pace.wait).await {
                Ok(true) => self.told.clear(),
                Ok(false) => tokio::time::sleep(pace.look).await,
                Err(error) => {
                    self.complain(error);
                    tokio::time::sleep(pace.look.max(Duration::from_millis(200))).await;
                }
            }
        }
    }

    /// Looks after the jobs that were taken, and asks for one more if the machine has nothing to do; whether it did.
    async fn round(&mut self, wait: Duration) -> Result<bool, String> {
        let (status, queue) = ask(&self.shared).await;
        let Ok(jobs) = &queue else { return Ok(false) };
        self.settle(jobs).await?;
        if busy(&status, &queue).is_some() {
            return Ok(false);
        }
        let consumer = self.consumer().await?;
        let batch = consumer.batch().max_messages(1).expires(wait).messages().await;
        let mut batch = batch.map_err(|error| words(&error))?;
        match batch.next().await {
            Some(Ok(message)) => self.take(&message).await?,
            Some(Err(error)) => return Err(words(&*error)),
            None => {}
        }
        Ok(true)
    }

    async fn consumer(&self) -> Result<Consumer<pull::Config>, String> {
        let config = streams::takers(&self.group, self.shared.options.pace.patience);
        let name = config.durable_name.clone().unwrap_or_default();
        let found = self.connection.streams.jobs.get_or_create_consumer(&name, config).await;
        found.map_err(|error| format!("the jobs of group {}: {}", self.group, words(&error)))
    }

    /// Brings every job in the spool on: into the queue, or to its end.
    async fn settle(&mut self, queue: &Queue) -> Result<(), String> {
        for kept in self.spool.open() {
            let ticket = kept.ticket;
            match find(queue, &self.file(&ticket)) {
                Some(QueuedJob { number, outcome: Some(outcome), message, .. }) => {
                    self.record(&ticket, outcome, Some(*number), message.clone()).await?;
                    self.over(&ticket.id)?;
                }
                Some(QueuedJob { number, .. }) => {
                    if !self.recorded.contains(&ticket.id) {
                        self.record(&ticket, QUEUED, Some(*number), None).await?;
                        self.recorded.insert(ticket.id);
                    }
                }
                None => self.settle_unqueued(&ticket).await?,
            }
        }
        Ok(())
    }

    /// Decides by its record what becomes of a job that is in the spool and not in the queue.
    async fn settle_unqueued(&mut self, ticket: &JobTicket) -> Result<(), String> {
        match self.connection.record(&ticket.id).await? {
            Some(record) if record.machine == self.shared.options.machine => {
                if record.state == TAKEN {
                    self.submit(ticket).await
                } else {
                    // It was in the queue, which has forgotten it since.
                    self.over(&ticket.id)
                }
            }
            // It was never claimed, or by another.
            _ => self.spool.remove(&ticket.id).map_err(|error| error.to_string()),
        }
    }

    /// Decides what becomes of a message.
    async fn take(&mut self, message: &Message) -> Result<(), String> {
        let ticket = match read(message) {
            Ok(ticket) => ticket,
            Err(refusal) => {
                self.tell(&format!("a message that is no job was refused: {refusal}"));
                self.put_aside(message, None, &refusal).await?;
                return acknowledge(message).await;
            }
        };
        let record = self.connection.record(&ticket.id).await?;
        if let Some(record) = &record
            && record.state == REFUSED
        {
            // Whoever refused it may have died before it was put aside.
            let refusal = JobRefusal::new(record.message.clone().unwrap_or_default());
            self.put_aside(message, Some(&ticket), &refusal).await?;
            return acknowledge(message).await;
        }
        let is_mine = record
            .as_ref()
            .is_some_and(|it| it.machine == self.shared.options.machine && it.state == TAKEN);
        if record.is_some() && !is_mine {
            return acknowledge(message).await;
        }
        let (status, queue) = ask(&self.shared).await;
        if busy(&status, &queue).is_some() {
            return answer(message, AckKind::Nak(None)).await;
        }
        if let Err(error) = self.spool.keep(&ticket, &message.payload) {
            answer(message, AckKind::Nak(Some(LATER))).await?;
            return Err(format!("job {} cannot be kept: {error}", ticket.id));
        }
        if !is_mine {
            match self.check(&ticket, message).await? {
                Verdict::Fit => {}
                Verdict::Refused(refusal) => return self.refuse(&ticket, message, &refusal).await,
                Verdict::Unknown(why) => {
                    answer(message, AckKind::Nak(Some(LATER))).await?;
                    return Err(format!("job {} cannot be checked: {why}", ticket.id));
                }
            }
            if !self.claim(&ticket, TAKEN, None).await? {
                self.spool.remove(&ticket.id).map_err(|error| error.to_string())?;
                return acknowledge(message).await;
            }
        }
        let submitted = self.submit(&ticket).await;
        acknowledge(message).await?;
        if let Ok(queue) = &queue {
            let needed: BTreeSet<&str> = queue
                .running
                .iter()
                .chain(&queue.waiting)
                .filter_map(|job| job.file.as_deref())
                .collect();
            self.spool.prune(&|file| needed.contains(file.display().to_string().as_str()));
        }
        submitted
    }

    /// Has a job checked, and says meanwhile that it is not forgotten.
    async fn check(&self, ticket: &JobTicket, message: &Message) -> Result<Verdict, String> {
        let (shared, file, set) =
            (self.shared.clone(), self.spool.file(ticket), ticket.set.clone());
        let work = move || shared.pipeline.check(&file, &set, &|| shared.is_over());
        let mut checked = tokio::task::spawn_blocking(work);
        let still = self.shared.options.pace.patience / 3;
        loop {
            tokio::select! {
                verdict = &mut checked => return verdict.map_err(|error| error.to_string()),
                () = tokio::time::sleep(still) => answer(message, AckKind::Progress).await?,
            }
        }
    }

    async fn refuse(
        &mut self,
        ticket: &JobTicket,
        message: &Message,
        refusal: &JobRefusal,
    ) -> Result<(), String> {
        let removed = self.spool.remove(&ticket.id).map_err(|error| error.to_string());
        if self.claim(ticket, REFUSED, Some(refusal.to_string())).await? {
            self.tell(&format!("job {} ({}) was refused: {refusal}", ticket.id, ticket.name));
            self.put_aside(message, Some(ticket), refusal).await?;
        }
        acknowledge(message).await?;
        removed
    }

    /// Puts a message where refused jobs lie, with the words of the refusal.
    async fn put_aside(
        &self,
        message: &Message,
        ticket: Option<&JobTicket>,
        refusal: &JobRefusal,
    ) -> Result<(), String> {
        let mut refusal = refusal.clone();
        refusal.message = refusal.message.chars().take(LONGEST_REFUSAL).collect();
        let told = serde_json::to_string(&refusal).map_err(|error| error.to_string())?;
        let mut aside = PublishMessage::build().header(REFUSAL, told.as_str());
        if let Some(ticket) = ticket {
            let ticket_text = serde_json::to_string(ticket).map_err(|error| error.to_string())?;
            aside = aside
                .header(TICKET, ticket_text.as_str())
                .message_id(format!("refused-{}", ticket.id));
        }
        let subject = || streams::refused(&self.group);
        let whole = aside.clone().payload(message.payload.clone());
        match self.connection.publish(subject(), whole).await {
            // With one header more it is too large; the words matter more.
            Err(Unpublished::TooLarge) => self.connection.publish(subject(), aside).await,
            published => published,
        }
        .map_err(|error| format!("a refused job cannot be put aside: {error}"))
    }

    /// Writes the first record of a job; whether it is the first.
    async fn claim(
        &self,
        ticket: &JobTicket,
        state: &str,
        why: Option<String>,
    ) -> Result<bool, String> {
        let record = self.record_of(ticket, state, None, why);
        let body = serde_json::to_vec(&record).map_err(|error| error.to_string())?;
        let first = PublishMessage::build().payload(body.into()).expected_last_subject_sequence(0);
        match self.connection.publish(streams::record(&ticket.id), first).await {
            Ok(()) => Ok(true),
            Err(Unpublished::NotFirst) => {
                // It may be our own, whose answer was lost.
                let found = self.connection.record(&ticket.id).await?;
                Ok(found.is_some_and(|it| it.machine == record.machine && it.state == state))
            }
            Err(error) => Err(format!("job {} cannot be claimed: {error}", ticket.id)),
        }
    }

    /// Puts a job that is ours into the queue.
    async fn submit(&mut self, ticket: &JobTicket) -> Result<(), String> {
        let (shared, file, set) =
            (self.shared.clone(), self.spool.file(ticket), ticket.set.clone());
        let submitted =
            tokio::task::spawn_blocking(move || shared.pipeline.submit(&file, &set)).await;
        let submitted = submitted.map_err(|error| error.to_string())?;
        let number = submitted
            .map_err(|error| format!("job {} cannot be queued yet: {error}", ticket.id))?;
        self.tell(&format!("job {} ({}) is job {number} here", ticket.id, ticket.name));
        self.record(ticket, QUEUED, Some(number), None).await?;
        self.recorded.insert(ticket.id.clone());
        Ok(())
    }

    /// Says what has become of a job that is ours.
    async fn record(
        &self,
        ticket: &JobTicket,
        state: &str,
        number: Option<u64>,
        why: Option<String>,
    ) -> Result<(), String> {
        let record = self.record_of(ticket, state, number, why);
        let told = self.connection.tell(streams::record(&ticket.id), &record).await;
        told.map_err(|error| {
            format!("what has become of job {} cannot be told: {error}", ticket.id)
        })
    }

    fn record_of(
        &self,
        ticket: &JobTicket,
        state: &str,
        number: Option<u64>,
        message: Option<String>,
    ) -> JobRecord {
        JobRecord {
            version: VERSION,
            id: ticket.id.clone(),
            name: ticket.name.clone(),
            machine: self.shared.options.machine.clone(),
            group: self.group.clone(),
            time: now(),
            state: state.to_owned(),
            number,
            message,
        }
    }

    fn over(&mut self, id: &str) -> Result<(), String> {
        self.recorded.remove(id);
        self.spool.end(id).map_err(|error| format!("job {id}: {error}"))
    }

    /// The file of a job as the queue tells it.
    fn file(&self, ticket: &JobTicket) -> String {
        let path = self.spool.file(ticket);
        std::path::absolute(&path).unwrap_or(path).display().to_string()
    }

    fn tell(&self, text: &str) {
        self.shared.pipeline.tell(&format!("fleet: {text}"));
    }

    /// Tells what does not go, once for as long as it does not.
    fn complain(&mut self, error: String) {
        if error != self.told {
            self.tell(&error);
            self.told = error;
        }
    }
}

/// The newest job in the queue with this file.
fn find<'a>(queue: &'a Queue, file: &str) -> Option<&'a QueuedJob> {
    let jobs = queue.running.iter().chain(&queue.waiting).chain(&queue.ended);
    jobs.filter(|job| job.file.as_deref() == Some(file)).min_by_key(|job| job.number)
}

/// The ticket of a message.
fn read(message: &Message) -> Result<JobTicket, JobRefusal> {
    let refuse = |text: String| JobRefusal::new(text);
    let header = message.headers.as_ref().and_then(|headers| headers.get(TICKET));
    let Some(header) = header else {
        return Err(refuse(format!("it has no header {TICKET}, in which a job says what it is")));
    };
    let ticket: JobTicket = serde_json::from_str(header.as_str()).map_err(|error| {
        refuse(format!("the header {TICKET} is not as docs/fleet.md describes it: {error}"))
    })?;
    check(&ticket).map_err(refuse)?;
    if message.payload.is_empty() {
        return Err(refuse("the file is empty".to_owned()));
    }
    Ok(ticket)
}

/// Whether a ticket can be one.
///
/// # Errors
/// Why it cannot, with what would be right.
pub(crate) fn check(ticket: &JobTicket) -> Result<(), String> {
    if ticket.version != VERSION {
        return Err(format!("version {} is not known here: {VERSION} is", ticket.version));
    }
    if !name::is_id(&ticket.id) {
        let shown: String = ticket.id.chars().take(32).collect();
        return Err(format!("the number {shown:?} is none: 16 of 0-9 and a-f"));
    }
    check_name(&ticket.name)
}

/// Takes a message off the queue of the fleet, and waits until the server has done so.
async fn acknowledge(message: &Message) -> Result<(), String> {
    message.double_ack().await.map_err(|error| format!("a job cannot be acknowledged: {error}"))
}

async fn answer(message: &Message, kind: AckKind) -> Result<(), String> {
    message.ack_with(kind).await.map_err(|error| format!("the server cannot be answered: {error}"))
}
