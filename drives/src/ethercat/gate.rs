//! The laser's gate as the samples of a digital output, and its power as the value of an analogue one.

use messages::{LaserCycle, Nanoseconds};

/// Full scale of the analogue output.
const FULL: f64 = 32_767.0;

/// Puts the gate of `laser` into the bits of `to`, the first sample in the lowest bit of the first byte:
/// `samples` of them in a `period`. A change goes to the nearest sample; what is both opened and closed within
/// one is lost.
///
/// Of several samples the last one is dark: a terminal holds it while no frame comes, and no command is valid for
/// longer than its cycle.
pub fn sample(laser: &LaserCycle, samples: u16, period: Nanoseconds, to: &mut [u8]) {
    to.fill(0);
    let mut open = laser.gate != 0;
    let mut edges = laser.edges().iter().peekable();
    let length = period.0 as f64 / f64::from(samples.max(1));
    let lit = if samples > 1 { samples - 1 } else { samples };
    for index in 0..lit {
        // A change that is nearer to this sample's beginning than to the next one's is made here.
        let until = (f64::from(index) + 0.5) * length;
        while let Some(edge) = edges.next_if(|edge| f64::from(edge.offset) < until) {
            open = edge.gate != 0;
        }
        if open && let Some(byte) = to.get_mut(usize::from(index / 8)) {
            *byte |= 1 << (index % 8);
        }
    }
}

/// What of full scale the power of `laser` is in its cycle: that of the first light in it.
pub fn power(laser: &LaserCycle) -> i16 {
    let first = laser.edges().iter().find(|edge| edge.gate != 0);
    let power = if laser.gate != 0 { laser.power } else { first.map_or(0.0, |edge| edge.power) };
    (power.clamp(0.0, 1.0) * FULL).round() as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::GateEdge;

    fn laser(gate: u32, edges: &[(u32, u32)]) -> LaserCycle {
        let mut cycle = LaserCycle { gate, power: 0.5, ..LaserCycle::OFF };
        for (offset, gate) in edges {
            assert!(cycle.push(GateEdge { offset: *offset, gate: *gate, power: 0.25 }));
        }
        cycle
    }

    fn bits(laser: &LaserCycle, samples: u16) -> Vec<bool> {
        let mut bytes = vec![0xff; usize::from(samples).div_ceil(8)];
        sample(laser, samples, Nanoseconds(1_000_000), &mut bytes);
        let bit = |index: u16| bytes[usize::from(index / 8)] >> (index % 8) & 1 != 0;
        (0..samples).map(bit).collect()
    }

    #[test]
    fn an_edge_goes_to_the_nearest_sample() {
        for offset in [0, 4_999, 5_000, 5_001, 123_456, 654_321, 984_999] {
            let bits = bits(&laser(0, &[(offset, 1)]), 100);
            let first = bits.iter().position(|bit| *bit).unwrap_or(100);
            let at = first as f64 * 10_000.0;
            assert!((at - f64::from(offset)).abs() <= 5_000.0, "{offset} {at}");
            assert!(bits[first..].iter().rev().skip(1).all(|bit| *bit));
        }
    }

    #[test]
    fn a_dark_cycle_has_no_bit_and_a_lit_one_all_but_the_last() {
        assert!(!bits(&LaserCycle::OFF, 100).contains(&true));
        let lit = bits(&laser(3, &[]), 100);
        assert_eq!(lit.iter().position(|bit| !bit), Some(99));
        // One sample: a change before the middle of the cycle is made at its beginning, a later one in the next.
        assert_eq!(bits(&laser(3, &[(400_000, 0)]), 1), [false]);
        assert_eq!(bits(&laser(3, &[(600_000, 0)]), 1), [true]);
        assert_eq!(bits(&laser(0, &[(600_000, 4)]), 1), [false]);
    }

    #[test]
    fn power_is_that_of_the_first_light() {
        assert_eq!(power(&LaserCycle::OFF), 0);
        assert_eq!(power(&laser(1, &[])), 16_384);
        assert_eq!(power(&laser(0, &[(5, 1)])), 8_192);
    }
}
