//! Room in shared memory: what a domain takes, and what happens where there is none.
//!
//! The processes that run into walls are this test binary again, running [`walled_process`] with a
//! script in the environment. A tmpfs of a given size needs namespaces: where this user may have
//! none, such a test has nothing to say and passes.

#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stdout, reason = "children tell their parent")]

mod scratch;

use std::fs::{self, File};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use messages::{Command as MotorCommand, Cycle, Feedback, Setpoint};
use runtime::{Domain, DomainError, Instance, Samples};
use scratch::Scratch;

const SCRIPT: &str = "GRAVER_TEST_ROOM";
const INSTANCE: &str = "GRAVER_TEST_INSTANCE";
const SHARED: &str = "/dev/shm";

/// The domain's files in shared memory.
fn segments(instance: &Instance) -> Vec<PathBuf> {
    let prefix = instance.prefix();
    fs::read_dir(SHARED)
        .unwrap()
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix))
        .map(|entry| entry.path())
        .collect()
}

fn allocated(path: &Path) -> u64 {
    fs::metadata(path).unwrap().blocks() * 512
}

fn taken(instance: &Instance) -> u64 {
    segments(instance).iter().map(|path| allocated(path)).sum()
}

/// Whether each page of each segment is there.
fn assert_whole(instance: &Instance) {
    for path in segments(instance) {
        let size = fs::metadata(&path).unwrap().len();
        assert!(allocated(&path) >= size, "{path:?}: {} of {size} bytes", allocated(&path));
    }
}

fn reserve(instance: &Instance) -> u64 {
    let mut reserves =
        segments(instance).into_iter().filter(|path| path.to_string_lossy().ends_with("reserve"));
    allocated(&reserves.next().unwrap())
}

#[test]
fn what_a_pipeline_needs_is_taken_at_once_and_every_port_is_whole() {
    let scratch = Scratch::new();
    let instance = scratch.instance();
    let holder = Domain::create(instance).unwrap();
    let (before, held) = (taken(instance), reserve(instance));
    assert_whole(instance);

    let publisher = holder.publisher::<Feedback>().unwrap();
    let reader = holder.subscriber::<Feedback>(Samples::All).unwrap();
    assert_whole(instance);
    assert!(reserve(instance) < held);
    // What the ports took came out of the reserve, small files in the root included.
    assert!(taken(instance) <= before);

    drop((publisher, reader));
    holder.allocate().unwrap();
    assert_eq!(reserve(instance), held);
}

#[test]
fn nothing_of_a_domain_is_open_to_others() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let _ports = (
        holder.publisher::<Feedback>().unwrap(),
        holder.subscriber::<Feedback>(Samples::All).unwrap(),
        holder.listener(runtime::wake::Wake::Feedback).unwrap(),
    );
    let mode = |path: &Path| fs::symlink_metadata(path).unwrap().permissions().mode();
    for path in segments(scratch.instance()) {
        assert_eq!(mode(&path) & 0o077, 0, "{path:?}");
    }
    let root = scratch.instance().root();
    // Nobody else gets past this one.
    assert_eq!(mode(root.parent().unwrap()) & 0o777, 0o700);
    assert_eq!(mode(&root) & 0o777, 0o700);
    for name in ["ready", "members/domain"] {
        assert_eq!(mode(&root.join(name)) & 0o777, 0o600, "{name}");
    }
}

#[test]
fn each_domain_has_names_that_none_had_before() {
    let scratch = Scratch::new();
    let names = || {
        let holder = Domain::create(scratch.instance()).unwrap();
        let mut names = segments(scratch.instance());
        names.retain(|path| path.to_string_lossy().ends_with("reserve"));
        drop(holder);
        names
    };
    assert_ne!(names(), names());
}

