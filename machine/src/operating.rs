//! What a person needs to operate a machine: its switches and outputs, how its axes find their reference,
//! and what an open door or an emergency stop does.

use crate::actuator::Actuator;
use crate::modbus::Device;

/// The most digital inputs, and the most outputs: one bit each in a sample.
pub use messages::MAX_INPUTS;

/// Everything about operating a machine. The default has no input, and axes that know their place.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Operating {
    /// Its digital inputs, [`MAX_INPUTS`] at most; the first is bit 0 of a feedback's `inputs`. Those that devices tell
    /// stand behind those of the port.
    pub inputs: Vec<Input>,
    /// Its digital outputs; the first is bit 0 of a command's `outputs`.
    pub outputs: Vec<Output>,
    /// What is asked over Modbus TCP.
    pub devices: Vec<Device>,
    /// How each axis finds its reference, in the order of the axes; `None` of one that knows its place from
    /// the start.
    pub homing: Vec<Option<Homing>>,
    /// What is done for safety.
    pub safety: Safety,
}

impl Operating {
    /// Leaves out the devices and their inputs: nothing beside the drives is asked.
    pub fn disconnect(&mut self) {
        if let Some(first) = self.devices.first() {
            self.inputs.truncate(first.input);
        }
        self.devices.clear();
    }

    /// How the axis with this index finds its reference.
    pub fn homing(&self, axis: usize) -> Option<&Homing> {
        self.homing.get(axis)?.as_ref()
    }

    /// The bit of each input with its function.
    pub fn bits(&self) -> impl Iterator<Item = (u64, &Input)> {
        self.inputs.iter().take(MAX_INPUTS).enumerate().map(|(index, input)| (1 << index, input))
    }

    /// The bits of all inputs with a function that `is_meant`.
    pub fn mask(&self, is_meant: impl Fn(&InputFunction) -> bool) -> u64 {
        let meant = self.bits().filter(|(_, input)| is_meant(&input.function));
        meant.fold(0, |mask, (bit, _)| mask | bit)
    }

    /// The bit of each output with its function.
    pub fn output_bits(&self) -> impl Iterator<Item = (u64, &Output)> {
        self.outputs.iter().take(MAX_INPUTS).enumerate().map(|(index, output)| (1 << index, output))
    }

    /// The bits of the outputs that open brakes.
    pub fn brakes(&self) -> u64 {
        let brakes = self.output_bits().filter(|(_, it)| it.function == OutputFunction::Brake);
        brakes.fold(0, |bits, (bit, _)| bits | bit)
    }

    /// The output with this name, and its index.
    pub fn output(&self, name: &str) -> Option<(usize, &Output)> {
        self.outputs.iter().enumerate().find(|(_, output)| output.name == name)
    }

    /// Whether the machine has the air assist that a job asks for: it has no outputs to speak of, or one for it.
    pub fn may_have_air(&self) -> bool {
        self.outputs.is_empty() || self.outputs.iter().any(|it| it.function == OutputFunction::Air)
    }

    /// How many digital outputs a job can switch beside the air assist; `None` where the file has no outputs.
    pub fn general_outputs(&self) -> Option<usize> {
        let general = self.outputs.iter().filter(|it| it.function == OutputFunction::General);
        (!self.outputs.is_empty()).then(|| general.count())
    }

    /// The input with this name, and its index.
    pub fn input(&self, name: &str) -> Option<(usize, &Input)> {
        self.inputs.iter().enumerate().find(|(_, input)| input.name == name)
    }
}

/// A digital input.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Its name in the machine file.
    pub name: String,
    /// What it says when it is active.
    pub function: InputFunction,
    /// Whether a low level is active; the port turns it round, so that 1 is active everywhere else.
    pub is_active_low: bool,
    /// Where it is active in the simulated plant.
    pub simulated: Option<SimulatedSwitch>,
}

/// A switch of the simulated plant: active beyond a place of an axis, towards one side. An index pulse is there,
/// and once for each turn of the motor from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulatedSwitch {
    /// The axis.
    pub axis: usize,
    /// Towards which end it is active.
    pub side: Side,
    /// From where on [m or rad].
    pub at: f64,
}

/// A digital output.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Its name in the machine file.
    pub name: String,
    /// What it switches.
    pub function: OutputFunction,
    /// Whether a low level switches it on.
    pub is_active_low: bool,
}

/// Which end of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Where its position is least.
    Lower,
    /// Where its position is greatest.
    Upper,
}

impl Side {
    /// −1 for the lower, 1 for the upper side.
    pub fn sign(self) -> f64 {
        match self {
            Self::Lower => -1.0,
            Self::Upper => 1.0,
        }
    }
}

