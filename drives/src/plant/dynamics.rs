//! Equations of motion of motors, transmission and load, and one Runge–Kutta step through them.
//!
//! Per motor: current, angle, speed; per joint: position and velocity of the load.
//!
//! ```text
//! voltage ─► winding ─► k·i ─► rotor ─ratio─► K, B ─► load ─► tool
//!                               │ viscous and Coulomb friction
//! ```
//!
//! With an elastic transmission the joints feel `τ = K·(q_m − q_l) + B·(q̇_m − q̇_l)`, and the
//! motors `−ratio·τ`. A joint with backlash feels nothing while its gap is open; once it is closed,
//! the spring is wound by what is left of the way, and pushes but does not pull. With a rigid
//! transmission motors and load are one inertia in joint coordinates, `diag(J/ratio²) + M(q)`. A gearbox's efficiency is sizing data and not part of the motion;
//! losses are the friction at the shaft.
//!
//! Which motors stick, and against which friction the others slide, stands still during a step:
//! [`friction`](super::friction) sees to that. How the inertia of the load changes during it says
//! [`coupling`](super::coupling).

use machine::Mechanism;
use machine::kinematics::{Joints, KinematicsError, Pose};
use machine::transmission::backlash;
use nalgebra::{SMatrix, SVector};

use super::PlantError;
use super::contacts::Contacts;
use super::coupling::{Coupling, Response, Unsolvable, positive_inverse};
use super::motors::Motors;
use super::state::{Phases, State};
use super::stepping::Field;
use super::winding::Weights;

/// Times that the decay of a rotor whose winding has settled counts against the stability of a step, which
/// ends at a product of 1 there: each step begins with the current that its fourth stage led to.
const SETTLING: f64 = 3.0;

/// What joins motors and load.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Transmission<const N: usize> {
    Rigid,
    Elastic {
        stiffness: SMatrix<f64, N, N>,
        damping: SMatrix<f64, N, N>,
        /// Half of the backlash of each joint, where any has some [joint units].
        gaps: Option<Joints<N>>,
    },
}

/// The equations of motion.
#[derive(Debug, Clone)]
pub struct Dynamics<const N: usize, M: Mechanism<N>, const A: usize = N> {
    mechanism: M,
    motors: Motors<A>,
    transmission: Transmission<N>,
    coupling: Coupling<N, M>,
    /// What turns steppers.
    field: Option<Field<A>>,
    /// 1/J of each rotor.
    mobility: SVector<f64, A>,
    /// ratio/J of each rotor.
    reaction: SVector<f64, A>,
    /// 1/ratio: motor radians per joint unit.
    turns: SVector<f64, A>,
}

/// Where a step has led.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached<const N: usize, const A: usize = N> {
    /// Where the plant is.
    pub state: State<N, A>,
    /// Acceleration of the load in the step's last stage, which is third-order close to where it
    /// ended [m/s² or rad/s²].
    pub acceleration: Joints<N>,
}

/// The part of a substep that a step takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Where it starts, as a share of the substep.
    pub from: f64,
    /// How much of it it takes, as a share.
    pub length: f64,
}

impl Part {
    /// All of it.
    pub const WHOLE: Self = Self { from: 0.0, length: 1.0 };

    /// The share at which it ends.
    pub fn end(&self) -> f64 {
        self.from + self.length
    }
}

impl<const N: usize, M: Mechanism<N>, const A: usize> Dynamics<N, M, A> {
    /// The equations of `mechanism` moved by `motors`.
    ///
    /// # Errors
    /// If the mass matrix at `home` cannot be inverted, or several motors drive a joint rigidly or with
    /// backlash.
    pub fn new(mechanism: M, motors: Motors<A>, home: M::ChainState) -> Result<Self, PlantError> {
        let mut gap = Joints::<N>::zeros();
        for (motor, joint) in motors.joint.into_iter().enumerate() {
            gap[joint] = motors.gap[motor].max(gap[joint]);
        }
        let gaps = Some(gap).filter(|gap| gap.iter().any(|gap| *gap > 0.0));
        let has_gap = |motor: usize| motors.share[motor] < 1.0 && motors.gap[motor] > 0.0;
        if A != N && ((0..A).any(has_gap) || mechanism.stiffness().is_none()) {
            return Err(PlantError::Pair);
        }
        let transmission = match mechanism.stiffness() {
            Some(stiffness) => {
                Transmission::Elastic { stiffness, damping: mechanism.damping(), gaps }
            }
            None => Transmission::Rigid,
        };
        let rigid = (transmission == Transmission::Rigid).then(|| rotors(&motors));
        let coupling =
            Coupling::new(&mechanism, home, rigid).map_err(|_| PlantError::SingularMass)?;
        let mobility = motors.inertia.map(|inertia| 1.0 / inertia);
        Ok(Self {
            mechanism,
            motors,
            transmission,
            coupling,
            field: None,
            mobility,
            reaction: motors.ratio.component_mul(&mobility),
            turns: motors.ratio.map(|ratio| 1.0 / ratio),
        })
    }

