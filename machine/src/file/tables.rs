//! The tables of a machine file, with every default that is a value; those of the mechanisms are in
//! [`super::mechanism`]. A default that follows from other values is said here in words, and stands
//! where these meet: the following error, largest speed and range of an axis in `axes`, home and the
//! origins of programs in `validate`.
//!
//! Their documentation becomes the schema's, so it speaks to whoever writes a machine file.

use super::drives::DrivesTable;
use super::frame::MachineFrameTable;
use super::mechanism::MechanismTable;
use super::modbus::ModbusTable;
use super::operating::{HomingTable, InputTable, OutputTable, SafetyTable};
use crate::document::{Either, Fraction, Named, NonNegative, Number, Point, Positive, Spanned};
use crate::drives::ActuatorMode;
use crate::gcode_settings::ZMeaning;
use crate::limits::CornerMode;
use crate::quantity as unit;
use crate::table;

/// A quantity of any sign.
type Signed<K> = crate::document::Quantity<K>;
/// A quantity above 0.
type Above<K> = crate::document::Quantity<K, Positive>;
/// A quantity of 0 or more.
type AtLeastZero<K> = crate::document::Quantity<K, NonNegative>;

table! {
    /// A machine for laser marking.
    pub struct MachineTable {
        /// The machine's name.
        pub name: Spanned<String>,
        /// What it is, for people.
        pub description: Option<Spanned<String>>,
        /// Where the tool rests, [x, y] or [x, y, z]; the centre of the area when left out.
        pub home: Option<Point>,
        /// How the axes stand at rest, one value each, for machines that can hold the tool in one
        /// place in several ways. Instead of `home`.
        pub home_axes: Option<Vec<Signed<unit::Travel>>>,
        /// Where the tool may go.
        pub area: AreaTable,
        /// Limits of the tool's motion, as norms of the vectors.
        pub path: PathTable,
        /// How the axes move the tool: one table, named by the kind of mechanism.
        pub mechanism: MechanismTable,
        /// How the machine frame lies over the axes of a cartesian, a corexy or a galvo.
        pub frame: Option<MachineFrameTable>,
        /// One table for each axis, named as the mechanism names them: `x` and `y` (and `z`) of a
        /// cartesian, `a` and `b` of a corexy, `th1`, `th2` and `d` of a polar.
        pub axis: Named<AxisTable>,
        /// Its digital inputs, named.
        pub inputs: Option<Named<InputTable>>,
        /// Its digital outputs, named.
        pub outputs: Option<Named<OutputTable>>,
        /// Devices that are asked over Modbus TCP, named.
        pub modbus: Option<Named<ModbusTable>>,
        /// What an emergency stop and an open door do, and how far a test may go.
        pub safety: SafetyTable,
        /// What the machine bears of a computer that is late.
        pub realtime: RealtimeTable,
        /// What drives the motors: one table, named by its kind.
        pub drives: DrivesTable,
        /// The laser source.
        pub laser: LaserTable,
        /// How the machine reads G-code.
        pub gcode: GcodeTable,
        /// The job that belongs to the machine.
        pub job: Option<JobTable>,
    }
}

table! {
    /// Where the tool may go, machine frame: [from, to] in each direction.
    pub struct AreaTable {
        /// Range of x.
        pub x: [Signed<unit::Length>; 2],
        /// Range of y.
        pub y: [Signed<unit::Length>; 2],
        /// Range of z, for machines with such an axis.
        pub z: Option<[Signed<unit::Length>; 2]>,
    }
}

table! {
    /// Limits of the tool's motion, as norms of the vectors.
    pub struct PathTable {
        /// Largest speed while marking.
        pub speed: Above<unit::Speed> = "0.25 m/s",
        /// Largest speed of a free move.
        pub rapid: Above<unit::Speed> = "0.25 m/s",
        /// Largest acceleration.
        pub acceleration: Above<unit::Acceleration> = "10 m/s^2",
        /// Largest jerk.
        pub jerk: Above<unit::Jerk> = "500 m/s^3",
        /// How far a smoothed join may lie from the drawn line, and the tool from its path between two
        /// setpoints.
        pub tolerance: Above<unit::Length> = "5 um",
        /// How corners are passed where a job says nothing of them: `blend`, on the way and rounded
        /// within the tolerance, or `exact`, at rest.
        pub corners: Spanned<CornerMode> = "blend",
    }
}

