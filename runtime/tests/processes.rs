//! Processes that join, leave and are killed: who is let in, and what is left afterwards.
//!
//! The other processes are this test binary again, running [`member_process`] with a script in
//! the environment.

#![allow(clippy::unwrap_used)]

mod scratch;

use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use messages::{Cycle, Feedback, Progress};
use runtime::child::ChildProcess;
use runtime::peer::{PeerState, Peers};
use runtime::wake::Wake;
use runtime::{Domain, DomainError, Instance, Role, Samples};
use scratch::Scratch;

const INSTANCE: &str = "GRAVER_TEST_INSTANCE";
const ROLE: &str = "GRAVER_TEST_ROLE";

/// Long beyond anything that a loaded computer needs.
const PATIENCE: Duration = Duration::from_secs(60);

fn role(name: &str) -> Role {
    Role::NAMED.into_iter().find(|role| role.name() == name).unwrap()
}

/// In a child: enters the instance, says so, publishes if it is drives, and leaves when its
/// standard input ends. Without the environment it is an empty test.
#[test]
fn member_process() {
    let (Ok(name), Ok(role_name)) = (std::env::var(INSTANCE), std::env::var(ROLE)) else { return };
    let instance = Instance::new(&name).unwrap();
    let entered = match role(&role_name) {
        Role::Domain => Domain::create(&instance),
        role => Domain::join(&instance, role),
    };
    let domain = match entered {
        Ok(domain) => domain,
        Err(error) => {
            println!("\nmember: {error}");
            return;
        }
    };
    let ports = (domain.role() == Role::Drives).then(|| {
        let mut publisher = domain.publisher::<Feedback>().unwrap();
        let epoch = u64::from(std::process::id());
        publisher.publish(&Feedback { epoch, cycle: Cycle(1), ..Feedback::default() }).unwrap();
        publisher
    });
    let status = domain.subscriber::<Progress>(Samples::All).unwrap();
    println!("\nmember: ready");
    std::io::stdin().read_to_end(&mut Vec::new()).unwrap();
    drop((ports, status));
    drop(domain);
    println!("\nmember: left");
}

fn command(instance: &Instance, role: Role) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", "member_process", "--nocapture", "--test-threads=1"])
        .env(INSTANCE, instance.name())
        .env(ROLE, role.name())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    command
}

fn said(child: &mut Child) -> String {
    let lines = BufReader::new(child.stdout.as_mut().unwrap()).lines();
    let mut member = lines
        .map_while(Result::ok)
        .filter_map(|line| line.strip_prefix("member: ").map(String::from));
    member.next().unwrap_or_default()
}

/// Starts a member that is no child of the holder, and waits until it is in.
fn start(instance: &Instance, role: Role) -> Child {
    let mut child = command(instance, role).spawn().unwrap();
    assert_eq!(said(&mut child), "ready");
    child
}

fn kill(mut child: Child) {
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().signal(), Some(libc::SIGKILL));
}

fn leave(mut child: Child) {
    drop(child.stdin.take());
    assert_eq!(said(&mut child), "left");
    assert!(child.wait().unwrap().success());
}

