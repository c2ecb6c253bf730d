//! The operators' Unix socket at the domain holder: lines of JSON, same user only.
//!
//! A client sends one request a line. The holder answers with any number of lines
//! `{"part": VALUE}` and then one `{"reply": VALUE}`, or `{"error": TEXT}`.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::ops::ControlFlow;
use std::os::fd::AsRawFd;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::{Value, json};

use crate::domain::Domain;
use crate::instance::{Instance, user};

/// Longest line that either side takes, in bytes.
const MAX_LINE: u64 = 1 << 20;

/// How long a client waits for a plain answer: longer than the holder waits for the controller.
pub const ANSWER_PATIENCE: Duration = Duration::from_secs(4);

/// How often a client that follows a request interrupts the wait.
const FOLLOW_PERIOD: Duration = Duration::from_millis(100);

/// How long a client may leave what it is told unread, once all buffers are full.
const CLIENT_PATIENCE: Duration = Duration::from_secs(1);

/// How often the accepting thread checks whether it shall end.
const LOOK_PERIOD: Duration = Duration::from_millis(20);

/// Why an operator could not be served, or a request failed.
#[derive(Debug, thiserror::Error)]
pub enum SocketError {
    /// There is no holder to talk to.
    #[error(
        "no pipeline is running as instance {instance:?}; start one with `graver run` or \
             `graver domain`"
    )]
    NotRunning {
        /// The instance's name.
        instance: String,
    },
    /// The socket failed.
    #[error("{path:?}: {source}")]
    Io {
        /// The socket.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The holder went away before it answered.
    #[error("the pipeline of instance {instance:?} ended before it answered")]
    Ended {
        /// The instance's name.
        instance: String,
    },
    /// The holder lives and says nothing.
    #[error(
        "the pipeline of instance {instance:?} did not answer within {} s: its process {pid} is \
         stopped or hangs",
        .patience.as_secs_f64()
    )]
    Silent {
        /// The instance's name.
        instance: String,
        /// The holder's process.
        pid: i32,
        /// How long it was waited for.
        patience: Duration,
    },
    /// The holder refused to listen.
    #[error("{0}")]
    Refused(String),
}

/// Who is at the other end of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Credentials {
    pub(crate) pid: i32,
    pub(crate) user: u32,
}

pub(crate) fn credentials(stream: &UnixStream) -> io::Result<Credentials> {
    let mut found = libc::ucred { pid: 0, uid: u32::MAX, gid: u32::MAX };
    let mut length = size_of::<libc::ucred>() as libc::socklen_t;
    // SAFETY: `found` is a ucred of `length` bytes for the kernel to fill; the descriptor is open.
    #[allow(unsafe_code)]
    let result = unsafe {
        libc::getsockopt(
            stream.as_raw_fd(),
            libc::SOL_SOCKET,
            libc::SO_PEERCRED,
            (&raw mut found).cast(),
            &mut length,
        )
    };
    match result {
        0 => Ok(Credentials { pid: found.pid, user: found.uid }),
        _ => Err(io::Error::last_os_error()),
    }
}

/// One request being answered.
#[derive(Debug)]
pub struct Conversation<'a> {
    stream: &'a UnixStream,
    stop: &'a AtomicBool,
}

impl Conversation<'_> {
    /// Sends a part of the answer ahead of the reply.
    ///
    /// # Errors
    /// When the client is gone.
    pub fn tell(&mut self, part: &Value) -> io::Result<()> {
        write_line(self.stream, &json!({ "part": part }))
    }

    /// Whether there is still somebody to answer to; a handler that follows something ends when
    /// not.
    pub fn is_open(&self) -> bool {
        if self.stop.load(Ordering::Relaxed) {
            return false;
        }
        let mut entry =
            libc::pollfd { fd: self.stream.as_raw_fd(), events: libc::POLLRDHUP, revents: 0 };
        // SAFETY: one valid pollfd whose descriptor `self.stream` owns.
        #[allow(unsafe_code)]
        let closed = unsafe { libc::poll(&mut entry, 1, 0) };
        closed == 0
    }
}

