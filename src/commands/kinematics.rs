//! `graver kinematics`: JSON lines in, JSON lines out, in order.

pub mod lines;

use self::lines::{Branch, Ellipse, ErrorBody, Reply, ReplyPose, Request};
use crate::arguments::{KinematicsArguments, KinematicsVerb};
use crate::exit::{Exit, Failure};
use crate::inputs;
use machine::kinematics::{Joints, KinematicsError};
use machine::{Machine, Mechanism, MechanismVisitor, Pose};
use nalgebra::{Matrix2, SMatrix, SymmetricEigen, Vector3};
use signals::math;
use std::io::{BufRead, BufWriter, Write};

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
        let answer =
            Answer { mechanism: &mechanism, machine: &self.machine, arguments: self.arguments };
        let mut previous = Joints::<N>::zeros();
        let mut line = String::new();
        let mut number = 0;
        loop {
            line.clear();
            let read = self.input.read_line(&mut line).map_err(Failure::service)?;
            if read == 0 {
                break;
            }
            number += 1;
            if line.trim().is_empty() {
                continue;
            }
            let request: Request = match serde_json::from_str(&line) {
                Ok(request) => request,
                Err(error) => {
                    self.output.flush().map_err(Failure::service)?;
                    return Err(Failure::bad_input(format!(
                        "standard input, line {number}, column {}: {error}",
                        error.column()
                    )));
                }
            };
            let reply = answer.line(&request, &mut previous);
            let reply = reply.unwrap_or_else(|error| Reply::Error { error });
            serde_json::to_writer(&mut self.output, &reply).map_err(Failure::service)?;
            self.output.write_all(b"\n").map_err(Failure::service)?;
        }
        self.output.flush().map_err(Failure::service)?;
        Ok(Exit::Done)
    }
}

struct Answer<'a, const N: usize, M> {
    mechanism: &'a M,
    machine: &'a Machine,
    arguments: &'a KinematicsArguments,
}

