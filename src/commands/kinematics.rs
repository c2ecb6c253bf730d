//! `graver kinematics`: JSON lines in, JSON lines out, in order.

mod input;
pub mod lines;

use self::input::{Input, NotJson};
use self::lines::{Branch, Ellipse, ErrorBody, Reply, ReplyPose, Request, RequestPose};
use crate::arguments::{KinematicsArguments, KinematicsVerb};
use crate::exit::{Exit, Failure};
use crate::inputs;
use machine::kinematics::{Branch as _, Joints, KinematicsError, TaskSpace};
use machine::{Actuator, EquationOfMotion, Machine, Mechanism, MechanismVisitor, Pose};
use messages::finite::first_not_finite;
use messages::math;
use nalgebra::{
    DMatrix, DVector, Matrix3, Rotation3, SMatrix, SVD, SymmetricEigen, Vector3, Vector6,
};
use serde_json::Value;
use std::io::{self, BufRead, BufWriter, ErrorKind, Write};

/// Turns of the iterations behind singular values and eigenvalues before they are given up; a matrix
/// of six rows takes about a dozen.
const MOST_TURNS: usize = 1000;

/// Runs the command on standard input and output.
///
/// # Errors
/// A machine file that does not read, or input that is not JSON.
pub fn run(arguments: &KinematicsArguments) -> Result<Exit, Failure> {
    let machine = inputs::machine(&arguments.machine)?.machine;
    let input = std::io::stdin().lock();
    let output = BufWriter::new(std::io::stdout().lock());
    let mechanism = machine.mechanism.clone();
    mechanism.visit(Lines { machine, arguments, input, output })
}

struct Lines<'a, I, O> {
    machine: Machine,
    arguments: &'a KinematicsArguments,
    input: I,
    output: O,
}

impl<I: BufRead, O: Write> MechanismVisitor for Lines<'_, I, O> {
    type Output = Result<Exit, Failure>;

    fn visit<const N: usize, M: Mechanism<N>>(mut self, mechanism: M) -> Self::Output {
        let home = &self.machine.home_joints;
        let mut answer = Answer {
            mechanism: &mechanism,
            machine: &self.machine,
            arguments: self.arguments,
            previous: Joints::from_fn(|axis, _| home.get(axis).copied().unwrap_or_default()),
            near: None,
        };
        let mut input = Input::new(self.input);
        loop {
            let request = match input.next_request() {
                Ok(None) => break,
                Ok(Some(Ok(request))) => request,
                Ok(Some(Err(error))) => {
                    if !write_line(&mut self.output, &Reply::Error { error })? {
                        break;
                    }
                    continue;
                }
                Err(NotJson::Unreadable(error)) => return Err(Failure::service(error)),
                Err(NotJson::Line { number, detail }) => {
                    let message = format!("standard input, line {number}: {detail}");
                    let error = ErrorBody::not_json(message.clone());
                    if write_line(&mut self.output, &Reply::Error { error })? {
                        flush(&mut self.output)?;
                    }
                    return Err(Failure::bad_input(message));
                }
            };
            let reply = answer
                .line(&request)
                .and_then(finite)
                .unwrap_or_else(|error| Reply::Error { error });
            if !write_line(&mut self.output, &reply)? {
                break;
            }
        }
        flush(&mut self.output)?;
        Ok(Exit::Done)
    }
}

/// Writes `reply` as a line; `false` where nobody reads on.
fn write_line(output: &mut impl Write, reply: &Reply) -> Result<bool, Failure> {
    let mut line = serde_json::to_vec(reply).map_err(Failure::service)?;
    line.push(b'\n');
    heard(output.write_all(&line))
}

fn flush(output: &mut impl Write) -> Result<bool, Failure> {
    heard(output.flush())
}

/// Whoever read has read enough where the pipe is closed, as `head` does.
fn heard(written: io::Result<()>) -> Result<bool, Failure> {
    match written {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(Failure::service(error)),
    }
}

/// The reply, if all of its numbers are finite.
fn finite(reply: Reply) -> Result<Reply, ErrorBody> {
    match first_not_finite(&reply) {
        None => Ok(reply),
        Some(place) => Err(ErrorBody {
            code: "not_finite".into(),
            axis: None,
            value: None,
            limit: Some(f64::MAX),
            detail: format!("\"{place}\" of the answer is beyond the largest number"),
        }),
    }
}

/// Answers lines in order; each starts from the answer before.
struct Answer<'a, const N: usize, M: Mechanism<N>> {
    mechanism: &'a M,
    machine: &'a Machine,
    arguments: &'a KinematicsArguments,
    previous: Joints<N>,
    near: Option<M::ChainState>,
}