    /// The mechanism.
    pub fn mechanism(&self) -> &M {
        &self.mechanism
    }

    /// Where the tool is with the load at `load` [m or rad], the chain solved from where it was last.
    ///
    /// # Errors
    /// Where it cannot close.
    pub fn locate(&self, load: &Joints<N>) -> Result<Pose, KinematicsError> {
        self.mechanism.locate(load, self.mechanism.branch(), Some(self.coupling.chain()))
    }

    /// The same with steppers, which turn in `field`.
    pub(super) fn with_field(self, field: Option<Field<A>>) -> Self {
        Self { field, ..self }
    }

    /// What turns steppers, to be moved on.
    pub(super) fn field_mut(&mut self) -> Option<&mut Field<A>> {
        self.field.as_mut()
    }

    /// Closes the brakes of motors that have been powered for `time` [s], `None` if they are not, and
    /// opens those that have had the time to.
    pub(super) fn power(&mut self, time: Option<f64>) {
        self.motors.power(time);
    }

    /// The motors.
    pub fn motors(&self) -> &Motors<A> {
        &self.motors
    }

    /// Puts the load where a rigid transmission has it; leaves it alone behind an elastic one.
    pub fn couple(&self, state: &mut State<N, A>) {
        if self.transmission == Transmission::Rigid {
            state.load = by_joint(&self.motors.ratio.component_mul(&state.angle));
            state.load_speed = by_joint(&self.motors.ratio.component_mul(&state.speed));
        }
    }

    /// An upper bound of the modulus of every mechanical eigenvalue at `home` [1/s].
    ///
    /// For `s² + d·s + w²` with matrix norms `d` and `w²`, `|s| ≤ (d + √(d² + 4w²))/2`.
    pub fn fastest(&self) -> f64 {
        let motors = &self.motors;
        let Transmission::Elastic { stiffness, damping, .. } = &self.transmission else {
            let drag = self.at_shafts(&motors.viscous);
            return match &self.field {
                Some(field) => {
                    let damping = self.at_shafts(&field.damping());
                    bound(drag + damping, self.at_shafts(&field.stiffness()))
                }
                None => drag,
            };
        };
        let mut drag = self.at_shafts(&motors.viscous);
        let mut spring = 0.0;
        if let Some(field) = &self.field {
            drag += self.at_shafts(&field.damping());
            spring = self.at_shafts(&field.stiffness());
        }
        let rotors = motors.ratio.component_mul(&motors.ratio).component_div(&motors.inertia);
        let rotors = if A == N {
            by_joint(&rotors)
        } else {
            // Several rotors on one joint swing against each other too.
            let shared = rotors.component_mul(&motors.share);
            Joints::from_fn(|joint, _| {
                let own = (0..A).filter(|motor| motors.joint[*motor] == joint);
                2.0 * own.map(|motor| shared[motor]).fold(0.0, f64::max)
            })
        };
        let admittance = self.coupling.mobility() + SMatrix::from_diagonal(&rotors);
        let square = row_sum(&(admittance * stiffness)) + spring;
        let linear = row_sum(&(admittance * damping)) + drag;
        bound(linear, square)
    }

    /// The rate at which windings and rotors turn each other by torque and back-EMF at `home` [1/s], as the
    /// step feels it: for that it is explicit, however exactly it solves a winding alone.
    ///
    /// A slow winding swings with its rotor at `k/√(L·J)`. Where the winding settles within the step, what is
    /// left is the rotor's decay, `k²/(R·J)`, which counts three times. In between, the smaller of
    /// the two is enough: the product with a step that is just stable is nowhere below 2.8, by the
    /// eigenvalues of the step for `R·h/L` from 0.001 to 10,000.
    pub fn electrical(&self) -> f64 {
        let windings = &self.motors.windings;
        let square = windings.torque_constant.component_mul(&windings.torque_constant);
        let swing = self.at_shafts(&square.component_div(&windings.inductance)).sqrt();
        swing.min(SETTLING * self.at_shafts(&square.component_div(&windings.resistance)))
    }

