//! A domain: all channels of one pipeline, created and held by one process, joined by the others.
//!
//! Holding matters: with iceoryx2 0.10 a process killed while it creates a service leaves it
//! unusable, while services that somebody holds open survive any death among the others.

use std::any::Any;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::rc::Rc;
use std::sync::mpsc;
use std::sync::{Arc, Once};
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::prelude::{
    FileName, LogLevel, SemanticString, SignalHandlingMode, ipc, set_log_level,
};
use messages::{
    Command as MotorCommand, ControllerReport, DrivesReport, Feedback, JobOffer, PlannerReport,
    Progress, SentSetpoint, Setpoint, SimulatedInputs, SlowInputs,
};

use crate::channel::{self, Channel, ChannelError, Publisher, Samples, Subscriber};
use crate::instance::{Instance, SHARED_MEMORY};
use crate::membership::{self, Membership};
use crate::operator;
use crate::peer::Peer;
use crate::room::{self, Room, RoomError, need};
use crate::wake::{self, Listener, Notifier, Wake};

/// How long a service waits for its domain to appear: units start at the same time.
pub const JOIN_PATIENCE: Duration = Duration::from_secs(10);

/// How long creating a node may take; on a half-made management segment iceoryx2 would loop for
/// ever.
const NODE_PATIENCE: Duration = Duration::from_secs(10);

/// What a process is in its domain; each named role exists once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// Holds the domain.
    Domain,
    /// The planner service.
    Planner,
    /// The controller service.
    Controller,
    /// The drives service.
    Drives,
    /// The monitor service.
    Monitor,
    /// The service that speaks Modbus TCP with devices beside the drives.
    Modbus,
    /// An observer, who only reads; any number of them.
    Observer,
}

impl Role {
    /// The roles that exist once, the holder first.
    pub const NAMED: [Self; 6] =
        [Self::Domain, Self::Drives, Self::Controller, Self::Planner, Self::Monitor, Self::Modbus];

    /// The name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Domain => "domain",
            Self::Planner => "planner",
            Self::Controller => "controller",
            Self::Drives => "drives",
            Self::Monitor => "monitor",
            Self::Modbus => "modbus",
            Self::Observer => "observer",
        }
    }
}

impl std::fmt::Display for Role {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name())
    }
}

/// Why a domain could not be created or joined.
#[derive(Debug, thiserror::Error)]
pub enum DomainError {
    /// Somebody in the instance is alive.
    #[error(
        "instance {instance:?} is in use by pid {pid} ({role}); stop it, or choose another name \
         with --instance"
    )]
    InUse {
        /// The instance's name.
        instance: String,
        /// A living process in it; 0 if it could not be told.
        pid: i32,
        /// What that process is.
        role: Role,
    },
    /// There is no domain, or its holder is dead or not ready.
    #[error(
        "no pipeline is running as instance {instance:?}; start one with `graver run` or \
             `graver domain`"
    )]
    Absent {
        /// The instance's name.
        instance: String,
    },
    /// Another living process has this role.
    #[error("instance {instance:?} already has a {role}, pid {pid}")]
    RoleTaken {
        /// The instance's name.
        instance: String,
        /// The role.
        role: Role,
        /// The process that has it; 0 if it could not be told.
        pid: i32,
    },
    /// Somebody else has taken the name of the run directory.
    #[error("{directory:?} {what}; start again, or set XDG_RUNTIME_DIR to a directory of your own")]
    Foreign {
        /// The directory.
        directory: PathBuf,
        /// What stands there, in words that go on after its name.
        what: String,
    },
    /// There is no room in shared memory.
    #[error(transparent)]
    Room(#[from] RoomError),
    /// The operating system refused.
    #[error("{path:?}: {source}")]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// iceoryx2 could not make its node.
    #[error("shared memory of instance {instance:?} could not be set up: {reason}")]
    Node {
        /// The instance's name.
        instance: String,
        /// What iceoryx2 said.
        reason: String,
    },
    /// A channel could not be created.
    #[error(transparent)]
    Channel(#[from] ChannelError),
}

impl DomainError {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }
}