impl<const N: usize, M: Mechanism<N>> Answer<'_, N, M> {
    fn line(&mut self, request: &Request) -> Result<Reply, ErrorBody> {
        match self.arguments.verb {
            KinematicsVerb::Forward => self.forward(request),
            KinematicsVerb::Inverse => self.inverse(request),
            KinematicsVerb::Jacobian => self.jacobian(request),
            KinematicsVerb::Dynamics => self.dynamics(request),
            KinematicsVerb::Matrices => self.matrices(request),
            KinematicsVerb::Ellipse => self.ellipse(request),
        }
    }

    /// Joint units per unit of what the user calls a joint value.
    fn ratios(&self) -> Joints<N> {
        Joints::from_fn(
            |axis, _| {
                if self.arguments.motor { self.actuators(axis)[0].ratio } else { 1.0 }
            },
        )
    }

    fn joints(&self, key: &str, values: Option<&Vec<f64>>) -> Result<Joints<N>, ErrorBody> {
        let values = values.ok_or_else(|| missing(key))?;
        if values.len() != N {
            return Err(ErrorBody::bad_request(format!(
                "\"{key}\" has {} values, the machine {N} axes",
                values.len()
            )));
        }
        Ok(Joints::<N>::from_fn(|axis, _| values[axis]).component_mul(&self.ratios()))
    }

    /// The branch that a line asks for; what it leaves open is as the machine is built.
    fn branch(&self, request: &Request) -> Result<M::Branch, ErrorBody> {
        let mut branch = self.mechanism.branch();
        for (name, value) in request.branch.iter().flatten() {
            let number =
                |value: &Value| value.as_i64().and_then(|number| i32::try_from(number).ok());
            let values: Option<Vec<i32>> = match value {
                Value::Array(values) => values.iter().map(number).collect(),
                value => number(value).map(|number| vec![number]),
            };
            let chosen = values.and_then(|values| branch.choose(name, &values));
            branch = chosen.ok_or_else(|| {
                let names: Vec<&str> = branch.choices().iter().map(|(name, _)| *name).collect();
                let known = match names.as_slice() {
                    [] => "this mechanism has one solution only".to_owned(),
                    names => format!("its branches are {}", names.join(", ")),
                };
                ErrorBody::bad_request(format!("\"branch\": no \"{name}\": {value}; {known}"))
            })?;
        }
        Ok(branch)
    }

    /// The chain with the joints at `q`, solved from the one before.
    fn solve(&mut self, q: &Joints<N>, branch: M::Branch) -> Result<M::ChainState, ErrorBody> {
        let state = self
            .mechanism
            .solve(q, branch, self.near.as_ref())
            .or_else(|_| self.mechanism.solve(q, branch, None))
            .map_err(|error| self.kinematics_error(&error))?;
        self.near = Some(state);
        Ok(state)
    }

    /// The chain that a line speaks of.
    fn state(&mut self, request: &Request) -> Result<M::ChainState, ErrorBody> {
        let q = self.joints("q", request.q.as_ref())?;
        let branch = self.branch(request)?;
        self.solve(&q, branch)
    }

    fn forward(&mut self, request: &Request) -> Result<Reply, ErrorBody> {
        let q = self.joints("q", request.q.as_ref())?;
        self.check_limits(&q)?;
        let branch = self.branch(request)?;
        let state = self.solve(&q, branch)?;
        let pose = self.mechanism.pose(&state);
        let task_space = self.mechanism.task_space();
        let rotation = (task_space == TaskSpace::Pose).then(|| {
            core::array::from_fn(|row| core::array::from_fn(|column| pose.rotation[(row, column)]))
        });
        let axis = (task_space == TaskSpace::Axis).then(|| beam(&pose).into());
        let pose = ReplyPose { position: self.shown(&pose.position), rotation, axis };
        Ok(Reply::Forward { pose, branch: shown_branch(self.mechanism.branch_of(&state)) })
    }

    fn inverse(&mut self, request: &Request) -> Result<Reply, ErrorBody> {
        let wanted = request.pose.as_ref().ok_or_else(|| missing("pose"))?;
        let shown = self.dimensions();
        if wanted.position.len() < shown || wanted.position.len() > 3 {
            return Err(ErrorBody::bad_request(format!(
                "\"position\" has {} values, the tool moves in {shown}",
                wanted.position.len()
            )));
        }
        if request.previous.is_some() {
            self.previous = self.joints("previous", request.previous.as_ref())?;
        }
        let branch = self.branch(request)?;
        let position =
            Vector3::from_fn(|row, _| wanted.position.get(row).copied().unwrap_or_default());
        let mut pose = None;
        let solved = match (wanted.a, wanted.r) {
            (None, None) => {
                let pose = pose.insert(Pose { position, rotation: rotation(wanted)? });
                self.mechanism.inverse(pose, branch, &self.previous)
            }
            (a, r) => self
                .mechanism
                .inverse_machine_angles(
                    &position,
                    [a.unwrap_or_default(), r.unwrap_or_default()],
                    branch,
                    &self.previous,
                )
                .ok_or_else(|| {
                    ErrorBody::bad_request(
                        "\"a\" and \"r\" are angles of an mcm; this machine has none".to_owned(),
                    )
                })?,
        };
        let q = solved.map_err(|error| self.kinematics_error(&error))?;
        self.check_limits(&q)?;
        self.previous = q;
        let state = match pose {
            Some(pose) => {
                let near = self.near.as_ref();
                let state = self
                    .mechanism
                    .solve_at(&pose, &q, branch, near)
                    .or_else(|_| self.mechanism.solve(&q, branch, None))
                    .map_err(|error| self.kinematics_error(&error))?;
                *self.near.insert(state)
            }
            None => self.solve(&q, branch)?,
        };
        let axes = self.machine.axes.iter().zip(q.iter()).filter_map(|(axis, value)| {
            let [lower, upper] = axis.limits.position;
            let distance = (value - lower).min(upper - value);
            distance.is_finite().then(|| (axis.name.clone(), distance))
        });
        let singularities = self.mechanism.margins(&state);
        let margin = axes
            .chain(singularities.iter().map(|margin| (margin.name.to_owned(), margin.value)))
            .collect();
        let shown = q.component_div(&self.ratios());
        let branch = shown_branch(self.mechanism.branch_of(&state));
        Ok(Reply::Inverse { q: numbers(&shown), branch, margin })
    }

    /// Tool velocity per joint rate, in the joint values that the user speaks of.
    fn tool_jacobian(&self, state: &M::ChainState) -> SMatrix<f64, 6, N> {
        let mut jacobian = self.mechanism.jacobian(state);
        for (axis, ratio) in self.ratios().iter().enumerate() {
            jacobian.column_mut(axis).scale_mut(*ratio);
        }
        jacobian
    }

    /// The rows of the tool's Jacobian in which the mechanism can choose the tool's motion.
    fn task_jacobian(&self, state: &M::ChainState) -> DMatrix<f64> {
        let jacobian = self.tool_jacobian(state);
        let rows = match self.mechanism.task_space() {
            TaskSpace::Plane => 2,
            TaskSpace::Space => 3,
            TaskSpace::Axis | TaskSpace::Pose => 6,
        };
        let mut task = DMatrix::from_fn(rows, N, |row, column| jacobian[(row, column)]);
        if self.mechanism.task_space() == TaskSpace::Axis {
            // The rate of the beam's direction, ω×t: turning about the beam does not show in it.
            let beam = beam(&self.mechanism.pose(state));
            for column in 0..N {
                let turning: Vector3<f64> = jacobian.fixed_view::<3, 1>(3, column).into_owned();
                task.view_mut((3, column), (3, 1)).copy_from(&turning.cross(&beam));
            }
        }
        task
    }

    fn jacobian(&mut self, request: &Request) -> Result<Reply, ErrorBody> {
        let state = self.state(request)?;
        let task = self.task_jacobian(&state);
        let rows: Vec<Vec<f64>> =
            task.row_iter().map(|row| row.iter().copied().collect()).collect();
        let determinant = if task.is_square() {
            task.clone().lu().determinant()
        } else if task.nrows() > N {
            (task.transpose() * &task).lu().determinant().max(0.0).sqrt()
        } else {
            (&task * task.transpose()).lu().determinant().max(0.0).sqrt()
        };
        let values = SVD::try_new_unordered(task, false, false, 5.0 * f64::EPSILON, MOST_TURNS)
            .ok_or_else(ErrorBody::not_converged)?
            .singular_values;
        let mut singular: Vec<f64> = values.iter().copied().collect();
        singular.sort_by(|a, b| b.total_cmp(a));
        Ok(Reply::Jacobian { j: rows, det: determinant, singular_values: singular })
    }

    fn dynamics(&mut self, request: &Request) -> Result<Reply, ErrorBody> {
        let velocity = self.joints("qd", request.qd.as_ref())?;
        let acceleration = self.joints("qdd", request.qdd.as_ref())?;
        let state = self.state(request)?;
        let mut effort = self.mechanism.inverse_dynamics(&state, &velocity, &acceleration);
        if let Some(wrench) = &request.wrench {
            if wrench.len() > 6 {
                return Err(ErrorBody::bad_request(format!(
                    "\"wrench\" has {} values, at most 6",
                    wrench.len()
                )));
            }
            let wrench = Vector6::from_fn(|row, _| wrench.get(row).copied().unwrap_or(0.0));
            effort += self.mechanism.wrench_efforts(&state, &wrench);
        }
        let ratios = self.ratios();
        let friction = match request.friction {
            Some(false) => Joints::zeros(),
            None | Some(true) => self.friction(&velocity),
        };
        let rotors = self.rotors().component_mul(&acceleration).component_div(&ratios);
        let shown = effort.component_mul(&ratios) + rotors + friction;
        Ok(Reply::Dynamics { effort: numbers(&shown), friction: numbers(&friction) })
    }

    /// What the axes' friction takes at `velocity` [m/s or rad/s], as efforts on what the user calls a
    /// joint value.
    fn friction(&self, velocity: &Joints<N>) -> Joints<N> {
        let joints = Joints::<N>::from_fn(|axis, _| {
            let of = |it: &Actuator| it.friction.torque(velocity[axis] / it.ratio) / it.ratio;
            self.actuators(axis).iter().map(of).sum::<f64>()
        });
        joints.component_mul(&self.ratios())
    }

    /// Inertia of each axis' rotors, at the shaft of its first motor, where motor angles are asked for
    /// [kg·m²]; joints have none.
    fn rotors(&self) -> Joints<N> {
        let motor = self.arguments.motor;
        Joints::from_fn(|axis, _| {
            let own = self.actuators(axis);
            let turns = |it: &Actuator| own[0].ratio / it.ratio;
            let of = |it: &Actuator| it.motor.rotor_inertia() * turns(it) * turns(it);
            if motor { own.iter().map(of).sum() } else { 0.0 }
        })
    }

    /// What drives the axis with this index; a machine file gives each at least one.
    fn actuators(&self, axis: usize) -> &[Actuator] {
        self.machine.axes[axis].driven_by(&self.machine.actuators)
    }

    fn matrices(&mut self, request: &Request) -> Result<Reply, ErrorBody> {
        let velocity = match &request.qd {
            None => Joints::zeros(),
            given => self.joints("qd", given.as_ref())?,
        };
        let state = self.state(request)?;
        let equation = EquationOfMotion::of(self.mechanism, &state, &velocity)
            .through(&self.ratios(), &self.rotors());
        let rows = |matrix: &SMatrix<f64, N, N>| {
            matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
        };
        let coriolis = |row| equation.coriolis.iter().map(|column| column[row]).collect();
        Ok(Reply::Matrices {
            m: rows(&equation.mass),
            v: numbers(&equation.velocity),
            g: numbers(&equation.gravity),
            c: rows(&equation.centrifugal),
            b: (0..N).map(coriolis).collect(),
            friction: numbers(&self.friction(&velocity)),
        })
    }

    fn ellipse(&mut self, request: &Request) -> Result<Reply, ErrorBody> {
        let state = self.state(request)?;
        let jacobian = self.tool_jacobian(&state);
        let size = self.dimensions();
        let linear = DMatrix::from_fn(size, N, |row, column| jacobian[(row, column)]);
        let axes = principal_axes(&linear * linear.transpose())?;
        let least = axes.last().map_or(0.0, |(axis, _)| *axis);
        // So near to a singularity that the force has no number either.
        if !least.recip().is_finite() {
            return Err(ErrorBody {
                code: "singular".into(),
                axis: None,
                value: Some(least),
                limit: Some(0.0),
                detail: "the tool cannot move in one direction here".into(),
            });
        }
        let ellipse = |axes: Vec<(f64, DVector<f64>)>| Ellipse {
            angle: axes.first().map_or(0.0, |(_, direction)| angle(direction)),
            directions: axes.iter().map(|(_, along)| along.iter().copied().collect()).collect(),
            axes: axes.iter().map(|(axis, _)| *axis).collect(),
        };
        // Kinetostatic duality (source 003 eq. 5.13, 5.14): the force ellipse is the inverse one.
        let inverse = axes.iter().rev().map(|(axis, along)| (1.0 / axis, along.clone())).collect();
        Ok(Reply::Ellipse { velocity: ellipse(axes), force: ellipse(inverse) })
    }

    fn dimensions(&self) -> usize {
        if self.mechanism.task_space() == TaskSpace::Plane { 2 } else { 3 }
    }

    fn shown(&self, position: &Vector3<f64>) -> Vec<f64> {
        position.iter().take(self.dimensions()).copied().collect()
    }

    fn check_limits(&self, q: &Joints<N>) -> Result<(), ErrorBody> {
        for (axis, value) in self.machine.axes.iter().zip(q.iter()) {
            let [lower, upper] = axis.limits.position;
            let (limit, side) = if !value.is_finite() {
                (f64::NAN, "is not a number")
            } else if *value < lower {
                (lower, "is below its lower limit")
            } else if *value > upper {
                (upper, "is above its upper limit")
            } else {
                continue;
            };
            return Err(ErrorBody {
                code: format!("limit_{}", axis.name),
                axis: Some(axis.name.clone()),
                value: value.is_finite().then_some(*value),
                limit: limit.is_finite().then_some(limit),
                detail: format!("axis {} {side}", axis.name),
            });
        }
        Ok(())
    }

    fn kinematics_error(&self, error: &KinematicsError) -> ErrorBody {
        ErrorBody {
            code: error.code.into(),
            axis: error.axis.and_then(|axis| self.machine.axes.get(axis)).map(|a| a.name.clone()),
            value: error.value.is_finite().then_some(error.value),
            limit: error.limit.is_finite().then_some(error.limit),
            detail: error.detail.into(),
        }
    }
}

