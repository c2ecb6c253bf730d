//! The server: takes connections, so many and no more, and answers what comes over them.

use crate::access::{Access, Peer, TokenError, Tokens};
use crate::api::{guard, system};
use crate::context::{Context, Slots};
use crate::hub::Hub;
use crate::metrics::Metrics;
use crate::pipeline::Pipeline;
use crate::preview::Previewer;
use crate::spool::Spool;
use crate::{observe, poll, routes};
use axum::extract::DefaultBodyLimit;
use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use runtime::Instance;
use runtime::peer_user::PeerUser;
use std::collections::HashMap;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Connections at a time.
const MOST: usize = 256;

/// Of them, those of other users of this computer, and those from other computers: the rest is kept for the machine's
/// own user, whom nobody may keep out.
const MOST_OF_OTHERS: usize = 96;
const MOST_FROM_ELSEWHERE: usize = 96;

/// From one other computer.
const MOST_OF_ONE: usize = 64;

/// Connections of which it is being found out whose they are.
const NAMELESS: usize = 32;

/// How long the head of a request may take to come.
const HEAD_PATIENCE: Duration = Duration::from_secs(10);

/// What the kernel keeps of what a page has not read [bytes]: its part of what a slow page may miss.
const SEND_BUFFER: u32 = 128 << 10;

/// Connections that wait to be taken.
const BACKLOG: u32 = 64;

/// How often it is asked whether to end.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// How a server is to be.
#[derive(Debug)]
pub struct Options {
    /// Where it listens.
    pub listen: SocketAddr,
    /// The file with the tokens, made where there is none; `None` where there is no folder for it.
    pub token_file: Option<PathBuf>,
    /// Whether the user of this computer needs no token.
    pub trusts_own_user: bool,
    /// Names by which browsers may call it.
    pub names: Vec<String>,
    /// The folder of uploaded files.
    pub spool: PathBuf,
    /// The program that plans jobs: `graver`.
    pub program: PathBuf,
    /// Whose samples are read; `None` to read none.
    pub observed: Option<Instance>,
}

/// Why a server cannot be.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address.
    #[error("cannot listen at {address}: {source}")]
    Listen {
        /// It.
        address: SocketAddr,
        /// What the operating system says.
        source: io::Error,
    },
    /// The tokens.
    #[error(transparent)]
    Tokens(#[from] TokenError),
    /// An address that others reach, and no tokens.
    #[error(
        "{0} can be reached from other computers, and there are no tokens: name a file for them with --token-file, \
         or listen at 127.0.0.1"
    )]
    NoTokens(SocketAddr),
    /// A thread.
    #[error("the server could not start: {0}")]
    Start(#[from] io::Error),
}

/// A server that listens.
pub struct Server {
    runtime: tokio::runtime::Runtime,
    listener: TcpListener,
    address: SocketAddr,
    context: Context,
    observed: Option<Instance>,
    made_tokens: Option<PathBuf>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Server at {}", self.address)
    }
}

