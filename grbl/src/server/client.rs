//! One connection: who it is, what it sends, and what it is sent.

use std::io::{self, Read, Write};
use std::net::{IpAddr, Shutdown, SocketAddr, TcpStream};
use std::os::fd::AsFd;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use nix::sys::socket::{setsockopt, sockopt};

use super::opening::Opening;
use super::{Core, Operator, SILENCE, Shared, spawn};
use crate::machine::Machine;
use crate::report::Reporter;
use crate::session::{GREETING, Realtime, Splitter, Unit};

/// Pieces of output that wait for a client.
const PIECES: usize = 1024;

/// How long a client may take to read what it is sent, or to confirm that it is there.
const PATIENCE: Duration = Duration::from_secs(5);

/// Bytes that are read at a time.
const CHUNK: usize = 4096;

/// Where output of a client goes.
#[derive(Debug, Clone)]
pub(super) struct Sink(SyncSender<Vec<u8>>);

impl Sink {
    /// Sends; false where the client does not read.
    pub(super) fn send(&self, bytes: Vec<u8>) -> bool {
        self.0.try_send(bytes).is_ok()
    }

    fn line(&self, text: &str) -> bool {
        self.send(format!("{text}\r\n").into_bytes())
    }
}

/// A connection that was accepted.
pub(super) struct Client {
    reader: Box<dyn Read + Send>,
    sink: Sink,
    /// Where it comes from; `None` of a terminal of this computer.
    host: Option<IpAddr>,
}

impl Client {
    /// Of a connection.
    pub(super) fn of(stream: TcpStream, peer: SocketAddr) -> io::Result<Self> {
        // A socket that was accepted from one that does not block may not block either.
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        keep_alive(&stream)?;
        let (sender, receiver) = sync_channel(PIECES);
        let writer = stream.try_clone()?;
        spawn("grbl-writer", move || {
            write(&writer, &receiver);
            // Ends the reading too.
            let _ = writer.shutdown(Shutdown::Both);
        })?;
        Ok(Self {
            reader: Box::new(stream),
            sink: Sink(sender),
            host: Some(peer.ip().to_canonical()),
        })
    }

    /// Of a terminal.
    pub(super) fn of_terminal(
        reader: impl Read + Send + 'static,
        writer: impl Write + Send + 'static,
    ) -> io::Result<Self> {
        let (sender, receiver) = sync_channel(PIECES);
        spawn("grbl-writer", move || write(writer, &receiver))?;
        Ok(Self { reader: Box::new(reader), sink: Sink(sender), host: None })
    }

    fn is_here(&self) -> bool {
        self.host.is_none_or(|host| host.is_loopback())
    }
}

fn write(mut writer: impl Write, pieces: &Receiver<Vec<u8>>) {
    while let Ok(piece) = pieces.recv() {
        if writer.write_all(&piece).and_then(|()| writer.flush()).is_err() {
            return;
        }
    }
}

/// Makes a peer that has vanished known within some seconds.
fn keep_alive(stream: &TcpStream) -> io::Result<()> {
    let socket = &stream.as_fd();
    setsockopt(socket, sockopt::KeepAlive, &true)?;
    setsockopt(socket, sockopt::TcpKeepIdle, &5)?;
    setsockopt(socket, sockopt::TcpKeepInterval, &2)?;
    setsockopt(socket, sockopt::TcpKeepCount, &3)?;
    Ok(())
}

/// Says why a connection is refused, and closes it.
pub(super) fn turn_away(mut stream: &TcpStream, words: &str) {
    let _ = stream.set_nonblocking(false);
    let _ = stream.set_write_timeout(Some(Duration::from_millis(100)));
    // Whoever has gone already need not be told.
    let _ = stream.write_all(format!("[MSG:{words}]\r\n").as_bytes());
    let _ = stream.shutdown(Shutdown::Write);
}

/// Serves a client until it goes.
pub(super) fn serve<M: Machine + 'static>(mut client: Client, shared: &Arc<Shared<M>>) {
    let number = {
        let mut core = shared.lock();
        core.clients += 1;
        core.newest += 1;
        let number = core.newest;
        if shared.is_free(&core) {
            shared.take_over(&mut core, number, &client);
        } else {
            client.sink.send(format!("\r\n{GREETING}\r\n").into_bytes());
            client.sink.line(
                "[MSG:another client operates: you get status and answers; $TAKE takes over]",
            );
        }
        number
    };
    let mut watcher = Watcher::default();
    let mut bytes = vec![0; CHUNK];
    let mut opening = Opening::default();
    loop {
        match client.reader.read(&mut bytes) {
            Ok(0) => break,
            Ok(length) => match opening.take(&bytes[..length]) {
                Some(heard) => watcher.hear(&heard, number, &client, shared),
                None => break,
            },
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => break,
        }
        if shared.is_over() {
            break;
        }
    }
    let mut core = shared.lock();
    core.clients -= 1;
    if core.operator.as_ref().is_some_and(|operator| operator.client == number) {
        core.operator = None;
        core.session.disconnect(shared.now());
        shared.pump(&mut core);
    }
}

