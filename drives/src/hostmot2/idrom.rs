//! What a board is: its name, its modules and its pins, read from the board itself and checked.

use super::asking::Asking;
use crate::link::Link;

/// What stands at [`COOKIE_AT`] of every HostMot2 board, and the name behind it.
const COOKIE: u32 = 0x55aa_cafe;
const COOKIE_AT: u16 = 0x0100;
const NAME: [u32; 2] = [u32::from_le_bytes(*b"HOST"), u32::from_le_bytes(*b"MOT2")];
/// Words of the IDROM's head.
const HEAD: u16 = 16;
/// Module descriptors at most, of 3 words.
const MODULES: u16 = 32;
/// Pins at most.
const PINS: u32 = 144;

/// Why a board is not taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BoardError {
    /// Nobody answers.
    #[error("no answer")]
    Silent,
    /// It answers, but is no HostMot2 board.
    #[error("what answers is no HostMot2 board: {0}")]
    Foreign(String),
    /// Its description contradicts itself.
    #[error("the board `{board}` describes itself wrongly: {what}")]
    Inconsistent {
        /// Its name.
        board: String,
        /// What is wrong.
        what: String,
    },
    /// It lacks a module, or an instance.
    #[error("the board `{board}` has {found}, and the machine file uses {wanted}")]
    Lacking {
        /// Its name.
        board: String,
        /// What it has of the kind.
        found: String,
        /// What is asked for.
        wanted: String,
    },
}

/// A kind of module that the port uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Makes all pins inputs when nobody feeds it.
    Watchdog = 2,
    /// The pins.
    IoPort = 3,
    /// Counts encoders.
    Encoder = 4,
    /// Makes steps.
    Stepgen = 5,
    /// Makes pulse widths.
    Pwm = 6,
    /// A clock with timers.
    Dpll = 26,
    /// An interface to a scan head.
    Xy2mod = 43,
    /// Makes single pulses.
    Oneshot = 199,
}

impl Kind {
    /// What it is called in the machine file, or in the manuals of the boards.
    pub fn name(self) -> &'static str {
        match self {
            Self::Watchdog => "watchdog",
            Self::IoPort => "ioport",
            Self::Encoder => "encoder",
            Self::Stepgen => "stepgen",
            Self::Pwm => "pwm",
            Self::Dpll => "dpll",
            Self::Xy2mod => "xy2mod",
            Self::Oneshot => "oneshot",
        }
    }

    /// Registers that the port counts on.
    fn registers(self) -> u8 {
        match self {
            Self::Watchdog => 3,
            Self::IoPort | Self::Pwm | Self::Encoder => 5,
            Self::Oneshot => 6,
            Self::Dpll => 7,
            Self::Stepgen => 10,
            Self::Xy2mod => 11,
        }
    }
}

/// A module of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Module {
    tag: u8,
    /// How many instances it has.
    pub instances: u8,
    /// What it counts by [Hz].
    pub clock: u32,
    base: u16,
    registers: u8,
    register_stride: u16,
    instance_stride: u16,
}

impl Module {
    /// A module that is alone on its board, by a clock of `hertz`.
    #[cfg(test)]
    pub(super) fn for_tests(hertz: u32) -> Self {
        let (register_stride, instance_stride) = (0x100, 4);
        Self {
            tag: 0,
            instances: 8,
            clock: hertz,
            base: 0,
            registers: 16,
            register_stride,
            instance_stride,
        }
    }

    /// The address of the register `index` of `instance`.
    pub fn address(&self, index: u16, instance: u32) -> u16 {
        let offset = u32::from(index) * u32::from(self.register_stride)
            + instance * u32::from(self.instance_stride);
        self.base.wrapping_add(offset as u16)
    }
}

/// What a pin is wired to inside the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Pin {
    function: u8,
    tag: u8,
    unit: u8,
}

/// A board as it describes itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Board {
    /// Its name.
    pub name: String,
    /// Pins of a connector.
    pub port_width: u32,
    modules: Vec<Module>,
    pins: Vec<Pin>,
}

