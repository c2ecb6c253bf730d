//! A terminal that stands for a serial port.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use runtime::pseudo_terminal::PseudoTerminal;

use super::client::{self, Client};
use super::{Shared, spawn};
use crate::machine::Machine;

/// How often a terminal that nobody has open is looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// Serves whoever opens the terminal at `path`.
pub(super) fn start<M: Machine + 'static>(
    path: &Path,
    shared: &Arc<Shared<M>>,
) -> io::Result<JoinHandle<()>> {
    let terminal = PseudoTerminal::open(path)?;
    let shared = shared.clone();
    spawn("grbl-tty", move || {
        while !shared.is_over() {
            if !terminal.is_opened(LOOK_PERIOD) {
                continue;
            }
            let end = || terminal.end();
            let (Ok(reader), Ok(writer)) = (end(), end()) else { return };
            let Ok(client) = Client::of_terminal(reader, writer) else { return };
            client::serve(client, &shared);
        }
    })
}
