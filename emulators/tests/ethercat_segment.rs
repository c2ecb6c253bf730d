//! The emulated segment against a small master of its own: states and their codes, process data, clocks,
//! watchdogs and light.

mod reference;

use emulators::ethercat::Layout;
use messages::Nanoseconds;
use messages::random::SplitMix64;
use reference::{BRD, CYCLE, FRMW, LRW, Master};

/// The drives of the built-in machine, the oversampled output, the analogue one, inputs, outputs.
const DRIVES: u16 = 2;
const GATE: u16 = 3;
const POWER: u16 = 4;

struct Running {
    master: Master,
    targets: [i32; DRIVES as usize],
    word: u16,
    mode: u8,
    gate: [u8; 13],
    power: u16,
}

/// Logical addresses: 7 bytes to each drive, 13 to the gate, 2 to the power; 7 from each drive.
const INPUTS: usize = 7 * DRIVES as usize + 15;

impl Running {
    /// A segment in OP, its clocks the same, with a watchdog of 10 ms.
    fn new() -> Self {
        let mut master = Master::new(&Layout::default());
        let count = master.scan();
        master.clocks(count);
        for slave in 1..=DRIVES {
            master.pre_op(slave);
            let at = 7 * u32::from(slave - 1);
            master.manager(slave, 2, 0x1100, 7, 0x64);
            master.manager(slave, 3, 0x1400, 7, 0x20);
            master.map(slave, 0, at, 7, (0x1100, 2));
            master.map(slave, 1, INPUTS as u32 + at, 7, (0x1400, 1));
        }
        for (slave, at, length) in [(GATE, 14, 13), (POWER, 27, 2)] {
            assert_eq!(master.request(slave, 2), (2, 0));
            master.manager(slave, 0, 0x1000, length, 0x64);
            master.map(slave, 0, at, length, (0x1000, 2));
        }
        for slave in 1..=POWER {
            master.write(slave, 0x0420, &100_u16.to_le_bytes());
            master.synchronize(
                slave,
                if slave == GATE { 10_000 } else { CYCLE as u32 },
                if slave == GATE { 100 } else { 1 },
            );
            assert_eq!(master.request(slave, 4), (4, 0), "slave {slave}");
            assert_eq!(master.request(slave, 8), (8, 0), "slave {slave}");
        }
        let mut running =
            Self { master, targets: [0; 2], word: 0, mode: 8, gate: [0; 13], power: 0 };
        running.cycle();
        running
    }

    /// One cycle; status word, position and mode of each drive.
    fn cycle(&mut self) -> Vec<(u16, i32, u8)> {
        let mut data = Vec::new();
        for target in self.targets {
            data.extend(self.word.to_le_bytes());
            data.extend(target.to_le_bytes());
            data.push(self.mode);
        }
        data.extend(self.gate);
        data.extend(self.power.to_le_bytes());
        data.resize(INPUTS + 7 * usize::from(DRIVES), 0);
        self.master.ask(FRMW, 1, 0x0910, &[0; 8]);
        let (data, counter) = self.master.ask(LRW, 0, 0, &data);
        assert_eq!(counter, 3 * DRIVES + 4);
        self.master.wait(CYCLE);
        data[INPUTS..]
            .chunks(7)
            .map(|it| {
                let word = u16::from_le_bytes([it[0], it[1]]);
                (word, i32::from_le_bytes([it[2], it[3], it[4], it[5]]), it[6])
            })
            .collect()
    }

    fn cycles(&mut self, count: usize) -> Vec<(u16, i32, u8)> {
        (0..count).map(|_| self.cycle()).last().unwrap_or_default()
    }

    fn enable(&mut self) {
        for (word, state) in [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)] {
            self.word = word;
            let status = self.cycles(4);
            assert!(status.iter().all(|it| it.0 & 0x6F == state), "{word:#x}: {status:x?}");
        }
    }
}

