//! Which motors stick and which slide through a smooth stretch of the motion.

use nalgebra::SVector;

/// One motor and its friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Contact {
    /// There is no Coulomb friction.
    Frictionless,
    /// At rest, and held there.
    Held,
    /// Sliding in the direction of this sign.
    Sliding(f64),
}

/// The contacts of all motors through one smooth stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contacts<const N: usize> {
    contact: [Contact; N],
    torque: SVector<f64, N>,
    free: SVector<f64, N>,
    held: usize,
}

impl<const N: usize> Contacts<N> {
    /// Of motors without friction.
    pub(super) fn new() -> Self {
        Self {
            contact: [Contact::Frictionless; N],
            torque: SVector::zeros(),
            free: SVector::repeat(1.0),
            held: 0,
        }
    }

    /// Puts `motor` into `contact`, against `coulomb` friction torque [N·m].
    pub(super) fn set(&mut self, motor: usize, contact: Contact, coulomb: f64) {
        self.contact[motor] = contact;
        (self.torque[motor], self.free[motor]) = match contact {
            Contact::Frictionless => (0.0, 1.0),
            Contact::Held => (0.0, 0.0),
            Contact::Sliding(sign) => (coulomb * sign, 1.0),
        };
        self.held = self.contact.iter().filter(|contact| **contact == Contact::Held).count();
    }

    /// The contact of `motor`.
    pub(super) fn of(&self, motor: usize) -> Contact {
        self.contact[motor]
    }

    /// Coulomb torque against each motor [N·m].
    pub fn torque(&self) -> &SVector<f64, N> {
        &self.torque
    }

    /// 1 for a motor that can move, 0 for one that is held.
    pub fn free(&self) -> &SVector<f64, N> {
        &self.free
    }

    /// Whether any motor is held.
    pub fn any_held(&self) -> bool {
        self.held != 0
    }
}
