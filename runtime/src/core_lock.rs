//! One pipeline for each real-time core.
//!
//! Two drives at the same priority on one core would make each other late. The claim is a bound
//! name in the abstract socket namespace: it is the same for all users, ends with its process
//! however that dies, and leaves no file. Anybody can bind such a name, so a name that is taken
//! proves nothing: the kernel is asked whether its owner really has a real-time thread on the core.
//! Where not, the next name is the claim, and every pipeline checks all of them.

mod occupant;

use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::sync::mpsc;
use std::time::Duration;

use crate::instance::user;
use crate::socket::{Credentials, credentials};
use occupant::{Occupation, anybody, occupation};

/// How long asking for the owner of a name may take.
const PATIENCE: Duration = Duration::from_millis(200);

/// How many names a core has.
const NAMES: usize = 9;

/// Why a core could not be claimed.
#[derive(Debug, thiserror::Error)]
pub enum CoreError {
    /// Another pipeline runs on it.
    #[error(
        "CPU {core} is the real-time core of another pipeline{}; name another with --core",
        .pid.map(|pid| format!(" (pid {pid})")).unwrap_or_default()
    )]
    InUse {
        /// The CPU.
        core: usize,
        /// The other pipeline's drives, if it could be told.
        pid: Option<i32>,
    },
    /// The operating system refused.
    #[error("CPU {core} could not be claimed: {source}")]
    Io {
        /// The CPU.
        core: usize,
        /// Why.
        source: io::Error,
    },
}

/// Who holds a core's name without a real-time thread on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Squatter {
    /// Its process, or 0 if it could not be told.
    pub pid: i32,
    /// Its user, or `u32::MAX` if it could not be told.
    pub user: u32,
}

/// A claim on a real-time core; dropping it gives the core free.
#[derive(Debug)]
pub struct CoreLock {
    core: usize,
    squatter: Option<Squatter>,
    /// None where every name is somebody else's.
    _name: Option<UnixListener>,
}

impl CoreLock {
    /// Claims `core` for this process. Only drives that really have a real-time priority need it.
    ///
    /// # Errors
    /// [`CoreError::InUse`] when another pipeline runs there.
    pub fn claim(core: usize) -> Result<Self, CoreError> {
        Self::claim_named(core, &format!("graver/core/{core}"))
    }

    fn claim_named(core: usize, name: &str) -> Result<Self, CoreError> {
        let failed = |source| CoreError::Io { core, source };
        let (mut squatter, mut held) = (None, None);
        // All of them: a pipeline that began beside a squatter holds a later one.
        for number in 1..=NAMES {
            let name = if number == 1 { name.to_owned() } else { format!("{name}/{number}") };
            let address = SocketAddr::from_abstract_name(name).map_err(failed)?;
            match UnixListener::bind_addr(&address) {
                Ok(listener) => {
                    held.get_or_insert(listener);
                }
                Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                    let found = examine(core, owner(address))?;
                    squatter.get_or_insert(found);
                }
                Err(source) => return Err(failed(source)),
            }
        }
        Ok(Self { core, squatter, _name: held })
    }

    /// The CPU.
    pub fn core(&self) -> usize {
        self.core
    }

    /// The first who holds one of the core's names for nothing, if any.
    pub fn squatter(&self) -> Option<Squatter> {
        self.squatter
    }
}

/// Whether the owner of a name runs a pipeline on the core, or only holds the name.
fn examine(core: usize, owner: Option<Credentials>) -> Result<Squatter, CoreError> {
    let in_use = |pid| Err(CoreError::InUse { core, pid });
    let Some(Credentials { pid, user: uid }) = owner else {
        // Nobody answers behind the name. A pipeline would; but its answers can be used up.
        return match anybody(core) {
            Some(pid) => in_use(Some(pid)),
            None => Ok(Squatter { pid: 0, user: u32::MAX }),
        };
    };
    let told = (pid != 0).then_some(pid);
    match told.map_or(Occupation::Unknown, |pid| occupation(pid, core)) {
        Occupation::RealTime => in_use(told),
        Occupation::Unknown if uid == user() => in_use(told),
        Occupation::None | Occupation::Unknown => Ok(Squatter { pid, user: uid }),
    }
}

