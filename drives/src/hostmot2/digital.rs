//! The machine's digital inputs and outputs, on pins that no module drives.

use machine::operating::{MAX_INPUTS, Operating};

use super::arming::{MOST_PORTS, Pins};
use super::idrom::{Board, BoardError};
use crate::port::Actuation;

/// An input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Input {
    pin: u32,
    is_active_low: bool,
}

/// An output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Output {
    pin: u32,
    is_active_low: bool,
}

/// All of them, in the order of the machine file, in which each has a bit.
#[derive(Debug, Clone, Default)]
pub struct Digital {
    inputs: Vec<Input>,
    /// `None` of those that are switched elsewhere.
    outputs: Vec<Option<Output>>,
}

impl Digital {
    /// Those of `operating` on the pins `inputs` and `outputs` of `board`, of which `pins` knows those that modules
    /// drive; all outputs are off.
    ///
    /// # Errors
    /// A pin that the board lacks, or that is an output already.
    pub fn new(
        board: &Board,
        pins: &mut Pins,
        operating: &Operating,
        (inputs, outputs): (&[u32], &[Option<u32>]),
    ) -> Result<Self, BoardError> {
        let mut digital = Self::default();
        let taken = |pin: u32, name: &str| BoardError::Lacking {
            board: board.name.clone(),
            found: format!(
                "the pins 0 to {}, some of which are outputs of modules or others",
                (board.ports() * board.port_width).saturating_sub(1)
            ),
            wanted: format!("pin {pin} as `{name}`"),
        };
        for (output, &pin) in operating.outputs.iter().zip(outputs) {
            let is_active_low = output.is_active_low;
            if let Some(pin) = pin.filter(|pin| !pins.own(*pin, is_active_low)) {
                return Err(taken(pin, &output.name));
            }
            digital.outputs.push(pin.map(|pin| Output { pin, is_active_low }));
        }
        for (input, &pin) in operating.inputs.iter().zip(inputs) {
            if !pins.is_input(pin) {
                return Err(taken(pin, &input.name));
            }
            digital.inputs.push(Input { pin, is_active_low: input.is_active_low });
        }
        Ok(digital)
    }

    /// Gives the outputs their levels under `actuation`.
    pub fn set(&self, pins: &mut Pins, actuation: &Actuation) {
        for (bit, output) in self.outputs.iter().enumerate().take(MAX_INPUTS) {
            let Some(output) = output else { continue };
            let is_on = actuation.outputs >> bit & 1 != 0;
            pins.set(output.pin, is_on != output.is_active_low);
        }
    }

    /// The inputs by the `levels` of connectors of `width` pins, 1 where they are active.
    pub fn active(&self, levels: &[u32; MOST_PORTS], width: u32) -> u64 {
        let is_active = |input: &Input| {
            let word = levels.get((input.pin / width) as usize).copied().unwrap_or(0);
            (word >> (input.pin % width) & 1 != 0) != input.is_active_low
        };
        let inputs = self.inputs.iter().take(MAX_INPUTS).enumerate();
        inputs.fold(0, |mask, (bit, input)| mask | u64::from(is_active(input)) << bit)
    }
}
