//! The process data of a drive: what is mapped, and where it stands.

/// An object in the process data: index and bits, of sub-index 0.
type Entry = (u16, u8);

/// What a drive is sent: control word, mode, target position, target velocity, target torque, velocity offset,
/// torque offset.
pub const OUTPUTS: [Entry; 7] = [
    (0x6040, 16),
    (0x6060, 8),
    (0x607a, 32),
    (0x60ff, 32),
    (0x6071, 16),
    (0x60b1, 32),
    (0x60b2, 16),
];

/// What a drive sends: status word, mode, position, velocity, torque, error code, following error.
pub const INPUTS: [Entry; 7] = [
    (0x6041, 16),
    (0x6061, 8),
    (0x6064, 32),
    (0x606c, 32),
    (0x6077, 16),
    (0x603f, 16),
    (0x60f4, 32),
];

/// What a drive sends beside that where inputs of the machine are among its own: digital inputs.
pub const DIGITAL: Entry = (0x60fd, 32);

/// The mapping entry of an object.
pub fn entry((index, bits): Entry) -> u32 {
    u32::from(index) << 16 | u32::from(bits)
}

/// What a drive is told, in its own units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Told {
    /// Control word.
    pub control: u16,
    /// Mode of operation.
    pub mode: i8,
    /// Target position [counts].
    pub position: i32,
    /// Target velocity [counts/s].
    pub velocity: i32,
    /// Target torque [rated/1000].
    pub torque: i16,
    /// What is added to a torque that the drive makes by itself [rated/1000].
    pub torque_offset: i16,
}

/// What a drive says, in its own units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Said {
    /// Status word.
    pub status: u16,
    /// Mode of operation.
    pub mode: i8,
    /// Position [counts].
    pub position: i32,
    /// Torque [rated/1000].
    pub torque: i16,
    /// Error code.
    pub error: u16,
    /// Digital inputs, where they are mapped: bit 0 is the negative limit switch, 1 the positive one, 2 the home switch.
    pub digital: u32,
}

/// Bytes of [`OUTPUTS`] and of [`INPUTS`].
pub const LENGTH: usize = 19;

impl Told {
    /// Writes it into a drive's outputs; does nothing where they are shorter than [`LENGTH`].
    pub fn write(&self, to: &mut [u8]) {
        let Some(to) = to.first_chunk_mut::<LENGTH>() else { return };
        let mut at = 0;
        let mut put = |bytes: &[u8]| {
            let end = at + bytes.len();
            if let Some(place) = to.get_mut(at..end) {
                place.copy_from_slice(bytes);
            }
            at = end;
        };
        put(&self.control.to_le_bytes());
        put(&self.mode.to_le_bytes());
        put(&self.position.to_le_bytes());
        put(&self.velocity.to_le_bytes());
        put(&self.torque.to_le_bytes());
        put(&[0; 4]);
        put(&self.torque_offset.to_le_bytes());
    }
}

impl Said {
    /// Reads it from a drive's inputs; `None` where they are shorter than [`LENGTH`].
    pub fn read(from: &[u8]) -> Option<Self> {
        let (data, behind) = from.split_first_chunk::<LENGTH>()?;
        let [s0, s1, mode, p0, p1, p2, p3, _, _, _, _, t0, t1, e0, e1, ..] = *data;
        Some(Self {
            status: u16::from_le_bytes([s0, s1]),
            mode: mode as i8,
            position: i32::from_le_bytes([p0, p1, p2, p3]),
            torque: i16::from_le_bytes([t0, t1]),
            error: u16::from_le_bytes([e0, e1]),
            digital: behind.first_chunk().copied().map_or(0, u32::from_le_bytes),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_those_of_the_objects() {
        for entries in [OUTPUTS, INPUTS] {
            let bits: usize = entries.iter().map(|(_, bits)| usize::from(*bits)).sum();
            assert_eq!(bits, LENGTH * 8);
        }
        assert_eq!(entry((0x607a, 32)), 0x607a_0020);
    }

    #[test]
    fn each_number_stands_at_its_place() {
        let told = Told {
            control: 0x1234,
            mode: 8,
            position: -2,
            velocity: 0x0102_0304,
            torque: -3,
            torque_offset: 5,
        };
        let mut bytes = [0xee; LENGTH];
        told.write(&mut bytes);
        assert_eq!(
            bytes,
            [0x34, 0x12, 8, 0xfe, 0xff, 0xff, 0xff, 4, 3, 2, 1, 0xfd, 0xff, 0, 0, 0, 0, 5, 0]
        );
        let inputs = [0x37, 0x12, 9, 1, 0, 0, 0x80, 7, 7, 7, 7, 0xff, 0xff, 0x11, 0x86, 9, 9, 9, 9];
        let said = Said::read(&inputs).unwrap_or_default();
        assert_eq!((said.status, said.mode, said.torque), (0x1237, 9, -1));
        assert_eq!((said.position, said.error), (i32::MIN + 1, 0x8611));
        assert_eq!(said.digital, 0);
        assert_eq!(Said::read(&inputs[1..]), None);
        let more = [&inputs[..], &[5, 0, 1, 0]].concat();
        assert_eq!(Said::read(&more).map(|said| said.digital), Some(0x0001_0005));
    }
}
