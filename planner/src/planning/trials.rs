//! How a window that breaks a limit is planned again.

use machine::{Actuator, Axis};

use crate::error::PlanError;
use crate::limits::tightening::Tightening;
use crate::verify::checker::{LimitViolation, Quantity};

/// How often a window is planned again with less of a limit that it breaks, and how often after that
/// slower as a whole.
const TIGHTER: usize = 24;
const SLOWER: usize = 40;

/// A trial counts as so many where a motor gets too warm: what stays of that at a tenth of the speed is
/// friction.
const HEAT: usize = 4;

/// How much slower each of the latter is.
const SHARE: f64 = 0.85;

/// Why there is no next window.
#[derive(Debug)]
pub(super) enum Failure {
    /// What cannot be done.
    Here(PlanError),
    /// A limit that is broken whatever the window does: by the end of one before.
    Before(PlanError),
}

/// What a window may use of the limits, less with each trial.
#[derive(Debug, Clone)]
pub(super) struct Trials {
    shares: Tightening,
    count: usize,
    is_slower: bool,
}

impl Trials {
    /// The first, on a mechanism with so many axes.
    pub(super) fn new(axes: usize) -> Self {
        Self { shares: Tightening::none(axes), count: 0, is_slower: false }
    }

    pub(super) fn shares(&self) -> &Tightening {
        &self.shares
    }

    /// Leaves less of what was broken. Says whether that is worth another trial.
    pub(super) fn tighten(
        &mut self,
        violation: &LimitViolation,
        axes: &[Axis],
        actuators: &[Actuator],
    ) -> bool {
        let is_heat = violation.quantity == Quantity::HeatingCurrent;
        self.count += if is_heat { HEAT } else { 1 };
        if self.count > TIGHTER + SLOWER || violation.quantity.is_place() {
            return false;
        }
        if self.count > TIGHTER || is_heat {
            self.slow();
        } else {
            let index = violation.axis.as_ref().and_then(|name| {
                let driven = || actuators.iter().find(|actuator| actuator.name == *name);
                let axis = axes.iter().position(|axis| axis.name == *name);
                axis.or_else(|| driven().map(|actuator| actuator.axis))
            });
            self.shares.tighten(violation, index);
        }
        true
    }

    /// Goes slower as a whole.
    pub(super) fn slow(&mut self) {
        self.shares.slow(SHARE);
        self.is_slower = true;
    }

    /// Whether it went slower as a whole in any trial.
    pub(super) fn has_been_slowed(&self) -> bool {
        self.is_slower
    }
}
