//! Jobs of a fleet: none is lost, none is done twice, and what is refused is kept with its words.

use crate::support::{Cell, Machine, Nats, submit, survey, until};
use fleet::{FleetError, Server};
use operator::fleet::{FleetStatus, JobRecord, JobRefusal};
use std::sync::atomic::Ordering;

/// The records of jobs, when all of them are in this state.
fn all(server: &Server, count: usize, state: &str) -> FleetStatus {
    until(&format!("{count} jobs {state}"), || {
        let fleet = survey(server);
        let reached = fleet.jobs.iter().filter(|job| job.state == state).count();
        (reached == count).then_some(fleet)
    })
}

#[test]
fn machines_that_share_a_group_do_each_job_once() {
    const JOBS: usize = 12;
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let ids: Vec<String> =
        (0..JOBS).map(|number| submit(&server, "plate.ngc", &format!("job {number}"))).collect();
    assert_eq!(survey(&server).waiting["lasers"], JOBS as u64);
    let cells = [Cell::idle(), Cell::idle(), Cell::idle()];
    let machines: Vec<Machine> = cells
        .iter()
        .zip(["one", "two", "three"])
        .map(|(cell, name)| Machine::new(&server, name, Some("lasers"), spool.path(), cell.clone()))
        .collect();
    let fleet = all(&server, JOBS, "completed");
    let mut done: Vec<String> = cells.iter().flat_map(|cell| cell.state().done.clone()).collect();
    done.sort();
    let mut expected: Vec<String> = (0..JOBS).map(|number| format!("job {number}")).collect();
    expected.sort();
    assert_eq!(done, expected);
    assert_eq!(fleet.waiting.get("lasers"), None, "an acknowledged job is gone");
    for JobRecord { id, machine, number, group, name, .. } in &fleet.jobs {
        assert!(ids.contains(id) && number.is_some());
        assert_eq!((group.as_str(), name.as_str()), ("lasers", "plate.ngc"));
        assert!(["one", "two", "three"].contains(&machine.as_str()));
    }
    drop(machines);
}

#[test]
fn a_machine_with_other_things_to_do_takes_nothing() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let busy = Cell::idle();
    busy.state().status.fault = Some("overload".to_owned());
    let _busy = Machine::new(&server, "busy", Some("lasers"), spool.path(), busy.clone());
    let _other = Machine::new(&server, "other", Some("printers"), spool.path(), Cell::idle());
    let _watched = Machine::new(&server, "watched", None, spool.path(), Cell::idle());
    until("all three", || (survey(&server).machines.len() == 3).then_some(()));
    submit(&server, "a.ngc", "a");
    let state = survey(&server).machines["busy"].state.clone().unwrap();
    assert!(state.busy.unwrap().contains("overload"));
    assert_eq!(survey(&server).waiting["lasers"], 1);
    busy.state().status.fault = None;
    all(&server, 1, "completed");
    assert_eq!(busy.state().done, ["a"]);
}

#[test]
fn a_refused_job_is_put_aside_with_its_words_and_the_next_is_done() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let cell = Cell::idle();
    let refusal = JobRefusal {
        file: Some("wide.ngc".to_owned()),
        line: Some(3),
        column: Some(5),
        message: "x 900 mm is outside of the area, which ends at 400 mm".to_owned(),
    };
    cell.state().refused.insert("wide.ngc".to_owned(), refusal.clone());
    let _machine = Machine::new(&server, "one", Some("lasers"), spool.path(), cell.clone());
    let wide = submit(&server, "wide.ngc", "G1 X900");
    submit(&server, "good.ngc", "good");
    all(&server, 1, "completed");
    let fleet = all(&server, 1, "refused");
    assert_eq!(cell.state().done, ["good"]);
    let record = fleet.jobs.iter().find(|job| job.id == wide).unwrap();
    assert_eq!(
        record.message.as_deref(),
        Some("wide.ngc:3:5: x 900 mm is outside of the area, which ends at 400 mm")
    );
    assert_eq!((fleet.refused["lasers"], fleet.waiting.get("lasers")), (1, None));
    assert!(cell.heard("was refused: wide.ngc:3:5").is_some());
    let (headers, body) =
        last(&server, fleet::streams::REFUSED, &fleet::streams::refused("lasers"));
    assert_eq!(body, b"G1 X900");
    let told: JobRefusal =
        serde_json::from_str(headers.get("Graver-Refusal").unwrap().as_str()).unwrap();
    assert_eq!(told, refusal);
    let ticket: serde_json::Value =
        serde_json::from_str(headers.get("Graver-Job").unwrap().as_str()).unwrap();
    assert_eq!((&ticket["id"], &ticket["name"]), (&wide.into(), &"wide.ngc".into()));
    assert!(
        !spool.path().join("one").join(ticket["id"].as_str().unwrap()).exists(),
        "nothing of it is kept"
    );
}

