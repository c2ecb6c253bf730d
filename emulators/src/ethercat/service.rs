//! The emulated line in real time: a bus, and the clock.

use std::io;
use std::time::{Duration, Instant};

use messages::Nanoseconds;

use super::bus::Bus;
use super::link::Link;

/// The longest sleep without a frame: the plant and the watchdogs go on meanwhile [ns].
const NAP: i64 = 1_000_000;

/// Answers the frames on `bus` until `stop` says so, which is asked at least every 2 ms or so.
///
/// # Errors
/// If the socket fails; a master that is gone is no error.
pub fn serve(link: &mut Link, bus: &mut Bus, mut stop: impl FnMut() -> bool) -> io::Result<()> {
    let start = Instant::now();
    let now = || Nanoseconds(i64::try_from(start.elapsed().as_nanos()).unwrap_or(i64::MAX));
    let framing = bus.framing();
    let mut frame = [0; 1600];
    while !stop() {
        let nap = link.next().map_or(NAP, |at| (at - now()).0.clamp(0, NAP));
        if let Some(length) = bus.receive(&mut frame, Duration::from_nanos(nap as u64))? {
            link.send(frame.get(..length).unwrap_or_default(), framing, now());
        } else {
            link.segment.advance(now());
        }
        while let Some(back) = link.receive(now()) {
            bus.send(&back)?;
        }
    }
    Ok(())
}
