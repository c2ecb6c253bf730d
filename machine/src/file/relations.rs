//! What two values of a machine file say of each other: each may be usual by itself, and both together
//! make a machine that trips, misses its path, or cannot be controlled.
//!
//! The arithmetic is that of the machine at home. It warns and proves nothing: the planner holds every
//! job to the machine's limits, and the controller every motion.

use messages::time::SETPOINT_TIME;
use nalgebra::{DMatrix, SMatrix};

use super::axes::{Drive, Joint};
use super::mechanism::travel_place;
use super::tables::{AxisTable, MachineTable, PathTable};
use crate::actuator::Actuator;
use crate::axis::{Axis, JointUnit};
use crate::document::{Diagnostics, Span};
use crate::kinematics::{Joints, Mechanism};
use crate::mechanisms::spectrum::smallest_eigenvalue;
use crate::mechanisms::{MechanismKind, MechanismVisitor};
use crate::motor::{DcMotor, Motor, StepperMotor};
use crate::trip::following::{DISCONTINUITY, LEAD_STEP};

/// The fastest that a velocity loop may be in any direction of the joints [rad/s]: with a command that
/// acts one cycle after its measurement, and the speed taken over a cycle, it is unstable from about
/// 600 rad/s on.
const FASTEST_LOOP: f64 = 350.0;

/// Tolerances of the path by which friction alone may push the tool off it: its feedforward, which
/// depends on oil and warmth, would else have to be right to half a per cent.
const FRICTION_TOLERANCES: f64 = 200.0;

/// Load inertia per rotor inertia that a velocity loop of the rotor still rules: behind a spring, and
/// rigid.
const LARGEST_LOAD: [f64; 2] = [10.0, 30.0];

/// Times a motor may outrun what path and limits ask of its axis.
const LARGEST_SPEED_RESERVE: f64 = 60.0;

/// Usual electrical time constants of windings, L/R [s].
const ELECTRICAL: [f64; 2] = [20e-6, 0.2];

/// Usual mechanical time constants of motors with their load, J·R/k² [s].
const MECHANICAL: [f64; 2] = [50e-6, 2.0];

/// Times a velocity loop should be faster than the position loop around it: 4 are usual, and below 2
/// both swing together.
const LOOP_RATIO: f64 = 2.0;

/// Share of a motor's torque that friction may take.
const LARGEST_FRICTION: f64 = 0.3;

/// Share of the holding torque that the detent torque of a stepper may have.
const LARGEST_DETENT: f64 = 0.3;

/// Counts that a largest following error must leave to an axis that is held in one place.
const FEWEST_COUNTS: f64 = 4.0;

/// The machine at home.
#[derive(Debug, Clone, Default, PartialEq)]
struct Standing {
    /// Way of the tool per joint unit [m/m or m/rad].
    lever: Vec<f64>,
    /// Joint speed per tool speed in the least favourable direction, the other joints helping.
    worst_speed: Vec<f64>,
    /// What gravity takes at each joint [N or N·m].
    gravity: Vec<f64>,
    /// The lowest resonance of the load on its springs, the motors held [rad/s]; `None` where the
    /// transmission is rigid.
    resonance: Option<f64>,
    /// The smallest inertia that the loops move together, as a share of what each takes for its own.
    smallest_share: f64,
}

/// Gives [`Standing`]; `None` where the chain cannot close at home, which is refused elsewhere.
struct AtHome<'a> {
    joints: &'a [Joint],
    driven: &'a [(Drive, Actuator)],
}

