//! Test paths and their limits.

use messages::math::{cos, hypot, sin};

use super::jets::Series;
use crate::law::{Along, Limits, Row, Side, Site, TimeLaw};

pub(super) const SPEED: u16 = 0;
pub(super) const ACCELERATION: u16 = 1;
pub(super) const JERK: u16 = 2;
pub(super) const JOINT_SPEED: u16 = 3;
pub(super) const JOINT_ACCELERATION: u16 = 4;

/// The place by the parameter, with derivatives.
pub(super) type Curve = Box<dyn Fn(f64) -> [Series; 2]>;
/// The joints by the place.
pub(super) type Joints = fn([Series; 2]) -> [Series; 2];

/// A planar path and its limits.
pub(super) struct Path {
    pub(super) curve: Curve,
    pub(super) length: f64,
    pub(super) borders: Vec<f64>,
    /// Tool speed, acceleration and jerk.
    pub(super) tool: [f64; 3],
    /// Joint speeds and accelerations.
    pub(super) joints: Option<(Joints, [f64; 2], [f64; 2])>,
    pub(super) facets: usize,
}

impl Path {
    pub(super) fn new(
        curve: impl Fn(f64) -> [Series; 2] + 'static,
        length: f64,
        tool: [f64; 3],
    ) -> Self {
        let (joints, borders) = (None, Vec::new());
        Self { curve: Box::new(curve), length, borders, tool, joints, facets: 12 }
    }

    pub(super) fn with_joints(mut self, joints: Joints, speeds: [f64; 2], a: [f64; 2]) -> Self {
        self.joints = Some((joints, speeds, a));
        self
    }

    pub(super) fn with_borders(mut self, count: usize) -> Self {
        let step = self.length / count as f64;
        self.borders = (1..count).map(|index| index as f64 * step).collect();
        self
    }

    pub(super) fn line(length: f64, tool: [f64; 3]) -> Self {
        Self::new(|u| [Series::parameter(u), Series::constant(0.0)], length, tool)
    }

    pub(super) fn circle(radius: f64, turns: f64, tool: [f64; 3]) -> Self {
        let curve = move |u| {
            let angle = Series::parameter(u).scaled(1.0 / radius);
            [angle.cosine().scaled(radius), angle.sine().scaled(radius)]
        };
        Self::new(curve, core::f64::consts::TAU * turns * radius, tool)
    }

    /// x = u, y a sine.
    pub(super) fn wave(height: f64, period: f64, length: f64, tool: [f64; 3]) -> Self {
        let curve = move |u| {
            let x = Series::parameter(u);
            [x, x.scaled(core::f64::consts::TAU / period).sine().scaled(height)]
        };
        Self::new(curve, length, tool)
    }

    /// The uses of speed, acceleration, jerk, joint speed and joint acceleration at a moment.
    pub(super) fn uses(&self, along: &Along) -> [f64; 5] {
        let Along { position: u, velocity: v, acceleration: a, jerk: j } = *along;
        let orders = |d: [f64; 3]| {
            [d[0] * v, d[0] * a + d[1] * v * v, d[0] * j + 3.0 * d[1] * v * a + d[2] * v * v * v]
        };
        let place = (self.curve)(u);
        let [x, y] = place.map(|part| orders(part.derivatives()));
        let mut uses = [0.0; 5];
        for k in 0..3 {
            uses[k] = hypot(x[k], y[k]) / self.tool[k];
        }
        if let Some((joints, speeds, accelerations)) = self.joints {
            for (joint, q) in joints(place).into_iter().enumerate() {
                let q = orders(q.derivatives());
                uses[3] = uses[3].max(q[0].abs() / speeds[joint]);
                uses[4] = uses[4].max(q[1].abs() / accelerations[joint]);
            }
        }
        uses
    }

    /// The largest uses over a law.
    pub(super) fn most(&self, law: &TimeLaw, step: f64) -> [f64; 5] {
        let mut most = [0.0_f64; 5];
        let count = (law.duration() / step).ceil() as usize;
        for index in 0..=count {
            let uses = self.uses(&law.at(index as f64 * step));
            for (most, used) in most.iter_mut().zip(uses) {
                assert!(used.is_finite());
                *most = most.max(used);
            }
        }
        most
    }