impl Server {
    /// Begins to listen; nothing is answered before [`Self::run`].
    ///
    /// # Errors
    /// An address that cannot be had, tokens that cannot be read, and none where they are needed.
    pub fn bind(options: Options, pipeline: Arc<dyn Pipeline>) -> Result<Self, ServeError> {
        let (tokens, is_new) = match &options.token_file {
            Some(path) => Tokens::open(path)?,
            None => (Tokens::default(), false),
        };
        if tokens.is_empty() && !options.listen.ip().is_loopback() {
            return Err(ServeError::NoTokens(options.listen));
        }
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let listener = {
            let _inside = runtime.enter();
            let listening = listen(options.listen);
            listening.map_err(|source| ServeError::Listen { address: options.listen, source })?
        };
        let address = listener.local_addr()?;
        let metrics = Arc::new(Metrics::new());
        let access = Access::new(tokens, options.trusts_own_user, &options.names, address.port());
        let context = Context {
            pipeline,
            hub: Arc::new(Hub::new(metrics.clone())),
            metrics,
            spool: Arc::new(Spool::new(options.spool)),
            previewer: Arc::new(Previewer::new(options.program)),
            access: Arc::new(access),
            is_over: Arc::new(AtomicBool::new(false)),
            uploads: Slots::for_uploads(),
            plans: Slots::for_plans(),
        };
        let made_tokens = options.token_file.filter(|_| is_new);
        Ok(Self { runtime, listener, address, context, observed: options.observed, made_tokens })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The file of tokens, if it was made just now.
    pub fn made_tokens(&self) -> Option<&PathBuf> {
        self.made_tokens.as_ref()
    }

    /// What its threads share.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Serves until `is_over` says so.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub fn run(self, is_over: impl Fn() -> bool) -> Result<(), ServeError> {
        let Self { runtime, listener, context, observed, .. } = self;
        let threads = Threads::start(&context, observed)?;
        let app = routes::router()
            .fallback(system::page)
            .layer(DefaultBodyLimit::max(guard::LARGEST_BODY))
            .layer(axum::middleware::from_fn_with_state(context.clone(), guard::admit))
            .with_state(context.clone());
        runtime.block_on(accept(&listener, &app, is_over));
        context.is_over.store(true, Ordering::Relaxed);
        drop(threads);
        // Pages are told, and a request under way has a moment.
        runtime.block_on(async { tokio::time::sleep(2 * LOOK_PERIOD).await });
        runtime.shutdown_timeout(Duration::from_secs(1));
        Ok(())
    }
}

fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    socket.set_reuseaddr(true)?;
    // Those that are accepted inherit it.
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// The threads that ask and read; dropping it ends them.
struct Threads {
    is_over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Threads {
    fn start(context: &Context, observed: Option<Instance>) -> io::Result<Self> {
        let is_over = context.is_over.clone();
        let mut threads = Self { is_over, threads: Vec::new() };
        let own = context.clone();
        threads.add("poll", move || poll::run(&own))?;
        if let Some(instance) = observed {
            let own = context.clone();
            threads.add("observe", move || observe::run(&instance, &own))?;
        }
        Ok(threads)
    }

    fn add(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
        self.threads.push(std::thread::Builder::new().name(name.into()).spawn(work)?);
        Ok(())
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

async fn accept(listener: &TcpListener, app: &Router, is_over: impl Fn() -> bool) {
    let places = Arc::new(Places::default());
    let nameless = Arc::new(Semaphore::new(NAMELESS));
    let mut look = tokio::time::interval(LOOK_PERIOD);
    while !is_over() {
        let accepted = async {
            // Those that come meanwhile wait in the kernel, in their order.
            let turn = nameless.clone().acquire_owned().await.map_err(io::Error::other)?;
            listener.accept().await.map(|accepted| (accepted, turn))
        };
        tokio::select! {
            _ = look.tick() => {}
            accepted = accepted => match accepted {
                Ok(((stream, peer), turn)) => {
                    tokio::spawn(serve(stream, peer, app.clone(), places.clone(), turn));
                }
                // Out of descriptors, for example: others will be closed.
                Err(_) => tokio::time::sleep(LOOK_PERIOD).await,
            },
        }
    }
}

/// Answers what comes over one connection, for which it was its `turn` to be told whose it is.
async fn serve(
    stream: TcpStream,
    peer: SocketAddr,
    app: Router,
    places: Arc<Places>,
    turn: OwnedSemaphorePermit,
) {
    let Ok(local) = stream.local_addr() else { return };
    // Reading the kernel's tables may take a while where many sockets are open.
    let user = tokio::task::spawn_blocking(move || PeerUser::between(local, peer)).await;
    let user = user.ok().and_then(Result::ok).unwrap_or(PeerUser::Unknown);
    drop(turn);
    // Without a place it is closed: whoever comes too often waits.
    let Some(_place) = Place::take(&places, Owner::of(user, peer.ip())) else { return };
    // What is small must not wait for more.
    let _ = stream.set_nodelay(true);
    let app = app.layer(Extension(Peer { address: peer.ip(), user }));
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_PATIENCE)
        .max_buf_size(64 << 10)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(app))
        .with_upgrades();
    // A connection that breaks is closed; there is nobody to tell.
    let _ = served.await;
}

/// Whose a connection is, as far as places go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Owner {
    /// The user of the machine.
    Own,
    /// Another user of this computer, or one that is hidden.
    Other,
    /// Somebody at this address.
    Elsewhere(IpAddr),
}