/// The process behind a bound name. Connecting can block when many have asked before, hence the
/// thread.
fn owner(address: SocketAddr) -> Option<Credentials> {
    let (send, receive) = mpsc::channel();
    let ask = move || {
        let found = UnixStream::connect_addr(&address).and_then(|stream| credentials(&stream));
        let _ = send.send(found.ok());
    };
    std::thread::Builder::new().name("core-owner".into()).spawn(ask).ok()?;
    receive.recv_timeout(PATIENCE).ok().flatten()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use std::process::{Child, Command, Stdio};

    const NAME: &str = "GRAVER_TEST_CORE_NAME";
    const PRIORITY: &str = "GRAVER_TEST_CORE_PRIORITY";

    /// A core that no computer has: nobody can be in real time there.
    const NOWHERE: usize = 100_000;

    fn name(test: &str) -> String {
        format!("graver/test-core/{test}/{}", std::process::id())
    }

    /// Asserts that the name is free, but for the instant in which a child of another test, between
    /// fork and exec, has what was closed.
    fn assert_free(name: &str) {
        let started = std::time::Instant::now();
        while CoreLock::claim_named(NOWHERE, name).unwrap().squatter().is_some() {
            assert!(started.elapsed() < Duration::from_secs(30), "{name} stays taken");
        }
    }

    #[test]
    fn a_core_is_claimed_and_given_free() {
        let name = name("free");
        let claim = CoreLock::claim_named(NOWHERE, &name).unwrap();
        assert_eq!((claim.core(), claim.squatter()), (NOWHERE, None));
        drop(claim);
        assert_free(&name);
    }

    #[test]
    fn who_holds_a_name_for_nothing_is_told_and_passed_over() {
        let name = name("squat");
        let first = CoreLock::claim_named(NOWHERE, &name).unwrap();
        let own = Squatter { pid: std::process::id() as i32, user: user() };
        let second = CoreLock::claim_named(NOWHERE, &name).unwrap();
        assert_eq!(second.squatter(), Some(own));
        assert_eq!(CoreLock::claim_named(NOWHERE, &name).unwrap().squatter(), Some(own));
        // The first name is free again; the others are checked all the same.
        drop(first);
        assert_eq!(CoreLock::claim_named(NOWHERE, &name).unwrap().squatter(), Some(own));
        drop(second);
        assert_free(&name);
    }

    #[test]
    fn a_name_behind_which_nobody_answers_is_no_claim() {
        let name = name("deaf");
        let address = SocketAddr::from_abstract_name(&name).unwrap();
        let _deaf = std::os::unix::net::UnixDatagram::bind_addr(&address).unwrap();
        let claim = CoreLock::claim_named(NOWHERE, &name).unwrap();
        // Sockets of another kind have names of their own on some kernels.
        assert!(claim.squatter().is_none_or(|squatter| squatter.pid == 0));
    }

    #[test]
    fn somebody_who_holds_every_name_does_not_stop_a_start() {
        let name = name("every");
        let claims: Vec<CoreLock> =
            (0..NAMES + 2).map(|_| CoreLock::claim_named(NOWHERE, &name).unwrap()).collect();
        assert!(claims.iter().skip(1).all(|claim| claim.squatter().is_some()));
    }

    /// In a child: claims the name for the last CPU, real-time if asked, says how that went, and
    /// waits for its end. Without the environment it is an empty test.
    #[test]
    fn claiming_process() {
        let Ok(name) = std::env::var(NAME) else { return };
        let core = crate::thread::last_core();
        let realtime = crate::thread::enter_realtime(&crate::thread::RealtimeOptions {
            priority: std::env::var(PRIORITY).is_ok().then_some(crate::thread::DRIVES_PRIORITY),
            placement: crate::thread::Placement::Core(core),
            lock_memory: false,
        });
        let claim = CoreLock::claim_named(core, &name).unwrap();
        println!("\nchild: {} {core}", realtime.facts.fifo);
        std::io::stdin().read_line(&mut String::new()).unwrap();
        drop(claim);
    }

    /// A child that has claimed the name; dropping it ends it.
    struct Claimant(Child);

    impl Drop for Claimant {
        fn drop(&mut self) {
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }

    /// Starts a child, and tells its CPU if it is in real time there.
    fn start(name: &str, real_time: bool) -> (Claimant, Option<usize>) {
        let module = module_path!().split_once("::").unwrap().1;
        let mut command = Command::new(std::env::current_exe().unwrap());
        if real_time {
            command.env(PRIORITY, "");
        }
        let mut child = command
            .args(["--exact", &format!("{module}::claiming_process"), "--nocapture"])
            .env(NAME, name)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map(Claimant)
            .unwrap();
        let lines = io::BufRead::lines(io::BufReader::new(child.0.stdout.as_mut().unwrap()));
        let said = lines
            .map_while(Result::ok)
            .find_map(|line| line.strip_prefix("child: ").map(String::from))
            .unwrap();
        let (fifo, core) = said.split_once(' ').unwrap();
        (child, (fifo == "1").then(|| core.parse().unwrap()))
    }

    #[test]
    fn two_true_pipelines_on_one_core_are_refused_a_squatter_before_them_or_not() {
        let name = name("true");
        let (squatter, _) = start(&name, false);
        let (pipeline, core) = start(&name, true);
        // A user who may have no real-time priority cannot have two true pipelines.
        let Some(core) = core else { return };
        let refused = || CoreLock::claim_named(core, &name).unwrap_err().to_string();
        let expected = format!(
            "CPU {core} is the real-time core of another pipeline (pid {}); name another with \
             --core",
            pipeline.0.id()
        );
        assert_eq!(refused(), expected);
        // Another CPU is not its core.
        assert!(CoreLock::claim_named(core + 1, &name).is_ok());
        drop(squatter);
        assert_eq!(refused(), expected);
        drop(pipeline);
        assert!(CoreLock::claim_named(core, &name).is_ok());
    }
}
