//! Typed channels: which sample travels with which quality, and the ports at its two ends.
//!
//! Every sample is stamped with its publisher's serial number in the header, so that a reader
//! counts what it lost without knowing what the sample means.

use std::any::Any;
use std::fmt::Debug;
use std::marker::PhantomData;

use iceoryx2::node::Node;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{
    AttributeSpecifier, AttributeVerifier, BackpressureStrategy, CallbackProgression, ZeroCopySend,
    ipc,
};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use messages::{
    Command, ControllerReport, DrivesReport, Feedback, JobOffer, PlannerReport, Progress, Sample,
    SentSetpoint, Setpoint, SimulatedInputs, SlowInputs,
};

use crate::domain::{Domain, DomainGuard};
use crate::room::{RoomError, need};

/// How long a reader of [`Samples::All`] may be away from a 1 kHz channel without a loss, in
/// samples.
pub const DEEP: usize = 4096;

/// Samples of a 1 kHz channel that are kept for a reader which is started again: half a second, in
/// which a dead monitor has its successor, so that nothing lacks in the recording. Handing them over
/// costs the publisher about 0.1 µs each, once.
const KEPT_FOR_A_SUCCESSOR: usize = 512;

/// Setpoints under way at most; the planner's own limit is the room that the controller reports.
pub const SETPOINTS_UNDER_WAY: usize = 2048;

/// Samples of a status channel that wait for a reader who polls a few times a second.
const STATUS_DEPTH: usize = 64;

/// Samples that a reader can have in its hands at once.
pub(crate) const BORROWED: usize = 2;

/// How a channel treats a reader that does not keep up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Qos {
    /// The oldest sample makes room. Late joiners get the newest one, or as many as the channel
    /// keeps ([`Channel::KEPT`]), at the publisher's next [`Publisher::publish`] or
    /// [`Publisher::greet`].
    KeepLast {
        /// Samples that a reader of [`Samples::All`] can have waiting.
        depth: usize,
    },
    /// Nothing makes room: the publisher is told that the buffer is full.
    Reliable {
        /// Samples that can be under way.
        depth: usize,
    },
}

/// A sample that has a channel in every domain.
pub trait Channel: Sample {
    /// The name of the channel.
    const SERVICE: &'static str;
    /// How it treats a reader that does not keep up.
    const QOS: Qos;
    /// How many readers there can be.
    const READERS: usize = 4;
    /// How many of them can be of [`Samples::All`]; the publisher has memory for no more.
    const DEEP_READERS: usize = Self::READERS;
    /// How many of the newest samples a late reader of [`Samples::All`] gets, on a channel of
    /// [`Qos::KeepLast`].
    const KEPT: usize = 1;
}

impl Channel for Feedback {
    const SERVICE: &'static str = "feedback";
    const QOS: Qos = Qos::KeepLast { depth: DEEP };
    // The monitor, and who measures beside it.
    const DEEP_READERS: usize = 2;
    const KEPT: usize = KEPT_FOR_A_SUCCESSOR;
}

impl Channel for Command {
    const SERVICE: &'static str = "commands";
    const QOS: Qos = Qos::KeepLast { depth: DEEP };
    // As of feedback.
    const DEEP_READERS: usize = 2;
    const KEPT: usize = KEPT_FOR_A_SUCCESSOR;
}

impl Channel for Setpoint {
    const SERVICE: &'static str = "setpoints";
    const QOS: Qos = Qos::Reliable { depth: SETPOINTS_UNDER_WAY };
    // A second reader that stands still would hold the planner up.
    const READERS: usize = 1;
}

impl Channel for SentSetpoint {
    const SERVICE: &'static str = "sent-setpoints";
    const QOS: Qos = Qos::KeepLast { depth: SETPOINTS_UNDER_WAY };
    // The monitor, and its successor.
    const READERS: usize = 2;
    const KEPT: usize = KEPT_FOR_A_SUCCESSOR;
}