fn eventually(what: &str, mut holds: impl FnMut() -> bool) {
    let started = Instant::now();
    while !holds() {
        assert!(started.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn without_a_domain_nobody_joins() {
    let scratch = Scratch::new();
    let patience = Duration::from_millis(20);
    let error =
        Domain::join_within(scratch.instance(), Role::Planner, patience).unwrap_err().to_string();
    let expected = format!(
        "no pipeline is running as instance {:?}; start one with `graver run` or `graver domain`",
        scratch.instance().name()
    );
    assert_eq!(error, expected);
}

#[test]
fn an_instance_in_use_names_its_holder() {
    let scratch = Scratch::new();
    let holder = start(scratch.instance(), Role::Domain);
    match Domain::create(scratch.instance()).unwrap_err() {
        DomainError::InUse { pid, role, .. } => {
            assert_eq!((pid, role), (holder.id() as i32, Role::Domain));
        }
        error => panic!("{error}"),
    }
    leave(holder);
    scratch.assert_gone();
    drop(Domain::create(scratch.instance()).unwrap());
}

#[test]
fn a_role_has_one_owner_and_dies_with_it() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let planner = start(scratch.instance(), Role::Planner);
    let patience = Duration::from_millis(20);
    match Domain::join_within(scratch.instance(), Role::Planner, patience).unwrap_err() {
        DomainError::RoleTaken { pid, role, .. } => {
            assert_eq!((pid, role), (planner.id() as i32, Role::Planner));
        }
        error => panic!("{error}"),
    }
    kill(planner);
    drop(Domain::join(scratch.instance(), Role::Planner).unwrap());
    drop(holder);
}

#[test]
fn a_killed_holder_keeps_its_place_until_the_last_member_has_left() {
    let scratch = Scratch::new();
    let holder = start(scratch.instance(), Role::Domain);
    let drives = start(scratch.instance(), Role::Drives);
    let monitor = start(scratch.instance(), Role::Monitor);
    kill(holder);

    let newcomer = Duration::from_millis(20);
    assert!(matches!(
        Domain::join_within(scratch.instance(), Role::Planner, newcomer),
        Err(DomainError::Absent { .. })
    ));
    match Domain::create(scratch.instance()).unwrap_err() {
        DomainError::InUse { pid, role, .. } => {
            assert_eq!((pid, role), (drives.id() as i32, Role::Drives));
        }
        error => panic!("{error}"),
    }
    leave(monitor);
    assert!(!scratch.left().is_empty());
    leave(drives);
    scratch.assert_gone();
}

#[test]
fn the_next_start_wipes_what_the_killed_left() {
    let scratch = Scratch::new();
    for _ in 0..3 {
        let holder = start(scratch.instance(), Role::Domain);
        let drives = start(scratch.instance(), Role::Drives);
        let controller = start(scratch.instance(), Role::Controller);
        kill(drives);
        kill(holder);
        kill(controller);
        assert!(!scratch.left().is_empty());
    }
    let holder = Domain::create(scratch.instance()).unwrap();
    assert!(holder.publisher::<Feedback>().is_ok());
}

#[test]
fn a_holder_killed_while_it_creates_does_no_harm() {
    let scratch = Scratch::new();
    for delay in 0..12 {
        let mut holder = command(scratch.instance(), Role::Domain).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(3 * delay));
        holder.kill().unwrap();
        holder.wait().unwrap();
    }
    let holder = Domain::create(scratch.instance()).unwrap();
    assert!(holder.publisher::<Feedback>().is_ok());
}

#[test]
fn members_killed_while_they_join_do_no_harm() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    for delay in 0..12 {
        let mut drives = command(scratch.instance(), Role::Drives).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(2 * delay));
        drives.kill().unwrap();
        drives.wait().unwrap();
        holder.clean();
    }
    let mut reader = holder.subscriber::<Feedback>(Samples::All).unwrap();
    let drives = start(scratch.instance(), Role::Drives);
    let _ = reader.receive().unwrap();
    leave(drives);
    assert!(holder.publisher::<Feedback>().is_ok());
}

#[test]
fn a_successor_of_a_killed_publisher_is_heard() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut reader = holder.subscriber::<Feedback>(Samples::All).unwrap();
    for _ in 0..4 {
        let drives = start(scratch.instance(), Role::Drives);
        let pid = u64::from(drives.id());
        eventually("its own feedback arrives", || {
            reader.receive().unwrap().is_some_and(|feedback| feedback.epoch == pid)
        });
        kill(drives);
        holder.clean();
    }
    assert_eq!(reader.lost(), 0);
}

#[test]
fn members_that_leave_at_once_leave_nothing() {
    let scratch = Scratch::new();
    for _ in 0..5 {
        let holder = start(scratch.instance(), Role::Domain);
        let mut members: Vec<Child> = [Role::Drives, Role::Controller, Role::Planner]
            .map(|role| start(scratch.instance(), role))
            .into();
        members.push(holder);
        for member in &mut members {
            drop(member.stdin.take());
        }
        for mut member in members {
            assert!(member.wait().unwrap().success());
        }
        scratch.assert_gone();
    }
}