/// A number for each joint, as it is printed.
fn numbers<const N: usize>(joints: &Joints<N>) -> Vec<f64> {
    joints.as_slice().to_vec()
}

/// The direction in which the beam shines.
fn beam(pose: &Pose) -> Vector3<f64> {
    -pose.rotation.column(2).into_owned()
}

/// The orientation that a pose asks for; level where it asks for none.
fn rotation(pose: &RequestPose) -> Result<Matrix3<f64>, ErrorBody> {
    /// How far from orthonormal a rotation may be written.
    const ROUNDING: f64 = 1e-6;
    if let Some(rows) = &pose.rotation {
        let rotation = Matrix3::from_fn(|row, column| rows[row][column]);
        let off = (rotation * rotation.transpose() - Matrix3::identity()).amax();
        if off.is_nan() || off > ROUNDING || rotation.determinant() < 0.0 {
            return Err(ErrorBody::bad_request("\"rotation\" is not a rotation".to_owned()));
        }
        return Ok(rotation);
    }
    let Some(axis) = pose.axis else { return Ok(Matrix3::identity()) };
    let axis = Vector3::from(axis);
    if !(axis.norm() > 0.0 && axis.norm().is_finite()) {
        return Err(ErrorBody::bad_request("\"axis\" has no direction".to_owned()));
    }
    let down = -Vector3::z();
    let turned = Rotation3::rotation_between(&down, &axis)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI));
    Ok(turned.into_inner())
}

