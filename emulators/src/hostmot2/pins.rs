//! The pins: what each is connected to, and whether it is high.
//!
//! An input that nothing drives is pulled high. So is every pin after power-on, and from a bite of the
//! watchdog until its direction is written again.

use super::layout::{PINS, PORT_WIDTH, PORTS};

/// Registers by their number.
mod register {
    pub(super) const DATA: u16 = 0;
    pub(super) const DIRECTION: u16 = 1;
    pub(super) const SOURCE: u16 = 2;
    pub(super) const OPEN_DRAIN: u16 = 3;
    pub(super) const INVERT: u16 = 4;
}

/// The pins of one connector, one bit each.
#[derive(Debug, Clone, Copy)]
struct Port {
    data: u32,
    /// 1 an output.
    direction: u32,
    /// 1 from a module.
    source: u32,
    open_drain: u32,
    invert: u32,
    /// What stands outside at the inputs.
    outside: u32,
}

const POWERED: Port = Port {
    data: 0,
    direction: 0,
    source: 0,
    open_drain: 0,
    invert: 0,
    outside: (1 << PORT_WIDTH) - 1,
};

/// All pins.
#[derive(Debug, Clone)]
pub struct Pins {
    ports: [Port; PORTS],
}

impl Default for Pins {
    fn default() -> Self {
        Self { ports: [POWERED; PORTS] }
    }
}

impl Pins {
    /// The register `index` of the connector `port`; `signals` are what the modules put out.
    pub fn read(&self, index: u16, port: usize, signals: &[bool; PINS]) -> u32 {
        let Some(pins) = self.ports.get(port) else { return 0 };
        match index {
            register::DATA => (0..PORT_WIDTH).fold(0, |word, bit| {
                let pin = port * PORT_WIDTH + bit;
                let signal = signals.get(pin).copied().unwrap_or(false);
                word | u32::from(self.level(pin, signal)) << bit
            }),
            register::DIRECTION => pins.direction,
            register::SOURCE => pins.source,
            register::OPEN_DRAIN => pins.open_drain,
            register::INVERT => pins.invert,
            _ => 0,
        }
    }

    /// Writes the register `index` of the connector `port`.
    pub fn write(&mut self, index: u16, port: usize, value: u32) {
        let Some(pins) = self.ports.get_mut(port) else { return };
        match index {
            register::DATA => pins.data = value,
            register::DIRECTION => pins.direction = value,
            register::SOURCE => pins.source = value,
            register::OPEN_DRAIN => pins.open_drain = value,
            register::INVERT => pins.invert = value,
            _ => {}
        }
    }

    /// Whether `pin` is high, where its module puts `signal` out.
    pub fn level(&self, pin: usize, signal: bool) -> bool {
        let Some((port, bit)) = self.place(pin) else { return true };
        if port.direction & bit == 0 {
            return port.outside & bit != 0;
        }
        let value = if port.source & bit == 0 { port.data & bit != 0 } else { signal };
        // With an open drain it is pulled high where it is not driven low.
        value != (port.invert & bit != 0)
    }

    /// Whether `pin` is an output of its module.
    pub fn connected(&self, pin: usize) -> bool {
        self.place(pin).is_some_and(|(port, bit)| port.direction & port.source & bit != 0)
    }

    /// Whether `pin` is turned over on its way out.
    pub fn inverted(&self, pin: usize) -> bool {
        self.place(pin).is_some_and(|(port, bit)| port.invert & bit != 0)
    }

    /// Drives `pin` from outside, where it is an input.
    pub fn drive(&mut self, pin: usize, high: bool) {
        let Some(port) = self.ports.get_mut(pin / PORT_WIDTH) else { return };
        let bit = 1 << (pin % PORT_WIDTH);
        port.outside = if high { port.outside | bit } else { port.outside & !bit };
    }

    /// Makes all pins inputs.
    pub fn release(&mut self) {
        for port in &mut self.ports {
            port.direction = 0;
        }
    }

    fn place(&self, pin: usize) -> Option<(&Port, u32)> {
        Some((self.ports.get(pin / PORT_WIDTH)?, 1 << (pin % PORT_WIDTH)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOTHING: [bool; PINS] = [false; PINS];

    #[test]
    fn an_undriven_pin_is_high() {
        let mut pins = Pins::default();
        assert!(pins.level(5, false));
        assert_eq!(pins.read(register::DATA, 0, &NOTHING), 0x00ff_ffff);
        pins.drive(5, false);
        assert_eq!(pins.read(register::DATA, 0, &NOTHING), 0x00ff_ffdf);
    }

    #[test]
    fn an_output_is_its_data_or_its_module_and_may_be_turned_over() {
        let mut pins = Pins::default();
        pins.write(register::DIRECTION, 1, 0b111);
        pins.write(register::SOURCE, 1, 0b010);
        pins.write(register::DATA, 1, 0b001);
        pins.write(register::INVERT, 1, 0b100);
        let levels = [0, 1, 2].map(|bit| pins.level(PORT_WIDTH + bit, true));
        assert_eq!(levels, [true, true, true]);
        let levels = [0, 1, 2].map(|bit| pins.level(PORT_WIDTH + bit, false));
        assert_eq!(levels, [true, false, true]);
        assert_eq!([0, 1, 2].map(|bit| pins.connected(PORT_WIDTH + bit)), [false, true, false]);
    }

    #[test]
    fn released_they_are_all_high() {
        let mut pins = Pins::default();
        pins.write(register::DIRECTION, 0, 0xff_ffff);
        assert!(!pins.level(3, false));
        pins.release();
        assert!(pins.level(3, false));
    }
}