#[test]
fn a_peer_is_seen_to_come_die_and_come_again() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut peers = Peers::watch(&holder, &[Role::Planner, Role::Drives]).unwrap();
    assert_eq!(peers.state(Role::Planner), PeerState::Unknown);
    assert_eq!(peers.state(Role::Monitor), PeerState::Unknown);
    for _ in 0..3 {
        let planner = start(scratch.instance(), Role::Planner);
        eventually("it is found", || peers.state(Role::Planner) == PeerState::Alive);
        assert_eq!(holder.peer(Role::Planner).unwrap().pid(), planner.id() as i32);
        kill(planner);
        assert_eq!(peers.state(Role::Planner), PeerState::Dead);
        assert!(holder.peer(Role::Planner).is_none());
    }
    assert_eq!(peers.state(Role::Drives), PeerState::Unknown);
}

#[test]
fn a_child_keeps_the_domain_from_its_first_instruction() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    // `sleep` never joins; it has nothing but what it inherited.
    let mut sleep = Command::new("sleep");
    sleep.arg("600");
    let mut child = ChildProcess::spawn(&holder, sleep).unwrap();
    drop(holder);
    assert!(!scratch.left().is_empty());
    assert!(matches!(Domain::create(scratch.instance()), Err(DomainError::InUse { .. })));
    assert!(child.is_alive());
    assert_eq!(child.wait_within(Duration::ZERO).unwrap(), None);
    child.terminate().unwrap();
    let status = child.wait_within(PATIENCE).unwrap().unwrap();
    assert_eq!(status.signal(), Some(libc::SIGTERM));
    drop(Domain::create(scratch.instance()).unwrap());
}

#[test]
fn a_child_inherits_the_lock_and_nothing_else() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let _ports = (holder.publisher::<Feedback>().unwrap(), holder.listener(Wake::Command).unwrap());
    let mut sleep = Command::new("sleep");
    sleep.arg("600").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let child = ChildProcess::spawn(&holder, sleep).unwrap();
    let directory = format!("/proc/{}/fd", child.pid());
    // While it starts, `sleep` also has its libraries open for a moment.
    eventually("only the lock is open", || {
        let entries = std::fs::read_dir(&directory).unwrap().flatten();
        let mut open: Vec<_> =
            entries.filter_map(|entry| std::fs::read_link(entry.path()).ok()).collect();
        open.retain(|path| path != Path::new("/dev/null"));
        open == [scratch.instance().lock_path()]
    });
}

#[test]
fn a_child_that_joined_gives_its_inheritance_back() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut planner =
        ChildProcess::spawn(&holder, command(scratch.instance(), Role::Planner)).unwrap();
    assert_eq!(said(planner.child()), "ready");
    drop(holder);
    // Were the inherited lock still open, the planner would not know that it is the last one.
    drop(planner.child().stdin.take());
    assert_eq!(said(planner.child()), "left");
    scratch.assert_gone();
    assert!(planner.wait_within(PATIENCE).unwrap().unwrap().success());
}

#[test]
fn a_dropped_child_is_asked_to_end_and_not_killed() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let said = folder.path().join("said");
    let mut shell = Command::new("sh");
    let script = "trap 'echo asked; exit 0' TERM; echo ready; while :; do sleep 0.02; done";
    shell.arg("-c").arg(script).stdin(Stdio::null());
    shell.stdout(std::fs::File::create(&said).unwrap());
    let child = ChildProcess::spawn(&holder, shell).unwrap();
    let peer = runtime::peer::Peer::open(child.pid()).unwrap();
    eventually("it is ready", || std::fs::read_to_string(&said).unwrap() == "ready\n");
    drop(child);
    assert!(peer.ended_within(PATIENCE));
    assert_eq!(std::fs::read_to_string(&said).unwrap(), "ready\nasked\n");
}
