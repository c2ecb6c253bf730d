//! A session behind sockets: a thread for each connection, one that asks the machine how it goes, and a few that carry
//! out what clients ask.
//!
//! One client operates; others get status reports and the answers to questions. Nobody waits for a client: one that
//! does not read is cut off, and one that has vanished is followed by the next.

mod client;
mod lanes;
mod opening;
mod tty;

use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use runtime::peer_user::PeerUser;

use self::client::{Client, Sink};
use self::lanes::Lanes;
use crate::machine::{Answer, Ask, Machine};
use crate::network::Network;
use crate::session::Session;

/// How often the machine is asked how it goes, with somebody there and without.
const POLL_INTERVALS: [Duration; 2] = [Duration::from_millis(25), Duration::from_millis(250)];

/// How often the accepting thread checks whether it shall end.
const LOOK_PERIOD: Duration = Duration::from_millis(20);

/// A client that has said nothing for so long is followed by one that wants to operate.
const SILENCE: Duration = Duration::from_secs(5);

/// Connections at a time.
const MOST_CLIENTS: usize = 16;

/// How a server is reached.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// Other computers that may connect, where it listens for them.
    pub networks: Vec<Network>,
    /// Where software that speaks to a serial port finds one.
    pub tty: Option<PathBuf>,
}

/// What all threads share.
struct Shared<M> {
    machine: M,
    core: Mutex<Core>,
    lanes: Lanes,
    started: Instant,
    stop: AtomicBool,
    access: Access,
}

/// The session and who operates it.
struct Core {
    session: Session,
    operator: Option<Operator>,
    clients: usize,
    /// The number of the newest connection.
    newest: u64,
}

/// The client that operates.
struct Operator {
    client: u64,
    host: Option<IpAddr>,
    sink: Sink,
    heard: Instant,
}

/// A running server. Dropping it ends its threads; the machine goes on with what it has.
pub struct Server {
    stop: Arc<dyn Fn() + Send + Sync>,
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    /// Serves `session` of `machine` to whoever connects to `listener`, if there is one, and at `access`'s terminal.
    ///
    /// # Errors
    /// A thread that cannot be started, a terminal that cannot be made.
    pub fn start<M: Machine + 'static>(
        machine: M,
        session: Session,
        listener: Option<TcpListener>,
        access: Access,
    ) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            machine,
            core: Mutex::new(Core { session, operator: None, clients: 0, newest: 0 }),
            lanes: Lanes::default(),
            started: Instant::now(),
            stop: AtomicBool::new(false),
            access,
        });
        let mut threads = lanes::start(&shared)?;
        let polling = shared.clone();
        threads.push(spawn("grbl-status", move || poll(&polling))?);
        if let Some(listener) = listener {
            listener.set_nonblocking(true)?;
            let accepting = shared.clone();
            threads.push(spawn("grbl-accept", move || accept(&listener, &accepting))?);
        }
        if let Some(path) = shared.access.tty.clone() {
            threads.push(tty::start(&path, &shared)?);
        }
        let stopped = shared;
        let stop = move || {
            stopped.stop.store(true, Ordering::Relaxed);
            stopped.lanes.wake();
        };
        Ok(Self { stop: Arc::new(stop), threads })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        (self.stop)();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn spawn(name: &str, run: impl FnOnce() + Send + 'static) -> io::Result<JoinHandle<()>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(run)
}

impl<M: Machine + 'static> Shared<M> {
    fn lock(&self) -> MutexGuard<'_, Core> {
        // A thread that panicked leaves a session that is whole: each of its steps is.
        self.core.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The time of the session [s].
    fn now(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Moves what the session says to the client that operates, and what it asks to the machine.
    fn pump(&self, core: &mut Core) {
        loop {
            let asks = core.session.take_asks();
            if asks.is_empty() {
                break;
            }
            for (ticket, ask) in asks {
                if let Err(full) = self.lanes.add(ticket, ask) {
                    core.session.answered(ticket, Answer::Refused(full.to_owned()), self.now());
                }
            }
        }
        let output = core.session.take_output();
        if output.is_empty() {
            return;
        }
        let is_told = core.operator.as_ref().is_none_or(|operator| operator.sink.send(output));
        if !is_told {
            core.operator = None;
            core.session.disconnect(self.now());
        }
    }

    /// Carries out a request, and tells the session what came of it.
    fn carry_out(&self, ticket: u64, ask: &Ask) {
        let answer = self.machine.ask(ask);
        let mut core = self.lock();
        core.session.answered(ticket, answer, self.now());
        self.pump(&mut core);
    }
}

/// Asks the machine how it goes, until the server ends.
fn poll<M: Machine + 'static>(shared: &Shared<M>) {
    while !shared.is_over() {
        let status = shared.machine.status().ok();
        let (jobs, is_watched) = {
            let core = shared.lock();
            (core.session.jobs(), core.clients > 0 || core.session.is_active())
        };
        // One that is under way shows in the status.
        let running = status.as_ref().and_then(|status| status.job_number);
        let jobs = jobs.into_iter().filter(|job| Some(*job) != running);
        let states: Vec<_> =
            jobs.filter_map(|job| Some((job, shared.machine.job(job).ok()?))).collect();
        {
            let mut core = shared.lock();
            let now = shared.now();
            core.session.observe(status, now);
            for (job, state) in states {
                core.session.job(job, state, now);
            }
            core.session.tick(now);
            shared.pump(&mut core);
        }
        std::thread::sleep(POLL_INTERVALS[usize::from(!is_watched)]);
    }
}

fn accept<M: Machine + 'static>(listener: &TcpListener, shared: &Arc<Shared<M>>) {
    let mut clients: Vec<(TcpStream, JoinHandle<()>)> = Vec::new();
    while !shared.is_over() {
        clients.retain(|(_, thread)| !thread.is_finished());
        let Ok((stream, peer)) = listener.accept() else {
            std::thread::sleep(LOOK_PERIOD);
            continue;
        };
        let full = (clients.len() >= MOST_CLIENTS)
            .then(|| format!("{MOST_CLIENTS} clients are connected already"));
        if let Some(words) = full.or_else(|| stranger(&stream, peer, &shared.access.networks)) {
            client::turn_away(&stream, &words);
            continue;
        }
        let (Ok(own), Ok(client)) = (stream.try_clone(), Client::of(stream, peer)) else {
            continue;
        };
        let serving = shared.clone();
        if let Ok(thread) = spawn("grbl-client", move || client::serve(client, &serving)) {
            clients.push((own, thread));
        }
    }
    for (stream, thread) in clients {
        let _ = stream.shutdown(std::net::Shutdown::Both);
        let _ = thread.join();
    }
}

/// Why whoever is at the other end may not connect; `None` where it may.
fn stranger(stream: &TcpStream, peer: SocketAddr, networks: &[Network]) -> Option<String> {
    let address = peer.ip().to_canonical();
    match PeerUser::of(stream) {
        Ok(PeerUser::Own) => None,
        Ok(PeerUser::Other(user)) => {
            Some(format!("user {user} may not operate this machine: it belongs to another user"))
        }
        Ok(PeerUser::Elsewhere) if networks.iter().any(|network| network.contains(address)) => None,
        Ok(PeerUser::Elsewhere) => Some(format!(
            "{address} may not operate this machine: start graver with --grbl-from {address}"
        )),
        Ok(PeerUser::Unknown) => Some("nobody knows whose this connection is".to_owned()),
        Err(error) => Some(format!("nobody knows whose this connection is: {error}")),
    }
}