    /// What `at_shaft`, torques of the motors by their motion, makes of the acceleration of what they turn
    /// directly: of the rotors, and behind a rigid transmission of motors and load, which are one inertia.
    fn at_shafts(&self, at_shaft: &SVector<f64, A>) -> f64 {
        match self.transmission {
            Transmission::Elastic { .. } => self.mobility.component_mul(at_shaft).amax(),
            Transmission::Rigid => {
                let square = self.motors.ratio.component_mul(&self.motors.ratio);
                let turned = SMatrix::from_diagonal(&by_joint(&at_shaft.component_div(&square)));
                row_sum(&(self.coupling.mobility() * turned))
            }
        }
    }

    /// Solves the load side for a substep of `step` [s] that begins in `state`.
    ///
    /// # Errors
    /// If the chain cannot close on the way, or is singular there.
    pub fn begin(&mut self, state: &State<N, A>, step: f64) -> Result<(), Unsolvable> {
        self.coupling.begin(&self.mechanism, &state.load, &state.load_speed, step)
    }

    /// The end of the substep begun, where `contacts` have changed just there.
    pub fn turn(&self, state: &State<N, A>, contacts: &Contacts<A>) -> Reached<N, A> {
        let response = self.coupling.at(1.0);
        let (_, acceleration) = self.accelerations(state, contacts, &response, 1.0);
        Reached { state: *state, acceleration }
    }

    /// Ends the substep as `reached`, where the next one begins.
    pub fn end(&mut self, reached: &Reached<N, A>) {
        self.coupling.end(&reached.state.load, &reached.state.load_speed, &reached.acceleration);
    }

    /// Torque that turns each motor at the share `at` of the substep begun, Coulomb friction left
    /// out: what its stiction must hold.
    pub fn net_torque(
        &self,
        state: &State<N, A>,
        contacts: &Contacts<A>,
        at: f64,
    ) -> SVector<f64, A> {
        let motors = &self.motors;
        let shaft = self.driven(state) - motors.viscous.component_mul(&state.speed);
        match self.transmission {
            Transmission::Elastic { .. } => {
                let effort = self.transmitted(state);
                shaft - motors.ratio.component_mul(&self.borne(state, &effort))
            }
            Transmission::Rigid => {
                let response = self.coupling.at(at);
                let (_, load) = self.accelerations(state, contacts, &response, at);
                // A held motor bears what the others' acceleration puts on its joint.
                let load_side = self.coupling.inertia(at) * load + response.bias;
                shaft - motors.ratio.component_mul(&by_motor(&load_side))
            }
        }
    }

    /// Torque of currents and fields on the rotors [N·m].
    #[inline(always)]
    fn driven(&self, state: &State<N, A>) -> SVector<f64, A> {
        match &self.field {
            None => self.motors.windings.torque_constant.component_mul(&state.current),
            Some(field) => field.torque(state),
        }
    }

    /// Effort that the transmission puts on the joints [N or N·m]; zero when it is rigid.
    #[inline(always)]
    pub fn transmitted(&self, state: &State<N, A>) -> Joints<N> {
        match &self.transmission {
            Transmission::Rigid => Joints::zeros(),
            Transmission::Elastic { stiffness, damping, gaps } => {
                let ahead = self.joined(&state.angle) - state.load;
                let faster = self.joined(&state.speed) - state.load_speed;
                if let Some(gaps) = gaps {
                    return across_gaps(stiffness, damping, &ahead, &faster, gaps);
                }
                stiffness * ahead + damping * faster
            }
        }
    }

    /// Where `angle` of the motors has the joints: of several motors on one, in the mean of their springs.
    #[inline(always)]
    fn joined(&self, angle: &SVector<f64, A>) -> Joints<N> {
        let Motors { ratio, share, joint, .. } = &self.motors;
        if A == N {
            return Joints::from_fn(|row, _| ratio[row] * angle[row]);
        }
        let mut joined = Joints::zeros();
        for motor in 0..A {
            joined[joint[motor]] += share[motor] * (ratio[motor] * angle[motor]);
        }
        joined
    }