table! {
    /// The loaded part of a screw, from its fixed bearing to the nut.
    pub struct ShaftTable {
        /// Diameter of its core, under the thread of the balls.
        pub core_diameter: Above<unit::Length>,
        /// Bore of a hollow shaft.
        pub bore: AtLeastZero<unit::Length> = "0 mm",
        /// From the fixed bearing to the nut, on average.
        pub length: Above<unit::Length>,
        /// Modulus of elasticity; that of steel when left out.
        pub modulus: Above<unit::Modulus> = "210e9 N/m^2",
        /// Shear modulus; that of steel when left out.
        pub shear_modulus: Above<unit::Modulus> = "80e9 N/m^2",
        /// Axial stiffness of the nut, as its data sheet has it; rigid when left out.
        pub nut_stiffness: Option<Above<unit::Stiffness>>,
        /// What of the nut's stiffness its tolerances leave.
        pub nut_accuracy: Fraction<Positive> = 1.0,
    }
}

table! {
    /// A belt between its pulley and what it pulls.
    pub struct SectionTable {
        /// Modulus of elasticity.
        pub modulus: Above<unit::Modulus>,
        /// Cross-section that carries the load.
        pub area: Above<unit::Area>,
        /// Lengths of its two spans, on average.
        pub spans: [Above<unit::Length>; 2],
    }
}

table! {
    /// One axis: its joint's limits, and what stands between the voltage and the joint.
    pub struct AxisTable {
        /// Turns of the motor per turn of the screw, pulley or arm.
        pub gear: Number<Positive> = 1.0,
        /// What stands between gear and joint. The belts of a corexy, and a screw of a cartesian that
        /// has a `lead` there, stand in the mechanism's own table instead.
        pub transmission: TransmissionTable,
        /// How far the joint moves freely while the motor stands, from stop to stop: the play of
        /// gear, coupling and nut. It needs an elastic transmission.
        pub backlash: Option<AtLeastZero<unit::Travel>>,
        /// Efficiency of gear and screw in motion, for sizing only: losses in motion are `friction`.
        pub efficiency: Fraction<Positive> = 1.0,
        /// What of that efficiency is left when it starts from standstill, for sizing only; 1 of
        /// planetary gears.
        pub static_efficiency: Fraction<Positive> = 1.0,
        /// The motor: one table, named by its kind.
        pub motor: MotorTable,
        /// Friction, all of it seen at the motor shaft.
        pub friction: FrictionTable,
        /// The encoder on the motor shaft; a stepper has none.
        pub encoder: Option<EncoderTable>,
        /// Which target the motor's drive follows, and so which loops it closes itself: `voltage` (none),
        /// `torque` (current), `velocity` (current and velocity) or `position` (all). When left out,
        /// `voltage` for a DC motor and `position` for a stepper.
        pub mode: Option<Spanned<ActuatorMode>>,
        /// Limits beyond those of the path.
        pub limits: LimitsTable,
        /// Bandwidths of the control loops; a stepper has none.
        pub loops: Option<LoopsTable>,
        /// Where several motors drive the axis: a table for each, named, in their order. What it leaves
        /// out is as the axis has it.
        pub actuator: Option<Named<AxisActuatorTable>>,
        /// How the axis finds its reference; when left out, it knows its place from the start.
        pub homing: Option<HomingTable>,
    }
}

table! {
    /// One of several motors that drive an axis together, with what is its own; everything else is as the
    /// axis has it.
    pub struct AxisActuatorTable {
        /// Whether the motor is mounted the other way round, so that it turns backwards for a joint that
        /// moves forwards.
        pub mirrored: Spanned<bool> = false,
        /// How far the actuator stands beyond its place, in the joint's travel, when it is at its home
        /// reference. Enabling takes it back, which squares the axis.
        pub square: Option<Signed<unit::Travel>>,
        /// Turns of the motor per turn of the screw, pulley or arm.
        pub gear: Option<Number<Positive>>,
        /// The motor: one table, named by its kind.
        pub motor: Option<MotorTable>,
        /// Friction, all of it seen at the motor shaft.
        pub friction: Option<FrictionTable>,
        /// The encoder on the motor shaft.
        pub encoder: Option<EncoderTable>,
        /// Which target the motor's drive follows.
        pub mode: Option<Spanned<ActuatorMode>>,
        /// Bandwidths of the control loops.
        pub loops: Option<LoopsTable>,
    }
}

