//! What stands where on the board: its modules with their registers, and what each pin is.

use super::clock::Clock;

/// The board's name, as its information space gives it. Its pins come in three connectors of 24.
pub const BOARD_NAME: &[u8; 16] = b"7I80HD-16\0\0\0\0\0\0\0";
/// The name in the IDROM.
pub const CONFIGURATION_NAME: &[u8; 8] = b"MESA7I80";
/// Connectors.
pub const PORTS: usize = 3;
/// Pins of a connector.
pub const PORT_WIDTH: usize = 24;
/// Pins of the board.
pub const PINS: usize = PORTS * PORT_WIDTH;

/// Step generators.
pub const STEPGENS: usize = 6;
/// Encoder counters.
pub const ENCODERS: usize = 6;
/// PWM generators.
pub const PWMGENS: usize = 6;
/// One-shots, of two timers each.
pub const ONESHOTS: usize = 4;
/// Interfaces to a scan head of two mirrors.
pub const XY2MODS: usize = 1;

/// From one register of a module to the next [bytes].
pub const REGISTER_STRIDE: u16 = 0x100;
/// From one instance of a module to the next, inside a register [bytes].
pub const INSTANCE_STRIDE: u16 = 4;

/// What a module does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Makes all pins inputs when nobody feeds it.
    Watchdog,
    /// The pins themselves.
    IoPort,
    /// Counts the edges of encoders.
    Encoder,
    /// Steps and directions.
    Stepgen,
    /// Pulse widths.
    Pwmgen,
    /// Timers that follow the arrival of packets.
    Dpll,
    /// The positions of two mirrors by XY2-100.
    Xy2mod,
    /// The board's lights.
    Led,
    /// Pulses of a set delay and width.
    Oneshot,
}

/// A module: what its descriptor in the IDROM says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Descriptor {
    /// What it does.
    pub kind: Kind,
    /// Its general function tag.
    pub tag: u8,
    /// Version of its registers.
    pub version: u8,
    /// What it counts by.
    pub clock: Clock,
    /// How many instances there are.
    pub instances: u8,
    /// Address of its first register.
    pub base: u16,
    /// How many registers it says that it has. Some have one more, by which the DPLL samples them.
    pub registers: u8,
    /// Which registers each instance has, one bit each; of the others there is one for all.
    pub multiple: u32,
}

/// The modules, in the order of the IDROM.
pub const MODULES: [Descriptor; 9] = [
    module(Kind::Watchdog, 2, 0, Clock::Low, 1, 0x0c00, 3, 0),
    module(Kind::IoPort, 3, 0, Clock::Low, PORTS, 0x1000, 5, 0x1f),
    module(Kind::Dpll, 26, 0, Clock::Low, 1, 0x7000, 7, 0),
    module(Kind::Encoder, 4, 2, Clock::Low, ENCODERS, 0x3000, 5, 0x03),
    module(Kind::Stepgen, 5, 2, Clock::Low, STEPGENS, 0x2000, 10, 0x1ff),
    module(Kind::Pwmgen, 6, 0, Clock::High, PWMGENS, 0x4000, 5, 0x03),
    module(Kind::Xy2mod, 43, 0, Clock::Low, XY2MODS, 0x5000, 11, 0x1ff),
    module(Kind::Oneshot, 199, 0, Clock::Low, ONESHOTS, 0x6000, 6, 0x3f),
    module(Kind::Led, 128, 0, Clock::Low, 1, 0x0200, 1, 0),
];

#[allow(clippy::too_many_arguments, reason = "a table's columns")]
const fn module(
    kind: Kind,
    tag: u8,
    version: u8,
    clock: Clock,
    instances: usize,
    base: u16,
    registers: u8,
    multiple: u32,
) -> Descriptor {
    Descriptor { kind, tag, version, clock, instances: instances as u8, base, registers, multiple }
}

impl Kind {
    /// Its line of [`MODULES`].
    pub fn descriptor(self) -> &'static Descriptor {
        MODULES.iter().find(|module| module.kind == self).unwrap_or(&MODULES[0])
    }
}