impl Channel for Progress {
    const SERVICE: &'static str = "progress";
    const QOS: Qos = Qos::KeepLast { depth: STATUS_DEPTH };
    // One more than others: who switches slow outputs.
    const READERS: usize = 5;
    const DEEP_READERS: usize = 4;
}

impl Channel for ControllerReport {
    const SERVICE: &'static str = "controller-reports";
    const QOS: Qos = Qos::KeepLast { depth: STATUS_DEPTH };
}

impl Channel for DrivesReport {
    const SERVICE: &'static str = "drives-reports";
    const QOS: Qos = Qos::KeepLast { depth: STATUS_DEPTH };
}

impl Channel for PlannerReport {
    const SERVICE: &'static str = "planner-reports";
    const QOS: Qos = Qos::KeepLast { depth: STATUS_DEPTH };
}

impl Channel for JobOffer {
    const SERVICE: &'static str = "job-offers";
    const QOS: Qos = Qos::KeepLast { depth: STATUS_DEPTH };
}

impl Channel for SlowInputs {
    const SERVICE: &'static str = "slow-inputs";
    const QOS: Qos = Qos::KeepLast { depth: STATUS_DEPTH };
    // The cycle and the supervisor want the newest one only.
    const DEEP_READERS: usize = 2;
}

impl Channel for SimulatedInputs {
    const SERVICE: &'static str = "simulated-inputs";
    const QOS: Qos = Qos::KeepLast { depth: STATUS_DEPTH };
}

/// Why a channel could not be opened or used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChannelError {
    /// Another build of Graver runs this domain.
    #[error(
        "channel {channel:?} carries another layout of {sample} than this build's: all processes \
         of an instance must be the same build"
    )]
    Layout {
        /// The channel.
        channel: &'static str,
        /// The type's name and version.
        sample: &'static str,
    },
    /// iceoryx2 refused to create or open it.
    #[error("channel {channel:?} could not be opened: {reason}")]
    Refused {
        /// The channel.
        channel: &'static str,
        /// What iceoryx2 said.
        reason: String,
    },
    /// All readers of every sample that the channel has memory for are there.
    #[error("channel {channel:?} has {readers} readers of every sample already, and no more fit")]
    Crowded {
        /// The channel.
        channel: &'static str,
        /// How many there can be.
        readers: usize,
    },
    /// There is no room for it in shared memory.
    #[error(transparent)]
    Room(#[from] RoomError),
    /// The channel went away between joining and opening.
    #[error("channel {channel:?} is gone: the holder of the domain has ended")]
    Gone {
        /// The channel.
        channel: &'static str,
    },
    /// An open channel failed; the domain is damaged. Does not allocate.
    #[error("channel {channel:?} failed")]
    Lost {
        /// The channel.
        channel: &'static str,
    },
}

/// Which samples a reader wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Samples {
    /// Only the newest one, for a cycle.
    Latest,
    /// Every one, in order, losses counted.
    All,
}

/// A sample as iceoryx2 carries it.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Wire<T: Sample>(pub(crate) T);

// SAFETY: a `Sample` is fixed-size, has neither padding nor references (the zerocopy bounds prove
// it), and any bit pattern is valid. The name has a version, and the layout hash is checked.
#[allow(unsafe_code)]
unsafe impl<T: Sample> ZeroCopySend for Wire<T> {
    unsafe fn type_name() -> &'static str {
        T::NAME
    }
}

/// The publisher's count of samples, from 1, beside each sample.
#[derive(Debug, Clone, Copy, Default)]
#[repr(transparent)]
pub(crate) struct Serial(u64);

// SAFETY: a transparent u64.
#[allow(unsafe_code)]
unsafe impl ZeroCopySend for Serial {
    unsafe fn type_name() -> &'static str {
        "graver.Serial.v1"
    }
}

type Factory<T> = PortFactory<ipc::Service, Wire<T>, Serial>;

/// The service attribute that holds the layout hash.
const LAYOUT_KEY: &str = "layout";

