//! A task for each device: it is asked in its period, and at once when something is to be switched.

use machine::modbus::Device;
use messages::Nanoseconds;
use tokio::sync::watch;
use tokio::time::{Duration, MissedTickBehavior, interval};

use crate::conversation::{Conversation, Outputs};
use crate::heard::Heard;

/// What the tasks are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Orders {
    /// What the outputs are to be.
    pub outputs: Outputs,
    /// Whether the outputs are written once more, and then nothing.
    pub is_last: bool,
}

/// Talks with the device of this index until the last orders have been carried out; `now` is the clock of the samples.
pub async fn attend(
    index: usize,
    device: Device,
    mut orders: watch::Receiver<Orders>,
    heard: Heard,
    now: impl Fn() -> Nanoseconds,
) {
    let mut period = interval(Duration::from_nanos(device.period.0.unsigned_abs()));
    // After a round that took longer the next one comes a period later.
    period.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let has_outputs = !device.writes.is_empty();
    let mut conversation = Conversation::new(device);
    loop {
        let is_changed = tokio::select! {
            _ = period.tick() => false,
            changed = orders.changed() => match changed {
                Ok(()) => true,
                Err(_) => return,
            },
        };
        let Orders { outputs, is_last } = *orders.borrow_and_update();
        if is_last {
            if has_outputs {
                // Nobody is left to be told that it failed; the device's own watchdog is for that.
                let _ = conversation.tell(outputs).await;
            }
            return;
        }
        if is_changed && !has_outputs {
            continue;
        }
        let outcome = conversation.round(outputs, &heard).await;
        heard.note(index, outcome, now());
    }
}