table! {
    /// The motor: exactly one of these.
    pub struct MotorTable {
        /// A brushed permanent-magnet motor.
        pub dc: Option<DcMotorTable>,
        /// A two-phase hybrid stepper, rotating or linear.
        pub stepper: Option<StepperMotorTable>,
    }
}

table! {
    /// A brushed permanent-magnet motor with its supply and power stage.
    pub struct DcMotorTable {
        /// Voltage of the supply.
        pub voltage: Above<unit::Voltage>,
        /// Largest current of the power stage.
        pub current: Above<unit::Current>,
        /// Resistance of the winding.
        pub resistance: Above<unit::Resistance>,
        /// Inductance of the winding.
        pub inductance: Above<unit::Inductance>,
        /// Torque per current, which is also back-EMF per speed.
        pub torque_constant: Above<unit::TorqueConstant>,
        /// Moment of inertia of the rotor.
        pub rotor_inertia: Above<unit::Inertia>,
        /// Current that the winding bears for ever.
        pub continuous_current: Option<Above<unit::Current>>,
        /// Torque that the data sheet promises; only checked against the other data.
        pub nominal_torque: Option<Above<unit::Torque>>,
        /// Speed at which it promises that torque.
        pub nominal_speed: Option<Above<unit::AngularSpeed>>,
    }
}

table! {
    /// A two-phase hybrid stepper with its driver and supply. A linear one is unrolled: 4 full steps
    /// to a turn, whose lead is the tooth pitch; its torque is its force times `lead/2π`.
    pub struct StepperMotorTable {
        /// Full steps in a turn, a multiple of 4.
        pub full_steps: Number<Positive> = 200.0,
        /// Pulses per full step.
        pub microsteps: Number<Positive> = 16.0,
        /// Largest torque at standstill with both phases at rated current.
        pub holding_torque: Above<unit::Torque>,
        /// Torque of the unpowered motor.
        pub detent_torque: AtLeastZero<unit::Torque> = "0 N m",
        /// Moment of inertia of the rotor.
        pub rotor_inertia: Above<unit::Inertia>,
        /// Peak current of a phase that gives the holding torque.
        pub current: Above<unit::Current>,
        /// Resistance of a phase.
        pub resistance: Above<unit::Resistance>,
        /// Inductance of a phase.
        pub inductance: Above<unit::Inductance>,
        /// Voltage of the supply.
        pub voltage: Above<unit::Voltage>,
        /// Damping that the driver gives the rotor.
        pub damping: AtLeastZero<unit::TorsionalDamping> = "0 N m s/rad",
        /// Largest pulse rate of the driver.
        pub pulse_rate: Above<unit::PulseRate> = "200 kHz",
    }
}

table! {
    /// Friction, all of it seen at the motor shaft.
    pub struct FrictionTable {
        /// Coulomb friction, the same at rest and in motion.
        pub coulomb: AtLeastZero<unit::Torque>,
        /// Viscous friction.
        pub viscous: AtLeastZero<unit::TorsionalDamping>,
        /// Torque of a brake that holds the shaft while the motor is unpowered, or of a planar motor's
        /// magnets that clamp it while its air is off.
        pub brake: AtLeastZero<unit::Torque> = "0 N m",
        /// How long the brake goes on holding after the motor is powered; the motor bears the load by then.
        pub brake_release: AtLeastZero<unit::Duration> = "20 ms",
    }
}

table! {
    /// The encoder on the motor shaft.
    pub struct EncoderTable {
        /// Counts per revolution, all edges counted.
        pub resolution: Above<unit::CountsPerTurn>,
    }
}

table! {
    /// Limits of one axis, in the joint's travel: of the carriage, the belt, the arm or the table.
    pub struct LimitsTable {
        /// Soft limits [from, to]; when left out, the range that the area needs and the following
        /// error beyond it.
        /// Of an arm or a table, angles; "unlimited" for a table that may turn for ever. Machines
        /// whose axes do not follow from the area must say it.
        pub position: Option<Either<Unlimited, [Signed<unit::Travel>; 2]>>,
        /// Largest speed; when left out, 90 % of what the motor reaches without load.
        pub velocity: Option<Above<unit::TravelSpeed>>,
        /// Largest acceleration; none when left out.
        pub acceleration: Option<Above<unit::TravelAcceleration>>,
        /// Largest jerk; none when left out.
        pub jerk: Option<Above<unit::TravelJerk>>,
        /// Largest difference between setpoint and feedback before the machine stops; 1 mm or
        /// 10 mrad when left out.
        pub following_error: Option<Above<unit::Travel>>,
        /// Largest distance of two actuators of the axis from each other before the machine stops; the
        /// following error when left out. Of an axis with several actuators only.
        pub racking: Option<Above<unit::Travel>>,
    }
}