impl MechanismVisitor for AtHome<'_> {
    type Output = Option<Standing>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { joints, driven } = self;
        let home = Joints::<N>::from_fn(|row, _| joints.get(row).map_or(0.0, |joint| joint.home));
        let chain = mechanism.solve(&home, mechanism.branch(), None).ok()?;
        let jacobian = mechanism.jacobian(&chain);
        let linear = DMatrix::from_fn(3, N, |row, column| jacobian[(row, column)]);
        let mass = mechanism.mass_matrix(&chain);
        // The actuators of a joint move together: what each moves of it is added up at the first one's shaft.
        let side = |joint: usize| {
            let of = driven.iter().map(|(_, actuator)| actuator).filter(|it| it.axis == joint);
            let mut of = of.peekable();
            let ratio = of.peek().map_or(1.0, |first| first.ratio.abs());
            of.fold((ratio, 0.0, 0.0), |(ratio, rotors, inertia), actuator| {
                let square = (ratio / actuator.ratio) * (ratio / actuator.ratio);
                let rotor = actuator.motor.rotor_inertia() * square;
                (ratio, rotors + rotor, inertia + actuator.gains.inertia * square)
            })
        };
        let sides: [(f64, f64, f64); N] = core::array::from_fn(side);
        let seen = SMatrix::<f64, N, N>::from_fn(|row, column| {
            let ((ratio, rotors, own), (other_ratio, _, other)) = (sides[row], sides[column]);
            let rotor = if row == column { rotors } else { 0.0 };
            let inertia = rotor + ratio * mass[(row, column)] * other_ratio;
            inertia / (own * other).sqrt()
        });
        Some(Standing {
            lever: linear.column_iter().map(|column| column.norm()).collect(),
            worst_speed: inverse_rows(&linear).unwrap_or_else(|| vec![0.0; N]),
            gravity: mechanism.gravity(&chain).iter().copied().collect(),
            resonance: mechanism.stiffness().and_then(|stiffness| lowest(&mass, &stiffness)),
            smallest_share: smallest_eigenvalue(seen),
        })
    }
}

/// The lengths of the rows of the inverse of `jacobian`, of the least motion of the joints where they
/// can move the tool in several ways; `None` at a singularity.
fn inverse_rows(jacobian: &DMatrix<f64>) -> Option<Vec<f64>> {
    /// Turns of the iteration before it is given up; a dozen are usual.
    const MOST_TURNS: usize = 1000;
    /// Singular values below this count as directions in which the tool cannot move [m/rad].
    const LEAST: f64 = 1e-6;
    if jacobian.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    let turned = jacobian.clone();
    let parts =
        nalgebra::SVD::try_new_unordered(turned, true, true, 5.0 * f64::EPSILON, MOST_TURNS)?;
    let inverse = parts.pseudo_inverse(LEAST).ok()?;
    Some(inverse.row_iter().map(|row| row.norm()).collect())
}

/// The lowest angular frequency of `mass` on `stiffness` [rad/s].
fn lowest<const N: usize>(
    mass: &SMatrix<f64, N, N>,
    stiffness: &SMatrix<f64, N, N>,
) -> Option<f64> {
    let half = mass.cholesky()?.l().try_inverse()?;
    let square = smallest_eigenvalue(half * stiffness * half.transpose());
    (square >= 0.0).then(|| square.sqrt())
}

/// One actuator as the file says it and as it was understood, with its axis.
struct Subject<'a> {
    table: &'a AxisTable,
    joint: &'a Joint,
    axis: &'a Axis,
    actuator: &'a Actuator,
    /// Way of the tool per joint unit [m/m or m/rad].
    lever: f64,
    /// Joint speed per tool speed at home, or anywhere where that is the same.
    worst_speed: f64,
    /// What gravity takes at the joint [N or N·m].
    gravity: f64,
    /// Whether a spring is between motor and load.
    is_elastic: bool,
}

/// Warns of values of a machine that do not fit each other, and refuses contradictions.
/// `joints`, `axes` and what is `driven` belong to each other.
pub(super) fn check(
    table: &MachineTable,
    mechanism: &MechanismKind,
    joints: &[Joint],
    axes: &[Axis],
    driven: &[(Drive, Actuator)],
    diagnostics: &mut Diagnostics,
) {
    if joints.len() != axes.len() {
        return;
    }
    let Some(standing) = mechanism.visit(AtHome { joints, driven }) else { return };
    for (index, (drive, actuator)) in driven.iter().enumerate() {
        let (joint, axis) = (&joints[actuator.axis], &axes[actuator.axis]);
        if driven[axis.actuators.start..index].iter().any(|(other, _)| is_alike(other, drive)) {
            continue;
        }
        let worst_speed = joint.worst_speed.max(standing.worst_speed[actuator.axis]);
        let subject = Subject {
            table: &drive.table,
            joint,
            axis,
            actuator,
            lever: standing.lever[actuator.axis],
            worst_speed,
            gravity: standing.gravity[actuator.axis],
            is_elastic: standing.resonance.is_some(),
        };
        subject.following_error(&table.path, standing.resonance, diagnostics);
        subject.resolution(&table.path, diagnostics);
        subject.speeds(&table.path, diagnostics);
        if index == axis.actuators.start {
            subject.lead(table, diagnostics);
        }
        subject.load(diagnostics);
        subject.weight(diagnostics);
        match &actuator.motor {
            Motor::Dc(motor) => subject.dc(motor, &table.path, diagnostics),
            Motor::Stepper(motor) => subject.stepper(motor, &table.path, diagnostics),
        }
    }
    loops(driven, &standing, diagnostics);
}

