//! What machines say, and who may hear it.

use crate::support::{Cell, Machine, Nats, server, survey, until};
use fleet::{Credentials, FleetError};
use messages::{Cycle, Feedback};
use monitor::hub::Batch;
use operator::PastFault;
use std::sync::atomic::Ordering;

#[test]
fn the_last_of_what_each_machine_says_is_kept_and_a_goodbye() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let cells = [Cell::idle(), Cell::idle()];
    let mut machines = ["one", "two"].map(|name| {
        let cell = cells[usize::from(name == "two")].clone();
        Machine::new(&server, name, None, spool.path(), cell)
    });
    let fault =
        PastFault { time: 5, code: "overload".to_owned(), detail: "axis a".to_owned(), job: None };
    {
        let mut state = cells[1].state();
        state.status.fault = Some("overload".to_owned());
        state.status.faults = vec![fault.clone()];
        state.status.job_number = Some(7);
        state.status.job = Some("plate".to_owned());
        state.status.share = 0.25;
    }
    let mut cycle = 0;
    let fleet = until("both machines in all their messages", || {
        for machine in &mut machines {
            cycle += 1;
            let feedback = Feedback { cycle: Cycle(cycle), missed: 2, ..Feedback::default() };
            machine.poll(&Batch { feedbacks: vec![feedback], ..Batch::default() });
        }
        let fleet = survey(&server);
        let whole = fleet.machines.values().filter(|machine| {
            machine.metrics.as_ref().is_some_and(|it| it.cycles > 1)
                && machine.job.is_some()
                && machine.faults.is_some()
        });
        let is_told = |name: &str| fleet.machines.get(name)?.job.as_ref()?.job.clone();
        (whole.count() == 2 && is_told("two").is_some()).then_some(fleet)
    });
    let (one, two) = (&fleet.machines["one"], &fleet.machines["two"]);
    assert!(one.is_heard && two.is_heard);
    assert_eq!(one.state.as_ref().unwrap().state, "idle");
    assert_eq!(one.job.as_ref().unwrap().job, None);
    assert_eq!(two.state.as_ref().unwrap().fault.as_deref(), Some("overload"));
    assert_eq!(two.faults.as_ref().unwrap().faults, [fault]);
    let job = two.job.as_ref().unwrap().job.clone().unwrap();
    assert_eq!((job.number, job.name.as_str(), job.share, job.id), (7, "plate", 0.25, None));
    assert!(two.metrics.as_ref().unwrap().since > 1e9);

    let [first, second] = machines;
    drop(second);
    let fleet = survey(&server);
    assert!(!fleet.machines["two"].is_heard, "it has said goodbye before it ended");
    assert!(!fleet.machines["two"].state.as_ref().unwrap().online);
    until("the first goes on", || survey(&server).machines["one"].is_heard.then_some(()));
    drop(first);
}

#[test]
fn a_server_that_was_away_is_found_again_and_has_what_it_had() {
    let Some(mut nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let cell = Cell::idle();
    let machine = Machine::new(&server, "one", None, spool.path(), cell.clone());
    until("the machine", || survey(&server).machines.get("one").cloned());
    let unsent = machine.publisher.unsent();
    nats.restart(|| {
        until("it is told", || cell.heard("is away"));
        until("what is not sent is counted", || {
            (machine.publisher.unsent() > unsent).then_some(())
        });
        cell.state().status.state = "running".to_owned();
    });
    until("the new state", || {
        let state = survey(&server).machines.get("one")?.state.clone()?;
        (state.state == "running").then_some(())
    });
}

#[test]
fn streams_that_are_deleted_are_made_anew() {
    let Some(nats) = Nats::start() else { return };
    let (server, spool) = (nats.server(), tempfile::tempdir().unwrap());
    let _machine = Machine::new(&server, "one", None, spool.path(), Cell::idle());
    until("the machine", || survey(&server).machines.get("one").cloned());
    delete(&server, fleet::streams::MACHINES);
    until("the machine again", || survey(&server).machines.get("one").cloned());
}

/// Deletes a stream behind everybody's back.
fn delete(server: &fleet::Server, stream: &str) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let client = async_nats::connect(server.address.to_string()).await.unwrap();
        async_nats::jetstream::new(client).delete_stream(stream).await.unwrap();
    });
}

#[test]
fn a_stream_that_somebody_made_otherwise_is_told_and_not_used() {
    let Some(nats) = Nats::start() else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let client = async_nats::connect(nats.server().address.to_string()).await.unwrap();
        let config = async_nats::jetstream::stream::Config {
            name: fleet::streams::JOBS.to_owned(),
            subjects: vec![fleet::streams::jobs("*")],
            ..Default::default()
        };
        async_nats::jetstream::new(client).create_stream(config).await.unwrap();
    });
    let error = fleet::survey::survey(&nats.server()).unwrap_err().to_string();
    assert!(error.contains("GRAVER_JOBS") && error.contains("workqueue"), "{error}");
}

#[test]
fn a_server_without_jetstream_is_told_so() {
    let Some(nats) = Nats::start_with("") else { return };
    let error = fleet::survey::survey(&nats.server()).unwrap_err();
    assert!(matches!(error, FleetError::NoJetStream(_)), "{error}");
    assert!(error.to_string().contains("nats-server -js"), "{error}");
}

#[test]
fn credentials_let_in_and_are_never_told() {
    const TOKEN: &str = "token-of-the-fleet-47";
    let config = format!(
        "jetstream {{ store_dir: \"FOLDER/store\" }}\nauthorization {{ token: \"{TOKEN}\" }}"
    );
    let Some(nats) = Nats::start_with(&config) else { return };
    let with = |credentials: Option<Credentials>| fleet::Server { credentials, ..nats.server() };
    let token = |text: &str| Some(Credentials::Token(text.to_owned()));
    assert!(fleet::survey::survey(&with(token(TOKEN))).is_ok());
    let wrong = format!("{TOKEN}8");
    for (credentials, words) in [(None, "no credentials"), (token(&wrong), "these credentials")] {
        let error = fleet::survey::survey(&with(credentials)).unwrap_err();
        assert!(matches!(error, FleetError::NotAllowed { .. }), "{error}");
        assert!(error.to_string().contains(words) && !error.to_string().contains(TOKEN), "{error}");
    }
    let spool = tempfile::tempdir().unwrap();
    let cell = Cell::idle();
    let machine =
        Machine::new(&with(token(&wrong)), "one", Some("lasers"), spool.path(), cell.clone());
    until("the refusal", || cell.heard("lets nobody in"));
    let shown = format!("{:?} {:?}", machine.publisher, machine.options);
    drop(machine);
    let told = cell.state().told.join("\n");
    assert!(!told.contains(TOKEN) && !shown.contains(TOKEN), "{told}\n{shown}");
    assert!(!cell.is_checking.load(Ordering::Relaxed));
}

#[test]
fn credentials_are_not_sent_in_the_clear_where_the_connection_must_be_encrypted() {
    const TOKEN: &str = "token-of-the-fleet-47";
    // It has no certificate, and takes everybody.
    let Some(nats) = Nats::start() else { return };
    let address = nats.server().address.to_string().replace("nats://", "tls://");
    let credentials = Some(Credentials::Token(TOKEN.to_owned()));
    let refused = fleet::survey::survey(&fleet::Server { credentials, ..server(&address) });
    let error = refused.unwrap_err();
    assert!(matches!(error, FleetError::Unreachable { .. }), "{error}");
}