// The bandwidths suit a cycle of 1 ms with a command that acts one cycle later: ω_c = 0.349/T_s,
// and for the outer loops what a pilot of both machines found (100 1/s in the velocity loop and
// 25 1/s in the position loop fail).
table! {
    /// Bandwidths of the control loops; the gains follow from motor and load. Where the control cycle is longer than
    /// 1 ms, what is not written is slower in proportion, and what is written too where it would swing.
    pub struct LoopsTable {
        /// Position loop.
        pub position: Above<unit::Bandwidth> = "40 1/s",
        /// Velocity loop.
        pub velocity: Above<unit::Bandwidth> = "160 rad/s",
        /// Current loop.
        pub current: Above<unit::Bandwidth> = "349 rad/s",
    }
}

// An axis that keeps its speed for 10 ms, from the default acceleration of the path, is 0.5 mm from
// its reference: half the default following error. A control computer with a real-time kernel stays
// below 1 ms; a virtual machine was seen to stand still for 8 ms every few seconds.
table! {
    /// When the control cycle comes, and what the machine bears of a computer that is late.
    pub struct RealtimeTable {
        /// The period of the control cycle: a whole multiple of 125 us, from 125 us (8 kHz) to 4 ms
        /// (250 Hz). Jobs are planned with a setpoint every 1 ms whatever it is.
        pub period: Above<unit::Duration> = "1 ms",
        /// How long the axes may go on with their last command, in the dark, before they are stopped:
        /// one `period` to 50 ms, of which whole cycles count. The gate is closed in the first cycle
        /// without a fresh command.
        pub stall: Above<unit::Duration> = "10 ms",
    }
}

table! {
    /// The laser source.
    pub struct LaserTable {
        /// From the gate's opening to light, at most 1 s; the planner makes up for it.
        pub on_delay: AtLeastZero<unit::Duration> = "0 s",
        /// From the gate's closing to darkness, at most 1 s; the planner makes up for it.
        pub off_delay: AtLeastZero<unit::Duration> = "0 s",
        /// The least power at which the source gives steady light, a share of full power: no less is
        /// asked of it while it is lit.
        pub min_power: Fraction = 0.0,
        /// The least share of the power asked for that power in proportion to the speed (M4) goes
        /// down to where the tool is slow.
        pub proportional_floor: Fraction = 0.0,
        /// The lowest and the highest pulse repetition rate that a job may ask for, where drives can set
        /// it; left out, the source keeps its own.
        pub frequency: Option<[Above<unit::PulseRate>; 2]>,
    }
}

crate::dialect_table! {
    /// How the machine reads G-code.
    pub struct GcodeTable {
        /// What Z means: `ignored`, or the height of the `focus` on a machine with a z axis.
        pub z: Spanned<ZMeaning> = "ignored",
        /// Whether M7 and M8 switch an air assist.
        pub air_assist: Spanned<bool> = true,
        /// Origins of the work coordinate systems, machine frame; the home when left out.
        pub origins: OriginsTable,
    }
}

table! {
    /// Origins of the work coordinate systems, machine frame; the home when left out.
    pub struct OriginsTable {
        /// Origin of G54, in force when a program starts.
        pub g54: Option<Point>,
        /// Origin of G55.
        pub g55: Option<Point>,
        /// Origin of G56.
        pub g56: Option<Point>,
        /// Origin of G57.
        pub g57: Option<Point>,
        /// Origin of G58.
        pub g58: Option<Point>,
        /// Origin of G59.
        pub g59: Option<Point>,
        /// Origin of G59.1.
        pub g59_1: Option<Point>,
        /// Origin of G59.2.
        pub g59_2: Option<Point>,
        /// Origin of G59.3.
        pub g59_3: Option<Point>,
    }
}

impl OriginsTable {
    /// The origins in the order of the systems.
    pub(crate) fn each(&self) -> [Option<Point>; 9] {
        let Self { g54, g55, g56, g57, g58, g59, g59_1, g59_2, g59_3, .. } = self;
        [*g54, *g55, *g56, *g57, *g58, *g59, *g59_1, *g59_2, *g59_3]
    }
}