/// A register of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register {
    /// Of which module.
    pub kind: Kind,
    /// Its number in the module.
    pub index: u16,
    /// Of which instance; 0 where there is one for all.
    pub instance: usize,
}

impl Register {
    /// What stands at `address`, if anything does.
    pub fn at(address: u16) -> Option<Self> {
        MODULES.iter().find_map(|module| {
            let offset = address.checked_sub(module.base)?;
            let (index, inside) = (offset / REGISTER_STRIDE, offset % REGISTER_STRIDE);
            let sampled = matches!(module.kind, Kind::Encoder | Kind::Stepgen);
            let registers = u16::from(module.registers) + u16::from(sampled);
            (index < registers).then_some(Self {
                kind: module.kind,
                index,
                instance: usize::from(inside / INSTANCE_STRIDE),
            })
        })
    }
}

/// What a pin is beside an input or output of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    /// Nothing else.
    Gpio,
    /// An output of a stepgen: 1 steps, 2 direction.
    Stepgen(u8, usize),
    /// An input of an encoder: 1 A, 2 B, 3 index.
    Encoder(u8, usize),
    /// An output of a PWM generator: 1 pulses, 2 direction.
    Pwmgen(u8, usize),
    /// The enable of a PWM generator, low where it is enabled.
    PwmEnable(usize),
    /// An output of a one-shot: 3 of its first timer, 4 of its second.
    Oneshot(u8, usize),
    /// A line to the scan head: 1 and 2 data of its mirrors, 3 clock, 4 synchronisation.
    Xy2mod(u8, usize),
}

impl Function {
    /// Its pin descriptor: secondary pin, secondary tag, unit, primary tag.
    pub const fn descriptor(self) -> [u8; 4] {
        const OUTPUT: u8 = 0x80;
        let (pin, tag, unit) = match self {
            Self::Gpio => (0, 0, 0),
            Self::Encoder(pin, unit) => (pin, 4, unit),
            Self::Stepgen(pin, unit) => (pin | OUTPUT, 5, unit),
            Self::Pwmgen(pin, unit) => (pin | OUTPUT, 6, unit),
            Self::PwmEnable(unit) => (3 | OUTPUT, 6, unit),
            Self::Oneshot(pin, unit) => (pin | OUTPUT, 199, unit),
            Self::Xy2mod(pin, unit) => (pin | OUTPUT, 43, unit),
        };
        [pin, tag, unit as u8, 3]
    }
}

/// What each pin is: the first connector has steps and one-shots, the second encoders and inputs, the third
/// PWM and mirrors.
pub fn functions() -> [Function; PINS] {
    let mut functions = [Function::Gpio; PINS];
    let (first, rest) = functions.split_at_mut(PORT_WIDTH);
    let (second, third) = rest.split_at_mut(PORT_WIDTH);
    let fill = |pins: &mut [Function], given: &mut dyn Iterator<Item = Function>| {
        for (pin, function) in pins.iter_mut().zip(given) {
            *pin = function;
        }
    };
    let steps =
        (0..STEPGENS).flat_map(|unit| [Function::Stepgen(1, unit), Function::Stepgen(2, unit)]);
    let shots =
        (0..ONESHOTS).flat_map(|unit| [Function::Oneshot(3, unit), Function::Oneshot(4, unit)]);
    fill(first, &mut steps.chain(shots));
    let encoders = (0..ENCODERS).flat_map(|unit| [1, 2, 3].map(|pin| Function::Encoder(pin, unit)));
    fill(second, &mut encoders.into_iter());
    let widths = (0..PWMGENS).flat_map(|unit| {
        [Function::Pwmgen(1, unit), Function::Pwmgen(2, unit), Function::PwmEnable(unit)]
    });
    let mirrors = (0..XY2MODS).flat_map(|unit| [1, 2, 3, 4].map(|pin| Function::Xy2mod(pin, unit)));
    fill(third, &mut widths.chain(mirrors));
    functions
}

/// The pin with `function`, if there is one.
pub fn pin_of(function: Function) -> Option<usize> {
    functions().iter().position(|pin| *pin == function)
}