impl<const N: usize, M: Mechanism<N>> Answer<'_, N, M> {
    fn line(&self, request: &Request, previous: &mut Joints<N>) -> Result<Reply, ErrorBody> {
        match self.arguments.verb {
            KinematicsVerb::Forward => self.forward(request),
            KinematicsVerb::Inverse => self.inverse(request, previous),
            KinematicsVerb::Jacobian => self.jacobian(request),
            KinematicsVerb::Dynamics => self.dynamics(request),
            KinematicsVerb::Ellipse => self.ellipse(request),
        }
    }

    /// Joint units per unit of what the user calls a joint value.
    fn ratios(&self) -> Joints<N> {
        Joints::from_fn(
            |axis, _| {
                if self.arguments.motor { self.machine.axes[axis].ratio } else { 1.0 }
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

    fn assemble(&self, q: &Joints<N>) -> Result<M::Assembly, ErrorBody> {
        self.mechanism
            .assemble(q, self.mechanism.branch(), None)
            .map_err(|error| self.kinematics_error(&error))
    }

    fn forward(&self, request: &Request) -> Result<Reply, ErrorBody> {
        let q = self.joints("q", request.q.as_ref())?;
        self.check_limits(&q)?;
        let pose = self
            .mechanism
            .forward(&q, self.mechanism.branch())
            .map_err(|error| self.kinematics_error(&error))?;
        let pose = ReplyPose { position: self.shown(&pose.position) };
        Ok(Reply::Forward { pose, branch: Branch::new() })
    }

    fn inverse(&self, request: &Request, previous: &mut Joints<N>) -> Result<Reply, ErrorBody> {
        let pose = request.pose.as_ref().ok_or_else(|| missing("pose"))?;
        let shown = self.dimensions();
        if pose.position.len() < shown || pose.position.len() > 3 {
            return Err(ErrorBody::bad_request(format!(
                "\"position\" has {} values, the tool moves in {shown}",
                pose.position.len()
            )));
        }
        if request.previous.is_some() {
            *previous = self.joints("previous", request.previous.as_ref())?;
        }
        let position =
            Vector3::from_fn(|row, _| pose.position.get(row).copied().unwrap_or_default());
        let q = self
            .mechanism
            .inverse(&Pose::at(position), self.mechanism.branch(), previous)
            .map_err(|error| self.kinematics_error(&error))?;
        self.check_limits(&q)?;
        *previous = q;
        let margin = self
            .machine
            .axes
            .iter()
            .zip(q.iter())
            .map(|(axis, value)| {
                let [lower, upper] = axis.limits.position;
                (axis.name.clone(), (value - lower).min(upper - value))
            })
            .collect();
        let shown = q.component_div(&self.ratios());
        Ok(Reply::Inverse { q: shown.as_slice().to_vec(), branch: Branch::new(), margin })
    }

    /// Tool velocity per joint rate, in the directions in which the tool moves.
    fn tool_jacobian(&self, assembly: &M::Assembly) -> SMatrix<f64, 6, N> {
        let mut jacobian = self.mechanism.jacobian(assembly);
        for (axis, ratio) in self.ratios().iter().enumerate() {
            jacobian.column_mut(axis).scale_mut(*ratio);
        }
        jacobian
    }

    fn jacobian(&self, request: &Request) -> Result<Reply, ErrorBody> {
        let q = self.joints("q", request.q.as_ref())?;
        let jacobian = self.tool_jacobian(&self.assemble(&q)?);
        let square = SMatrix::<f64, N, N>::from_fn(|row, column| jacobian[(row, column)]);
        let rows: Vec<Vec<f64>> =
            square.row_iter().map(|row| row.iter().copied().collect()).collect();
        let dynamic = nalgebra::DMatrix::from_fn(N, N, |row, column| square[(row, column)]);
        let determinant = dynamic.clone().lu().determinant();
        let mut singular: Vec<f64> = dynamic.singular_values().iter().copied().collect();
        singular.sort_by(|a, b| b.total_cmp(a));
        Ok(Reply::Jacobian { j: rows, det: determinant, singular_values: singular })
    }

    fn dynamics(&self, request: &Request) -> Result<Reply, ErrorBody> {
        let position = self.joints("q", request.q.as_ref())?;
        let velocity = self.joints("qd", request.qd.as_ref())?;
        let acceleration = self.joints("qdd", request.qdd.as_ref())?;
        let assembly = self.assemble(&position)?;
        let mut effort = self.mechanism.inverse_dynamics(&assembly, &velocity, &acceleration);
        if let Some(wrench) = &request.wrench {
            if wrench.len() > 6 {
                return Err(ErrorBody::bad_request(format!(
                    "\"wrench\" has {} values, at most 6",
                    wrench.len()
                )));
            }
            // The tool pushes on the work with this wrench: virtual work gives Jᵀ·w at the joints.
            let wrench =
                nalgebra::Vector6::from_fn(|row, _| wrench.get(row).copied().unwrap_or(0.0));
            effort += self.mechanism.jacobian(&assembly).transpose() * wrench;
        }
        let ratios = self.ratios();
        let mut shown = effort.component_mul(&ratios);
        if self.arguments.motor {
            for (axis, value) in shown.iter_mut().enumerate() {
                let settings = &self.machine.axes[axis];
                *value += settings.motor.rotor_inertia * acceleration[axis] / settings.ratio;
            }
        }
        Ok(Reply::Dynamics { effort: shown.as_slice().to_vec() })
    }

    fn ellipse(&self, request: &Request) -> Result<Reply, ErrorBody> {
        let q = self.joints("q", request.q.as_ref())?;
        let jacobian = self.tool_jacobian(&self.assemble(&q)?);
        let plane = jacobian.fixed_view::<2, N>(0, 0);
        let product: Matrix2<f64> = plane * plane.transpose();
        let (axes, angle) = principal_axes(product);
        if axes[1] <= 0.0 {
            return Err(ErrorBody {
                code: "singular".into(),
                axis: None,
                value: Some(axes[1]),
                limit: Some(0.0),
                detail: "the tool cannot move in one direction here".into(),
            });
        }
        // Kinetostatic duality (source 003 eq. 5.13, 5.14): the force ellipse is the inverse one.
        let right = core::f64::consts::FRAC_PI_2;
        let turned = if angle > 0.0 { angle - right } else { angle + right };
        Ok(Reply::Ellipse {
            velocity: Ellipse { axes, angle },
            force: Ellipse { axes: [1.0 / axes[1], 1.0 / axes[0]], angle: turned },
        })
    }

    fn dimensions(&self) -> usize {
        if N < 3 { 2 } else { 3 }
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
            value: Some(error.value),
            limit: Some(error.limit),
            detail: error.detail.into(),
        }
    }
}

/// Semi-axes, larger first, of the ellipse of a symmetric matrix, and the angle of the larger one
/// in (−π/2, π/2] [rad].
fn principal_axes(matrix: Matrix2<f64>) -> ([f64; 2], f64) {
    let eigen = SymmetricEigen::new(matrix);
    let (major, minor) = if eigen.eigenvalues[0] >= eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
    let direction = eigen.eigenvectors.column(major);
    let mut angle = math::atan2(direction[1], direction[0]);
    let right = core::f64::consts::FRAC_PI_2;
    if angle > right {
        angle -= 2.0 * right;
    } else if angle <= -right {
        angle += 2.0 * right;
    }
    let semi = |index: usize| eigen.eigenvalues[index].max(0.0).sqrt();
    ([semi(major), semi(minor)], angle)
}

fn missing(key: &str) -> ErrorBody {
    ErrorBody::bad_request(format!("\"{key}\" is missing"))
}
