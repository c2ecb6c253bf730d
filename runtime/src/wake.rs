//! Wake events: how drives wakes the controller and the controller wakes drives.
//!
//! A wake says that there is something new, never what; the data is in the channel. Waiting is one `ppoll` on
//! the listener's descriptor and a drain: iceoryx2's own wait takes seven system calls, and its
//! wait set allocates and installs signal handlers.

use std::any::Any;
use std::os::fd::BorrowedFd;

use iceoryx2::node::Node;
use iceoryx2::port::notifier::NotifierNotifyError;
use iceoryx2::prelude::{FileDescriptorBased, ipc};

use crate::channel::ChannelError;
use crate::domain::{Domain, DomainGuard};
use crate::ready::wait_readable;
use crate::room::need;
use messages::Nanoseconds;

/// The two wake events of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wake {
    /// Drives to controller: a feedback is there.
    Feedback,
    /// Controller to drives: a command is there.
    Command,
}

impl Wake {
    fn service(self) -> &'static str {
        match self {
            Self::Feedback => "wake-feedback",
            Self::Command => "wake-command",
        }
    }
}

type Factory = iceoryx2::service::port_factory::event::PortFactory<ipc::Service>;

fn refused(wake: Wake, reason: impl std::fmt::Debug) -> ChannelError {
    ChannelError::Refused { channel: wake.service(), reason: format!("{reason:?}") }
}

pub(crate) fn create(
    node: &Node<ipc::Service>,
    wake: Wake,
) -> Result<Box<dyn Any + Send + Sync>, ChannelError> {
    let name = wake.service().try_into().map_err(|error| refused(wake, error))?;
    let factory = node
        .service_builder(&name)
        .event()
        .max_notifiers(2)
        .max_listeners(2)
        .max_nodes(16)
        .event_id_max_value(1)
        .create()
        .map_err(|error| refused(wake, error))?;
    Ok(Box::new(factory))
}

fn open(domain: &Domain, wake: Wake) -> Result<Factory, ChannelError> {
    let name = wake.service().try_into().map_err(|error| refused(wake, error))?;
    domain.node().service_builder(&name).event().open().map_err(|error| refused(wake, error))
}

/// The side that wakes.
#[derive(Debug)]
pub struct Notifier {
    port: iceoryx2::port::notifier::Notifier<ipc::Service>,
    wake: Wake,
    _guard: DomainGuard,
}

impl Notifier {
    pub(crate) fn open(domain: &Domain, wake: Wake) -> Result<Self, ChannelError> {
        let factory = open(domain, wake)?;
        let builder = factory.notifier_builder();
        let create = || builder.create().map_err(|error| refused(wake, error));
        let port = domain.room().open(0, create)?;
        Ok(Self { port, wake, _guard: domain.guard() })
    }

    /// Wakes whoever listens; one system call for each listener, no allocation.
    pub fn notify(&self) -> Result<(), ChannelError> {
        match self.port.notify() {
            // A missed deadline of the service still means delivered.
            Ok(_) | Err(NotifierNotifyError::MissedDeadline) => Ok(()),
            Err(_) => Err(ChannelError::Lost { channel: self.wake.service() }),
        }
    }
}

/// The side that waits.
#[derive(Debug)]
pub struct Listener {
    port: iceoryx2::port::listener::Listener<ipc::Service>,
    wake: Wake,
    _guard: DomainGuard,
}

impl Listener {
    pub(crate) fn open(domain: &Domain, wake: Wake) -> Result<Self, ChannelError> {
        let factory = open(domain, wake)?;
        let builder = factory.listener_builder();
        let create = || builder.create().map_err(|error| refused(wake, error));
        let port = domain.room().open(need::wake(), create)?;
        Ok(Self { port, wake, _guard: domain.guard() })
    }

    /// Waits until woken or until `deadline` on the monotonic clock; `false` at the deadline, or
    /// when a signal came. A deadline in the past only checks. Does not allocate.
    ///
    /// A wake may be older than the newest sample: read the channel, and wait again if it had
    /// nothing new.
    pub fn wait_until(&self, deadline: Nanoseconds) -> Result<bool, ChannelError> {
        let lost = || ChannelError::Lost { channel: self.wake.service() };
        // SAFETY: the number is only used while `self.port`, which owns the descriptor, is alive.
        #[allow(unsafe_code)]
        let descriptor =
            unsafe { BorrowedFd::borrow_raw(self.port.file_descriptor().native_handle()) };
        if !wait_readable(descriptor, deadline).map_err(|_| lost())? {
            return Ok(false);
        }
        let wakes = self.port.try_wait(|_| {}).map_err(|_| lost())?;
        Ok(wakes > 0)
    }

    /// Forgets wakes that came before now.
    pub fn drain(&self) -> Result<(), ChannelError> {
        self.wait_until(Nanoseconds(0)).map(|_| ())
    }
}
