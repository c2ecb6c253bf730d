//! The operators' Unix socket at the domain holder: lines of JSON, same user only.
//!
//! A client sends one request a line. The holder answers with any number of lines
//! `{"part": VALUE}` and then one `{"reply": VALUE}`, or `{"error": TEXT}`.

use std::io::{self, BufRead, BufReader, Read, Write};
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

/// How long a client waits for a plain answer; planning happens elsewhere, so this is long.
const ANSWER_PATIENCE: Duration = Duration::from_secs(10);

/// How often the accepting thread looks whether it shall end.
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

    /// Sends a request and gives its reply; parts are dropped. Waits at most ten seconds.
    pub fn request(&mut self, request: &Value) -> Result<Value, SocketError> {
        self.exchange(request, Some(ANSWER_PATIENCE), |_| ())
    }

    /// Sends a request, hands each part to `part` as it comes, and gives the reply, however long
    /// it takes.
    pub fn follow(
        &mut self,
        request: &Value,
        part: impl FnMut(Value),
    ) -> Result<Value, SocketError> {
        self.exchange(request, None, part)
    }

    fn exchange(
        &mut self,
        request: &Value,
        patience: Option<Duration>,
        mut part: impl FnMut(Value),
    ) -> Result<Value, SocketError> {
        let ended = || SocketError::Ended { instance: self.instance.clone() };
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::BrokenPipe
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::InvalidData => SocketError::Ended { instance: self.instance.clone() },
            _ => SocketError::Io { path: self.path.clone(), source },
        };
        self.reader.get_ref().set_read_timeout(patience).map_err(failed)?;
        write_line(self.reader.get_ref(), request).map_err(failed)?;
        loop {
            let line = read_line(&mut self.reader).map_err(failed)?.ok_or_else(ended)?;
            let mut answer: Value = serde_json::from_str(&line)
                .map_err(|error| failed(io::Error::other(error.to_string())))?;
            if let Some(value) = answer.get_mut("part") {
                part(value.take());
            } else if let Some(value) = answer.get_mut("reply") {
                return Ok(value.take());
            } else {
                let text = answer["error"].as_str().unwrap_or("the answer is not understood");
                return Err(SocketError::Refused(text.into()));
            }
        }
    }
}
