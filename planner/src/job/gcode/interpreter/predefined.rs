//! The parameters that say where a program is and what is in force: those of LinuxCNC that have a
//! meaning here.

use super::{Interpreter, Modal};
use crate::job::gcode::codes::{FeedMode, INCH, Motion, Plane, Reference};
use crate::job::gcode::expression::{Parameters, Target};

/// Seconds in a minute.
const MINUTE: f64 = 60.0;

impl Parameters for Interpreter {
    fn numbered(&self, index: u32) -> Option<f64> {
        match index {
            5161..=5163 => Some(self.kept(0, (index - 5161) as usize)),
            5181..=5183 => Some(self.kept(1, (index - 5181) as usize)),
            5220 => Some(1.0 + self.modal.system as f64),
            5420..=5422 => Some(self.here((index - 5420) as usize)),
            5423..=5428 => Some(0.0),
            _ => self.parameters.numbered(index),
        }
    }

    fn named(&self, name: &str) -> Option<f64> {
        let Modal { unit, distance, feed_mode, .. } = self.modal;
        let truth = |is: bool| Some(f64::from(u8::from(is)));
        match name {
            "_x" => Some(self.here(0)),
            "_y" => Some(self.here(1)),
            "_z" => Some(self.here(2)),
            "_metric" => truth(unit != INCH),
            "_imperial" => truth(unit == INCH),
            "_absolute" => truth(distance == Reference::Absolute),
            "_incremental" => truth(distance == Reference::Incremental),
            "_inverse_time" => truth(feed_mode == FeedMode::InverseTime),
            "_units_per_minute" => truth(feed_mode == FeedMode::PerMinute),
            "_units_per_rev" | "_task" | "_mist" | "_current_tool" => Some(0.0),
            "_coord_system" => Some(match self.modal.system {
                system @ 0..6 => 540.0 + 10.0 * system as f64,
                system => 585.0 + system as f64,
            }),
            "_motion_mode" => Some(match self.modal.motion {
                None => 800.0,
                Some(Motion::Rapid) => 0.0,
                Some(Motion::Line) => 10.0,
                Some(Motion::Clockwise) => 20.0,
                Some(Motion::Counterclockwise) => 30.0,
            }),
            "_plane" => Some(match self.modal.plane {
                Plane::Xy => 170.0,
                Plane::Zx => 180.0,
                Plane::Yz => 190.0,
            }),
            "_feed" => Some(self.modal.feed.map_or(0.0, |feed| feed * MINUTE / unit)),
            "_rpm" => Some(self.modal.level.map_or(0.0, |level| level * self.words.full_scale)),
            "_spindle_on" => truth(self.modal.laser.is_some()),
            "_flood" => truth(self.modal.outputs & 1 == 1),
            "_line" => Some(self.tracer.line as f64),
            "_call_level" => Some(self.parameters.level() as f64),
            "_value" => Some(self.parameters.returned.unwrap_or(0.0)),
            "_value_returned" => truth(self.parameters.returned.is_some()),
            _ => self.parameters.named(name),
        }
    }
}

impl Interpreter {
    /// Sets a parameter that the program may set: its own, or a coordinate of the places of G28 and G30. Gives back
    /// whether there was room for it.
    pub(in crate::job::gcode) fn set(&mut self, target: Target, value: f64) -> bool {
        let (place, axis) = match target {
            Target::Numbered(index @ 5161..=5163) => (0, index - 5161),
            Target::Numbered(index @ 5181..=5183) => (1, index - 5181),
            target => return self.parameters.set(target, value),
        };
        self.modal.kept[place][axis as usize] = value * self.modal.unit;
        true
    }

    /// A coordinate of the place of G28 or G30, in the machine's coordinates and the program's units.
    fn kept(&self, place: usize, axis: usize) -> f64 {
        self.modal.kept[place][axis] / self.modal.unit
    }

    /// Where the program is along `axis`, in its own coordinates and units.
    fn here(&self, axis: usize) -> f64 {
        let (zero, unit) = (self.modal.zero(), self.modal.unit);
        (self.tracer.position[axis] - zero[axis]) / unit
    }
}
