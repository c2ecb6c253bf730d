//! The part of the board's memory that says what the board is: cookie, name, IDROM with the descriptors of
//! modules and pins.

use super::clock::Clock;
use super::layout::{
    CONFIGURATION_NAME, INSTANCE_STRIDE, MODULES, PINS, PORT_WIDTH, PORTS, REGISTER_STRIDE,
    functions,
};

/// Where the IDROM starts.
const START: usize = 0x0400;
/// From there to the module descriptors.
const MODULES_OFFSET: usize = 0x40;
/// From there to the pin descriptors.
const PINS_OFFSET: usize = 0x200;
/// Its end: nothing else is read below the watchdog.
const END: usize = 0x0c00;

/// Addresses 0 to `END`, read only.
#[derive(Debug, Clone)]
pub struct Idrom(Vec<u8>);

impl Default for Idrom {
    fn default() -> Self {
        let mut memory = Writer(vec![0; END]);
        memory.word(0x0100, 0x55aa_cafe);
        memory.bytes(0x0104, b"HOSTMOT2");
        memory.word(0x010c, START as u32);

        let words = [
            16, // Size of the FPGA [thousand gates].
            256,
            PORTS as u32,
            PINS as u32,
            PORT_WIDTH as u32,
            Clock::Low.hertz(),
            Clock::High.hertz(),
            u32::from(INSTANCE_STRIDE),
            0x40,
            u32::from(REGISTER_STRIDE),
            4,
        ];
        memory.word(START, 3);
        memory.word(START + 4, MODULES_OFFSET as u32);
        memory.word(START + 8, PINS_OFFSET as u32);
        memory.bytes(START + 12, CONFIGURATION_NAME);
        for (index, word) in words.into_iter().enumerate() {
            memory.word(START + 20 + 4 * index, word);
        }
        for (index, module) in MODULES.iter().enumerate() {
            let at = START + MODULES_OFFSET + 12 * index;
            let first = [module.tag, module.version, module.clock.tag(), module.instances];
            memory.bytes(at, &first);
            memory.word(at + 4, u32::from(module.base) | u32::from(module.registers) << 16);
            memory.word(at + 8, module.multiple);
        }
        for (index, function) in functions().iter().enumerate() {
            memory.bytes(START + PINS_OFFSET + 4 * index, &function.descriptor());
        }
        Self(memory.0)
    }
}

impl Idrom {
    /// The word at `address`; `None` behind its end.
    pub fn word(&self, address: u16) -> Option<u32> {
        let word = self.0.get(usize::from(address)..)?.first_chunk::<4>()?;
        Some(u32::from_le_bytes(*word))
    }
}

struct Writer(Vec<u8>);

impl Writer {
    fn bytes(&mut self, at: usize, bytes: &[u8]) {
        if let Some(place) = self.0.get_mut(at..at + bytes.len()) {
            place.copy_from_slice(bytes);
        }
    }

    fn word(&mut self, at: usize, word: u32) {
        self.bytes(at, &word.to_le_bytes());
    }
}