    /// What of the `effort` of the transmission each motor bears at its joint [N or N·m]: its share, and what
    /// its own spring has beyond the mean of those of its joint.
    #[inline(always)]
    fn borne(&self, state: &State<N, A>, effort: &Joints<N>) -> SVector<f64, A> {
        let (Transmission::Elastic { stiffness, damping, .. }, false) =
            (&self.transmission, A == N)
        else {
            return by_motor(effort);
        };
        let Motors { ratio, share, joint, .. } = &self.motors;
        let (mean, mean_speed) = (self.joined(&state.angle), self.joined(&state.speed));
        SVector::from_fn(|motor, _| {
            let row = joint[motor];
            let ahead = ratio[motor] * state.angle[motor] - mean[row];
            let faster = ratio[motor] * state.speed[motor] - mean_speed[row];
            let own = stiffness[(row, row)] * ahead + damping[(row, row)] * faster;
            share[motor] * (effort[row] + own)
        })
    }

    /// Accelerations of motors [rad/s²] and load [m/s² or rad/s²] at the share `at` of the substep
    /// begun, where the load has this `response`.
    #[inline(always)] // Four calls a step through memory cost as much as the arithmetic.
    fn accelerations(
        &self,
        state: &State<N, A>,
        contacts: &Contacts<A>,
        response: &Response<N>,
        at: f64,
    ) -> (SVector<f64, A>, Joints<N>) {
        let motors = &self.motors;
        let torque =
            self.driven(state) - motors.viscous.component_mul(&state.speed) - contacts.torque();
        match self.transmission {
            Transmission::Elastic { .. } => {
                let effort = self.transmitted(state);
                let motor = (self.mobility.component_mul(&torque)
                    - self.reaction.component_mul(&self.borne(state, &effort)))
                .component_mul(contacts.free());
                (motor, response.mobility * (effort - response.bias))
            }
            Transmission::Rigid => {
                let free = by_joint(contacts.free());
                let push = (by_joint(&torque.component_mul(&self.turns)) - response.bias)
                    .component_mul(&free);
                let load = if contacts.any_held() {
                    partly_held(&self.coupling.inertia(at), &push, &free)
                } else {
                    response.mobility * push
                };
                (by_motor::<N, A>(&load).component_mul(&self.turns), load)
            }
        }
    }

    /// Where `start` is after one step of the length of `weights`, which is `part` of the substep
    /// begun.
    ///
    /// Classical fourth-order Runge–Kutta for the mechanical part; the winding is solved by its
    /// exponentials at the same stages. Current beyond the power stage's limit is cut at the
    /// end of the step: see [`super::Plant`].
    pub fn step(
        &self,
        start: &State<N, A>,
        contacts: &Contacts<A>,
        phases: &Phases<A>,
        weights: &Weights<A>,
        part: Part,
    ) -> Reached<N, A> {
        let step = weights.step;
        let half = 0.5 * step;
        let course = match phases {
            Phases::Open => None,
            Phases::Driven(voltage) => {
                Some(self.motors.windings.course(&start.current, &start.speed, voltage))
            }
        };
        let current =
            |value: fn(&super::winding::Course<A>, &Weights<A>, &SVector<f64, A>) -> _,
             speed: &SVector<f64, A>| {
                course.as_ref().map_or_else(SVector::zeros, |course| value(course, weights, speed))
            };
        let shares = [part.from, part.from + 0.5 * part.length, part.end()];
        // One by one: an array's `map` would take them through memory.
        let at_start = self.coupling.at(shares[0]);
        let halfway = self.coupling.at(shares[1]);
        let at_end = self.coupling.at(shares[2]);
        let mut first = *start;
        if course.is_none() {
            first.current = SVector::zeros();
        }
        let (motor_1, load_1) = self.accelerations(&first, contacts, &at_start, shares[0]);

        let mut second = State {
            current: current(|course, weights, _| course.second(weights), &first.speed),
            angle: first.angle + first.speed * half,
            speed: first.speed + motor_1 * half,
            load: first.load + first.load_speed * half,
            load_speed: first.load_speed + load_1 * half,
        };
        self.couple(&mut second);
        let (motor_2, load_2) = self.accelerations(&second, contacts, &halfway, shares[1]);

        let mut third = State {
            current: current(super::winding::Course::third, &second.speed),
            angle: first.angle + second.speed * half,
            speed: first.speed + motor_2 * half,
            load: first.load + second.load_speed * half,
            load_speed: first.load_speed + load_2 * half,
        };
        self.couple(&mut third);
        let (motor_3, load_3) = self.accelerations(&third, contacts, &halfway, shares[1]);

        let mut fourth = State {
            current: current(super::winding::Course::fourth, &third.speed),
            angle: first.angle + third.speed * step,
            speed: first.speed + motor_3 * step,
            load: first.load + third.load_speed * step,
            load_speed: first.load_speed + load_3 * step,
        };
        self.couple(&mut fourth);
        let (motor_4, load_4) = self.accelerations(&fourth, contacts, &at_end, shares[2]);

        let sixth = step / 6.0;
        let between = second.speed + third.speed;
        let mut end = State {
            current: course.map_or_else(SVector::zeros, |course| {
                course.end(weights, &(between * 0.5), &fourth.speed)
            }),
            angle: first.angle + (first.speed + between * 2.0 + fourth.speed) * sixth,
            speed: first.speed + (motor_1 + (motor_2 + motor_3) * 2.0 + motor_4) * sixth,
            load: first.load
                + (first.load_speed
                    + (second.load_speed + third.load_speed) * 2.0
                    + fourth.load_speed)
                    * sixth,
            load_speed: first.load_speed + (load_1 + (load_2 + load_3) * 2.0 + load_4) * sixth,
        };
        self.couple(&mut end);
        Reached { state: end, acceleration: load_4 }
    }
}

