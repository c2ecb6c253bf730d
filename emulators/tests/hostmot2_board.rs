//! The board as a master sees it, in virtual time: LBP16, IDROM, watchdog, gate, motors.

use emulators::hostmot2::layout::{Function, PORT_WIDTH, pin_of};
use emulators::hostmot2::record::Record;
use emulators::hostmot2::rig::Rig;
use emulators::hostmot2::spaces::Identity;
use emulators::hostmot2::wiring::Wiring;
use emulators::hostmot2::{Board, Emulator, Faults};
use machine::Machine;
use messages::Nanoseconds;

const MILLISECOND: i64 = 1_000_000;

/// The commands of a datagram.
#[derive(Default)]
struct Packet(Vec<u8>);

impl Packet {
    fn command(mut self, word: u16, address: u16) -> Self {
        self.0.extend((word | 0x4000).to_le_bytes());
        self.0.extend(address.to_le_bytes());
        self
    }
    /// Reads `count` words of the modules.
    fn read(self, address: u16, count: u16) -> Self {
        self.command(0x0280 | count, address)
    }
    /// Writes words of the modules.
    fn write(self, address: u16, words: &[u32]) -> Self {
        let mut packet = self.command(0x8280 | words.len() as u16, address);
        packet.0.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        packet
    }
    fn feed(self) -> Self {
        self.write(0x0e00, &[0x5a00_0000])
    }
}

