//! Whatever a client sends: no panic, one answer for each line, and nothing lit but by jobs.

use grbl::machine::Ask;
use messages::random::SplitMix64 as Random;
use operator::Verb;

use crate::bench::Bench;

/// Lines that clients send, and some that none should.
const LINES: [&str; 48] = [
    "",
    "G0 X10",
    "G1 X20 F600",
    "G1Y30S500",
    "M3 S100",
    "M4S1000",
    "M5",
    "M8",
    "M9",
    "M2",
    "M30",
    "%",
    "G4 P0.01",
    "G4P0",
    "G91",
    "G90",
    "G20",
    "G21",
    "G92 X0 Y0",
    "G92.1",
    "G54",
    "G59",
    "G10 L2 P1 X1 Y1",
    "G10 L20 P2 X0",
    "$$",
    "$#",
    "$G",
    "$I",
    "$N",
    "$",
    "$X",
    "$H",
    "$HX",
    "$C",
    "$SLP",
    "$RST=#",
    "$J=G91 X1 F600",
    "$J=X10Y10F900",
    "$J=G91X-1",
    "G38.2 X110 F900",
    "G1X10S0.1:0.5:7F900",
    "G2 X110 Y110 I5 J0 F600",
    "M0",
    "(comment",
    "G1 X1e9 F1",
    "o1 while [1]",
    "#1=[2/0]",
    "G53 G0 X50 Y50",
];

/// Bytes of realtime commands, a reset apart.
const REALTIME: [u8; 22] = [
    b'?', b'!', b'~', b'~', 0x84, 0x85, 0x90, 0x91, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x99, 0x9A,
    0x9B, 0x9C, 0x9D, 0x9E, 0xA0, 0xA1,
];

/// A message: a line, a realtime command, or bytes of any kind without a line end.
pub(crate) fn message(random: &mut Random) -> Vec<u8> {
    match random.below(10) {
        0..=5 => format!("{}\n", LINES[random.below(LINES.len() as u64) as usize]).into_bytes(),
        6 | 7 => vec![REALTIME[random.below(REALTIME.len() as u64) as usize]],
        8 => {
            let length = random.below(20);
            let byte = |random: &mut Random| match random.below(256) as u8 {
                b'\n' | b'\r' | 0x18 => b'x',
                byte => byte,
            };
            (0..length).map(|_| byte(random)).collect()
        }
        _ if random.below(40) == 0 => vec![0x18],
        _ => b"\n".to_vec(),
    }
}

fn answers(lines: &[String]) -> usize {
    lines.iter().filter(|line| *line == "ok" || line.starts_with("error:")).count()
}

#[test]
fn a_hundred_thousand_messages_are_answered_line_by_line() {
    for seed in 0..4 {
        let mut random = Random::new(seed);
        let mut bench = Bench::new();
        let (mut lines, mut answered) = (0, 0);
        let mut said = Vec::new();
        for round in 0..25_000 {
            let message = message(&mut random);
            said.push(message.clone());
            let heard = bench.lines();
            answered += answers(&heard);
            if message == [0x18] {
                (lines, answered) = (0, 0);
            }
            lines += message.iter().filter(|byte| **byte == b'\n').count();
            bench.send(&message);
            match random.below(60) {
                0 => bench.pass(0.6),
                1..=3 => bench.pass(0.01),
                4 if random.below(100) == 0 => bench.machine.fault("following_error"),
                _ => {}
            }
            // A session that waits for somebody is given what it waits for, now and then.
            if round % 500 == 499 {
                bench.send("~");
                bench.pass(30.0);
                answered += answers(&bench.lines());
                assert_eq!(answered, lines, "seed {seed}, round {round}");
                (lines, answered) = (0, 0);
            }
        }
        let lights = bench.machine.asked.iter();
        let lights = lights.filter(|ask| {
            matches!(
                ask,
                Ask::Verb { verb: Verb::TestPulse, .. }
                    | Ask::Operate { verb: Verb::TestPulse, .. }
            )
        });
        assert_eq!(lights.count(), 0);
    }
}