impl Owner {
    fn of(user: PeerUser, address: IpAddr) -> Self {
        match user {
            PeerUser::Own => Self::Own,
            PeerUser::Other(_) | PeerUser::Unknown => Self::Other,
            PeerUser::Elsewhere => Self::Elsewhere(address),
        }
    }
}

/// Connections by owner.
#[derive(Debug, Default)]
struct Places(Mutex<HashMap<Owner, usize>>);

/// The place of a connection; dropping it gives it free.
struct Place {
    places: Arc<Places>,
    owner: Owner,
}

impl Place {
    fn take(places: &Arc<Places>, owner: Owner) -> Option<Self> {
        let mut taken = places.0.lock().unwrap_or_else(PoisonError::into_inner);
        let count = |of: &dyn Fn(&Owner) -> bool| -> usize {
            taken.iter().filter(|(owner, _)| of(owner)).map(|(_, count)| count).sum()
        };
        let has_room = match owner {
            Owner::Own => true,
            Owner::Other => count(&|it| *it == owner) < MOST_OF_OTHERS,
            Owner::Elsewhere(_) => {
                count(&|it| matches!(it, Owner::Elsewhere(_))) < MOST_FROM_ELSEWHERE
                    && count(&|it| *it == owner) < MOST_OF_ONE
            }
        };
        if !has_room || count(&|_| true) >= MOST {
            return None;
        }
        *taken.entry(owner).or_default() += 1;
        Some(Self { places: places.clone(), owner })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = taken.get_mut(&self.owner) {
            *count -= 1;
            if *count == 0 {
                taken.remove(&self.owner);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn nobody_takes_the_places_of_the_machines_own_user() {
        let places = Arc::new(Places::default());
        let take =
            |user, address: &str| Place::take(&places, Owner::of(user, address.parse().unwrap()));
        let fill = |user, address: &str| -> Vec<Place> {
            std::iter::from_fn(|| take(user, address)).take(MOST + 1).collect()
        };
        let mut held = Vec::new();
        // Several users together have no more than one, and so have several computers.
        for (user, expect) in [
            (PeerUser::Other(1001), MOST_OF_OTHERS),
            (PeerUser::Other(1002), 0),
            (PeerUser::Unknown, 0),
        ] {
            let taken = fill(user, "127.0.0.1");
            assert_eq!(taken.len(), expect, "{user:?}");
            held.extend(taken);
        }
        for (address, expect) in [
            ("192.0.2.1", MOST_OF_ONE),
            ("192.0.2.2", MOST_FROM_ELSEWHERE - MOST_OF_ONE),
            ("192.0.2.3", 0),
        ] {
            let taken = fill(PeerUser::Elsewhere, address);
            assert_eq!(taken.len(), expect, "{address}");
            held.extend(taken);
        }
        let own = fill(PeerUser::Own, "127.0.0.1");
        assert_eq!(own.len(), MOST - MOST_OF_OTHERS - MOST_FROM_ELSEWHERE);
        drop(held);
        let others = fill(PeerUser::Own, "::1");
        assert_eq!(own.len() + others.len(), MOST, "and has all where nobody else is");
        drop((own, others));
        assert!(places.0.lock().unwrap().is_empty());
    }
}
