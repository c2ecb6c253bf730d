//! A machine, checked: what every stage is built from.

use std::path::PathBuf;

use crate::actuator::Actuator;
use crate::axis::{Axis, JointUnit};
use crate::document::{Concern, DocumentError, Override};
use crate::drives::Drives;
use crate::gcode_settings::GcodeSettings;
use crate::laser::LaserSource;
use crate::limits::{CornerMode, PathLimits, Timing, WorkArea};
use crate::mechanisms::MechanismKind;
use crate::operating::Operating;

/// The built-in machine's file.
pub const BUILTIN: &str = include_str!("../../machines/corexy.toml");

/// Its name in errors.
pub const BUILTIN_NAME: &str = "machines/corexy.toml";

/// Everything that a machine file says, in SI units and free of contradictions.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Its name.
    pub name: String,
    /// How its axes move the tool.
    pub mechanism: MechanismKind,
    /// Its axes, in the order of the mechanism's joints.
    pub axes: Vec<Axis>,
    /// What drives them, those of the first axis first.
    pub actuators: Vec<Actuator>,
    /// Where the tool may go.
    pub area: WorkArea,
    /// Where the tool rests, machine frame [m].
    pub home: [f64; 3],
    /// How the joints stand there, load side [m or rad].
    pub home_joints: Vec<f64>,
    /// Limits of the tool's motion.
    pub path: PathLimits,
    /// How corners are passed where a job says nothing of them.
    pub corners: CornerMode,
    /// When the control cycle comes, and how late it may be.
    pub realtime: Timing,
    /// Its switches, how its axes are homed, and what is done for safety.
    pub operating: Operating,
    /// What drives the motors.
    pub drives: Drives,
    /// The laser source.
    pub laser: LaserSource,
    /// How it reads G-code.
    pub gcode: GcodeSettings,
    /// The job that runs when none is named, relative to the machine file.
    pub sample_job: Option<PathBuf>,
    /// What is sound enough to run but should be looked at.
    pub warnings: Vec<Warning>,
}

/// A warning about a machine file that does not keep it from running.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// What is wrong or unusual, with the numbers.
    pub text: String,
    /// Line in the file from 1; 0 when an override is meant.
    pub line: usize,
    /// Column in characters from 1; 0 when an override is meant.
    pub column: usize,
    /// Whether the value is used, or only compared with others.
    pub concern: Concern,
}

impl Machine {
    /// The actuators of each axis in turn, with the axis.
    pub fn driven(&self) -> impl Iterator<Item = (&Axis, &[Actuator])> {
        self.axes.iter().map(|axis| (axis, axis.driven_by(&self.actuators)))
    }

    /// Each actuator with the axis that it drives.
    pub fn drives(&self) -> impl Iterator<Item = (&Actuator, &Axis)> {
        self.actuators.iter().filter_map(|actuator| Some((actuator, self.axes.get(actuator.axis)?)))
    }

    /// The warnings that bear on a job, each with its line in the machine file: those of values that are
    /// used.
    pub fn job_warnings(&self) -> Vec<String> {
        let used = self.warnings.iter().filter(|warning| warning.concern == Concern::Use);
        used.map(|Warning { text, line, .. }| match line {
            0 => text.clone(),
            line => format!("machine file, line {line}: {text}"),
        })
        .collect()
    }

    /// Radius of the workpiece in the chuck that stands in the place of y [m]; `None` without one.
    pub fn chuck_radius(&self) -> Option<f64> {
        let radius = match &self.mechanism {
            MechanismKind::Cartesian(cartesian) => cartesian.travel[1],
            MechanismKind::CartesianLift(cartesian) => cartesian.travel[1],
            _ => return None,
        };
        self.axes.get(1).is_some_and(|axis| axis.unit == JointUnit::Angle).then_some(radius)
    }

    /// The CoreXY of source 003, the machine when none is named: `machines/corexy.toml`, built in.
    ///
    /// # Panics
    /// Never: the file is part of the build, and a test holds it to be sound.
    pub fn builtin() -> Self {
        match Self::builtin_with(&[]) {
            Ok(machine) => machine,
            Err(error) => panic!("{error}"),
        }
    }

    /// The built-in machine with `overrides` laid over it.
    ///
    /// # Errors
    /// Everything in the overrides that is not sound.
    pub fn builtin_with(overrides: &[Override]) -> Result<Self, DocumentError> {
        Self::parse(BUILTIN_NAME, BUILTIN, overrides)
    }
}