/// A branch as it is printed: single values as numbers.
fn shown_branch(branch: impl machine::kinematics::Branch) -> Branch {
    branch
        .choices()
        .into_iter()
        .map(|(name, values)| {
            let value = match values.as_slice() {
                [value] => (*value).into(),
                values => values.into(),
            };
            (name.to_owned(), value)
        })
        .collect()
}

/// Semi-axes, larger first, of the ellipsoid of a symmetric matrix, with their directions.
fn principal_axes(matrix: DMatrix<f64>) -> Result<Vec<(f64, DVector<f64>)>, ErrorBody> {
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_TURNS)
        .ok_or_else(ErrorBody::not_converged)?;
    let mut axes: Vec<(f64, DVector<f64>)> = eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
        .map(|(value, direction)| (value.max(0.0).sqrt(), direction.into_owned()))
        .collect();
    axes.sort_by(|(first, _), (second, _)| second.total_cmp(first));
    Ok(axes)
}

/// Angle of a line along `direction` in the x-y plane, in (−π/2, π/2] [rad].
fn angle(direction: &DVector<f64>) -> f64 {
    let right = core::f64::consts::FRAC_PI_2;
    let angle = math::atan2(direction[1], direction[0]);
    if angle > right {
        angle - 2.0 * right
    } else if angle <= -right {
        angle + 2.0 * right
    } else {
        angle
    }
}

fn missing(key: &str) -> ErrorBody {
    ErrorBody::bad_request(format!("\"{key}\" is missing"))
}
