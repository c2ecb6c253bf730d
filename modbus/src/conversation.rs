//! One device: its connection, and a round of all that it is asked and told.
//!
//! A round reads every input and writes every output, one request each, and has the device's timeout for all of them.
//! A connection that breaks in the midst of a round is made anew once: devices close those that they have had for long.
//! After a request that was not answered in time the connection is given up, so that a late answer is taken for nothing
//! else. A request that is refused ends only itself.

use std::sync::Arc;

use machine::modbus::{Device, Read, ReadPlace, Write, WritePlace};
use messages::DeviceState;
use tokio::net::TcpStream;
use tokio::time::{Duration, timeout};
use tokio_modbus::client::{Client, Context, tcp};
use tokio_modbus::{Request, Response, Slave};

use crate::heard::{Failed, Heard};

/// What the outputs are to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outputs {
    /// Each its safe state.
    Safe,
    /// These are on, one bit each in the order of the machine file.
    Follow(u64),
}

impl Outputs {
    /// Whether the output of `write` is to be on.
    fn is_on(self, write: &Write) -> bool {
        match self {
            Self::Safe => write.is_safe_on,
            Self::Follow(bits) => u32::try_from(write.output)
                .is_ok_and(|output| bits.checked_shr(output).unwrap_or(0) & 1 == 1),
        }
    }
}

/// Why a request was not answered.
enum Trouble {
    /// By an exception reply.
    Refused(u8),
    /// The answer was none to this, or the connection broke.
    Broken,
}

/// The conversation with one device.
#[allow(missing_debug_implementations)]
pub struct Conversation {
    device: Arc<Device>,
    connection: Option<Context>,
    /// The request under way, from 1; 0 for none.
    request: u32,
}

impl Conversation {
    /// With this device, not connected yet.
    pub fn new(device: Device) -> Self {
        Self { device: Arc::new(device), connection: None, request: 0 }
    }

    /// Asks and tells the device everything, within its timeout.
    ///
    /// # Errors
    /// How the round ended before its end.
    pub async fn round(&mut self, outputs: Outputs, heard: &Heard) -> Result<(), Failed> {
        self.within(outputs, Some(heard)).await
    }

    /// Only tells it its outputs, within its timeout.
    ///
    /// # Errors
    /// How that ended before its end.
    pub async fn tell(&mut self, outputs: Outputs) -> Result<(), Failed> {
        self.within(outputs, None).await
    }

    async fn within(&mut self, outputs: Outputs, heard: Option<&Heard>) -> Result<(), Failed> {
        let patience = Duration::from_nanos(self.device.timeout.0.unsigned_abs());
        self.request = 0;
        let ended = timeout(patience, self.requests(outputs, heard)).await;
        let outcome = ended.unwrap_or_else(|_| {
            let is_connected = self.connection.is_some();
            let state = if is_connected { DeviceState::Silent } else { DeviceState::Unreachable };
            Err(Failed { state, exception: 0, request: self.request })
        });
        if outcome.is_err_and(|failed| failed.state != DeviceState::Refusing) {
            self.connection = None;
        }
        outcome
    }

    async fn requests(&mut self, outputs: Outputs, heard: Option<&Heard>) -> Result<(), Failed> {
        let was_connected = self.connection.is_some();
        match self.all(outputs, heard).await {
            Err(failed) if was_connected && failed.state == DeviceState::Garbled => {
                self.connection = None;
                self.all(outputs, heard).await
            }
            outcome => outcome,
        }
    }

    /// All requests in turn; the first that was refused is told when all have been made.
    async fn all(&mut self, outputs: Outputs, heard: Option<&Heard>) -> Result<(), Failed> {
        self.request = 0;
        if self.connection.is_none() {
            self.connection = Some(connect(&self.device).await?);
        }
        let device = self.device.clone();
        let mut outcome = Ok(());
        if let Some(heard) = heard {
            for read in &device.reads {
                self.request += 1;
                match self.read(read).await {
                    Ok(word) => heard.take(read, word),
                    Err(trouble) => outcome = outcome.and(self.failed(&trouble)?),
                }
            }
        }
        self.request = device.reads.len() as u32;
        for write in &device.writes {
            self.request += 1;
            if let Err(trouble) = self.write(write, outputs.is_on(write)).await {
                outcome = outcome.and(self.failed(&trouble)?);
            }
        }
        outcome
    }

    /// How the request under way ends the round: a refusal at its end, anything else at once.
    fn failed(&self, trouble: &Trouble) -> Result<Result<(), Failed>, Failed> {
        let request = self.request;
        match trouble {
            Trouble::Refused(exception) => {
                let exception = u32::from(*exception);
                Ok(Err(Failed { state: DeviceState::Refusing, exception, request }))
            }
            Trouble::Broken => Err(Failed { state: DeviceState::Garbled, exception: 0, request }),
        }
    }

    /// The word that stands where `read` says; 0 or 1 of a bit.
    async fn read(&mut self, read: &Read) -> Result<u16, Trouble> {
        let at = read.address;
        let request = match read.place {
            ReadPlace::Discrete => Request::ReadDiscreteInputs(at, 1),
            ReadPlace::Coil => Request::ReadCoils(at, 1),
            ReadPlace::Input => Request::ReadInputRegisters(at, 1),
            ReadPlace::Holding => Request::ReadHoldingRegisters(at, 1),
        };
        let word = match self.call(request).await? {
            // Bits come in bytes: eight of them where one was asked for.
            Response::ReadDiscreteInputs(bits) | Response::ReadCoils(bits) => {
                bits.first().map(|bit| u16::from(*bit))
            }
            Response::ReadInputRegisters(words) | Response::ReadHoldingRegisters(words) => {
                words.first().copied().filter(|_| words.len() == 1)
            }
            _ => None,
        };
        word.ok_or(Trouble::Broken)
    }

    /// Switches the output of `write`; the device says it back.
    async fn write(&mut self, write: &Write, is_on: bool) -> Result<(), Trouble> {
        let at = write.address;
        let is_done = match write.place {
            WritePlace::Coil { is_active_low } => {
                let level = is_on != is_active_low;
                let request = Request::WriteSingleCoil(at, level);
                matches!(self.call(request).await?, Response::WriteSingleCoil(place, said)
                    if place == at && said == level)
            }
            WritePlace::Register { words } => {
                let word = words[usize::from(is_on)];
                let request = Request::WriteSingleRegister(at, word);
                matches!(self.call(request).await?, Response::WriteSingleRegister(place, said)
                    if place == at && said == word)
            }
        };
        if is_done { Ok(()) } else { Err(Trouble::Broken) }
    }

    /// The answer to a request. Its length is for the caller to judge: the crate's own readers panic at a wrong one.
    async fn call(&mut self, request: Request<'static>) -> Result<Response, Trouble> {
        let connection = self.connection.as_mut().ok_or(Trouble::Broken)?;
        match connection.call(request).await {
            Ok(Ok(response)) => Ok(response),
            Ok(Err(exception)) => Err(Trouble::Refused(exception.into())),
            Err(_) => Err(Trouble::Broken),
        }
    }
}

/// A connection to the device.
async fn connect(device: &Device) -> Result<Context, Failed> {
    let stream = TcpStream::connect(&device.address).await;
    let unreachable = Failed { state: DeviceState::Unreachable, exception: 0, request: 0 };
    let stream = stream.map_err(|_| unreachable)?;
    // A request is one small packet; waiting for more to send with it would only delay it.
    let _ = stream.set_nodelay(true);
    Ok(tcp::attach_slave(stream, Slave(device.unit)))
}