/// Effort on the joints where motors are `ahead` and `faster` by so much across gaps of `half` to
/// either side: none where a gap is open, and never one that pulls the motor's flank along.
#[cold]
#[inline(never)] // Its loop in every stage would cost the machines that have no backlash.
fn across_gaps<const N: usize>(
    stiffness: &SMatrix<f64, N, N>,
    damping: &SMatrix<f64, N, N>,
    ahead: &Joints<N>,
    faster: &Joints<N>,
    half: &Joints<N>,
) -> Joints<N> {
    let wound = backlash::wound(stiffness, ahead, half);
    // The very sums that `wound` stops at: to the last bit on a flank, or off it.
    let pushes = |joint: usize| wound[joint] == ahead[joint] - half[joint];
    let pulls = |joint: usize| wound[joint] == ahead[joint] + half[joint];
    let winding =
        Joints::from_fn(|joint, _| if pushes(joint) || pulls(joint) { faster[joint] } else { 0.0 });
    let effort = stiffness * wound + damping * winding;
    Joints::from_fn(|joint, _| match (pushes(joint), pulls(joint)) {
        // No gap at all.
        (true, true) => effort[joint],
        (true, false) => effort[joint].max(0.0),
        (false, true) => effort[joint].min(0.0),
        (false, false) => 0.0,
    })
}

/// The largest sum of sizes in a row of `matrix`, which bounds its eigenvalues.
fn row_sum<const N: usize>(matrix: &SMatrix<f64, N, N>) -> f64 {
    matrix.row_iter().map(|row| row.abs().sum()).fold(0.0, f64::max)
}

/// `|s|` of `s² + linear·s + square` at most.
fn bound(linear: f64, square: f64) -> f64 {
    (linear + (linear * linear + 4.0 * square).sqrt()) / 2.0
}

/// Accelerations of the joints that are free, the others being held.
fn partly_held<const N: usize>(
    inertia: &SMatrix<f64, N, N>,
    push: &Joints<N>,
    free: &Joints<N>,
) -> Joints<N> {
    let matrix = SMatrix::<f64, N, N>::from_fn(|row, column| {
        let held = if row == column { 1.0 - free[row] } else { 0.0 };
        inertia[(row, column)] * free[row] * free[column] + held
    });
    // A principal part of a positive definite matrix is one too.
    positive_inverse(&matrix).map_or_else(Joints::zeros, |inverse| inverse * push)
}

/// The rotors' inertia in joint coordinates, one on each joint.
fn rotors<const N: usize, const A: usize>(motors: &Motors<A>) -> SMatrix<f64, N, N> {
    let square = motors.ratio.component_mul(&motors.ratio);
    SMatrix::from_diagonal(&by_joint(&motors.inertia.component_div(&square)))
}

/// What belongs to the motors of joints with one each, by joint.
#[inline(always)]
fn by_joint<const N: usize, const A: usize>(motors: &SVector<f64, A>) -> Joints<N> {
    Joints::from_fn(|row, _| motors[row])
}

/// What belongs to joints with one motor each, by motor; 0 of those that are not there.
#[inline(always)]
fn by_motor<const N: usize, const A: usize>(joints: &Joints<N>) -> SVector<f64, A> {
    SVector::from_fn(|row, _| if row < N { joints[row] } else { 0.0 })
}
