//! The controller asked past a holder that hangs: a stop or a hold must not fail for want of a process that moves
//! nothing.

use crate::{Verb, VerbReply};
use runtime::operator::{OperatorLink, PATIENCE};
use runtime::socket::SocketError;
use runtime::{Domain, Instance, Role};
use std::time::{Duration, Instant};

/// Pause between two tries: somebody else may be asking past the holder too.
const RETRY: Duration = Duration::from_millis(50);

/// Asks the controller of `instance` directly, whose holder is `silent`.
///
/// # Errors
/// Why it cannot be asked, in words.
pub(crate) fn ask(
    instance: &Instance,
    (verb, value): (Verb, f64),
    silent: &SocketError,
) -> Result<VerbReply, String> {
    let begun = Instant::now();
    loop {
        let asked = once(instance, verb, value);
        if asked.is_ok() || begun.elapsed() > PATIENCE {
            return asked.map(|reply| VerbReply { direct: Some(silent.to_string()), ..reply });
        }
        std::thread::sleep(RETRY);
    }
}

fn once(instance: &Instance, verb: Verb, value: f64) -> Result<VerbReply, String> {
    let domain = Domain::join_within(instance, Role::Observer, Duration::ZERO);
    let domain = domain.map_err(|error| error.to_string())?;
    let link = OperatorLink::start(&domain).map_err(|error| error.to_string())?;
    let reply = link.request(verb.into(), value).map_err(|error| error.to_string())?;
    Ok(VerbReply::from(reply))
}