impl<M: Machine + 'static> Shared<M> {
    /// Whether nobody operates who is still there.
    fn is_free(&self, core: &Core) -> bool {
        core.operator.as_ref().is_none_or(|operator| operator.heard.elapsed() > SILENCE)
    }

    /// Makes `client` the one that operates.
    fn take_over(&self, core: &mut Core, number: u64, client: &Client) {
        if let Some(before) = core.operator.take() {
            core.session.disconnect(self.now());
            before.sink.line(
                "[MSG:another client has taken over: you get status and answers; $TAKE takes over]",
            );
        }
        let sink = client.sink.clone();
        core.operator =
            Some(Operator { client: number, host: client.host, sink, heard: Instant::now() });
        core.session.connect(self.now());
        self.pump(core);
    }

    /// Whether `client` may take the place of the one that operates: that is gone, or on the same computer.
    fn may_take(&self, core: &Core, client: &Client) -> bool {
        let same = |operator: &Operator| {
            operator.host == client.host
                || client.is_here() && operator.host.is_none_or(|host| host.is_loopback())
        };
        self.is_free(core) || core.operator.as_ref().is_none_or(same)
    }
}

/// A client that does not operate.
#[derive(Default)]
struct Watcher {
    splitter: Splitter,
    reporter: Reporter,
}

impl Watcher {
    fn hear<M: Machine + 'static>(
        &mut self,
        bytes: &[u8],
        number: u64,
        client: &Client,
        shared: &Arc<Shared<M>>,
    ) {
        let mut core = shared.lock();
        let mut rest = bytes;
        while let Some((&byte, after)) = rest.split_first() {
            if let Some(operator) =
                core.operator.as_mut().filter(|operator| operator.client == number)
            {
                operator.heard = Instant::now();
                core.session.receive(rest, shared.now());
                shared.pump(&mut core);
                return;
            }
            rest = after;
            let is_told = match self.splitter.take(byte) {
                Unit::None | Unit::Text => true,
                Unit::Realtime(Realtime::Report) => {
                    let report = core.session.watched(&mut self.reporter);
                    client.sink.line(&report)
                }
                Unit::Realtime(_) if shared.is_free(&core) => {
                    shared.take_over(&mut core, number, client);
                    core.session.receive(&[byte], shared.now());
                    shared.pump(&mut core);
                    true
                }
                Unit::Realtime(realtime) => {
                    if core.session.stop_by_watcher(realtime, shared.now()) {
                        shared.pump(&mut core);
                    }
                    let is_reset = realtime == Realtime::Reset;
                    !is_reset || client.sink.send(format!("\r\n{GREETING}\r\n").into_bytes())
                }
                Unit::TooLong => client.sink.line("error:11"),
                Unit::Line(line) => self.line(&line, number, client, shared, &mut core),
            };
            if !is_told {
                return;
            }
        }
    }

    /// Answers a line; one that wants more than an answer makes the client operate, where it may.
    fn line<M: Machine + 'static>(
        &mut self,
        line: &[u8],
        number: u64,
        client: &Client,
        shared: &Arc<Shared<M>>,
        core: &mut Core,
    ) -> bool {
        let text = String::from_utf8_lossy(line.trim_ascii()).into_owned();
        if text.is_empty() {
            return client.sink.line("ok");
        }
        if text.eq_ignore_ascii_case("$TAKE") {
            if !shared.may_take(core, client) {
                let words = "[MSG:a client on another computer operates]";
                return client.sink.line(words) && client.sink.line("error:9");
            }
            let is_told = client.sink.line("ok");
            shared.take_over(core, number, client);
            return is_told;
        }
        if let Some(lines) =
            text.strip_prefix('$').and_then(|question| core.session.query(question))
        {
            return lines.iter().all(|line| client.sink.line(line)) && client.sink.line("ok");
        }
        if shared.is_free(core) {
            shared.take_over(core, number, client);
            core.session.receive(&[line, b"\n"].concat(), shared.now());
            shared.pump(core);
            return true;
        }
        client.sink.line("[MSG:another client operates; $TAKE takes over]")
            && client.sink.line("error:9")
    }
}