fn words(reply: Option<&[u8]>) -> Vec<u32> {
    let reply = reply.unwrap_or(&[]);
    reply.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

fn board() -> Board {
    Board::new(Identity::default())
}

fn steppers() -> Machine {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../machines/cartesian_steppers.toml");
    Machine::load(path.as_ref(), &[]).expect("the machine")
}

fn with(machine: &Machine) -> Board {
    let wiring = Wiring::usual(machine);
    let rig = Rig::new(machine, &wiring).expect("a rig");
    board().with_machine(rig, &wiring, Record::with_way())
}

/// Makes the pins of `functions` outputs of their modules, those of `inverted` turned over.
fn connect(functions: &[Function], inverted: &[Function]) -> Packet {
    let mut masks = [[0_u32; 3]; 2];
    for (mask, functions) in masks.iter_mut().zip([functions, inverted]) {
        for pin in functions.iter().filter_map(|function| pin_of(*function)) {
            mask[pin / PORT_WIDTH] |= 1 << (pin % PORT_WIDTH);
        }
    }
    Packet::default().write(0x1400, &masks[1]).write(0x1200, &masks[0]).write(0x1100, &masks[0])
}

#[test]
fn the_idrom_is_found_by_its_cookie() {
    let mut board = board();
    let packet = Packet::default().read(0x0100, 1).read(0x010c, 1).read(0x0400, 3);
    let words = words(board.handle(Nanoseconds(0), &packet.0));
    assert_eq!(words, [0x55aa_cafe, 0x0400, 3, 0x40, 0x200]);
    // Watchdog, ports, and so on to the end of the list.
    let packet = Packet::default().read(0x0440, 30);
    let reply = board.handle(Nanoseconds(0), &packet.0).unwrap_or(&[]).to_vec();
    let tags: Vec<u8> = reply.chunks(12).map(|module| module[0]).collect();
    assert_eq!(tags, [2, 3, 26, 4, 5, 6, 43, 199, 128, 0]);
}

#[test]
fn a_write_is_proved_by_the_scratch_of_the_timers() {
    let mut board = board();
    let mut packet = Packet::default().command(0x9182, 0x10);
    packet.0.extend(0xdead_beef_u32.to_le_bytes());
    let packet = packet.command(0x1184, 0x10).command(0x1901, 0x08);
    let reply = board.handle(Nanoseconds(0), &packet.0).unwrap_or(&[]).to_vec();
    assert_eq!(reply, [0xef, 0xbe, 0xad, 0xde, 0, 0, 0, 0, 1, 0]);
}

#[test]
fn what_makes_no_sense_is_counted_and_harms_nothing() {
    let mut board = board();
    let datagrams: [&[u8]; 5] =
        [&[0x81], &[0x81, 0xc2], &[0x84, 0xc2, 0, 0x20, 1, 2], &[], &[0; 7]];
    for datagram in datagrams {
        board.handle(Nanoseconds(0), datagram);
    }
    // A byte of the modules, which have words only.
    let packet = Packet::default().command(0x0081, 0x0100).command(0x1984, 0x00);
    let reply = board.handle(Nanoseconds(0), &packet.0).unwrap_or(&[]).to_vec();
    assert_eq!(reply, [0, 3, 0, 4, 0, 1, 0, 0, 0]);
}

#[test]
fn every_random_datagram_is_survived() {
    let mut random = messages::random::SplitMix64::new(5);
    let mut board = with(&steppers());
    for index in 0..20_000 {
        let length = random.below(60) as usize;
        let datagram: Vec<u8> = (0..length).map(|_| random.bits() as u8).collect();
        let reply = board.handle(Nanoseconds(index * 1000), &datagram);
        assert!(reply.is_none_or(|reply| reply.len() <= 1472));
    }
}

#[test]
fn the_light_goes_out_with_the_watchdog_in_its_time() {
    let mut board = with(&steppers());
    let (gate, power) = (Function::Oneshot(4, 0), Function::Pwmgen(1, 0));
    let mut packet = connect(&[gate, power], &[gate]);
    // Half of the power; a gate of 100 ms from now on; a watchdog of 5 ms.
    packet = packet.write(0x4200, &[20_000]).write(0x4100, &[3]).write(0x4000, &[2048 << 16]);
    packet = packet.write(0x6100, &[10_000_000]).write(0x6500, &[0]);
    packet = packet.write(0x6500, &[(1 | 8 | 0x40 | 0x400) << 16]).write(0x0c00, &[499_999]).feed();
    board.handle(Nanoseconds(0), &packet.0);
    assert!(board.record().is_lit());
    for index in 1..=10 {
        board.handle(Nanoseconds(index * MILLISECOND), &Packet::default().feed().0);
    }
    board.advance(Nanoseconds(200 * MILLISECOND));
    assert_eq!(board.record().bites, [Nanoseconds(15 * MILLISECOND)]);
    let lit = board.record().lit(board.now());
    assert_eq!(lit, [[Nanoseconds(0), Nanoseconds(15 * MILLISECOND)]]);
    assert!((board.record().light[0].power - 0.5).abs() < 1e-3);
}

#[test]
fn an_active_high_gate_is_lit_before_and_after_everything() {
    let mut board = with(&steppers());
    let (gate, power) = (Function::Oneshot(4, 0), Function::Pwmgen(1, 0));
    let packet = connect(&[gate, power], &[]);
    let packet = packet.write(0x4200, &[20_000]).write(0x4100, &[3]).write(0x4000, &[2048 << 16]);
    board.handle(Nanoseconds(0), &packet.0);
    assert!(board.record().is_lit(), "this is why the gate is low for light");
}

#[test]
fn steps_move_the_tool_and_the_encoder() {
    let machine = steppers();
    let mut board = with(&machine);
    let steps = [Function::Stepgen(1, 0), Function::Stepgen(2, 0)];
    let packet = connect(&steps, &[]).write(0x2900, &[u32::MAX]);
    board.handle(Nanoseconds(0), &packet.0);
    // Up to speed and back in ramps of 100 ms.
    let top = 20_000.0;
    let mut last = Vec::new();
    for index in 0..300_i64 {
        let share = (index.min(300 - index) as f64 / 100.0).min(1.0);
        let rate = (top * share * 4_294_967_296.0 / 1e8) as u32;
        let packet = Packet::default().write(0x2000, &[rate]).read(0x2100, 1).read(0x3000, 1);
        last = words(board.handle(Nanoseconds(index * MILLISECOND), &packet.0));
    }
    let packet = Packet::default().write(0x2000, &[0]);
    board.handle(Nanoseconds(300 * MILLISECOND), &packet.0);
    board.advance(Nanoseconds(500 * MILLISECOND));
    let delivered = board.modules().stepgens.delivered(0);
    assert!((delivered - top * 0.2).abs() < 1.0, "{delivered}");
    // The encoder counts as many as there are pulses, a rotor's lag apart.
    let near = f64::from(last[1] as i16) - f64::from(last[0] >> 16);
    assert!(near.abs() < 60.0, "{last:?}");
    let rig = board.rig().expect("a rig");
    assert!(!rig.fault().is_some(), "{:?}", rig.fault());
    let actuator = &machine.actuators[0];
    let expected = delivered / actuator.encoder.counts * core::f64::consts::TAU * actuator.ratio;
    let tool = rig.tool().expect("a tool")[0] - machine.home[0];
    assert!((tool - expected).abs() < 20e-6, "{tool} against {expected}");
}

#[test]
fn a_bite_stops_the_steps() {
    let mut board = with(&steppers());
    let steps = [Function::Stepgen(1, 0), Function::Stepgen(2, 0)];
    let rate = (2000.0 * 4_294_967_296.0 / 1e8) as u32;
    let packet = connect(&steps, &[]).write(0x2900, &[u32::MAX]).write(0x2000, &[rate]);
    board.handle(Nanoseconds(0), &packet.write(0x0c00, &[999_999]).0);
    board.advance(Nanoseconds(50 * MILLISECOND));
    let delivered = board.modules().stepgens.delivered(0);
    assert!((delivered - 20.0).abs() < 0.1, "10 ms at 2,000 steps/s: {delivered}");
    assert_eq!(board.record().bites, [Nanoseconds(10 * MILLISECOND)]);
}

#[test]
fn a_cut_cable_lets_the_watchdog_bite_and_one_lost_frame_does_not() {
    let faults = Faults {
        loss: 0.01,
        late: 0.01,
        duplicate: 0.01,
        corrupt: 0.01,
        cut: Some([Nanoseconds(2000 * MILLISECOND), Nanoseconds(2100 * MILLISECOND)]),
        ..Faults::default()
    };
    let mut emulator = Emulator::new(board(), &faults, Nanoseconds(50_000));
    let packet = Packet::default().write(0x0c00, &[999_999]).feed();
    emulator.send(Nanoseconds(0), &packet.0);
    let packet = Packet::default().feed().read(0x0d00, 1);
    let mut answers = 0;
    for index in 1..2200 {
        emulator.send(Nanoseconds(index * MILLISECOND), &packet.0);
        let end = Nanoseconds((index + 1) * MILLISECOND - 1);
        answers += std::iter::from_fn(|| emulator.receive(end)).count();
    }
    let [inward, outward] = emulator.accounts();
    assert!(inward.lost > 100 && inward.corrupted > 5 && outward.lost > 5, "{inward:?}");
    assert!((1950..2150).contains(&answers), "{answers}");
    let bites = &emulator.board().record().bites;
    assert_eq!(bites.len(), 1, "{bites:?}");
    assert!((2005..2011).contains(&(bites[0].0 / MILLISECOND)), "{bites:?}");
}