fn refused<T: Channel>(reason: impl Debug) -> ChannelError {
    ChannelError::Refused { channel: T::SERVICE, reason: format!("{reason:?}") }
}

fn lost<T: Channel>() -> ChannelError {
    ChannelError::Lost { channel: T::SERVICE }
}

macro_rules! attribute {
    ($set:expr, $define:ident, $sample:ty) => {{
        let key = LAYOUT_KEY.try_into().map_err(refused::<$sample>)?;
        let layout = format!("{:016x}", <$sample as Sample>::LAYOUT);
        let value = layout.as_str().try_into().map_err(refused::<$sample>)?;
        $set.$define(&key, &value).map_err(refused::<$sample>)?
    }};
}

/// How many samples a late joiner gets.
pub(crate) const fn history<T: Channel>() -> usize {
    match T::QOS {
        Qos::KeepLast { .. } => T::KEPT,
        Qos::Reliable { .. } => 0,
    }
}

pub(crate) fn create<T: Channel>(
    node: &Node<ipc::Service>,
) -> Result<Box<dyn Any + Send + Sync>, ChannelError> {
    let (overflow, depth) = match T::QOS {
        Qos::KeepLast { depth } => (true, depth),
        Qos::Reliable { depth } => (false, depth),
    };
    let name = T::SERVICE.try_into().map_err(refused::<T>)?;
    let factory = node
        .service_builder(&name)
        .publish_subscribe::<Wire<T>>()
        .user_header::<Serial>()
        .enable_safe_overflow(overflow)
        .history_size(history::<T>())
        .subscriber_max_buffer_size(depth)
        .subscriber_max_borrowed_samples(BORROWED)
        .max_publishers(1)
        .max_subscribers(T::READERS)
        .max_nodes(16)
        .create_with_attributes(&attribute!(AttributeSpecifier::new(), define, T))
        .map_err(refused::<T>)?;
    Ok(Box::new(factory))
}

fn open<T: Channel>(domain: &Domain) -> Result<Factory<T>, ChannelError> {
    use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError as Error;
    let name = T::SERVICE.try_into().map_err(refused::<T>)?;
    domain
        .node()
        .service_builder(&name)
        .publish_subscribe::<Wire<T>>()
        .user_header::<Serial>()
        .open_with_attributes(&attribute!(AttributeVerifier::new(), require, T))
        .map_err(|error| match error {
            Error::IncompatibleTypes | Error::IncompatibleAttributes => {
                ChannelError::Layout { channel: T::SERVICE, sample: T::NAME }
            }
            Error::DoesNotExist => ChannelError::Gone { channel: T::SERVICE },
            other => refused::<T>(other),
        })
}

/// Whether one more reader of every sample fits; those of dead processes do not count.
fn check_deep_readers<T: Channel>(
    domain: &Domain,
    factory: &Factory<T>,
) -> Result<(), ChannelError> {
    let readers = || {
        let mut deep = 0;
        factory.dynamic_config().list_subscribers(|subscriber| {
            deep += usize::from(subscriber.buffer_size > 1);
            CallbackProgression::Continue
        });
        deep
    };
    if readers() < T::DEEP_READERS {
        return Ok(());
    }
    domain.clean();
    match readers() {
        deep if deep < T::DEEP_READERS => Ok(()),
        readers => Err(ChannelError::Crowded { channel: T::SERVICE, readers }),
    }
}

/// The writing end of a channel.
#[derive(Debug)]
pub struct Publisher<T: Channel> {
    port: iceoryx2::port::publisher::Publisher<ipc::Service, Wire<T>, Serial>,
    serial: u64,
    _guard: DomainGuard,
}

impl<T: Channel> Publisher<T> {
    pub(crate) fn open(domain: &Domain) -> Result<Self, ChannelError> {
        let factory = open::<T>(domain)?;
        let builder = factory
            .publisher_builder()
            .max_loaned_samples(1)
            // iceoryx2 would take every reader for one of every sample.
            .override_sample_preallocation(|_| need::samples::<T>())
            // The default would wait for a reader that stands still.
            .backpressure_strategy(BackpressureStrategy::DiscardData);
        let port = domain
            .room()
            .open(need::publisher::<T>(), || builder.create().map_err(refused::<T>))?;
        Ok(Self { port, serial: 0, _guard: domain.guard() })
    }