impl Board {
    /// Asks the board behind `link`.
    ///
    /// # Errors
    /// Nobody there, somebody else, or a board whose words contradict each other.
    pub fn read(link: &mut dyn Link) -> Result<Self, BoardError> {
        let mut asking = Asking::new(link);
        let name = asking.name()?;
        let start = asking.words(COOKIE_AT, 4)?;
        let [cookie, first, second, idrom] = start.as_slice() else {
            return Err(BoardError::Silent);
        };
        if *cookie != COOKIE || [*first, *second] != NAME {
            return Err(BoardError::Foreign(format!("its cookie is {cookie:#010x}")));
        }
        let wrong = |what: String| BoardError::Inconsistent { board: name.clone(), what };
        let idrom = u16::try_from(*idrom).map_err(|_| wrong("no IDROM".to_owned()))?;
        let head = asking.words(idrom, HEAD)?;
        let at = |index: usize| head.get(index).copied().unwrap_or(0);
        if !(2..=3).contains(&at(0)) {
            return Err(wrong(format!("an IDROM of the unknown type {}", at(0))));
        }
        let (count, port_width) = (at(8), at(9));
        if count > PINS || !(1..=32).contains(&port_width) || count % port_width != 0 {
            return Err(wrong(format!("{count} pins on connectors of {port_width}")));
        }
        let clocks = [at(10), at(11)];
        if clocks.iter().any(|clock| !(1_000_000..=1_000_000_000).contains(clock)) {
            return Err(wrong(format!("clocks of {clocks:?} Hz")));
        }
        let strides = [at(12), at(13), at(14), at(15)];
        let descriptors = asking.words(idrom.wrapping_add(at(1) as u16), 3 * MODULES)?;
        let modules = descriptors
            .as_chunks::<3>()
            .0
            .iter()
            .take_while(|words| words[0] & 0xff != 0)
            .map(|words| module(words, clocks, strides));
        let modules = modules.collect::<Result<Vec<_>, String>>().map_err(&wrong)?;
        let pins = asking.words(idrom.wrapping_add(at(2) as u16), count as u16)?;
        let pins = pins.into_iter().map(|word| {
            let [function, tag, unit, _] = word.to_le_bytes();
            Pin { function, tag, unit }
        });
        let pins = pins.collect();
        Ok(Self { name, port_width, modules, pins })
    }

    /// The module of `kind`, with the instance `unit`.
    ///
    /// # Errors
    /// There is none, it has fewer instances, or fewer registers than are known.
    pub fn module(&self, kind: Kind, unit: u32) -> Result<Module, BoardError> {
        let name = kind.name();
        let lacking = |found: String| BoardError::Lacking {
            board: self.name.clone(),
            found,
            wanted: format!("{name} {unit}"),
        };
        let module = self.modules.iter().find(|module| module.tag == kind as u8);
        let module = module.ok_or_else(|| lacking(format!("no {name}")))?;
        if module.registers < kind.registers() {
            return Err(BoardError::Inconsistent {
                board: self.name.clone(),
                what: format!("a {name} with {} registers", module.registers),
            });
        }
        if unit >= u32::from(module.instances) {
            let last = i32::from(module.instances) - 1;
            return Err(lacking(format!("{name} 0 to {last}")));
        }
        Ok(*module)
    }

    /// The pin that is the output `function` of the instance `unit` of `kind`.
    ///
    /// # Errors
    /// The firmware brings it to no pin.
    pub fn output(&self, kind: Kind, unit: u32, function: u8) -> Result<u32, BoardError> {
        self.pin(kind, unit, function | OUTPUT).ok_or_else(|| BoardError::Lacking {
            board: self.name.clone(),
            found: format!("no pin for output {function} of {} {unit}", kind.name()),
            wanted: "it".to_owned(),
        })
    }

    /// Pins that are outputs of the instance `unit` of `kind`, whatever they carry.
    pub fn outputs(&self, kind: Kind, unit: u32) -> impl Iterator<Item = u32> {
        let own = move |pin: &Pin| pin.tag == kind as u8 && u32::from(pin.unit) == unit;
        let pins = self.pins.iter().zip(0..);
        pins.filter(move |(pin, _)| own(pin) && pin.function & OUTPUT != 0).map(|(_, index)| index)
    }

    /// Connectors.
    pub fn ports(&self) -> u32 {
        self.pins.len() as u32 / self.port_width.max(1)
    }

    fn pin(&self, kind: Kind, unit: u32, function: u8) -> Option<u32> {
        let own = |pin: &Pin| {
            pin.tag == kind as u8 && u32::from(pin.unit) == unit && pin.function == function
        };
        self.pins.iter().zip(0..).find(|(pin, _)| own(pin)).map(|(_, index)| index)
    }
}

/// Bit of a pin's function that makes it an output.
const OUTPUT: u8 = 0x80;

/// The module that three words describe.
fn module(words: &[u32; 3], clocks: [u32; 2], strides: [u32; 4]) -> Result<Module, String> {
    let [tag, _version, clock, instances] = words[0].to_le_bytes();
    let clock = match clock {
        1 => clocks[0],
        2 => clocks[1],
        other => return Err(format!("a module {tag} by the unknown clock {other}")),
    };
    let stride = |which: u32, of: [u32; 2]| match which {
        0 => Ok(of[0] as u16),
        1 => Ok(of[1] as u16),
        other => Err(format!("a module {tag} with the unknown stride {other}")),
    };
    let [instance_0, instance_1, register_0, register_1] = strides;
    Ok(Module {
        tag,
        instances,
        clock,
        base: words[1] as u16,
        registers: (words[1] >> 16) as u8,
        register_stride: stride(words[1] >> 24 & 0xf, [register_0, register_1])?,
        instance_stride: stride(words[1] >> 28, [instance_0, instance_1])?,
    })
}