#[test]
fn what_is_no_job_is_put_aside_too() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let ticket = |name: &str, version: u32| {
        serde_json::json!({ "version": version, "id": "0123456789abcdef", "name": name, "submitted": 1.0 }).to_string()
    };
    let sent = [
        (None, "body", "no header Graver-Job"),
        (Some("not JSON".to_owned()), "body", "docs/fleet.md"),
        (Some(ticket("a.ngc", 2)), "body", "version 2"),
        (Some(ticket("../../etc/passwd.ngc", 1)), "body", "no name of a job's file"),
        (Some(ticket("a.ngc", 1)), "", "empty"),
    ];
    let cell = Cell::idle();
    for (header, body, _) in &sent {
        publish(&server, header.as_deref(), body);
    }
    let _machine = Machine::new(&server, "one", Some("lasers"), spool.path(), cell.clone());
    let count = sent.len() as u64;
    until("all of them aside", || {
        let fleet = survey(&server);
        (fleet.refused.get("lasers") == Some(&count) && fleet.waiting.is_empty()).then_some(())
    });
    for (_, _, words) in &sent {
        assert!(cell.heard(words).is_some(), "{words}: {:?}", cell.state().told);
    }
    assert!(!cell.is_checking.load(Ordering::Relaxed), "none of them was opened");
}

#[test]
fn a_machine_that_dies_before_its_claim_leaves_the_job_to_another() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let dying = Cell::idle();
    dying.hangs.store(true, Ordering::Relaxed);
    let machine = Machine::new(&server, "dying", Some("lasers"), spool.path(), dying.clone());
    submit(&server, "a.ngc", "a");
    until("it is checked", || dying.is_checking.load(Ordering::Relaxed).then_some(()));
    drop(machine);
    let other = Cell::idle();
    let _other = Machine::new(&server, "other", Some("lasers"), spool.path(), other.clone());
    let fleet = all(&server, 1, "completed");
    assert_eq!(fleet.jobs[0].machine, "other");
    // The first comes back, finds what it had kept, and learns that it is not its own.
    dying.hangs.store(false, Ordering::Relaxed);
    let _again = Machine::new(&server, "dying", Some("lasers"), spool.path(), dying.clone());
    let kept = spool.path().join("dying").join(&fleet.jobs[0].id);
    until("its copy is gone", || (!kept.exists()).then_some(()));
    assert_eq!((dying.state().done.len(), other.state().done.len()), (0, 1));
}

#[test]
fn a_job_that_is_checked_for_long_stays_with_its_machine() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let slow = Cell::idle();
    slow.hangs.store(true, Ordering::Relaxed);
    let machine = Machine::new(&server, "slow", Some("lasers"), spool.path(), slow.clone());
    submit(&server, "a.ngc", "a");
    until("it is checked", || slow.is_checking.load(Ordering::Relaxed).then_some(()));
    let other = Cell::idle();
    let _other = Machine::new(&server, "other", Some("lasers"), spool.path(), other.clone());
    // Three times what the server waits for a machine that says nothing.
    std::thread::sleep(3 * machine.options.pace.patience);
    slow.hangs.store(false, Ordering::Relaxed);
    assert_eq!(all(&server, 1, "completed").jobs[0].machine, "slow");
    assert!(!other.is_checking.load(Ordering::Relaxed));
}