    /// The largest uses of the tool's limits by the differences of samples every millisecond.
    pub(super) fn by_differences(&self, law: &TimeLaw) -> [f64; 3] {
        let step = 1e-3;
        let count = (law.duration() / step).ceil() as usize + 4;
        let place = |index: usize| {
            let u = law.at((index as f64 - 2.0) * step).position;
            (self.curve)(u).map(|part| part.0[0])
        };
        let mut most = [0.0_f64; 3];
        for index in 3..count {
            let p: [[f64; 2]; 4] = core::array::from_fn(|k| place(index - k));
            let norm = |weights: [f64; 4]| {
                let sum = |axis: usize| (0..4).map(|k| weights[k] * p[k][axis]).sum::<f64>();
                hypot(sum(0), sum(1))
            };
            most[0] = most[0].max(norm([1.0, -1.0, 0.0, 0.0]) / step / self.tool[0]);
            most[1] = most[1].max(norm([1.0, -2.0, 1.0, 0.0]) / (step * step) / self.tool[1]);
            let cube = step * step * step;
            most[2] = most[2].max(norm([1.0, -3.0, 3.0, -1.0]) / cube / self.tool[2]);
        }
        most
    }
}

impl Limits for Path {
    fn borders(&self, from: f64, to: f64, borders: &mut Vec<f64>) {
        borders.extend(self.borders.iter().filter(|border| (from..=to).contains(*border)));
    }

    fn site(&mut self, place: f64, _side: Side, rows: &mut Vec<Row>) -> Site {
        let start = rows.len();
        let at = (self.curve)(place);
        let [x, y] = at.map(Series::derivatives);
        let size = hypot(x[0], y[0]);
        let tangent = [x[0] / size, y[0] / size];
        let [speed, acceleration, jerk] = self.tool;
        let mut site = Site {
            speed: speed / size,
            speed_limit: SPEED,
            rows: 0..0,
            launch: jerk / size,
            launch_limit: JERK,
        };
        let apothem = cos(core::f64::consts::PI / self.facets as f64);
        for facet in 0..self.facets {
            let angle = core::f64::consts::TAU * (facet as f64 + 0.5) / self.facets as f64;
            let (c, s) = (cos(angle), sin(angle));
            let normal = [c * tangent[0] - s * tangent[1], c * tangent[1] + s * tangent[0]];
            let along: [f64; 3] = core::array::from_fn(|k| normal[0] * x[k] + normal[1] * y[k]);
            rows.push(Row {
                base: [0.0, along[0], along[1]],
                by_speed: [0.0; 3],
                top: acceleration * apothem,
                top_by_speed: 0.0,
                limit: ACCELERATION,
            });
            rows.push(Row {
                base: [0.0; 3],
                by_speed: [along[0], 3.0 * along[1], along[2]],
                top: jerk * apothem,
                top_by_speed: 0.0,
                limit: JERK,
            });
        }
        if let Some((joints, speeds, accelerations)) = self.joints {
            for (joint, q) in joints(at).into_iter().enumerate() {
                let q = q.derivatives();
                if speeds[joint] / q[0].abs() < site.speed {
                    site.speed = speeds[joint] / q[0].abs();
                    site.speed_limit = JOINT_SPEED;
                }
                for sign in [1.0, -1.0] {
                    rows.push(Row {
                        base: [0.0, sign * q[0], sign * q[1]],
                        by_speed: [0.0; 3],
                        top: accelerations[joint],
                        top_by_speed: 0.0,
                        limit: JOINT_ACCELERATION,
                    });
                }
            }
        }
        site.rows = start..rows.len();
        site
    }
}

/// The joints of a five-bar linkage.
pub(super) fn five_bar([x, y]: [Series; 2]) -> [Series; 2] {
    let (e, b, a) = (0.05, 0.2, 0.25);
    let leg = |base: f64, sign: f64| {
        let dx = x - Series::constant(base);
        let square = dx * dx + y * y;
        let bend = (square + Series::constant(b * b - a * a)) / square.root().scaled(2.0 * b);
        Series::angle(y, dx) + bend.arc_cosine().scaled(sign)
    };
    [leg(-e, 1.0), leg(e, -1.0)]
}

/// The joints of a polar machine.
pub(super) fn polar([x, y]: [Series; 2]) -> [Series; 2] {
    let c = 0.25;
    let arm = ((x * x + y * y).root().scaled(0.5 / c)).arc_sine().scaled(2.0);
    let mx = arm.cosine().scaled(c) - Series::constant(c);
    let my = arm.sine().scaled(c);
    [arm, Series::angle(my, mx) - Series::angle(y, x)]
}