table! {
    /// The job that belongs to the machine.
    pub struct JobTable {
        /// The job that runs when none is named, relative to this file.
        pub sample: Spanned<String>,
    }
}

table! {
    /// What stands between the gear and a joint: one of these, or nothing for a joint that turns
    /// with the gear.
    pub struct TransmissionTable {
        /// A screw that moves a carriage.
        pub screw: Option<AxisScrewTable>,
        /// A belt on a pulley.
        pub belt: Option<AxisBeltTable>,
        /// A pinion on a rack.
        pub rack: Option<RackTable>,
        /// The gear alone, with its elasticity.
        pub direct: Option<DirectTable>,
        /// An arm that bends, on the gear.
        pub link: Option<LinkTable>,
        /// A planar motor on its stator.
        pub planar: Option<PlanarTable>,
    }
}

table! {
    /// A screw that moves a carriage.
    pub struct AxisScrewTable {
        /// Travel per turn of the screw.
        pub lead: Above<unit::Lead>,
        /// Moment of inertia of the screw; it turns with the motor.
        pub inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Torsional stiffness from gear to nut, the axial one in series; rigid when this and
        /// `shaft` are left out.
        pub stiffness: Option<Above<unit::TorsionalStiffness>>,
        /// The shaft that it follows from, instead of `stiffness`.
        pub shaft: Option<ShaftTable>,
        /// Damping of that spring, as a share of critical damping.
        pub damping_ratio: Number<Positive> = 0.9,
    }
}

table! {
    /// A belt on a pulley.
    pub struct AxisBeltTable {
        /// Pitch radius of the pulley.
        pub pulley_radius: Above<unit::Length>,
        /// Moment of inertia of the pulleys; they turn with the gear.
        pub inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Stiffness of the belt; rigid when this and `section` are left out.
        pub stiffness: Option<Above<unit::Stiffness>>,
        /// The belt that it follows from, instead of `stiffness`.
        pub section: Option<SectionTable>,
        /// Damping of that spring, as a share of critical damping.
        pub damping_ratio: Number<Positive> = 0.9,
    }
}

table! {
    /// A pinion on a rack.
    pub struct RackTable {
        /// Pitch radius of the pinion.
        pub pinion_radius: Above<unit::Length>,
        /// Moment of inertia of the pinion; it turns with the gear.
        pub inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Stiffness of teeth, pinion and shaft together, seen at the rack; rigid when left out.
        pub stiffness: Option<Above<unit::Stiffness>>,
        /// Damping of that spring, as a share of critical damping.
        pub damping_ratio: Number<Positive> = 0.9,
    }
}

table! {
    /// The gear alone.
    pub struct DirectTable {
        /// Moment of inertia that turns stiffly with the gear's output.
        pub inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Torsional stiffness of gear and shaft, seen at the joint; rigid when left out.
        pub stiffness: Option<Above<unit::TorsionalStiffness>>,
        /// Damping of that spring, as a share of critical damping.
        pub damping_ratio: Number<Positive> = 0.9,
    }
}

table! {
    /// An arm that bends like a beam clamped at the gear, its bending lumped in one spring.
    pub struct LinkTable {
        /// Length of the beam.
        pub length: Above<unit::Length>,
        /// Modulus of elasticity of its material.
        pub modulus: Above<unit::Modulus>,
        /// Second moment of area of its cross-section, about the axis it bends around.
        pub second_moment: Above<unit::SecondMoment>,
        /// Damping of that spring, as a share of critical damping.
        pub damping_ratio: Number<Positive> = 0.9,
    }
}

table! {
    /// A planar stepper motor on its stator.
    pub struct PlanarTable {
        /// Pitch of the stator's teeth: travel per electrical turn of the motor's field.
        pub pitch: Above<unit::Length>,
    }
}

/// The word for an axis without end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unlimited {
    /// It may turn for ever.
    Unlimited,
}

crate::keyword! {
    Unlimited, "a range",
    "unlimited" => Self::Unlimited,
}

crate::keyword! {
    ZMeaning, "a meaning of Z",
    "ignored" => Self::Ignored,
    "focus" => Self::Focus,
}

crate::keyword! {
    ActuatorMode, "a mode of an actuator",
    "voltage" => Self::Voltage,
    "torque" => Self::Torque,
    "velocity" => Self::Velocity,
    "position" => Self::Position,
}

crate::keyword! {
    CornerMode, "a way to pass corners",
    "blend" => Self::Blend,
    "exact" => Self::Exact,
}