#[test]
fn the_slaves_are_counted_and_tell_who_they_are() {
    let mut master = Master::new(&Layout::default());
    assert_eq!(master.scan(), 6);
    let products: Vec<u32> = (1..=6).map(|slave| master.eeprom(slave, 0x0A)).collect();
    assert_eq!(products, [0x0402, 0x0402, 0x2262, 0x4001, 0x1008, 0x2008]);
    let (data, _) = master.ask(BRD, 0, 0x0130, &[0, 0]);
    assert_eq!(data, [1, 0]);
    let links: Vec<u16> = (1..=6).map(|slave| master.word(slave, 0x0110) & 0x0F00).collect();
    assert_eq!(links, [0x0A00, 0x0A00, 0x0A00, 0x0A00, 0x0A00, 0x0600]);
}

#[test]
fn a_state_is_refused_with_its_reason() {
    let mut master = Master::new(&Layout::default());
    master.scan();
    assert_eq!(master.request(1, 8), (0x11, 0x0011));
    // A fault is to be acknowledged first.
    assert_eq!(master.request(1, 2), (0x11, 0x0011));
    assert_eq!(master.request(1, 0x11), (1, 0));
    assert_eq!(master.request(1, 2), (0x11, 0x0016));
    master.request(1, 0x11);
    assert_eq!(master.request(1, 3), (0x11, 0x0013));
    master.request(1, 0x11);
    master.pre_op(1);
    assert_eq!(master.request(1, 4), (0x12, 0x001D));
    master.request(1, 0x12);
    master.manager(1, 2, 0x1100, 7, 0x64);
    assert_eq!(master.request(1, 4), (0x12, 0x001E));
    master.request(1, 0x12);
    master.manager(1, 3, 0x1400, 7, 0x20);
    assert_eq!(master.request(1, 4), (4, 0));
    // Sync signals that would have begun in the past never come.
    master.write(1, 0x09A0, &1_000_000_u32.to_le_bytes());
    master.write(1, 0x0981, &[3]);
    assert_eq!(master.request(1, 8), (0x14, 0x002D));
    master.request(1, 0x14);
    master.synchronize(1, 1_000_000, 1);
    assert_eq!(master.request(1, 8), (8, 0));
}

