//! The operators' socket: requests, parts, and clear words when nobody is there.

#![allow(clippy::unwrap_used)]

mod scratch;

use std::io::{BufRead, BufReader, Write};
use std::ops::ControlFlow;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use runtime::Domain;
use runtime::socket::{Conversation, OperatorClient, OperatorServer, SocketError};
use scratch::Scratch;
use serde_json::{Value, json};

/// Counts up to the request in parts, and answers with the double.
fn count(request: Value, conversation: &mut Conversation<'_>) -> Value {
    let end = request["to"].as_u64().unwrap_or(0);
    for part in 1..=end {
        conversation.tell(&json!(part)).unwrap();
    }
    json!({ "sum": end * (end + 1) / 2 })
}

#[test]
fn without_a_pipeline_an_operator_hears_how_to_start_one() {
    let scratch = Scratch::new();
    let error = OperatorClient::connect(scratch.instance()).unwrap_err().to_string();
    let name = scratch.instance().name();
    let expected = format!(
        "no pipeline is running as instance {name:?}; start one with `graver run` or `graver \
         domain`"
    );
    assert_eq!(error, expected);
}

#[test]
fn requests_are_answered_in_order_with_their_parts() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let _server = OperatorServer::bind(&holder, count).unwrap();
    let mut client = OperatorClient::connect(scratch.instance()).unwrap();

    assert_eq!(client.request(&json!({ "to": 3 })).unwrap(), json!({ "sum": 6 }));
    let mut parts = Vec::new();
    let reply = client.follow(&json!({ "to": 4 }), |part| {
        parts.extend(part);
        ControlFlow::<()>::Continue(())
    });
    let ControlFlow::Continue(reply) = reply.unwrap() else { panic!("nobody broke off") };
    assert_eq!(
        (reply, parts),
        (json!({ "sum": 10 }), vec![json!(1), json!(2), json!(3), json!(4)])
    );
}

#[test]
fn clients_do_not_wait_for_each_other() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let _server = OperatorServer::bind(&holder, |request, conversation| {
        while request == json!("follow") && conversation.is_open() {
            std::thread::sleep(Duration::from_millis(1));
        }
        request
    })
    .unwrap();
    let mut idle = UnixStream::connect(scratch.instance().socket_path()).unwrap();
    idle.write_all(b"\"follow\"\n").unwrap();
    let mut client = OperatorClient::connect(scratch.instance()).unwrap();
    assert_eq!(client.request(&json!("quick")).unwrap(), json!("quick"));
}

#[test]
fn a_line_that_is_no_json_is_refused_and_the_next_one_heard() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let _server = OperatorServer::bind(&holder, count).unwrap();
    let mut stream = UnixStream::connect(scratch.instance().socket_path()).unwrap();
    stream.write_all(b"{\"to\": \n{\"to\": 0}\n").unwrap();
    let mut lines = BufReader::new(stream).lines().map_while(Result::ok);
    let refusal = lines.next().unwrap();
    assert!(refusal.starts_with("{\"error\":\"the request is not JSON: EOF"), "{refusal}");
    assert_eq!(lines.next().unwrap(), "{\"reply\":{\"sum\":0}}");
}

#[test]
fn an_ended_pipeline_ends_its_operators() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let server = OperatorServer::bind(&holder, count).unwrap();
    let mut client = OperatorClient::connect(scratch.instance()).unwrap();
    client.request(&json!({})).unwrap();
    drop(server);
    assert!(matches!(client.request(&json!({})), Err(SocketError::Ended { .. })));
    assert!(matches!(
        OperatorClient::connect(scratch.instance()),
        Err(SocketError::NotRunning { .. })
    ));
}

#[test]
fn a_client_that_reads_nothing_does_not_keep_the_holder_from_its_end() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let (told, ended) = std::sync::mpsc::channel();
    let server = OperatorServer::bind(&holder, move |_, conversation: &mut Conversation<'_>| {
        let part = json!("a".repeat(100_000));
        while conversation.tell(&part).is_ok() {}
        let _ = told.send(());
        Value::Null
    })
    .unwrap();
    let mut client = UnixStream::connect(scratch.instance().socket_path()).unwrap();
    client.write_all(b"\"follow\"\n").unwrap();
    // Whatever it has to say has filled all buffers by then.
    ended.recv_timeout(Duration::from_secs(60)).unwrap();
    drop(server);
    drop(client);
}