#[test]
fn as_many_readers_of_every_sample_as_there_is_memory_for_are_let_in() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut publisher = holder.publisher::<Feedback>().unwrap();
    let mut every: Vec<_> =
        (0..2).map(|_| holder.subscriber::<Feedback>(Samples::All).unwrap()).collect();
    let refusal = holder.subscriber::<Feedback>(Samples::All).unwrap_err().to_string();
    assert_eq!(
        refusal,
        "channel \"feedback\" has 2 readers of every sample already, and no more fit"
    );
    let mut newest: Vec<_> =
        (0..2).map(|_| holder.subscriber::<Feedback>(Samples::Latest).unwrap()).collect();
    // None of them reads: the publisher has memory for all that waits.
    for cycle in 1..=10_000 {
        publisher.publish(&Feedback { cycle: Cycle(cycle), ..Feedback::default() }).unwrap();
    }
    for reader in every.iter_mut().chain(&mut newest) {
        assert_eq!(reader.newest().unwrap().unwrap().cycle, Cycle(10_000));
    }
    drop(every.pop());
    assert!(holder.subscriber::<Feedback>(Samples::All).is_ok());
}

#[test]
fn what_others_left_under_our_name_is_none_of_ours() {
    // Only root can make a file that belongs to somebody else.
    let scratch = Scratch::new();
    let foreign = Path::new(SHARED).join(format!("{}foreign", scratch.instance().prefix()));
    let own = Path::new(SHARED).join(format!("{}older_x", scratch.instance().prefix()));
    File::create(&own).unwrap();
    File::create(&foreign).unwrap();
    let is_foreign = std::os::unix::fs::chown(&foreign, Some(65534), None).is_ok();
    drop(Domain::create(scratch.instance()).unwrap());
    assert!(!own.exists());
    assert_eq!(foreign.exists(), is_foreign);
    let _ = fs::remove_file(&foreign);
}

/// In a child: plays its script. Without the environment it is an empty test.
#[test]
fn walled_process() {
    let (Ok(script), Ok(name)) = (std::env::var(SCRIPT), std::env::var(INSTANCE)) else { return };
    let instance = Instance::new(&name).unwrap();
    match script.as_str() {
        "create" => match Domain::create(&instance) {
            Ok(_) => println!("\nchild: created"),
            Err(error) => println!("\nchild: {error}"),
        },
        "fill" => fill(&instance),
        "late" => late(&instance),
        other => panic!("{other}"),
    }
}

/// Takes all that is left of the memory.
fn fill_up() {
    let mut file = File::create(Path::new(SHARED).join("filler")).unwrap();
    while std::io::Write::write(&mut file, &[1; 4096]).is_ok_and(|written| written > 0) {}
}

/// The memory is filled while samples wait for a reader that stands still.
fn fill(instance: &Instance) {
    let holder = Domain::create(instance).unwrap();
    let mut feedbacks = holder.publisher::<Feedback>().unwrap();
    let mut commands = holder.publisher::<MotorCommand>().unwrap();
    let mut reader = holder.subscriber::<Feedback>(Samples::All).unwrap();
    let _other = holder.subscriber::<MotorCommand>(Samples::All).unwrap();
    fill_up();
    for _ in 0..5000 {
        feedbacks.publish(&Feedback::default()).unwrap();
        commands.publish(&MotorCommand::default()).unwrap();
    }
    assert!(reader.newest().unwrap().is_some());
    println!("\nchild: went on");
}

/// A reader and a publisher join when the memory is full already.
fn late(instance: &Instance) {
    let holder = Domain::create(instance).unwrap();
    let mut feedbacks = holder.publisher::<Feedback>().unwrap();
    fill_up();
    let mut reader = holder.subscriber::<Feedback>(Samples::All).unwrap();
    feedbacks.publish(&Feedback { cycle: Cycle(7), ..Feedback::default() }).unwrap();
    assert_eq!(reader.receive().unwrap().unwrap().cycle, Cycle(7));
    let _setpoints = holder.publisher::<Setpoint>().unwrap();
    println!("\nchild: joined");
}