/// A process's part in a domain. Ports made from it keep it alive.
pub struct Domain {
    /// The holder's open channels.
    held: Vec<Box<dyn Any + Send + Sync>>,
    node: Rc<Node<ipc::Service>>,
    role: Role,
    membership: Arc<Membership>,
}

impl Domain {
    /// Takes the instance, wipes what the dead left in it, takes the shared memory that the whole
    /// pipeline needs, and creates every channel.
    ///
    /// # Errors
    /// [`DomainError::InUse`] with a pid while anybody in the instance is alive;
    /// [`DomainError::Room`] with what is needed and what is free where the pipeline does not fit.
    /// Nothing is left behind then.
    pub fn create(instance: &Instance) -> Result<Self, DomainError> {
        let membership = Arc::new(Membership::found(instance)?);
        membership.room().found()?;
        let create = || -> Result<_, DomainError> {
            let node = create_node(&membership, Role::Domain)?;
            membership.close_to_others()?;
            let held = create_services(&node)?;
            Ok((node, held))
        };
        let (node, held) = membership.room().open(need::holder() + need::node(), create)?;
        membership.open()?;
        Ok(Self { held, node: Rc::new(node), role: Role::Domain, membership })
    }

    /// Joins the instance's domain, waiting at most [`JOIN_PATIENCE`] for it to be ready.
    ///
    /// # Errors
    /// [`DomainError::Absent`] without a domain, [`DomainError::RoleTaken`] when the role has a
    /// living owner.
    pub fn join(instance: &Instance, role: Role) -> Result<Self, DomainError> {
        Self::join_within(instance, role, JOIN_PATIENCE)
    }

    /// Like [`Self::join`], waiting at most `patience`.
    pub fn join_within(
        instance: &Instance,
        role: Role,
        patience: Duration,
    ) -> Result<Self, DomainError> {
        let membership = Arc::new(Membership::join(instance, role, patience)?);
        Self::with_membership(membership, role)
    }

    /// A second entry to the same domain for another thread of this process: ports stay on the
    /// thread that made them.
    pub fn entry(&self) -> Entry {
        Entry { membership: self.membership.clone(), role: self.role }
    }

    fn with_membership(membership: Arc<Membership>, role: Role) -> Result<Self, DomainError> {
        let create = || create_node(&membership, role);
        let node = membership.room().open(need::node(), create)?;
        Ok(Self { held: Vec::new(), node: Rc::new(node), role, membership })
    }

    /// The instance.
    pub fn instance(&self) -> &Instance {
        self.membership.instance()
    }

    /// The role of this process.
    pub fn role(&self) -> Role {
        self.role
    }

    /// A publisher on the channel of `T`; each channel has one.
    pub fn publisher<T: Channel>(&self) -> Result<Publisher<T>, ChannelError> {
        Publisher::open(self)
    }

    /// A subscriber on the channel of `T`.
    pub fn subscriber<T: Channel>(&self, samples: Samples) -> Result<Subscriber<T>, ChannelError> {
        Subscriber::open(self, samples)
    }

    /// The side of a wake event that wakes.
    pub fn notifier(&self, wake: Wake) -> Result<Notifier, ChannelError> {
        Notifier::open(self, wake)
    }

    /// The side of a wake event that waits.
    pub fn listener(&self, wake: Wake) -> Result<Listener, ChannelError> {
        Listener::open(self, wake)
    }

    /// The living process with this role, if any.
    pub fn peer(&self, role: Role) -> Option<Peer> {
        Peer::find(self.instance(), role)
    }

    /// Lets the process that `command` starts keep the domain from its first instruction on, so
    /// that nobody can take the instance before the child has joined.
    pub fn inherit_lock(&self, command: &mut Command) -> Result<(), DomainError> {
        membership::inherit_lock(self.instance(), command)
    }

    /// Removes the ports of dead processes, so that their successors find room. For the holder,
    /// after a member died; never in a real-time loop.
    pub fn clean(&self) {
        self.node.blocking_cleanup_dead_nodes(Duration::from_millis(500));
    }

