//! Memory mapping units: which bits of the logical memory are which bits of a slave.

use super::registers::{FMMU, FMMUS};
use crate::ethercat::frame::{double_word, word};

/// A memory mapping unit as its registers have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fmmu {
    /// First bit in the logical memory.
    start: u64,
    /// How many bits.
    bits: u64,
    /// First bit in the slave's memory.
    physical: u64,
    /// Whether logical reads reach it.
    pub reads: bool,
    /// Whether logical writes reach it.
    pub writes: bool,
}

/// A run of bits that a datagram and a slave share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overlap {
    /// First bit in the datagram's data.
    pub data: usize,
    /// First bit in the slave's memory.
    pub memory: usize,
    /// How many bits.
    pub bits: usize,
}

impl Overlap {
    /// First byte of the slave that it touches, and one past the last.
    pub fn bytes(&self) -> (usize, usize) {
        (self.memory / 8, (self.memory + self.bits).div_ceil(8))
    }
}

impl Fmmu {
    /// The unit `index` of a slave's `memory`; `None` if it is not active.
    pub fn of(memory: &[u8], index: usize) -> Option<Self> {
        let at = usize::from(FMMU) + 16 * index.min(FMMUS - 1);
        if word(memory, at + 12) & 1 == 0 {
            return None;
        }
        let bit = |offset: usize| u64::from(word(memory, at + offset) & 0x07);
        let length = u64::from(word(memory, at + 4));
        let kind = word(memory, at + 11);
        let bits = (8 * length + bit(7)).checked_sub(bit(6) + 7)?;
        Some(Self {
            start: 8 * u64::from(double_word(memory, at)) + bit(6),
            bits,
            physical: 8 * u64::from(word(memory, at + 8)) + bit(10),
            reads: kind & 1 != 0,
            writes: kind & 2 != 0,
        })
    }

    /// What of it `length` bytes at `logical` reach.
    pub fn overlap(&self, logical: u32, length: usize) -> Option<Overlap> {
        let first = 8 * u64::from(logical);
        let last = first + 8 * length as u64;
        let (from, to) = (first.max(self.start), last.min(self.start + self.bits));
        (from < to).then(|| Overlap {
            data: (from - first) as usize,
            memory: (self.physical + from - self.start) as usize,
            bits: (to - from) as usize,
        })
    }
}

/// Copies `bits` bits from bit `from` of `source` to bit `to` of `target`; what is beyond either is left out.
pub fn copy_bits(source: &[u8], from: usize, target: &mut [u8], to: usize, bits: usize) {
    if from.is_multiple_of(8) && to.is_multiple_of(8) && bits.is_multiple_of(8) {
        let bytes = source.iter().skip(from / 8).take(bits / 8);
        target.iter_mut().skip(to / 8).zip(bytes).for_each(|(to, from)| *to = *from);
        return;
    }
    for bit in 0..bits {
        let value = source.get((from + bit) / 8).map(|byte| byte >> ((from + bit) % 8) & 1);
        if let (Some(value), Some(byte)) = (value, target.get_mut((to + bit) / 8)) {
            let mask = 1 << ((to + bit) % 8);
            *byte = if value == 1 { *byte | mask } else { *byte & !mask };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_maps_bits_within_a_byte() {
        let mut memory = vec![0; 0x800];
        // Bits 4 to 6 of logical byte 0x1000 are bits 1 to 3 of byte 0x1100.
        memory[0x600..0x610]
            .copy_from_slice(&[0, 0x10, 0, 0, 1, 0, 4, 6, 0, 0x11, 1, 2, 1, 0, 0, 0]);
        let unit = Fmmu::of(&memory, 0);
        let overlap = unit.and_then(|unit| unit.overlap(0x0FFF, 4));
        assert_eq!(overlap, Some(Overlap { data: 12, memory: 8 * 0x1100 + 1, bits: 3 }));
        assert_eq!(unit.and_then(|unit| unit.overlap(0x1001, 4)), None);
        let mut target = [0xFF, 0x00];
        copy_bits(&[0b0101_0000], 4, &mut target, 1, 3);
        assert_eq!(target, [0b1111_1011, 0]);
    }
}