/// The holder's side.
#[derive(Debug)]
pub struct OperatorServer {
    path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl OperatorServer {
    /// Opens the socket of the domain and serves each client on a thread of its own. `handler`
    /// gets each request and gives its reply; it may send parts ahead.
    pub fn bind<H>(domain: &Domain, handler: H) -> Result<Self, SocketError>
    where
        H: Fn(Value, &mut Conversation<'_>) -> Value + Send + Sync + 'static,
    {
        let path = domain.instance().socket_path();
        let failed = |source| SocketError::Io { path: path.clone(), source };
        let listener = UnixListener::bind(&path).map_err(failed)?;
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let thread = std::thread::Builder::new()
            .name("operators".into())
            .spawn(move || accept(&listener, Arc::new(handler), &stopped))
            .map_err(failed)?;
        Ok(Self { path, stop, thread: Some(thread) })
    }
}

impl Drop for OperatorServer {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = std::fs::remove_file(&self.path);
    }
}

fn accept<H>(listener: &UnixListener, handler: Arc<H>, stop: &Arc<AtomicBool>)
where
    H: Fn(Value, &mut Conversation<'_>) -> Value + Send + Sync + 'static,
{
    let mut clients: Vec<(UnixStream, JoinHandle<()>)> = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        clients.retain(|(_, thread)| !thread.is_finished());
        let Ok((stream, _)) = listener.accept() else {
            std::thread::sleep(LOOK_PERIOD);
            continue;
        };
        let (handler, stopped) = (handler.clone(), stop.clone());
        let Ok(own) = stream.try_clone() else { continue };
        // A client that reads nothing, because it is stopped, must not keep the holder from its end.
        if stream.set_write_timeout(Some(CLIENT_PATIENCE)).is_err() {
            continue;
        }
        let serve = move || {
            // The client has gone; there is nobody to tell.
            let _ = converse(&stream, handler.as_ref(), &stopped);
        };
        if let Ok(thread) = std::thread::Builder::new().name("operator".into()).spawn(serve) {
            clients.push((own, thread));
        }
    }
    for (stream, thread) in clients {
        // Ends a read; a reply that is being written still leaves.
        let _ = stream.shutdown(std::net::Shutdown::Read);
        let _ = thread.join();
    }
}

fn converse<H>(stream: &UnixStream, handler: &H, stop: &AtomicBool) -> io::Result<()>
where
    H: Fn(Value, &mut Conversation<'_>) -> Value,
{
    let client = credentials(stream)?;
    if client.user != user() && client.user != 0 {
        let refusal = format!(
            "user {} may not operate this machine: it belongs to user {}",
            client.user,
            user()
        );
        return write_line(stream, &json!({ "error": refusal }));
    }
    let mut reader = BufReader::new(stream);
    while let Some(line) = read_line(&mut reader)? {
        let answer = match serde_json::from_str(&line) {
            Ok(request) => {
                json!({ "reply": handler(request, &mut Conversation { stream, stop }) })
            }
            Err(error) => json!({ "error": format!("the request is not JSON: {error}") }),
        };
        write_line(stream, &answer)?;
    }
    Ok(())
}

fn read_line(reader: &mut impl BufRead) -> io::Result<Option<String>> {
    let mut line = String::new();
    match reader.by_ref().take(MAX_LINE).read_line(&mut line)? {
        0 => Ok(None),
        _ if line.ends_with('\n') => Ok(Some(line)),
        // Cut short by a dying process, or longer than anything we would say.
        _ => Err(io::ErrorKind::InvalidData.into()),
    }
}

fn write_line(mut stream: &UnixStream, value: &Value) -> io::Result<()> {
    let mut line = value.to_string();
    line.push('\n');
    stream.write_all(line.as_bytes())
}

/// One line of an answer.
enum Answer {
    Part(Value),
    Reply(Value),
}

/// An operator's side.
#[derive(Debug)]
pub struct OperatorClient {
    instance: String,
    path: PathBuf,
    reader: BufReader<UnixStream>,
}

impl OperatorClient {
    /// Connects to the holder of the instance's domain.
    ///
    /// # Errors
    /// [`SocketError::NotRunning`] when there is none.
    pub fn connect(instance: &Instance) -> Result<Self, SocketError> {
        let path = instance.socket_path();
        match UnixStream::connect(&path) {
            Ok(stream) => {
                Ok(Self { instance: instance.name().into(), path, reader: BufReader::new(stream) })
            }
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::NotFound | io::ErrorKind::ConnectionRefused
                ) =>
            {
                Err(SocketError::NotRunning { instance: instance.name().into() })
            }
            Err(source) => Err(SocketError::Io { path, source }),
        }
    }

    /// Sends a request and gives its reply; parts are dropped.
    ///
    /// # Errors
    /// [`SocketError::Silent`] when no answer comes within [`ANSWER_PATIENCE`].
    pub fn request(&mut self, request: &Value) -> Result<Value, SocketError> {
        self.request_within(request, ANSWER_PATIENCE)
    }

    /// Like [`Self::request`], waiting at most `patience` for each line.
    ///
    /// # Errors
    /// The same.
    pub fn request_within(
        &mut self,
        request: &Value,
        patience: Duration,
    ) -> Result<Value, SocketError> {
        self.send(request, Some(patience))?;
        loop {
            if let Answer::Reply(value) = self.answer()? {
                return Ok(value);
            }
        }
    }

    /// Sends a request, hands each part to `part` as it comes, and gives the reply, however long
    /// it takes. `part` gets `None` every tenth of a second in which nothing came, so that whoever
    /// follows can check other things; when it breaks, what it breaks with is given instead.
    ///
    /// # Errors
    /// A holder that goes away or does not understand.
    pub fn follow<B>(
        &mut self,
        request: &Value,
        mut part: impl FnMut(Option<Value>) -> ControlFlow<B>,
    ) -> Result<ControlFlow<B, Value>, SocketError> {
        self.send(request, None)?;
        loop {
            let heard = if self.has_words(FOLLOW_PERIOD) {
                match self.answer()? {
                    Answer::Part(value) => Some(value),
                    Answer::Reply(value) => return Ok(ControlFlow::Continue(value)),
                }
            } else {
                None
            };
            if let ControlFlow::Break(why) = part(heard) {
                return Ok(ControlFlow::Break(why));
            }
        }
    }

    fn send(&mut self, request: &Value, patience: Option<Duration>) -> Result<(), SocketError> {
        let stream = self.reader.get_ref();
        let sent = stream
            .set_read_timeout(patience)
            .and_then(|()| stream.set_write_timeout(patience))
            .and_then(|()| write_line(stream, request));
        sent.map_err(|error| self.failed(error))
    }

    /// The next line of the answer.
    fn answer(&mut self) -> Result<Answer, SocketError> {
        let ended = || SocketError::Ended { instance: self.instance.clone() };
        let line = read_line(&mut self.reader);
        let line = line.map_err(|error| self.failed(error))?.ok_or_else(ended)?;
        let mut answer: Value = serde_json::from_str(&line)
            .map_err(|error| self.failed(io::Error::other(error.to_string())))?;
        if let Some(value) = answer.get_mut("part") {
            Ok(Answer::Part(value.take()))
        } else if let Some(value) = answer.get_mut("reply") {
            Ok(Answer::Reply(value.take()))
        } else {
            let text = answer["error"].as_str().unwrap_or("the answer is not understood");
            Err(SocketError::Refused(text.into()))
        }
    }

    /// Waits at most `patience` for something to read.
    fn has_words(&self, patience: Duration) -> bool {
        let descriptor = self.reader.get_ref().as_raw_fd();
        let mut entry = libc::pollfd { fd: descriptor, events: libc::POLLIN, revents: 0 };
        let milliseconds = i32::try_from(patience.as_millis()).unwrap_or(i32::MAX);
        // SAFETY: one valid pollfd whose descriptor the stream in `self.reader` owns.
        #[allow(unsafe_code)]
        let mut ready = || unsafe { libc::poll(&mut entry, 1, milliseconds) } > 0;
        !self.reader.buffer().is_empty() || ready()
    }

    fn failed(&self, source: io::Error) -> SocketError {
        let instance = self.instance.clone();
        match source.kind() {
            io::ErrorKind::BrokenPipe
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::InvalidData => SocketError::Ended { instance },
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                let pid = credentials(self.reader.get_ref()).map_or(0, |holder| holder.pid);
                let patience = self.reader.get_ref().read_timeout().ok().flatten();
                SocketError::Silent { instance, pid, patience: patience.unwrap_or_default() }
            }
            _ => SocketError::Io { path: self.path.clone(), source },
        }
    }
}
