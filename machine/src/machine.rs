//! A machine, checked: what every stage is built from.

use std::path::PathBuf;

use crate::actuator::{Axis, DcMotor, Encoder, Friction, LoopGains};
use crate::limits::{AxisLimits, PathLimits, WorkArea};
use crate::mechanisms::{CoreXy, Elasticity, MechanismKind};
use crate::process::{GcodeSettings, LaserSource, ZMeaning};

/// Everything that a machine file says, in SI units and free of contradictions.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Its name.
    pub name: String,
    /// How its axes move the tool.
    pub mechanism: MechanismKind,
    /// Its axes, in the order of the mechanism's joints.
    pub axes: Vec<Axis>,
    /// Where the tool may go.
    pub area: WorkArea,
    /// Where the tool rests, machine frame [m].
    pub home: [f64; 3],
    /// Limits of the tool's motion.
    pub path: PathLimits,
    /// The laser source.
    pub laser: LaserSource,
    /// How it reads G-code.
    pub gcode: GcodeSettings,
    /// The job that runs when none is named, relative to the machine file.
    pub sample_job: Option<PathBuf>,
    /// What is sound enough to run but should be looked at.
    pub warnings: Vec<Warning>,
}

/// A doubt about a machine file that does not keep it from running.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// What is doubtful, with the numbers.
    pub text: String,
    /// Line in the file from 1; 0 when an override is meant.
    pub line: usize,
    /// Column in characters from 1; 0 when an override is meant.
    pub column: usize,
}

impl Machine {
    /// The CoreXY of source 003, built in.
    pub fn builtin() -> Self {
        let motor = DcMotor {
            resistance: 2.3,
            inductance: 2.3e-3,
            torque_constant: 0.021,
            rotor_inertia: 2e-6,
            voltage: 12.0,
            current: 5.2,
            continuous_current: None,
        };
        let ratio = 0.01 / 8.0;
        let axis = |name: &str, position| Axis {
            name: name.to_owned(),
            ratio,
            efficiency: 1.0,
            motor,
            friction: Friction { coulomb: 5e-3, viscous: 1e-6 },
            encoder: Encoder { counts: 4096.0 },
            gains: LoopGains {
                position: 40.0,
                velocity: 160.0,
                current: 349.0,
                inertia: 2e-6 + ratio * ratio * (0.33 + 1.06) / 4.0,
            },
            limits: AxisLimits {
                position,
                velocity: 0.9 * motor.voltage / motor.torque_constant * ratio,
                acceleration: f64::INFINITY,
                jerk: f64::INFINITY,
                following_error: 1e-3,
            },
        };
        let home = [0.1, 0.1, 0.0];
        Self {
            name: "CoreXY".to_owned(),
            mechanism: MechanismKind::CoreXy(CoreXy {
                mass: [0.33, 1.06],
                elasticity: Some([
                    Elasticity::damped(6e4, 0.33, 0.9),
                    Elasticity::damped(6e4, 1.06, 0.9),
                ]),
            }),
            axes: vec![axis("a", [-1e-3, 0.401]), axis("b", [-0.201, 0.201])],
            area: WorkArea { lower: [0.0; 3], upper: [0.2, 0.2, 0.0] },
            home,
            path: PathLimits {
                speed: 0.25,
                rapid: 0.25,
                acceleration: 10.0,
                jerk: 500.0,
                tolerance: 5e-6,
            },
            laser: LaserSource { on_delay: 0.0, off_delay: 0.0 },
            gcode: GcodeSettings {
                full_scale: 1000.0,
                z: ZMeaning::Ignored,
                origins: [home; 9],
                air_assist: true,
            },
            sample_job: Some(PathBuf::from("../jobs/letters.toml")),
            warnings: Vec::new(),
        }
    }
}