/// What an input says. Axes are told by their index, actuators by theirs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputFunction {
    /// The reference switch of an axis, or of one of its actuators.
    Home {
        /// The axis.
        axis: usize,
        /// The actuator that it belongs to, where the axis has several.
        actuator: Option<usize>,
    },
    /// The index pulse of an actuator's encoder: active in a measurement when it was passed since the one before.
    Index {
        /// The axis.
        axis: usize,
        /// The actuator that it belongs to, where the axis has several.
        actuator: Option<usize>,
    },
    /// A hard limit switch.
    Limit {
        /// The axis.
        axis: usize,
        /// At which end.
        side: Side,
    },
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The door is open.
    Door,
    /// Something that light needs is missing.
    Interlock,
    /// Something that people should see to.
    Warning,
    /// The probe touches.
    Probe,
    /// Nothing that Graver knows of.
    General,
}

/// What an output switches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OutputFunction {
    /// The air assist, as a job says.
    Air,
    /// The extraction: on while a job is under way, and for so long after it [s].
    Extraction {
        /// How long after a job.
        after: f64,
    },
    /// The holding brakes: on opens them, and they are open while the motors are powered.
    Brake,
    /// A lamp, a horn, a relay: on in some states of the controller, one bit each by their number.
    Signal {
        /// The states.
        states: u32,
    },
    /// Anything else, as a job says: of these the first is its digital output 0.
    General,
}

/// How an axis finds its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homing {
    /// By what.
    pub method: HomingMethod,
    /// Towards which end it looks.
    pub side: Side,
    /// Speed of the search [m/s or rad/s].
    pub speed: f64,
    /// Speed at which the reference is taken [m/s or rad/s].
    pub latch_speed: f64,
    /// Where the axis is at its reference [m or rad].
    pub position: f64,
    /// Axes with a lower number go first, those with the same number together.
    pub order: u32,
    /// The current at which a motor counts as standing against its stop [A].
    pub current: f64,
    /// What its drive is told, where that finds the reference.
    pub drive: DriveHoming,
}

/// By what an axis finds its reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HomingMethod {
    /// The edge of its switch.
    Switch,
    /// The first index pulse after the edge of its switch.
    Index,
    /// A hard stop, known by the motor's current.
    HardStop,
    /// Its encoder is absolute.
    Absolute,
    /// Its drive finds it by a method of its own.
    Drive,
}

/// What a drive is told that finds its reference by itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveHoming {
    /// The number of its method, by CiA 402, as the axis counts.
    pub method: i8,
    /// Acceleration of its motion [m/s² or rad/s²].
    pub acceleration: f64,
}

impl DriveHoming {
    /// The number of the method that `actuator`'s drive is told: a mirrored one counts against its axis.
    pub fn method_of(&self, actuator: &Actuator) -> i8 {
        let mirrored = Self::mirrored(self.method).filter(|_| actuator.ratio < 0.0);
        mirrored.unwrap_or(self.method)
    }

    /// The number of the `method` with lower and upper exchanged; `None` where none is known.
    pub fn mirrored(method: i8) -> Option<i8> {
        // Pairs of CiA 402-2, 11.3: those of 1 to 14 are by an index pulse, those of 17 to 30 the same without.
        match method {
            1 | 17 | 33 => Some(method + 1),
            2 | 18 | 34 => Some(method - 1),
            3 | 4 | 19 | 20 => Some(method + 2),
            5 | 6 | 21 | 22 => Some(method - 2),
            7..=10 | 23..=26 => Some(method + 4),
            11..=14 | 27..=30 => Some(method - 4),
            35 | 37 => Some(method),
            _ => None,
        }
    }
}

/// What an emergency stop does, by the categories of IEC 60204-1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopCategory {
    /// The power goes at once.
    Zero,
    /// The axes are brought to rest, and then the power goes.
    One,
    /// The axes are brought to rest, and held there with power.
    Two,
}

/// What an open door does to a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DoorAction {
    /// It is held, and goes on when it is told to with the door closed.
    Hold,
    /// It is given up with a fault.
    Stop,
}

/// What is done for safety. None of it is a safety function: those are wired.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Safety {
    /// What an emergency stop does.
    pub estop: StopCategory,
    /// What an open door does.
    pub door: DoorAction,
    /// The most power of a test pulse, 0..=1.
    pub test_power: f64,
    /// The longest test pulse [s].
    pub test_time: f64,
    /// The most power with which the frame around a job is shown, 0..=1.
    pub frame_power: f64,
    /// How long a jog goes on without another word [s].
    pub dead_man: f64,
}

impl Default for Safety {
    fn default() -> Self {
        Self {
            estop: StopCategory::One,
            door: DoorAction::Hold,
            test_power: 0.1,
            test_time: 0.1,
            frame_power: 0.05,
            dead_man: 0.2,
        }
    }
}
