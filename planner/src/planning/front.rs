//! What the planning of a window changes, and where it can go back to.

use std::collections::VecDeque;
use std::sync::Arc;

use machine::Mechanism;
use nalgebra::Vector3;

use super::Planning;
use super::account::Account;
use super::path_run::PathRun;
use crate::geometry::contour::Contour;
use crate::joint_space::configuration::Configuration;
use crate::law::flight::State;
use crate::light::exposure::Light;
use crate::sampling::sampler::Sampler;
use crate::trajectory::Piece;
use crate::verify::checker::Checker;
use crate::verify::interpolation::InterpolationCheck;

/// What the planning of a window changes.
#[derive(Clone)]
pub(super) struct Front<const N: usize, M: Mechanism<N>> {
    pub(super) now: Configuration<N>,
    /// The tool's state where it does not rest.
    pub(super) moving: Option<State>,
    pub(super) run: Option<PathRun<N>>,
    /// Whether that goes on in the next operation.
    pub(super) goes_on: bool,
    /// How much longer it stands where it is [s].
    pub(super) standing: f64,
    /// Number of the next operation, and parts of a path that was divided.
    pub(super) next: usize,
    pub(super) parts: VecDeque<Arc<Contour>>,
    pub(super) time: f64,
    pub(super) outputs: u64,
    pub(super) light: Light,
    pub(super) line: u64,
    pub(super) sampler: Sampler<N, M>,
    pub(super) checker: Checker,
    pub(super) interpolation: Option<InterpolationCheck>,
    pub(super) samples: u64,
    /// The first rest, which belongs to the first window.
    pub(super) lead_in: Option<Piece>,
    /// How long the operations so far were estimated to take [s], and where the tool is after them
    /// [m].
    pub(super) estimated: f64,
    pub(super) place: Vector3<f64>,
    /// The least z that was written up to this path, and of it [m].
    pub(super) lowest: [f64; 2],
}

/// Where planning can go back to.
#[derive(Clone)]
pub(super) struct Checkpoint<const N: usize, M: Mechanism<N>> {
    pub(super) front: Front<N, M>,
    pub(super) account: Account,
}

impl<const N: usize, M: Mechanism<N>> Checkpoint<N, M> {
    /// Stream time at which the next window begins [s].
    pub(super) fn time(&self) -> f64 {
        self.front.time
    }
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Where planning can be taken up again.
    pub(super) fn checkpoint(&self) -> Checkpoint<N, M> {
        Checkpoint { front: self.front.clone(), account: self.account.clone() }
    }

    /// Goes back to where `checkpoint` was taken.
    pub(super) fn restore(&mut self, checkpoint: Checkpoint<N, M>) {
        (self.front, self.account) = (checkpoint.front, checkpoint.account);
    }

    /// Lets go of what is needed no more when planning goes back to `oldest` at most.
    pub(super) fn release(&mut self, oldest: &Checkpoint<N, M>) {
        self.operations.release(oldest.front.next);
    }
}
