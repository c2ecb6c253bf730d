//! Asks the pipeline for its status and its queue, again and again, and tells what changed.

use crate::advice::advice;
use crate::context::Context;
use crate::events::Level;
use operator::Request;
use serde_json::Value;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How often the status is asked for while pages look, and while none does.
const WATCHED: Duration = Duration::from_millis(100);
const ALONE: Duration = Duration::from_millis(1000);

/// How often the queue is asked for, and the latencies are told.
const SELDOM: Duration = Duration::from_millis(1000);

/// Pause between two looks at whether something is due.
const STEP: Duration = Duration::from_millis(20);

/// Asks until the server ends.
pub fn run(context: &Context) {
    let (mut asked, mut seldom): (Option<Instant>, Option<Instant>) = (None, None);
    let due = |last: Option<Instant>, after: Duration| last.is_none_or(|it| it.elapsed() >= after);
    while !context.is_over.load(Ordering::Relaxed) {
        let pace = if context.metrics.clients() > 0 { WATCHED } else { ALONE };
        if due(asked, pace) {
            asked = Some(Instant::now());
            let status = context.pipeline.ask(&Request::Status);
            context.hub.post_status(status.map_err(|error| error.to_string()));
        }
        if due(seldom, SELDOM) {
            seldom = Some(Instant::now());
            if let Ok(queue) = context.pipeline.ask(&Request::Queue) {
                context.hub.post_queue(queue);
            }
            context.hub.post_latency();
        }
        std::thread::sleep(STEP);
    }
}

/// What a person should be told about the step from one status to the next, with what to do about it.
pub(crate) fn changes(before: Option<&Value>, now: &Value) -> Vec<(Level, String, Option<String>)> {
    let Some(before) = before else { return Vec::new() };
    let text = |status: &Value, key: &str| status[key].as_str().map(str::to_owned);
    let mut told = Vec::new();
    let fault = text(now, "fault");
    if let Some(code) = &fault
        && text(before, "fault").as_ref() != Some(code)
    {
        let newest = now["faults"].as_array().and_then(|faults| faults.last());
        let detail = newest.filter(|it| it["code"].as_str() == Some(code));
        let detail = detail.and_then(|it| text(it, "detail")).unwrap_or_else(|| code.clone());
        told.push((Level::Fault, detail, advice(code).map(str::to_owned)));
    }
    let (was, is) = (text(before, "state"), text(now, "state"));
    if was != is
        && let Some(is) = is
    {
        let cause = text(now, "cause").map(|cause| format!(": {cause}")).unwrap_or_default();
        let level = if fault.is_some() { Level::Warning } else { Level::Info };
        told.push((level, format!("the machine is {is}{cause}"), None));
    }
    let (was, is) = (text(before, "job"), text(now, "job"));
    if was != is {
        told.push(match (was, is) {
            (_, Some(job)) => (Level::Info, format!("job {job} has begun"), None),
            (was, None) => {
                (Level::Info, format!("job {} has ended", was.unwrap_or_default()), None)
            }
        });
    }
    for (name, pid) in now["services"].as_object().into_iter().flatten() {
        if pid.is_null() && before["services"][name].is_i64() {
            told.push((Level::Warning, format!("service {name} has ended"), None));
        }
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_fault_is_told_once_with_its_words_and_its_advice() {
        let idle =
            json!({ "state": "running", "fault": null, "job": "NASO", "services": {"drives": 5} });
        let faults = json!([{ "code": "overload", "detail": "overload of axis a: 3 A of 2 A" }]);
        let faulted = json!({ "state": "faulted", "fault": "overload", "job": null, "faults": faults,
            "services": {"drives": null} });
        let told = changes(Some(&idle), &faulted);
        let texts: Vec<_> = told.iter().map(|(level, text, _)| (*level, text.as_str())).collect();
        assert_eq!(
            texts,
            [
                (Level::Fault, "overload of axis a: 3 A of 2 A"),
                (Level::Warning, "the machine is faulted"),
                (Level::Info, "job NASO has ended"),
                (Level::Warning, "service drives has ended"),
            ]
        );
        assert!(told[0].2.is_some());
        assert_eq!(changes(Some(&faulted), &faulted), []);
        assert_eq!(changes(None, &faulted), [], "what was so before is no news");
    }
}