#[test]
fn process_data_is_remapped_in_its_order_alone() {
    let mut master = Master::new(&Layout::default());
    master.scan();
    master.pre_op(1);
    let entry = 0x6040_0010_u32.to_le_bytes();
    assert_eq!(master.download(1, 0x1600, 1, &entry), 0x0601_0003, "assigned");
    assert_eq!(master.download(1, 0x1C12, 0, &[0]), 0);
    assert_eq!(master.download(1, 0x1600, 1, &entry), 0x0601_0003, "not empty");
    assert_eq!(master.download(1, 0x1600, 0, &[0]), 0);
    let wrong = [
        (0x6040_0020_u32, 0x0604_0041, "size"),
        (0x6041_0010, 0x0604_0041, "direction"),
        (0x9999_0010, 0x0602_0000, "none"),
    ];
    for (value, abort, text) in wrong {
        assert_eq!(master.download(1, 0x1600, 1, &value.to_le_bytes()), abort, "{text}");
    }
    assert_eq!(master.download(1, 0x1C12, 1, &0x1A00_u16.to_le_bytes()), 0x0609_0030);
    let objects = [0x6040_0010, 0x6060_0008, 0x607A_0020, 0x60FF_0020, 0x6071_0010];
    master.remap(1, (0x1C12, 0x1600), &objects);
    master.manager(1, 2, 0x1100, 13, 0x64);
    master.manager(1, 3, 0x1400, 7, 0x20);
    assert_eq!(master.request(1, 4), (4, 0));
    assert_eq!(master.download(1, 0x1C12, 0, &[0]), 0x0800_0022, "in SAFE-OP");
    // The name is longer than four bytes: its length, then the text.
    let answer = master.sdo(1, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!((answer[0], &answer[8..]), (0x41, &b"Emulated CiA 402 servo drive"[..]));
}

#[test]
fn an_axis_follows_its_targets_and_stops_quickly() {
    let mut running = Running::new();
    running.enable();
    for _ in 0..500 {
        running.targets[0] += 4;
        running.cycle();
    }
    let there = running.cycles(600);
    assert!((there[0].1 - 2000).abs() <= 4, "{there:?}");
    assert!(there[1].1.abs() <= 2, "{there:?}");
    assert_eq!(there[0].0 & 0x3000, 0x1000);
    assert_eq!(there[0].2, 8);
    running.word = 0x02;
    let stopped = running.cycles(300);
    assert!(stopped.iter().all(|it| it.0 & 0x4F == 0x40), "{stopped:x?}");
}

#[test]
fn a_target_out_of_reach_is_a_following_error() {
    let mut running = Running::new();
    running.enable();
    running.targets[0] = 200_000;
    let status = running.cycles(300);
    assert_eq!(status[0].0 & 0x4F, 0x08, "{status:x?}");
    assert_eq!(running.master.sdo(1, &[0x40, 0x3F, 0x60, 0, 0, 0, 0, 0])[4..6], [0x11, 0x86]);
    running.targets[0] = status[0].1;
    running.word = 0x80;
    assert_eq!(running.cycles(4)[0].0 & 0x4F, 0x40);
}

#[test]
fn light_follows_the_samples_and_the_power() {
    let mut running = Running::new();
    running.power = 16_384;
    running.cycles(3);
    // Samples 10 to 19 and 95 to 99, and nothing in the next cycle.
    running.gate = [0, 0b1111_1100, 0b0000_1111, 0, 0, 0, 0, 0, 0, 0, 0, 0b1000_0000, 0b1111];
    running.cycle();
    running.gate = [0; 13];
    running.cycles(4);
    let light = running.master.segment.light();
    let lengths: Vec<_> = light.windows(2).map(|pair| (pair[1].at - pair[0].at).0).collect();
    assert_eq!(lengths.len(), 3, "{light:?}");
    for (length, expected) in lengths.iter().zip([100_000, 750_000, 50_000]) {
        assert!((length - expected).abs() < 1100, "{lengths:?}");
    }
    assert!((light[0].power - 0.5).abs() < 1e-3, "{light:?}");
}

#[test]
fn without_frames_the_watchdogs_put_the_light_out_and_stop_the_axes() {
    let mut running = Running::new();
    running.enable();
    running.gate = [0xFF; 13];
    running.power = 32_767;
    for _ in 0..200 {
        running.targets[0] += 4;
        running.cycle();
    }
    let last = running.master.now - Nanoseconds(CYCLE);
    assert!(running.master.segment.wires().lock().light.is_lit());
    running.master.wait(400_000_000);
    let dark = running.master.segment.light().last().copied();
    let dark = dark.filter(|edge| edge.power == 0.0).map(|edge| (edge.at - last).0);
    assert!(dark.is_some_and(|after| (0..=10_010_000).contains(&after)), "{dark:?}");
    // The drives miss their targets before their watchdogs expire.
    for (slave, number) in running.master.segment.slaves().iter().zip(1..=POWER) {
        let code = if number <= DRIVES { 0x001A } else { 0x001B };
        assert_eq!((slave.code(), slave.watchdog_count()), (code, 1), "slave {number}");
    }
    let at = |running: &Running| running.master.segment.wires().motor(0).counts;
    let before = at(&running);
    running.master.wait(100_000_000);
    assert_eq!(at(&running), before);
    assert_eq!(running.master.word(1, 0x0130), 0x14);
}

#[test]
fn a_cut_cable_leaves_the_slaves_behind_it_without_frames() {
    let mut running = Running::new();
    running.cycles(10);
    let now = running.master.now;
    running.master.segment.cut(2, now);
    assert_eq!(running.master.ask(BRD, 0, 0, &[0]).1, 2);
    running.master.wait(50_000_000);
    assert_eq!(running.master.segment.slaves()[2].code(), 0x001B);
    let now = running.master.now;
    running.master.segment.cut(6, now);
    assert_eq!(running.master.ask(BRD, 0, 0, &[0]).1, 6);
    running.master.segment.power_cycle(0, now);
    assert_eq!(running.master.ask(BRD, 0, 0x0130, &[0, 0]).0[0] & 1, 1);
}

#[test]
fn a_drive_finds_its_home_by_itself() {
    let mut running = Running::new();
    running.mode = 6;
    assert_eq!(running.master.download(1, 0x6098, 0, &[34]), 0);
    running.enable();
    running.word = 0x1F;
    let mut status = Vec::new();
    for _ in 0..3000 {
        status = running.cycle();
        if status[0].0 & 0x3400 == 0x1400 {
            break;
        }
    }
    assert_eq!(status[0].0 & 0x3400, 0x1400, "{status:x?}");
    // An index pulse every revolution of 4096 counts.
    let counts = running.master.segment.wires().motor(0).counts;
    assert!((counts - i64::from(status[0].1) - 4096).abs() < 40, "{counts} {status:?}");
}

#[test]
fn a_drive_that_finds_no_switch_says_so_and_one_that_is_told_to_stops() {
    let mut running = Running::new();
    running.mode = 6;
    // There is no home switch: it comes to its limit switch.
    assert_eq!(running.master.download(1, 0x6098, 0, &[21]), 0);
    assert_eq!(running.master.download(1, 0x6099, 1, &40_000_u32.to_le_bytes()), 0);
    running.enable();
    assert_eq!(running.cycles(4)[0].0 & 0x3400, 0x0400, "not begun");
    running.word = 0x1F;
    let moving = running.cycles(300);
    assert_eq!(moving[0].0 & 0x3400, 0, "{moving:x?}");
    // Without its bit it comes to rest, and is broken off.
    running.word = 0x0F;
    let rest = running.cycles(300);
    assert_eq!((rest[0].0 & 0x3400, rest[0].1), (0x0400, running.cycles(50)[0].1), "{rest:x?}");
    running.word = 0x1F;
    running.cycles(300);
    for _ in 0..20_000 {
        if running.cycle()[0].0 & 0x3400 != 0 {
            break;
        }
    }
    let status = running.cycles(200);
    assert_eq!(status[0].0 & 0x3400, 0x2400, "{status:x?}");
}

#[test]
fn random_frames_never_panic_and_the_same_ones_do_the_same() {
    let run = || {
        let mut master = Running::new().master;
        let mut random = SplitMix64::new(11);
        let mut sum = 0_u64;
        for _ in 0..50_000 {
            let mut frame = vec![0; 12];
            frame.extend([0x88, 0xA4]);
            let length = random.below(60) as usize + 12;
            if random.below(4) > 0 {
                // One that is sound, so that it gets further than the header.
                let data = length - 12;
                let offsets =
                    [0x0120, 0x0500, 0x0600, 0x0800, 0x0900, 0x0980, 0x1000, 0x1080, 0xFFF0];
                let offset = offsets[random.below(9) as usize] + random.below(16) as u16;
                frame.extend((0x1000 | length as u16).to_le_bytes());
                frame.extend([random.below(16) as u8, 0]);
                frame.extend((random.below(8) as u16).to_le_bytes());
                frame.extend(offset.to_le_bytes());
                frame.extend((data as u16).to_le_bytes());
                frame.extend([0, 0]);
            }
            frame.extend((0..length).map(|_| random.bits() as u8));
            master.now = master.now + Nanoseconds(random.below(20_000) as i64);
            let back = master.segment.process(&frame, master.now).unwrap_or_default();
            sum = back.iter().fold(sum, |sum, byte| sum.rotate_left(5) ^ u64::from(*byte));
        }
        sum
    };
    assert_eq!(run(), run());
}