/// Whether two actuators of an axis are the same in all that is said of them.
fn is_alike(one: &Drive, other: &Drive) -> bool {
    let spans = |drive: &Drive| {
        let AxisTable { gear, motor, friction, encoder, loops, .. } = &drive.table;
        let encoder = encoder.as_ref().map(|encoder| encoder.span);
        (gear.span, motor.span, friction.span, encoder, loops.as_ref().map(|loops| loops.span))
    };
    spans(one) == spans(other)
}

/// Whether the loops are fast enough for the springs, and slow enough for the cycle, where the axes
/// move each other's loads.
fn loops(driven: &[(Drive, Actuator)], standing: &Standing, diagnostics: &mut Diagnostics) {
    let Some((Drive { table, .. }, actuator)) = driven
        .iter()
        .filter(|(_, actuator)| actuator.motor.dc().is_some())
        .max_by(|(_, one), (_, other)| one.gains.velocity.total_cmp(&other.gains.velocity))
    else {
        return;
    };
    let bandwidth = actuator.gains.velocity;
    let span = table.loops.as_ref().map_or(table.span, |loops| loops.velocity.span);
    if let Some(resonance) = standing.resonance
        && resonance < bandwidth
    {
        diagnostics.warn(
            span,
            format!(
                "axis `{}`: the velocity loop has a bandwidth of {bandwidth:.1} rad/s, and the load on \
                 its springs resonates at {resonance:.1} rad/s: lower the one or stiffen the other",
                actuator.name
            ),
        );
    }
    let fastest = bandwidth / standing.smallest_share;
    // Put this way a share that is no number gives a warning.
    let slow_enough = fastest <= FASTEST_LOOP;
    if !slow_enough {
        diagnostics.warn(
            span,
            format!(
                "the axes move each other's load: where they work against each other the inertia is \
                 {:.3} of what the velocity loops of {bandwidth:.1} rad/s are made for, which makes \
                 them {fastest:.1} rad/s fast, and the control cycle bears {FASTEST_LOOP} rad/s: lower \
                 the bandwidth, or raise `gear` or `rotor_inertia`",
                standing.smallest_share
            ),
        );
    }
}