    /// Makes sure that every segment of the domain has all its pages, and puts what is left of the
    /// domain's room back into its reserve, for those who join later.
    ///
    /// Ports have their pages when they are open, so this is a second check: for the holder, when a
    /// service has come up and before the motors are powered, and after [`Self::clean`]. Never in
    /// a real-time loop.
    ///
    /// # Errors
    /// [`DomainError::Room`] with what is lacking. A reserve that somebody else's memory keeps
    /// short is none: all that is open is whole.
    pub fn allocate(&self) -> Result<(), DomainError> {
        Ok(self.room().allocate()?)
    }

    pub(crate) fn room(&self) -> &Room {
        self.membership.room()
    }

    pub(crate) fn node(&self) -> &Node<ipc::Service> {
        &self.node
    }

    /// What a port keeps so that the domain outlives it: the node first, then the membership.
    pub(crate) fn guard(&self) -> DomainGuard {
        DomainGuard { _node: self.node.clone(), _membership: self.membership.clone() }
    }
}

impl std::fmt::Debug for Domain {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Domain")
            .field("instance", self.instance())
            .field("role", &self.role)
            .field("held", &self.held.len())
            .finish()
    }
}

/// The right of another thread of this process to be in the domain too.
#[derive(Debug, Clone)]
pub struct Entry {
    membership: Arc<Membership>,
    role: Role,
}

impl Entry {
    /// Enters on the calling thread.
    pub fn enter(&self) -> Result<Domain, DomainError> {
        Domain::with_membership(self.membership.clone(), self.role)
    }

    /// The instance.
    pub fn instance(&self) -> &Instance {
        self.membership.instance()
    }
}

/// Keeps node and membership alive in this order behind a port.
#[derive(Debug)]
pub(crate) struct DomainGuard {
    _node: Rc<Node<ipc::Service>>,
    _membership: Arc<Membership>,
}

fn create_services(
    node: &Node<ipc::Service>,
) -> Result<Vec<Box<dyn Any + Send + Sync>>, ChannelError> {
    Ok(vec![
        channel::create::<Feedback>(node)?,
        channel::create::<MotorCommand>(node)?,
        channel::create::<Setpoint>(node)?,
        channel::create::<SentSetpoint>(node)?,
        channel::create::<Progress>(node)?,
        channel::create::<ControllerReport>(node)?,
        channel::create::<DrivesReport>(node)?,
        channel::create::<PlannerReport>(node)?,
        channel::create::<JobOffer>(node)?,
        channel::create::<SimulatedInputs>(node)?,
        channel::create::<SlowInputs>(node)?,
        wake::create(node, Wake::Feedback)?,
        wake::create(node, Wake::Command)?,
        operator::create(node)?,
    ])
}

fn create_node(membership: &Membership, role: Role) -> Result<Node<ipc::Service>, DomainError> {
    static QUIET: Once = Once::new();
    // Its failures come back as errors; printed as well they would break `--json` users' logs.
    QUIET.call_once(|| set_log_level(LogLevel::Fatal));

    let instance = membership.instance();
    let failed = |reason: String| {
        let hint = room::hint(&[Path::new(SHARED_MEMORY), &instance.root()]);
        DomainError::Node { instance: instance.name().into(), reason: reason + &hint }
    };
    let mut config = Config::default();
    config.global.prefix = FileName::new(membership.prefix().as_bytes())
        .map_err(|error| failed(format!("{error:?}")))?;
    let root = instance.root();
    let root = iceoryx2::prelude::Path::new(root.as_os_str().as_encoded_bytes())
        .map_err(|error| failed(format!("{error:?}")))?;
    config.global.set_root_path(&root);
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;

    let name = role.name().try_into().map_err(|error| failed(format!("{error:?}")))?;
    let (send, receive) = mpsc::sync_channel(1);
    let create = move || {
        let node = NodeBuilder::new()
            .name(&name)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>();
        let _ = send.send(node.map_err(|error| format!("{error:?}")));
    };
    std::thread::Builder::new()
        .name("node".into())
        .spawn(create)
        .map_err(|error| failed(error.to_string()))?;
    match receive.recv_timeout(NODE_PATIENCE) {
        Ok(node) => node.map_err(failed),
        Err(_) => Err(failed(format!("no answer within {} s", NODE_PATIENCE.as_secs()))),
    }
}