/// This binary with the script, started by the shell command `wall`, which ends in `"$@"`.
fn play(script: &str, wall: &[&str], instance: &str) -> Output {
    let (program, arguments) = wall.split_first().unwrap();
    Command::new(program)
        .args(arguments)
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "walled_process", "--nocapture", "--test-threads=1"])
        .env(SCRIPT, script)
        .env(INSTANCE, instance)
        .env_remove("XDG_RUNTIME_DIR")
        .output()
        .unwrap()
}

fn said(output: &Output) -> Option<String> {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().find_map(|line| line.strip_prefix("child: ").map(String::from))
}

/// What the script says in a /dev/shm of this size, and then what it left there; `None` where this
/// user may have no namespaces.
fn in_memory_of(size: &str, script: &str) -> Option<(Option<String>, Vec<String>)> {
    let inside = format!(
        "mount -t tmpfs -o size={size},mode=1777 tmpfs {SHARED} && echo 'child: inside' >&2; \
         \"$@\"; rm -f {SHARED}/filler; find {SHARED} -mindepth 1 | sed 's/^/left: /'"
    );
    let output =
        play(script, &["unshare", "-r", "-m", "sh", "-c", inside.as_str(), "sh"], "walled");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    if !errors.contains("child: inside") {
        return None;
    }
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let left = text.lines().filter_map(|line| line.strip_prefix("left: ").map(String::from));
    let said = said(&output).or_else(|| Some(format!("{text}{errors}")));
    Some((said, left.collect()))
}

#[test]
fn a_limit_on_files_is_an_error_that_says_what_is_needed_and_leaves_nothing() {
    let scratch = Scratch::new();
    let name = scratch.instance().name().to_owned();
    // 1024 blocks of 512 or 1024 bytes, less than a pipeline needs; the signal that goes with it
    // would end the process.
    let wall = ["sh", "-c", "trap '' XFSZ; ulimit -f 1024; exec \"$@\"", "sh"];
    let said = said(&play("create", &wall, &name)).unwrap();
    assert!(said.starts_with("no room in \"/dev/shm\": "), "{said}");
    assert!(said.contains(" KiB are needed, ") && said.contains(" KiB are free ("), "{said}");
    scratch.assert_gone();
}

#[test]
fn a_memory_that_is_too_small_is_an_error_that_says_how_much_is_needed_and_leaves_nothing() {
    for size in ["4k", "16k", "64k", "1m", "8m"] {
        let Some((said, left)) = in_memory_of(size, "create") else { return };
        let said = said.unwrap();
        assert!(said.starts_with("no room in \"/dev/shm"), "{size}: {said}");
        assert!(said.contains(" KiB are needed, ") && said.contains(" KiB are free ("), "{said}");
        assert_eq!(left, Vec::<String>::new(), "{size}");
    }
    let Some((said, left)) = in_memory_of("32m", "create") else { return };
    assert_eq!((said.as_deref(), left.len()), (Some("created"), 0));
}

#[test]
fn a_memory_that_fills_up_stops_nobody() {
    let Some((said, left)) = in_memory_of("32m", "fill") else { return };
    assert_eq!((said.as_deref(), left.len()), (Some("went on"), 0));
}

#[test]
fn there_is_room_for_those_who_join_when_the_memory_is_full() {
    let Some((said, left)) = in_memory_of("32m", "late") else { return };
    assert_eq!((said.as_deref(), left.len()), (Some("joined"), 0));
}

#[test]
fn what_is_needed_and_what_is_free_is_said_in_kib() {
    let error: DomainError = runtime::room::RoomError::Full {
        directory: SHARED.into(),
        needed: 17_000_000,
        free: 2_000_000,
        reason: "No space left on device (os error 28)".into(),
    }
    .into();
    assert_eq!(
        error.to_string(),
        "no room in \"/dev/shm\": 16602 KiB are needed, 1953 KiB are free (No space left on device \
         (os error 28)); make room there, or give it a larger size"
    );
}
