//! Which part of its area a machine can reach: a grid over x and y, at the height and with the
//! attitude of home, on the branch in which the machine is built.

use machine::kinematics::{Branch, Joints, KinematicsError, Margin};
use machine::pulses::quantisation_bound;
use machine::{Machine, Mechanism, MechanismVisitor, Pose};
use monitor::report::workspace::Ground;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// Places of the grid along x, and along y; odd, so that one lies in the middle.
pub const GRID: usize = 41;

/// Rounding allowed at a soft limit [m or rad].
const ROUNDING: f64 = 1e-9;

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
        let home = Joints::<N>::from_fn(|axis, _| {
            self.machine.home_joints.get(axis).copied().unwrap_or_default()
        });
        // Whichever turn a table is in.
        let branch = mechanism.branch().in_any_turn();
        let rotation = mechanism.forward(&home, branch)?.rotation;
        let mut grid = Grid {
            machine: self.machine,
            mechanism,
            branch,
            rotation,
            home,
            counts: core::array::from_fn(|axis| {
                let axis = self.machine.axes.get(axis);
                axis.map_or(f64::INFINITY, |axis| 1.0 / (axis.encoder.resolution() * axis.ratio))
            }),
            previous: home,
            tally: Tally::default(),
        };
        let ground = grid.walk();
        Ok(Surveyed { report: grid.tally.report(self.machine.home[2]), ground })
    }
}

/// Why the tool does not come to a place.
struct Refused {
    code: &'static str,
    axis: Option<usize>,
    singular: bool,
}

impl From<KinematicsError> for Refused {
    fn from(error: KinematicsError) -> Self {
        let singular = error.code.starts_with("singular") || error.code.contains("collision");
        Self { code: error.code, axis: error.axis, singular }
    }
}

/// How the tool comes to a place.
struct Reached<const N: usize> {
    /// [m or rad].
    joints: Joints<N>,
    margins: Vec<Margin>,
    /// What half a count on each axis comes to at the tool [m].
    count_error: f64,
}

struct Grid<'a, const N: usize, M: Mechanism<N>> {
    machine: &'a Machine,
    mechanism: M,
    branch: M::Branch,
    rotation: Matrix3<f64>,
    home: Joints<N>,
    /// Counts or pulses of each joint [1/m or 1/rad].
    counts: [f64; N],
    /// The joints at the last place that was reached [m or rad].
    previous: Joints<N>,
    tally: Tally,
}

impl<const N: usize, M: Mechanism<N>> Grid<'_, N, M> {
    /// Row by row, to and fro, so that each place is beside the one before.
    fn walk(&mut self) -> Vec<Ground> {
        let mut ground = vec![Ground::Outside; GRID * GRID];
        for row in 0..GRID {
            for step in 0..GRID {
                let column = if row % 2 == 0 { step } else { GRID - 1 - step };
                ground[row * GRID + column] = self.sample(column, row);
            }
        }
        ground
    }

    fn sample(&mut self, column: usize, row: usize) -> Ground {
        let along = |axis: usize, index: usize| {
            let area = &self.machine.area;
            let share = index as f64 / (GRID - 1) as f64;
            // Exact at both edges.
            area.lower[axis] * (1.0 - share) + area.upper[axis] * share
        };
        let position = Vector3::new(along(0, column), along(1, row), self.machine.home[2]);
        match self.reach(&position) {
            Ok(reached) => {
                self.tally.reach(&position, &reached);
                self.previous = reached.joints;
                Ground::Reached
            }
            Err(refused) => {
                let axis = refused.axis.and_then(|axis| self.machine.axes.get(axis));
                self.tally.refuse(&refused, axis.map(|axis| axis.name.as_str()));
                if refused.singular { Ground::Singular } else { Ground::Outside }
            }
        }
    }

    /// The tool at `position`, reached on from the place before or else from home.
    fn reach(&self, position: &Vector3<f64>) -> Result<Reached<N>, Refused> {
        let pose = Pose { position: *position, rotation: self.rotation };
        self.solve(&pose, &self.previous).or_else(|_| self.solve(&pose, &self.home))
    }

    fn solve(&self, pose: &Pose, previous: &Joints<N>) -> Result<Reached<N>, Refused> {
        let joints = self.mechanism.inverse(pose, self.branch, previous)?;
        for (axis, (settings, joint)) in self.machine.axes.iter().zip(joints.iter()).enumerate() {
            let [lower, upper] = settings.limits.position;
            // Put this way a joint that is no number is beyond.
            if !(*joint >= lower - ROUNDING && *joint <= upper + ROUNDING) {
                return Err(Refused { code: "limit", axis: Some(axis), singular: false });
            }
        }
        let chain = self.mechanism.solve(&joints, self.branch, None)?;
        let margins = self.mechanism.margins(&chain);
        match margins.iter().find(|margin| margin.value < margin.limit) {
            Some(margin) => Err(Refused { code: margin.name, axis: None, singular: true }),
            None => {
                let jacobian = self.mechanism.jacobian(&chain);
                let count_error = quantisation_bound(&jacobian, &self.counts);
                Ok(Reached { joints, margins, count_error })
            }
        }
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
    fn reach<const N: usize>(&mut self, position: &Vector3<f64>, reached: &Reached<N>) {
        self.reached += 1;
        self.count_error = self.count_error.max(reached.count_error);
        let [x, y] = [position.x, position.y];
        let bounds = self.bounds.get_or_insert(Bounds { x: [x, x], y: [y, y] });
        bounds.x = [bounds.x[0].min(x), bounds.x[1].max(x)];
        bounds.y = [bounds.y[0].min(y), bounds.y[1].max(y)];
        for margin in &reached.margins {
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

    fn refuse(&mut self, refused: &Refused, axis: Option<&str>) {
        self.singular += usize::from(refused.singular);
        let same = |(code, of, _): &&mut (String, Option<String>, usize)| {
            code == refused.code && of.as_deref() == axis
        };
        match self.refusals.iter_mut().find(same) {
            Some((.., count)) => *count += 1,
            None => self.refusals.push((refused.code.to_owned(), axis.map(str::to_owned), 1)),
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
