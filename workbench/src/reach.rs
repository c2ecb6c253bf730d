//! Which part of its area a machine can reach: a grid over x and y, at the height and with the
//! attitude of home, on the branch in which the machine is built.

use machine::analysis::{Area, Reached, Refusal, grid_position, to_and_fro};
use machine::kinematics::{KinematicsError, Margin};
use machine::pulses::quantisation_bound;
use machine::{Machine, Mechanism, MechanismVisitor};
use monitor::report::workspace::Ground;
use nalgebra::Vector3;
use serde::Serialize;

/// Places of the grid along x, and along y; odd, so that one lies in the middle.
pub const GRID: usize = 41;

/// What the survey of the area found.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ReachReport {
    /// Places of the grid along x and y, edges of the area included.
    pub grid: [usize; 2],
    /// Height of the grid, that of home [m].
    pub height: f64,
    /// Share of the places that are reached within the axes' limits and all margins.
    pub reached: f64,
    /// Share of the places that are singular, or nearer to a singularity or a collision than the
    /// machine's margins allow.
    pub singular: f64,
    /// Box around the reached places; null where there is none.
    pub bounds: Option<Bounds>,
    /// How far half an encoder count or pulse on each axis puts the tool off, at the reached place
    /// where it is most [m]; null where none is reached.
    pub count_error: Option<f64>,
    /// Every margin of the mechanism where it is least among the reached places.
    pub margins: Vec<PlaceMargin>,
    /// Why the other places are not reached, the most frequent first.
    pub refusals: Vec<Obstacle>,
}

/// A box in x and y.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Bounds {
    /// From and to [m].
    pub x: [f64; 2],
    /// From and to [m].
    pub y: [f64; 2],
}

/// A margin where it is least in the area.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct PlaceMargin {
    /// Its name, such as `type_2` or `center`.
    pub name: String,
    /// Its least value; 0 is the singularity or the collision.
    pub value: f64,
    /// What it must not fall below.
    pub limit: f64,
    /// Where that is, machine frame [m].
    pub position: [f64; 3],
}

/// Why places are not reached.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Obstacle {
    /// Code of the kinematics, name of a margin, or `limit` of an axis.
    pub code: String,
    /// The axis that it concerns; null for none.
    pub axis: Option<String>,
    /// Share of all places.
    pub share: f64,
}

/// A survey: its figures, and what is where.
#[derive(Debug, Clone)]
pub struct Surveyed {
    /// The figures.
    pub report: ReachReport,
    /// Row by row from the lowest y, along x.
    pub ground: Vec<Ground>,
}

/// Looks over the area of `machine`.
///
/// # Errors
/// Where the mechanism has no solution at home.
pub fn survey(machine: &Machine) -> Result<Surveyed, KinematicsError> {
    machine.mechanism.visit(Survey { machine })
}

struct Survey<'a> {
    machine: &'a Machine,
}

impl MechanismVisitor for Survey<'_> {
    type Output = Result<Surveyed, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { machine } = self;
        // Counts or pulses of each joint [1/m or 1/rad].
        let counts: [f64; N] = core::array::from_fn(|axis| {
            let axis = machine.axes.get(axis);
            let actuators = axis.map(|axis| axis.driven_by(&machine.actuators)).unwrap_or_default();
            actuators.iter().map(|it| 1.0 / it.count()).fold(f64::INFINITY, f64::min)
        });
        let mut area = Area::new(machine, &mechanism)?;
        let mut tally = Tally::default();
        let mut ground = vec![Ground::Outside; GRID * GRID];
        for [column, row] in to_and_fro([GRID, GRID]) {
            let position = grid_position(machine, [GRID, GRID], [column, row]);
            ground[row * GRID + column] = match area.reach(&position) {
                Ok(Reached { chain, margins, .. }) => {
                    let error = quantisation_bound(&mechanism.jacobian(&chain), &counts);
                    tally.reach(&position, &margins, error);
                    Ground::Reached
                }
                Err(refusal) => {
                    let axis = refusal.axis.and_then(|axis| machine.axes.get(axis));
                    tally.refuse(&refusal, axis.map(|axis| axis.name.as_str()));
                    if refusal.is_singular { Ground::Singular } else { Ground::Outside }
                }
            };
        }
        Ok(Surveyed { report: tally.report(machine.home[2]), ground })
    }
}

/// What was found so far.
#[derive(Debug, Default)]
struct Tally {
    reached: usize,
    singular: usize,
    bounds: Option<Bounds>,
    count_error: f64,
    margins: Vec<PlaceMargin>,
    refusals: Vec<(String, Option<String>, usize)>,
}

impl Tally {
    /// A place with its margins, and what half a count on each axis comes to at the tool [m].
    fn reach(&mut self, position: &Vector3<f64>, margins: &[Margin], count_error: f64) {
        self.reached += 1;
        self.count_error = self.count_error.max(count_error);
        let [x, y] = [position.x, position.y];
        let bounds = self.bounds.get_or_insert(Bounds { x: [x, x], y: [y, y] });
        bounds.x = [bounds.x[0].min(x), bounds.x[1].max(x)];
        bounds.y = [bounds.y[0].min(y), bounds.y[1].max(y)];
        for margin in margins {
            let found = PlaceMargin {
                name: margin.name.to_owned(),
                value: margin.value,
                limit: margin.limit,
                position: (*position).into(),
            };
            match self.margins.iter_mut().find(|kept| kept.name == found.name) {
                None => self.margins.push(found),
                Some(kept) if found.value < kept.value => *kept = found,
                Some(_) => {}
            }
        }
    }

    fn refuse(&mut self, refusal: &Refusal, axis: Option<&str>) {
        self.singular += usize::from(refusal.is_singular);
        let same = |(code, of, _): &&mut (String, Option<String>, usize)| {
            code == refusal.code && of.as_deref() == axis
        };
        match self.refusals.iter_mut().find(same) {
            Some((.., count)) => *count += 1,
            None => self.refusals.push((refusal.code.to_owned(), axis.map(str::to_owned), 1)),
        }
    }

    fn report(mut self, height: f64) -> ReachReport {
        let share = |count: usize| count as f64 / (GRID * GRID) as f64;
        self.refusals.sort_by_key(|(.., count)| core::cmp::Reverse(*count));
        let obstacle = |(code, axis, count)| Obstacle { code, axis, share: share(count) };
        ReachReport {
            grid: [GRID, GRID],
            height,
            reached: share(self.reached),
            singular: share(self.singular),
            bounds: self.bounds,
            count_error: (self.reached > 0).then_some(self.count_error),
            margins: self.margins,
            refusals: self.refusals.into_iter().map(obstacle).collect(),
        }
    }
}
