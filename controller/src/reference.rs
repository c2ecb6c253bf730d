//! Where the motors are in the machine: what they count, and what their references add to it.
//!
//! Drives counts from power-on. Of an axis that has to be homed the rest is unknown until it has found its
//! reference; until then the machine takes it to stand at its home. Everything in the controller is in the machine's
//! places; what goes to drives is in theirs.

use machine::Machine;
use machine::operating::HomingMethod;
use messages::{ActuatorArray, Command, Feedback, MAX_ACTUATORS};

/// How one motor's place is known.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Origin {
    /// Drives tells it.
    Told,
    /// Drives tells it but for this [rad].
    Absolute(f64),
    /// It has to be found, and is taken to be this until then [rad].
    Unknown(f64),
}

/// The references of a machine.
#[derive(Debug, Clone)]
pub struct Reference {
    origins: Vec<Origin>,
    /// What is added to a measured position [rad].
    offset: ActuatorArray,
    /// What is to be added to the offsets with the next feedback [rad].
    pending: Option<ActuatorArray>,
    /// Axes that know their place, one bit each.
    homed: u32,
    /// Those that know it from the start.
    known: u32,
    /// The run of drives that is counted in.
    epoch: Option<u64>,
    shifted: Feedback,
}

impl Reference {
    /// Of this machine.
    pub fn new(machine: &Machine) -> Self {
        let origin = |actuator: &machine::Actuator| {
            let home = machine.home_joints.get(actuator.axis).copied().unwrap_or_default();
            match machine.operating.homing(actuator.axis) {
                None => Origin::Told,
                Some(homing) if homing.method == HomingMethod::Absolute => {
                    Origin::Absolute(homing.position / actuator.ratio)
                }
                Some(_) => Origin::Unknown(home / actuator.ratio),
            }
        };
        let known = (0..machine.axes.len()).filter(|axis| {
            machine.operating.homing(*axis).is_none_or(|it| it.method == HomingMethod::Absolute)
        });
        let known = known.fold(0, |bits, axis| bits | bit(axis));
        Self {
            origins: machine.actuators.iter().take(MAX_ACTUATORS).map(origin).collect(),
            offset: [0.0; MAX_ACTUATORS],
            pending: None,
            homed: known,
            known,
            epoch: None,
            shifted: Feedback::default(),
        }
    }

    /// Axes that know their place, one bit each.
    pub fn homed(&self) -> u32 {
        self.homed
    }

    /// The first of `axes` that does not know its place.
    pub fn unknown(&self, axes: usize) -> Option<usize> {
        (0..axes).find(|axis| self.homed & bit(*axis) == 0)
    }

    /// The axis looks for its place: it does not know it until it is found.
    pub fn forget(&mut self, axis: usize) {
        self.homed &= !bit(axis) | self.known;
    }

    /// The axis knows its place from now on.
    pub fn found(&mut self, axis: usize) {
        self.homed |= bit(axis);
    }

    /// Adds `shift` [rad] to the offsets with the next feedback.
    pub fn shift(&mut self, shift: &ActuatorArray) {
        let pending = self.pending.get_or_insert([0.0; MAX_ACTUATORS]);
        pending.iter_mut().zip(shift).for_each(|(sum, shift)| *sum += shift);
    }

    /// What makes the places that drives tell those of the machine, for the actuators with a bit in `actuators` [rad].
    pub fn told(&self, actuators: u16) -> ActuatorArray {
        core::array::from_fn(|index| {
            let is_meant = actuators >> index & 1 != 0;
            if is_meant { -self.offset[index] } else { 0.0 }
        })
    }

    /// What was to be added, and is from now on.
    pub fn apply(&mut self) -> Option<ActuatorArray> {
        let shift = self.pending.take()?;
        self.offset.iter_mut().zip(&shift).for_each(|(offset, shift)| *offset += shift);
        Some(shift)
    }

    /// `feedback` in the machine's places. A new run of drives counts anew.
    pub fn locate<'a>(&'a mut self, feedback: &'a Feedback) -> &'a Feedback {
        if self.origins.iter().all(|origin| *origin == Origin::Told) {
            return feedback;
        }
        if self.epoch != Some(feedback.epoch) {
            self.epoch = Some(feedback.epoch);
            (self.homed, self.pending) = (self.known, None);
            for (index, origin) in self.origins.iter().enumerate() {
                self.offset[index] = match origin {
                    Origin::Told => 0.0,
                    Origin::Absolute(place) => *place,
                    Origin::Unknown(place) => place - feedback.position[index],
                };
            }
        }
        self.shifted = *feedback;
        self.shifted
            .position
            .iter_mut()
            .zip(&self.offset)
            .for_each(|(place, offset)| *place += offset);
        &self.shifted
    }

    /// Tells `command` in the places of drives.
    pub fn command(&self, command: &mut Command) {
        for (index, origin) in self.origins.iter().enumerate() {
            if *origin != Origin::Told {
                command.position[index] -= self.offset[index];
                command.reference[index] -= self.offset[index];
            }
        }
    }
}

/// The bit of an axis.
pub fn bit(axis: usize) -> u32 {
    1_u32.checked_shl(axis as u32).unwrap_or(0)
}
