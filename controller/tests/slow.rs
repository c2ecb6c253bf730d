//! What slow devices say holds for as long as they may be silent.

#![allow(clippy::unwrap_used)]

use controller::Presence;
use controller::slow::Slow;
use machine::Machine;
use messages::{DeviceState, Nanoseconds, SlowDevice, SlowInputs};

const DEVICES: &str = r#"
[inputs.door]
function = "door"
[modbus.chiller]
address = "10.0.0.5"
period = "100 ms"
timeout = "200 ms"
inputs.alarm = { discrete = 0, function = "interlock" }
[modbus.filter]
address = "10.0.0.6"
silence = "warning"
inputs.full = { coil = 0, function = "warning" }
"#;

const DOOR: u64 = 1;
const CHILLER: u64 = 2;
const ALARM: u64 = 4;
const FILTER: u64 = 8;
const FULL: u64 = 16;

fn slow() -> Slow {
    let text = format!("{}{DEVICES}", machine::machine::BUILTIN);
    Slow::new(&Machine::parse("devices.toml", &text, &[]).unwrap())
}

/// Both devices answered all at `at` [ms], with these inputs active.
fn said(active: u64, at: i64) -> SlowInputs {
    let answered = Nanoseconds(at * 1_000_000);
    let state = DeviceState::Answering as u32;
    let device = SlowDevice { answered, state, ..SlowDevice::default() };
    let mut slow = SlowInputs { active, ..SlowInputs::default() };
    slow.devices[..2].fill(device);
    slow
}

fn active(slow: &Slow, milliseconds: i64) -> u64 {
    slow.active(Nanoseconds(milliseconds * 1_000_000), Presence::Present)
}

#[test]
fn what_a_device_says_holds_until_it_is_overdue() {
    let mut slow = slow();
    assert_eq!(active(&slow, 0), 0, "nobody asks");
    slow.hear(&SlowInputs::default());
    assert_eq!(active(&slow, 1), CHILLER | FILTER);
    slow.hear(&said(ALARM, 1000));
    assert_eq!(active(&slow, 1001), ALARM);
    // 100 ms + 200 ms, and the margin of 100 ms.
    assert_eq!(active(&slow, 1400), ALARM);
    assert_eq!(active(&slow, 1401), ALARM | CHILLER);
    assert_eq!(active(&slow, 2000), ALARM | CHILLER | FILTER);
    slow.hear(&said(FULL, 2000));
    assert_eq!(active(&slow, 2001), FULL);
}

#[test]
fn a_refusal_and_a_dead_process_are_silence_at_once() {
    let mut slow = slow();
    slow.hear(&said(0, 1000));
    assert_eq!(slow.active(Nanoseconds(1_000_000_000), Presence::Lost), CHILLER | FILTER);
    let mut refused = said(0, 1000);
    refused.devices[0].state = DeviceState::Refusing as u32;
    slow.hear(&refused);
    assert_eq!(active(&slow, 1000), CHILLER);
}

#[test]
fn no_bit_of_another_input_is_taken() {
    let mut slow = slow();
    slow.hear(&said(u64::MAX, 1000));
    assert_eq!(active(&slow, 1000), ALARM | FULL);
    assert_eq!(active(&slow, 1000) & DOOR, 0);
}

/// Whatever stands in the memory that is shared, an answer of a time that is none holds for nothing.
#[test]
fn an_answer_far_ahead_or_of_no_time_is_silence() {
    let mut slow = slow();
    // Said between the beginning of the cycle and its look: a moment ahead.
    slow.hear(&said(0, 1002));
    assert_eq!(active(&slow, 1000), 0);
    slow.hear(&said(0, 100_000));
    assert_eq!(active(&slow, 1000), CHILLER | FILTER);
    for answered in [i64::MIN, i64::MAX] {
        let mut nonsense = said(0, 0);
        nonsense.devices[..2].iter_mut().for_each(|it| it.answered = Nanoseconds(answered));
        slow.hear(&nonsense);
        assert_eq!(active(&slow, 1000), CHILLER | FILTER, "{answered}");
        assert_eq!(active(&slow, -1000), CHILLER | FILTER, "{answered}");
    }
}