#[test]
fn a_machine_that_dies_after_its_claim_does_the_job_at_its_next_start_and_no_other_does() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let cell = Cell::idle();
    cell.is_full.store(true, Ordering::Relaxed);
    let machine = Machine::new(&server, "one", Some("lasers"), spool.path(), cell.clone());
    submit(&server, "a.ngc", "a");
    all(&server, 1, "taken");
    until("it is told", || cell.heard("cannot be queued yet: 100 jobs wait already"));
    drop(machine);
    let other = Cell::idle();
    let _other = Machine::new(&server, "other", Some("lasers"), spool.path(), other.clone());
    submit(&server, "b.ngc", "b");
    all(&server, 1, "completed");
    assert_eq!(other.state().done, ["b"]);
    cell.is_full.store(false, Ordering::Relaxed);
    let _again = Machine::new(&server, "one", Some("lasers"), spool.path(), cell.clone());
    all(&server, 2, "completed");
    assert_eq!((cell.state().done.clone(), other.state().done.len()), (vec!["a".to_owned()], 1));
}

#[test]
fn a_job_that_is_in_the_queue_already_is_not_queued_again_after_a_restart() {
    let Some(mut nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let cell = Cell::idle();
    let machine = Machine::new(&server, "one", Some("lasers"), spool.path(), cell.clone());
    submit(&server, "a.ngc", "a");
    all(&server, 1, "completed");
    drop(machine);
    // As if its end had never been told: the record of the claim is all that the server has.
    let id = survey(&server).jobs[0].id.clone();
    let ticket = spool.path().join("one").join(&id).join("job.json");
    let text =
        std::fs::read_to_string(&ticket).unwrap().replace("\"is_over\":true", "\"is_over\":false");
    std::fs::write(&ticket, text).unwrap();
    let taken =
        JobRecord { state: "taken".to_owned(), number: None, ..survey(&server).jobs[0].clone() };
    tell(&server, &fleet::streams::record(&id), &serde_json::to_vec(&taken).unwrap());
    all(&server, 1, "taken");
    nats.restart(|| {});
    let _again = Machine::new(&server, "one", Some("lasers"), spool.path(), cell.clone());
    all(&server, 1, "completed");
    assert_eq!(cell.state().done, ["a"]);
}

#[test]
fn a_file_that_no_message_holds_is_not_sent() {
    let Some(nats) = Nats::start() else { return };
    let server = nats.server();
    let sent = |size: usize| fleet::send::submit(&server, "lasers", "a.ngc", &[], vec![b'x'; size]);
    match sent(1 << 20).unwrap_err() {
        error @ FleetError::TooLarge { size, most } => {
            assert_eq!(size, 1 << 20);
            assert!(error.to_string().contains("max_payload"), "{error}");
            assert!(sent(most).is_ok(), "as large as it says");
        }
        other => panic!("{other}"),
    }
    for (group, name, size) in
        [("la sers", "a.ngc", 1), ("lasers", "a/b.ngc", 1), ("lasers", "a.ngc", 0)]
    {
        assert!(
            fleet::send::submit(&server, group, name, &[], vec![b'x'; size]).is_err(),
            "{group} {name} {size}"
        );
    }
    assert_eq!(survey(&server).waiting["lasers"], 1);
}

fn block_on<T>(work: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(work)
}

async fn context(server: &Server) -> async_nats::jetstream::Context {
    async_nats::jetstream::new(async_nats::connect(server.address.to_string()).await.unwrap())
}

/// The last message on a subject.
fn last(server: &Server, stream: &str, subject: &str) -> (async_nats::HeaderMap, Vec<u8>) {
    block_on(async {
        let stream = context(server).await.get_stream(stream).await.unwrap();
        let message = stream.get_last_raw_message_by_subject(subject).await.unwrap();
        (message.headers, message.payload.to_vec())
    })
}

/// Sends a message to the jobs, as any program can.
fn publish(server: &Server, header: Option<&str>, body: &str) {
    // The streams are there once somebody has asked for them.
    survey(server);
    let mut headers = async_nats::HeaderMap::new();
    if let Some(header) = header {
        headers.insert("Graver-Job", header);
    }
    let body = body.to_owned();
    block_on(async {
        let context = context(server).await;
        let sent = context
            .publish_with_headers(fleet::streams::jobs("lasers"), headers, body.into())
            .await;
        sent.unwrap().await.unwrap();
    });
}

fn tell(server: &Server, subject: &str, body: &[u8]) {
    let body = body.to_vec();
    block_on(async {
        context(server).await.publish(subject.to_owned(), body.into()).await.unwrap().await.unwrap()
    });
}
