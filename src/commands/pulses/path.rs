//! Where the counted pulses alone take the tool (source 004, section 4.4.c).
//!
//! A joint is where its count puts it, less the lead that the plan has over the load at that time: what
//! bends, and how far a rotor lags, is taken to be as planned. Joints without a stepper are as planned.

use super::PulseFacts;
use super::train::{Due, Train};
use crate::exit::Failure;
use drives::pulses::Segment;
use machine::Mechanism;
use machine::kinematics::{Joints, KinematicsError};
use machine::pulses::quantisation_bound;
use messages::Setpoint;
use messages::time::{SETPOINT_PERIOD, SETPOINT_TIME};
use nalgebra::Vector3;
use planner::trajectory::Reference;

/// The tool, followed from pulse to pulse.
pub(super) struct PulsePath<'a, const N: usize, M: Mechanism<N>> {
    mechanism: M,
    /// What is planned at a stream time [s].
    planned: &'a mut dyn FnMut(f64) -> Reference,
    /// The mechanism at the last setpoint.
    chain: M::ChainState,
    /// The planned joints through this cycle.
    joints: [Segment; N],
    /// The setpoint at which this cycle begins.
    before: Setpoint,
    /// The count of each train at this instant.
    counts: Vec<i64>,
    /// Pulses per joint unit; infinite for a joint without a stepper.
    per_length: [f64; N],
    found: PulseFacts,
    /// Integral of the deviation's square [m²·s].
    squares: f64,
    /// When it was looked at last [s], and how far the tool was off then [m].
    last: Option<(f64, Vector3<f64>)>,
    start: f64,
}

/// The tool at one instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Where the pulses have it [m].
    pub(super) tool: [f64; 3],
    /// How far that is from the plan [m].
    pub(super) deviation: f64,
    pub(super) is_lit: bool,
}

impl<'a, const N: usize, M: Mechanism<N>> PulsePath<'a, N, M> {
    pub(super) fn new(
        mechanism: M,
        planned: &'a mut dyn FnMut(f64) -> Reference,
        trains: &[Train],
        first: &Setpoint,
    ) -> Result<Self, KinematicsError> {
        let chain = mechanism.solve(&joints(&first.position), mechanism.branch(), None)?;
        let mut per_length = [f64::INFINITY; N];
        for train in trains {
            let coarsest = &mut per_length[train.axis];
            *coarsest = coarsest.min((train.per_radian / train.ratio).abs());
        }
        Ok(Self {
            mechanism,
            planned,
            chain,
            joints: [Segment::rest(0.0, SETPOINT_TIME); N],
            before: *first,
            counts: vec![0; trains.len()],
            per_length,
            found: PulseFacts::default(),
            squares: 0.0,
            last: None,
            start: first.sequence as f64 * SETPOINT_TIME,
        })
    }

    /// Enters the cycle from `before` to `now`.
    pub(super) fn begin(&mut self, before: &Setpoint, now: &Setpoint) {
        self.before = *before;
        self.joints = core::array::from_fn(|axis| Segment {
            time: SETPOINT_TIME,
            from: before.position[axis],
            from_speed: before.velocity[axis],
            to: now.position[axis],
            to_speed: now.velocity[axis],
        });
    }

    /// Takes a pulse.
    pub(super) fn count(&mut self, pulse: &Due) {
        self.counts[pulse.train] = pulse.count;
    }

    /// Where the tool is at a `share` of this cycle, with the pulses taken so far.
    pub(super) fn look(&mut self, share: f64, trains: &[Train]) -> Result<Place, KinematicsError> {
        let mut q = Joints::from_fn(|axis, _| self.joints[axis].at(share).0);
        for (train, count) in trains.iter().zip(&self.counts) {
            q[train.axis] += train.share * train.beyond(*count, share);
        }
        let tool = self.locate(&q)?;
        let time = (self.before.sequence as f64 + share) * SETPOINT_TIME;
        let planned = match (self.planned)(time) {
            Reference::Tool(tool) => tool.position,
            Reference::Joints(at) => self.locate(&joints(&at.position))?,
        };
        let off = tool - planned;
        let (deviation, is_lit) = (off.norm(), is_lit(&self.before, share));
        self.found.deviation_max = self.found.deviation_max.max(deviation);
        if is_lit {
            self.found.deviation_lit_max = self.found.deviation_lit_max.max(deviation);
        }
        if let Some((before, last)) = self.last.replace((time, off)) {
            // Between two pulses it changes at an even rate, nearly.
            let square = (last.norm_squared() + last.dot(&off) + off.norm_squared()) / 3.0;
            self.squares += square * (time - before);
        }
        Ok(Place { tool: tool.into(), deviation, is_lit })
    }

    /// Leaves the cycle, at whose end the tool may be off by what rounding allows there.
    pub(super) fn end(&mut self) -> Result<(), KinematicsError> {
        let q = Joints::from_fn(|axis, _| self.joints[axis].to);
        self.chain = self.mechanism.solve(&q, self.mechanism.branch(), Some(&self.chain))?;
        let bound = quantisation_bound(&self.mechanism.jacobian(&self.chain), &self.per_length);
        self.found.bound = self.found.bound.max(bound);
        Ok(())
    }

    /// What all of it came to.
    pub(super) fn facts(self, trains: &[Train]) -> PulseFacts {
        let mut facts = self.found;
        let actuators = trains.iter().map(|train| train.actuator + 1).max().unwrap_or(0).max(N);
        facts.counts = vec![0; actuators];
        facts.largest_rate = vec![0.0; actuators];
        for (train, count) in trains.iter().zip(&self.counts) {
            facts.counts[train.actuator] = *count;
            facts.largest_rate[train.actuator] = train.largest_rate;
        }
        let time = self.last.map_or(0.0, |(last, _)| last - self.start);
        if time > 0.0 {
            facts.deviation_rms = (self.squares / time).sqrt();
        }
        facts
    }

    fn locate(&self, q: &Joints<N>) -> Result<Vector3<f64>, KinematicsError> {
        Ok(self.mechanism.locate(q, self.mechanism.branch(), Some(&self.chain))?.position)
    }
}

/// Whether the source is told to be on at a `share` of the cycle that begins with `setpoint`.
fn is_lit(setpoint: &Setpoint, share: f64) -> bool {
    let offset = share * SETPOINT_PERIOD.0 as f64;
    let edges = setpoint.laser.edges().iter();
    let last = edges.take_while(|edge| f64::from(edge.offset) <= offset).last();
    last.map_or(setpoint.laser.gate, |edge| edge.gate) != 0
}

fn joints<const N: usize>(array: &messages::AxisArray) -> Joints<N> {
    Joints::from_fn(|axis, _| array[axis])
}

/// What is said of a place where the mechanism does not close with the joints that are counted.
pub(super) fn unclosed(time: f64, error: &KinematicsError) -> Failure {
    Failure::bad_input(format!("the pulses cannot be followed at {time:.6} s: {error}"))
}
