//! What a machine does in order: paths that are gone in one go, and what happens at rest between
//! them.

use std::sync::Arc;

use machine::kinematics::KinematicsError;
use nalgebra::Vector3;

use crate::geometry::contour::Contour;

/// One thing to do, and the line of the job file that asks for it, 0 for none.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Operation {
    pub(crate) kind: OperationKind,
    pub(crate) line: u64,
}

/// What is done.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum OperationKind {
    /// Go along a path without a stop.
    Path(Arc<Contour>),
    /// Move straight in the dark, from rest to rest.
    Rapid(Vector3<f64>),
    /// Stand still in the dark [s].
    Rest(f64),
    /// Light while the tool stands.
    Dot(Dot),
    /// Switch an output.
    Output { bit: u32, on: bool },
    /// Set the pulse repetition rate of the laser [pulses/s], 0 as the source is set.
    Frequency(f64),
    /// Wait for a person.
    Pause,
}

/// Light while the tool stands still.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Dot {
    pub(crate) at: Vector3<f64>,
    /// Times [s] and powers [fraction of full scale], one after the other.
    pub(crate) exposures: Vec<(f64, f64)>,
}

/// A place on the surface that is beyond an edge, and its line.
pub(crate) type OffSurface = (u64, KinematicsError);
