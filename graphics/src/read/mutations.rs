//! Damaged files for the tests of readers.

use messages::random::SplitMix64;

/// Gives a reader `count` files, each a sample with some bytes changed, left out, doubled, or replaced by parts
/// of the same file.
pub(crate) fn check(samples: &[&[u8]], count: u64, read: impl Fn(&[u8])) {
    let mut random = SplitMix64::new(1);
    for _ in 0..count {
        let mut bytes = samples[random.below(samples.len() as u64) as usize].to_vec();
        for _ in 0..=random.below(4) {
            mutate(&mut bytes, &mut random);
        }
        read(&bytes);
    }
}

fn mutate(bytes: &mut Vec<u8>, random: &mut SplitMix64) {
    const TELLING: [&[u8]; 12] = [
        b"0",
        b"-1",
        b"1e308",
        b"-1e-320",
        b"nan",
        b"99999999999",
        b"<",
        b"\"",
        b"\0",
        b"\xff",
        b" ",
        b"\n",
    ];
    if bytes.is_empty() {
        return;
    }
    let mut place = || random.below(bytes.len() as u64) as usize;
    let (at, other) = (place(), place());
    let (from, to) = (at.min(other), at.max(other).min(at.min(other) + 64));
    match random.below(6) {
        0 => bytes[at] = random.bits() as u8,
        1 => bytes[at] ^= 1 << random.below(8),
        2 => drop(bytes.drain(from..to)),
        3 => {
            let part = bytes[from..to].to_vec();
            bytes.splice(other..other, part);
        }
        4 => {
            let part = TELLING[random.below(TELLING.len() as u64) as usize];
            bytes.splice(at..at, part.iter().copied());
        }
        _ => mutate_number(bytes, at, random),
    }
}

/// Replaces the next number after a place by a telling one.
fn mutate_number(bytes: &mut Vec<u8>, at: usize, random: &mut SplitMix64) {
    const NUMBERS: [&[u8]; 8] =
        [b"0", b"-1", b"1e30", b"1e-30", b"65536", b"2147483648", b"-9007199254740993", b"1e400"];
    let Some(from) = bytes[at..].iter().position(u8::is_ascii_digit) else { return };
    let from = at + from;
    let length = bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let number = NUMBERS[random.below(NUMBERS.len() as u64) as usize];
    bytes.splice(from..from + length, number.iter().copied());
}
