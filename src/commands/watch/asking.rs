//! The thread that asks: the status ten times a second, and what keys ask for as soon as they are pressed.

use monitor::latency::HopLatency;
use operator::{Client, ClientError, Queue, Request, Status, VerbReply};
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

/// How often the status is asked for.
const INTERVAL: Duration = Duration::from_millis(100);

/// Every how many times the jobs are asked for too.
const JOBS_EVERY: u32 = 10;

/// What came back.
#[derive(Debug)]
pub(super) enum News {
    /// What the pipeline is doing.
    Status(Box<Status>),
    /// The jobs that wait.
    Jobs(Box<Queue>),
    /// The latencies of the hops since they are measured.
    Latencies(BTreeMap<String, HopLatency>),
    /// No pipeline, or one that does not answer.
    Silence(String),
    /// What became of a key's request.
    Answer(String),
}

/// Asks until nobody listens.
pub(super) fn ask(client: &Client, requests: &Receiver<Request>, news: &Sender<News>) {
    let mut until_jobs = 0;
    loop {
        let told = match requests.recv_timeout(INTERVAL) {
            Ok(request) => news.send(News::Answer(answer(client.verb(&request)))),
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => return,
        };
        let status = match client.status() {
            Ok(status) => News::Status(Box::new(status)),
            Err(error) => News::Silence(error.to_string()),
        };
        if told.and_then(|()| news.send(status)).is_err() {
            return;
        }
        if until_jobs == 0
            && let Ok(jobs) = client.ask_for::<Queue>(&Request::Queue)
        {
            // That nobody listens any more the next status finds.
            let _ = news.send(News::Jobs(Box::new(jobs)));
            until_jobs = JOBS_EVERY;
        }
        until_jobs = until_jobs.saturating_sub(1);
    }
}

fn answer(reply: Result<VerbReply, ClientError>) -> String {
    match reply {
        Ok(reply) if reply.accepted => {
            let caps = reply.capped_by.map_or(String::new(), |caps| format!(": {caps}"));
            format!("accepted; the machine was {}{caps}", reply.state)
        }
        Ok(reply) => {
            let otherwise = format!("not possible while the machine is {}", reply.state);
            format!("refused: {}", reply.refusal.unwrap_or(otherwise))
        }
        Err(error) => error.to_string(),
    }
}
