//! What systemd is told of a service: that it is ready, what it is doing, and that it lives. Nothing where systemd did not
//! start it: without `NOTIFY_SOCKET`.

use runtime::{heartbeat, message};
use sd_notify::NotifyState;
use std::time::Duration;

/// Beats are looked for this many times within the watchdog's time.
const CHECKS: u32 = 4;

/// Says that the service is there, and what it is doing; before the cycle, which says nothing.
pub fn ready(status: &str) {
    send(&[NotifyState::Ready, NotifyState::Status(status)]);
}

/// Says what the service is doing now.
pub fn status(status: &str) {
    send(&[NotifyState::Status(status)]);
}

/// Says that the service ends.
pub fn stopping() {
    send(&[NotifyState::Stopping]);
}

/// Tells the watchdog, if there is one, that the loop comes round, from a thread of its own. A process whose loop stands
/// still says nothing more, and systemd ends it.
///
/// # Errors
/// A thread that cannot be started.
pub fn watch() -> std::io::Result<()> {
    let Some(patience) = sd_notify::watchdog_enabled().filter(|it| !it.is_zero()) else {
        return Ok(());
    };
    let thread = std::thread::Builder::new().name("watchdog".to_owned());
    thread.spawn(move || keep_alive(patience / CHECKS)).map(drop)
}

fn keep_alive(interval: Duration) {
    let mut seen = None;
    loop {
        let beats = heartbeat::beats();
        if seen != Some(beats) || heartbeat::is_busy() {
            send(&[NotifyState::Watchdog]);
        }
        seen = Some(beats);
        std::thread::sleep(interval);
    }
}

fn send(state: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(state) {
        message::tell(&format!("systemd could not be told: {error}"));
    }
}