impl Subject<'_> {
    fn warn(&self, span: Span, text: &str, diagnostics: &mut Diagnostics) {
        diagnostics.warn(span, format!("axis `{}`: {text}", self.actuator.name));
    }

    /// What the loops of position and velocity, without their integral, hold a shaft with
    /// [N·m/rad].
    fn stiffness(&self) -> f64 {
        self.actuator.gains.inertia * self.actuator.gains.velocity * self.actuator.gains.position
    }

    /// The unit of the joint, and of its speed.
    fn units(&self) -> [&'static str; 4] {
        self.joint.unit.names()
    }

    /// The largest following error against the encoder, and against what supervision takes for a jump.
    fn following_error(
        &self,
        path: &PathTable,
        resonance: Option<f64>,
        diagnostics: &mut Diagnostics,
    ) {
        let Self { table, axis, actuator, .. } = self;
        let limit = axis.limits.following_error;
        let span = table.limits.following_error.map_or(table.limits.span, |declared| declared.span);
        let [unit, ..] = self.units();
        let count = actuator.count();
        let what = counted(&actuator.motor);
        let line = self.count_line(diagnostics);
        if limit < count {
            diagnostics.contradict(
                span,
                format!(
                    "axis `{}`: a following error of {limit:.3e} {unit} stops the machine, and one {what} \
                     is {count:.3e} {unit}{line}: it would stop at once",
                    axis.name
                ),
                "raise `following_error` to some counts or more, or the resolution",
            );
            return;
        }
        if limit < FEWEST_COUNTS * count {
            let text = format!(
                "a following error of {limit:.3e} {unit} stops the machine, which is less than \
                 {FEWEST_COUNTS} times the {what} of {count:.3e} {unit}{line}: noise of the encoder \
                 may stop it"
            );
            self.warn(span, &text, diagnostics);
        }
        // The jerk of a join, once more for what the mechanism adds to it.
        let jerk = 2.0 * path.jerk.value * self.worst_speed;
        let jump = jerk * SETPOINT_TIME * SETPOINT_TIME * SETPOINT_TIME / 12.0 / DISCONTINUITY;
        // Springs give way by the load's acceleration over ω², the field of a stepper by what all that
        // it turns takes of its stiffness.
        let springs = resonance.map_or(0.0, |resonance| 1.0 / (resonance * resonance));
        let field = actuator
            .motor
            .stepper()
            .map_or(0.0, |motor| actuator.gains.inertia / motor.stiffness());
        let lead = jerk * SETPOINT_TIME * (springs + field) / LEAD_STEP;
        let least = jump.max(lead);
        if limit < least {
            let text = format!(
                "a following error of {limit:.3e} {unit} stops the machine, and a path with the jerk \
                 of {} m/s³{} changes by what supervision takes for a jump below {least:.3e} {unit}: \
                 raise `following_error`, or lower the jerk",
                path.jerk.value,
                at_line(path.jerk.span, diagnostics)
            );
            self.warn(span, &text, diagnostics);
        }
    }

    /// Where the counts of the axis are said, ", line 3" of the file.
    fn count_line(&self, diagnostics: &Diagnostics) -> String {
        let encoder = self.table.encoder.as_ref().map(|encoder| encoder.resolution.span);
        let stepper = self.table.motor.stepper.as_ref().map(|stepper| stepper.microsteps.span);
        encoder.or(stepper).map_or_else(String::new, |span| at_line(span, diagnostics))
    }

    /// A count of the encoder against the path's tolerance.
    fn resolution(&self, path: &PathTable, diagnostics: &mut Diagnostics) {
        let Self { table, lever, actuator, .. } = self;
        let count = actuator.count() * lever;
        if count > path.tolerance.value {
            let encoder = table.encoder.as_ref().map(|encoder| encoder.resolution.span);
            let stepper = table.motor.stepper.as_ref().map(|stepper| stepper.microsteps.span);
            let text = format!(
                "one {} moves the tool by {:.3} µm, and the path's tolerance is {:.3} µm{}: give it a \
                 finer encoder or more gear, or the path more tolerance",
                counted(&actuator.motor),
                count * 1e6,
                path.tolerance.value * 1e6,
                at_line(path.tolerance.span, diagnostics)
            );
            self.warn(encoder.or(stepper).unwrap_or(table.span), &text, diagnostics);
        }
    }

    /// What the motor reaches through its gear against what path and limits ask for.
    fn speeds(&self, path: &PathTable, diagnostics: &mut Diagnostics) {
        let Self { table, axis, worst_speed, actuator, .. } = self;
        let [_, unit, ..] = self.units();
        let speed = if path.speed.value > path.rapid.value { path.speed } else { path.rapid };
        let asked = speed.value * worst_speed;
        let limit = axis.limits.velocity;
        // Where the tool's straight lines are the joints', `warnings` says it for each speed; a limit
        // that the file sets is meant.
        let is_declared = table.limits.velocity.is_some();
        if self.joint.worst_speed == 0.0 && !is_declared && asked > limit {
            let text = format!(
                "it reaches {limit:.3} {unit}, and near home a path at {} m/s may ask it for \
                 {asked:.3} {unit}: jobs that do are slowed or refused",
                speed.value
            );
            self.warn(speed.span, &text, diagnostics);
        }
        let used = table.limits.velocity.map_or(asked, |declared| declared.value).max(asked);
        let most = actuator.motor.largest_speed() * actuator.ratio.abs();
        if actuator.motor.dc().is_some() && used > 0.0 && most > LARGEST_SPEED_RESERVE * used {
            let text = format!(
                "the motor reaches {most:.3} {unit} through a gear of {}, and path and limits use \
                 {used:.3} {unit}: more gear or less lead would use the motor, and its encoder, better",
                table.gear.value
            );
            self.warn(table.gear.span, &text, diagnostics);
        }
    }

    /// The lead of a screw against its travel.
    fn lead(&self, table: &MachineTable, diagnostics: &mut Diagnostics) {
        let Self { joint, axis, .. } = self;
        let [lower, upper] = axis.limits.position;
        let turn = joint.travel * core::f64::consts::TAU;
        if joint.unit == JointUnit::Length && turn > upper - lower {
            let span = travel_place(table, joint.name);
            let text = format!(
                "one turn of the gear's output moves the joint by {turn:.4} m, and its whole travel is \
                 {:.4} m: is the lead or the radius right?",
                upper - lower
            );
            self.warn(span.unwrap_or(self.table.span), &text, diagnostics);
        }
    }

    /// The load's inertia against the rotor's.
    fn load(&self, diagnostics: &mut Diagnostics) {
        let Self { table, joint, actuator, .. } = self;
        let rotor = actuator.motor.rotor_inertia();
        if actuator.motor.stepper().is_some_and(StepperMotor::is_planar) {
            return;
        }
        let load = actuator.ratio * actuator.ratio * (joint.load * actuator.share);
        let most = LARGEST_LOAD[usize::from(!self.is_elastic)];
        let ratio = load / rotor;
        if ratio > most {
            let text = format!(
                "seen through a gear of {} the load has {load:.3e} kg·m², {ratio:.1} times the motor's \
                 {rotor:.3e} kg·m²{}, and up to {most} times are usual: is the gear right?",
                table.gear.value,
                rotor_line(table, diagnostics)
            );
            self.warn(table.gear.span, &text, diagnostics);
        }
    }

    /// What gravity takes against what holds an axis whose motor is unpowered.
    fn weight(&self, diagnostics: &mut Diagnostics) {
        let Self { table, gravity, actuator, .. } = self;
        let torque = (gravity * actuator.share * actuator.ratio).abs();
        let teeth = actuator.motor.stepper().map_or(0.0, |motor| motor.detent_torque);
        let held = actuator.friction.coulomb + actuator.brake.torque + teeth;
        if torque > held {
            let text = format!(
                "at home gravity turns the motor with {torque:.3e} N·m, and friction and brake hold \
                 {held:.3e} N·m: it sinks while the motor is unpowered; give it a `brake`, or balance it"
            );
            self.warn(table.friction.span, &text, diagnostics);
        }
    }

    /// What the data of a DC motor say of each other, and of the loops.
    fn dc(&self, motor: &DcMotor, path: &PathTable, diagnostics: &mut Diagnostics) {
        let Self { table, lever, actuator, .. } = self;
        let Some(data) = &table.motor.dc else { return };
        let DcMotor { resistance, inductance, torque_constant, .. } = *motor;
        let electrical = inductance / resistance;
        if !(ELECTRICAL[0]..=ELECTRICAL[1]).contains(&electrical) {
            let text = format!(
                "{inductance:.3e} H over {resistance:.3e} Ω{} are a time constant of {electrical:.3e} \
                 s; windings have {:.0e} to {:.1} s, and the current loop a cycle of {SETPOINT_TIME} s",
                at_line(data.resistance.span, diagnostics),
                ELECTRICAL[0],
                ELECTRICAL[1]
            );
            self.warn(data.inductance.span, &text, diagnostics);
        }
        let inertia = actuator.gains.inertia;
        // Behind a spring the rotor swings by itself, and only with the load on the whole.
        let alone = if self.is_elastic { motor.rotor_inertia } else { inertia };
        let unusual = [alone, inertia].into_iter().find(|inertia| {
            let time = inertia * resistance / (torque_constant * torque_constant);
            !(MECHANICAL[0]..=MECHANICAL[1]).contains(&time)
        });
        if let Some(turned) = unusual {
            let text = format!(
                "{torque_constant:.3e} N·m/A and {resistance:.3e} Ω{} turn {turned:.3e} kg·m² with a \
                 time constant of {:.3e} s; motors have {:.0e} to {} s",
                at_line(data.resistance.span, diagnostics),
                turned * resistance / (torque_constant * torque_constant),
                MECHANICAL[0],
                MECHANICAL[1]
            );
            self.warn(data.torque_constant.span, &text, diagnostics);
        }
        let (position, velocity) = (actuator.gains.position, actuator.gains.velocity);
        if position * LOOP_RATIO > velocity {
            let span = table.loops.as_ref().map_or(table.span, |loops| loops.position.span);
            let text = format!(
                "the position loop has a bandwidth of {position:.1} rad/s, and the velocity loop in it \
                 {velocity:.1} rad/s{}: less than {LOOP_RATIO} times as much, and they swing together",
                table.loops.as_ref().map_or_else(String::new, |loops| {
                    at_line(loops.velocity.span, diagnostics)
                })
            );
            self.warn(span, &text, diagnostics);
        }
        self.friction(motor.stall_torque(), diagnostics);
        let push = actuator.friction.coulomb / self.stiffness() * actuator.ratio.abs() * lever;
        if push > FRICTION_TOLERANCES * path.tolerance.value {
            let text = format!(
                "a friction of {:.3e} N·m against the {inertia:.3e} kg·m² that the loops are made for{} \
                 pushes the tool off its path by {:.2} mm, {:.0} times the tolerance of {:.3} µm{}: its \
                 feedforward would have to be that exact",
                actuator.friction.coulomb,
                rotor_line(table, diagnostics),
                push * 1e3,
                push / path.tolerance.value,
                path.tolerance.value * 1e6,
                at_line(path.tolerance.span, diagnostics)
            );
            self.warn(table.friction.coulomb.span, &text, diagnostics);
        }
    }

    /// Friction against what the motor gives at standstill [N·m].
    fn friction(&self, stall: f64, diagnostics: &mut Diagnostics) {
        let coulomb = self.actuator.friction.coulomb;
        if coulomb > LARGEST_FRICTION * stall {
            let text = format!(
                "friction takes {coulomb:.3e} N·m of the {stall:.3e} N·m that the motor gives at \
                 standstill: more than {:.0} % is unusual",
                LARGEST_FRICTION * 100.0
            );
            self.warn(self.table.friction.coulomb.span, &text, diagnostics);
        }
    }

    /// What the data of a stepper say of each other.
    fn stepper(&self, motor: &StepperMotor, path: &PathTable, diagnostics: &mut Diagnostics) {
        let Some(data) = &self.table.motor.stepper else { return };
        let (detent, holding) = (motor.detent_torque, motor.holding_torque);
        if detent >= holding {
            diagnostics.contradict(
                data.detent_torque.span,
                format!(
                    "axis `{}`: a detent torque of {detent} N·m is not less than the holding torque of \
                     {holding} N·m{}: the motor could not turn",
                    self.actuator.name,
                    at_line(data.holding_torque.span, diagnostics)
                ),
                "a detent torque is about a twentieth of the holding torque",
            );
        } else if detent > LARGEST_DETENT * holding {
            let text = format!(
                "a detent torque of {detent} N·m is {:.0} % of the holding torque of {holding} N·m{}: \
                 about 5 % are usual",
                detent / holding * 100.0,
                at_line(data.holding_torque.span, diagnostics)
            );
            self.warn(data.detent_torque.span, &text, diagnostics);
        }
        self.friction(holding, diagnostics);
        self.lag(motor, data.holding_torque.span, path, diagnostics);
    }

    /// How far friction holds a stepper off its pulses, whose holding torque is said at `span`: by so much it
    /// stops short of its place from either side.
    fn lag(
        &self,
        motor: &StepperMotor,
        span: Span,
        path: &PathTable,
        diagnostics: &mut Diagnostics,
    ) {
        let Self { table, lever, actuator, .. } = self;
        let coulomb = actuator.friction.coulomb;
        // Friction of more than the holding torque is warned of already, and the field then holds it nowhere.
        let angle = coulomb / motor.stiffness();
        let lag = angle * actuator.ratio.abs() * lever;
        if lag > path.tolerance.value {
            let text = format!(
                "a friction of {coulomb:.3e} N·m{} holds a motor of {:.3e} N·m of holding torque off its \
                 pulses by {angle:.3e} rad, which moves the tool by {:.3} µm, and the path's tolerance is \
                 {:.3} µm{}: give it a stronger motor or more gear, or the path more tolerance",
                at_line(table.friction.coulomb.span, diagnostics),
                motor.holding_torque,
                lag * 1e6,
                path.tolerance.value * 1e6,
                at_line(path.tolerance.span, diagnostics)
            );
            self.warn(span, &text, diagnostics);
        }
    }
}

/// What the position of `motor` is counted in.
fn counted(motor: &Motor) -> &'static str {
    match motor {
        Motor::Dc(_) => "count of the encoder",
        Motor::Stepper(_) => "pulse",
    }
}

/// " (line 12)" for a place in the file.
fn at_line(span: Span, diagnostics: &Diagnostics) -> String {
    diagnostics.position(span).map_or_else(String::new, |(line, _)| format!(" (line {line})"))
}

/// Where the rotor's inertia of an axis is said.
fn rotor_line(table: &AxisTable, diagnostics: &Diagnostics) -> String {
    let dc = table.motor.dc.as_ref().map(|motor| motor.rotor_inertia.span);
    let stepper = table.motor.stepper.as_ref().map(|motor| motor.rotor_inertia.span);
    dc.or(stepper).map_or_else(String::new, |span| at_line(span, diagnostics))
}
