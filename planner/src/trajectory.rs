//! A job as exact functions of time: pieces of motion, the instants at which the laser changes,
//! and those of outputs, frequencies and pauses.
//!
//! Position, velocity and acceleration are continuous over all pieces; the jerk steps. Stream time
//! starts with [`BEFORE`] of rest.

use std::sync::Arc;

use machine::kinematics::ToolMotion;
use messages::Nanoseconds;
use messages::time::SETPOINT_TIME;

use crate::geometry::attitude::AttitudeLaw;
use crate::geometry::path::{Path, PathCursor};
use crate::joint_space::joint_move::{JointMove, JointsAt};
use crate::law::flight::Flight;
use crate::law::time_law::TimeLaw;

/// Rest at the start of a stream [s], so that its first samples are at rest.
pub const BEFORE: f64 = 2.0 * SETPOINT_TIME;

/// A stretch of motion of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// When it starts, stream time [s].
    pub start: f64,
    /// [s].
    pub duration: f64,
    /// What happens.
    pub motion: Motion,
    /// Line of the job file, 0 for none.
    pub line: u64,
    /// The stroke or dot that it marks, leads to or comes from, from 1; 0 for none.
    pub stroke: u64,
}

/// What a path is gone along for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Errand {
    /// To mark, all of it or parts.
    Marks,
    /// In the dark, at the speed that the job asks for.
    Dark,
    /// In the dark, as fast as may be.
    Rapid,
}

/// The motion of a piece.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// At rest.
    Rest(JointMove),
    /// Along a path.
    Path {
        /// Where the tool goes.
        path: Arc<Path>,
        /// When it is where.
        law: Arc<TimeLaw>,
        /// What for.
        errand: Errand,
    },
    /// The tool from one state to another in the dark.
    Flight(Arc<Flight>),
    /// The joints together from rest to rest.
    Joints(JointMove),
}

/// Where a trajectory was looked at last, to look near it next.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cursor {
    /// The piece.
    pub(crate) piece: usize,
    cell: usize,
    path: PathCursor,
}

/// What a piece of motion says at one instant.
// It lives on the stack of one sample; a box would allocate four times a cycle.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reference {
    /// Where the tool shall be; the joints follow from it.
    Tool(ToolMotion),
    /// Where the joints shall be; the tool follows from them.
    Joints(JointsAt),
}

/// A change of the laser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserChange {
    /// Stream time at which the source is told.
    pub time: Nanoseconds,
    /// Fraction of full scale from then on; 0 closes the gate.
    pub power: f64,
    /// The stroke that this lights, from 1; 0 with the gate closed.
    pub stroke: u64,
}

/// Pieces of a job as functions of stream time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trajectory {
    /// The pieces, each starting where the one before ends.
    pub pieces: Vec<Piece>,
    /// Changes of the laser in order.
    pub laser: Vec<LaserChange>,
    /// Stream times [s] from which all outputs are as given.
    pub outputs: Vec<(f64, u64)>,
    /// Stream times [s] from which the laser has so many pulses a second, 0 as its source is set.
    pub frequencies: Vec<(f64, f64)>,
    /// Stream times at which to wait for a person [s].
    pub pauses: Vec<f64>,
    /// How the tool is turned where it leads.
    pub attitude: AttitudeLaw,
}

impl Trajectory {
    /// When the last piece ends, stream time [s].
    pub fn end(&self) -> f64 {
        self.pieces.last().map_or(0.0, |piece| piece.start + piece.duration)
    }

    /// From the first motion to the last, or to the last dot [s].
    pub fn duration(&self) -> f64 {
        self.end() - self.pieces.first().map_or(0.0, |piece| piece.duration)
    }

    /// Goes on with `next`, which starts where this one ends.
    pub(crate) fn append(&mut self, next: &Self) {
        self.pieces.extend_from_slice(&next.pieces);
        self.laser.extend_from_slice(&next.laser);
        self.outputs.extend_from_slice(&next.outputs);
        self.frequencies.extend_from_slice(&next.frequencies);
        self.pauses.extend_from_slice(&next.pauses);
    }

    /// The motion at `time` [s]; at rest before the start and after the end. `cursor` is the piece to
    /// begin with: searching goes on from there in either direction.
    #[inline(always)]
    pub fn at(&self, time: f64, cursor: &mut Cursor) -> Reference {
        let last = self.pieces.len() - 1;
        let mut index = cursor.piece.min(last);
        while index > 0 && time < self.pieces[index].start {
            index -= 1;
        }
        while index < last && time >= self.pieces[index + 1].start {
            index += 1;
        }
        cursor.piece = index;
        let piece = &self.pieces[index];
        let since = time - piece.start;
        if index == last && since >= piece.duration {
            return match piece.motion.at_near(piece.duration, cursor) {
                Reference::Tool(tool) => Reference::Tool(ToolMotion::rest(&tool.pose())),
                joints @ Reference::Joints(..) => joints,
            };
        }
        piece.motion.at_near(since.max(0.0), cursor)
    }

    /// The piece at `time` [s].
    pub fn piece_at(&self, time: f64) -> Option<&Piece> {
        let after = self.pieces.partition_point(|piece| piece.start <= time);
        self.pieces.get(after.max(1) - 1)
    }
}

impl Reference {
    /// The tool's motion, where it is what is said.
    pub fn tool(&self) -> Option<&ToolMotion> {
        match self {
            Self::Tool(tool) => Some(tool),
            Self::Joints(..) => None,
        }
    }
}

impl Motion {
    /// The motion at `time` since the start of the piece [s].
    pub fn at(&self, time: f64) -> Reference {
        self.at_near(time, &mut Cursor::default())
    }

    /// The same, looked for near `cursor`.
    #[inline(always)]
    fn at_near(&self, time: f64, cursor: &mut Cursor) -> Reference {
        match self {
            Self::Rest(joints) | Self::Joints(joints) => Reference::Joints(joints.at(time)),
            Self::Path { path, law, .. } => {
                let along = law.at_near(time, &mut cursor.cell);
                let rates = [along.velocity, along.acceleration, along.jerk];
                Reference::Tool(path.tool_near(along.position, rates, &mut cursor.path))
            }
            Self::Flight(flight) => Reference::Tool(flight.tool(time)),
        }
    }
}