    /// Publishes one sample; never waits.
    ///
    /// `false` when it reached no reader: on a [`Qos::Reliable`] channel the buffer is full or
    /// there is no reader yet, and the same sample must be published again. On the other channels
    /// `false` only says that nobody listens now.
    ///
    /// Allocates once: iceoryx2 0.10 keeps 48 bytes for each loan and frees them here.
    pub fn publish(&mut self, sample: &T) -> Result<bool, ChannelError> {
        let mut loan = self.port.loan_uninit().map_err(|_| lost::<T>())?;
        *loan.user_header_mut() = Serial(self.serial + 1);
        let readers = loan.write_payload(Wire(*sample)).send().map_err(|_| lost::<T>())?;
        if readers > 0 || matches!(T::QOS, Qos::KeepLast { .. }) {
            self.serial += 1;
        }
        Ok(readers > 0)
    }

    /// Gives the newest sample to readers that have joined since the last [`Self::publish`] or
    /// `greet`; on a [`Qos::Reliable`] channel there is none to give.
    ///
    /// A reader that joins does not get it by itself. Whoever publishes seldom on a
    /// [`Qos::KeepLast`] channel calls this on every poll, so that a process which was started
    /// again learns what was said before; one that publishes many times a second needs not. Never
    /// waits. Cheap when nobody joined; else it maps the reader's memory, 40 to 160 µs: not for a
    /// real-time loop.
    pub fn greet(&mut self) -> Result<(), ChannelError> {
        self.port.update_connections().map_err(|_| lost::<T>())
    }
}

/// The reading end of a channel.
#[derive(Debug)]
pub struct Subscriber<T: Channel> {
    port: iceoryx2::port::subscriber::Subscriber<ipc::Service, Wire<T>, Serial>,
    origin: Option<u128>,
    serial: u64,
    lost: u64,
    _sample: PhantomData<T>,
    _guard: DomainGuard,
}

impl<T: Channel> Subscriber<T> {
    pub(crate) fn open(domain: &Domain, samples: Samples) -> Result<Self, ChannelError> {
        let factory = open::<T>(domain)?;
        let depth = match T::QOS {
            Qos::KeepLast { depth } | Qos::Reliable { depth } => depth,
        };
        let size = match samples {
            Samples::Latest => 1,
            Samples::All => depth,
        };
        let kept = history::<T>().min(size);
        let builder = factory.subscriber_builder().buffer_size(size).history_request(kept);
        let port = domain.room().open(need::subscriber::<T>(size), || {
            if size > 1 {
                check_deep_readers(domain, &factory)?;
            }
            builder.create().map_err(refused::<T>)
        })?;
        let guard = domain.guard();
        Ok(Self { port, origin: None, serial: 0, lost: 0, _sample: PhantomData, _guard: guard })
    }

    /// The next sample, if one waits. Does not allocate.
    pub fn receive(&mut self) -> Result<Option<T>, ChannelError> {
        let Some(sample) = self.port.receive().map_err(|_| lost::<T>())? else { return Ok(None) };
        let serial = sample.user_header().0;
        let origin = Some(sample.origin().value());
        if origin == self.origin {
            self.lost += serial.saturating_sub(self.serial + 1);
        } else {
            self.origin = origin;
        }
        self.serial = serial;
        Ok(Some(sample.payload().0))
    }

    /// The newest sample that waits, all older ones dropped. Does not allocate.
    pub fn newest(&mut self) -> Result<Option<T>, ChannelError> {
        let mut newest = None;
        while let Some(sample) = self.receive()? {
            newest = Some(sample);
        }
        Ok(newest)
    }

    /// Samples of the present publisher and its predecessors that this reader never saw, from its
    /// first sample on.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}
