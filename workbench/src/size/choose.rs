//! The choice: every motor with every gear, and the smallest pair that holds every limit.

use super::candidate::{Candidate, GearChoice};
use super::checks::{self, Use};
use super::need::AxisNeed;
use super::report::{AxisSize, BeltSize, Drive, NeedSize, Rejected, ScrewSize};
use super::{Gears, Options, Order, thermal};
use crate::catalogue::{Catalogue, CatalogueMotor};
use crate::operating::{AxisCourse, Demand};
use core::cmp::Ordering;
use machine::transmission::gear::LoadClass;
use machine::{JointUnit, Motor};

/// Pairs that are told of those that do not hold.
const MOST_REJECTED: usize = 10;

/// A motor with a gear, and what it uses.
#[derive(Debug, Clone)]
pub struct Judged {
    /// The pair.
    pub candidate: Candidate,
    /// What it uses of every limit, or of the first that it breaks.
    pub uses: Vec<Use>,
    /// What the motor does; empty but of the pairs that the machine has and gets.
    pub course: AxisCourse,
}

impl Judged {
    /// `candidate` on the axis of `need`. One that is too slow is not looked at any further.
    fn new(
        candidate: Candidate,
        need: &AxisNeed,
        catalogue: &Catalogue,
        options: &Options,
    ) -> Self {
        let speed = checks::speed(&candidate, need, options.margin);
        let uses = if speed.holds() {
            checks::uses(&candidate, need, &candidate.course(need), catalogue, options)
        } else {
            vec![speed]
        };
        let course = AxisCourse { name: need.name.clone(), points: Vec::new() };
        Self { candidate, uses, course }
    }

    fn share(&self) -> f64 {
        checks::worst(&self.uses).map_or(0.0, |worst| worst.share)
    }

    fn holds(&self) -> bool {
        self.uses.iter().all(Use::holds)
    }
}

/// What a motor of the kind of `motor` is called.
pub fn kind(motor: &Motor) -> &'static str {
    match motor {
        Motor::Dc(_) => "DC motor",
        Motor::Stepper(motor) if motor.is_planar() => "planar motor",
        Motor::Stepper(_) => "stepper",
    }
}

/// Whether the one can take the place of the other: the drives and the controller stay.
fn is_like(one: &Motor, other: &Motor) -> bool {
    match (one, other) {
        (Motor::Dc(_), Motor::Dc(_)) => true,
        (Motor::Stepper(one), Motor::Stepper(other)) => one.is_planar() == other.is_planar(),
        _ => false,
    }
}

/// What the axis of `need` needs, what it has, and, where `is_asked`, what of `catalogue` would do.
pub fn axis(need: &AxisNeed, catalogue: &Catalogue, options: &Options, is_asked: bool) -> AxisSize {
    let present = Candidate::present(need);
    let course = present.course(need);
    let uses = checks::uses(&present, need, &course, catalogue, options);
    let inertia_ratio = present.inertia_ratio(need);
    let size = AxisSize {
        axis: need.name.clone(),
        unit: match need.unit {
            JointUnit::Length => "m",
            JointUnit::Angle => "rad",
        },
        need: NeedSize {
            demand: Demand::of(&course),
            inertia_ratio,
            class: LoadClass::of(inertia_ratio).into(),
        },
        belt: need.pulley.map(|_| BeltSize::new(need)),
        screw: catalogue.screws.iter().find(|it| it.axis == need.axis).map(ScrewSize::new),
        now: Drive::new(&present, uses.clone()),
        is_asked,
        kind: kind(&need.actuator.motor),
        candidates: catalogue
            .motors
            .iter()
            .filter(|motor| is_like(&need.actuator.motor, &motor.motor))
            .count(),
        chosen: None,
        rejected: Vec::new(),
        present: Judged { candidate: present, uses, course },
        judged: None,
    };
    if !is_asked {
        return size;
    }
    let (fitting, mut others) = judge(need, catalogue, options);
    others.sort_by(|one, other| one.share().total_cmp(&other.share()));
    let rejected = others.iter().take(MOST_REJECTED).filter_map(Rejected::new).collect();
    let best = smallest(fitting, options.order)
        .map(|best| Judged { course: best.candidate.course(need), ..best });
    let chosen = best.as_ref().map(|best| {
        let mut drive = Drive::new(&best.candidate, best.uses.clone());
        drive.temperature = temperature(best, options);
        drive
    });
    AxisSize { chosen, rejected, judged: best, ..size }
}

/// Every pair that holds, and of each motor without one the pair that comes nearest.
fn judge(need: &AxisNeed, catalogue: &Catalogue, options: &Options) -> (Vec<Judged>, Vec<Judged>) {
    let (mut fitting, mut others) = (Vec::new(), Vec::new());
    for motor in &catalogue.motors {
        if !is_like(&need.actuator.motor, &motor.motor) {
            continue;
        }
        let mut nearest: Option<Judged> = None;
        let held = fitting.len();
        for gear in gears(need, motor, catalogue, options) {
            let candidate = Candidate::new(need, motor, gear);
            let judged = Judged::new(candidate, need, catalogue, options);
            if judged.holds() {
                fitting.push(judged);
            } else if nearest.as_ref().is_none_or(|nearest| judged.share() < nearest.share()) {
                nearest = Some(judged);
            }
        }
        if fitting.len() == held {
            others.extend(nearest);
        }
    }
    (fitting, others)
}

/// The gears to try with `motor`.
fn gears<'a>(
    need: &AxisNeed,
    motor: &CatalogueMotor,
    catalogue: &'a Catalogue,
    options: &Options,
) -> Vec<GearChoice<'a>> {
    match options.gears {
        Gears::Keep => vec![GearChoice::Present],
        Gears::Catalogue => {
            let gears = catalogue.gears.iter().map(GearChoice::Of);
            core::iter::once(GearChoice::None).chain(gears).collect()
        }
        Gears::Any => vec![GearChoice::Ratio(best_ratio(need, motor, catalogue, options))],
    }
}

/// The ratio at which `motor` uses least of its worst limit, to three digits.
fn best_ratio(
    need: &AxisNeed,
    motor: &CatalogueMotor,
    catalogue: &Catalogue,
    options: &Options,
) -> f64 {
    /// Ratios between which the best is looked for.
    const RANGE: [f64; 2] = [0.2, 1000.0];
    /// Ratios that are tried first, evenly on a logarithmic scale.
    const COARSE: u32 = 40;
    /// Steps of the golden section, to a part in a thousand.
    const STEPS: u32 = 16;
    /// The golden section of 1.
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let [low, high] = RANGE.map(messages::math::ln);
    let share = |logarithm: f64| {
        let ratio = messages::math::exp(logarithm);
        let candidate = Candidate::new(need, motor, GearChoice::Ratio(ratio));
        Judged::new(candidate, need, catalogue, options).share()
    };
    let at = |step: u32| low + (high - low) * f64::from(step) / f64::from(COARSE);
    let shares: Vec<f64> = (0..=COARSE).map(|step| share(at(step))).collect();
    let best = (0..=COARSE)
        .min_by(|one, other| shares[*one as usize].total_cmp(&shares[*other as usize]))
        .unwrap_or(0);
    let (mut from, mut to) = (at(best.saturating_sub(1)), at((best + 1).min(COARSE)));
    for _ in 0..STEPS {
        let width = GOLDEN * (to - from);
        if share(to - width) <= share(from + width) {
            to = from + width;
        } else {
            from = to - width;
        }
    }
    three_digits(messages::math::exp((from + to) / 2.0))
}

fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// The smallest of `fitting` in `order`.
fn smallest(fitting: Vec<Judged>, order: Order) -> Option<Judged> {
    let has_mass = fitting.iter().all(|judged| judged.candidate.mass.is_some());
    let size = |judged: &Judged| match order {
        Order::Mass if has_mass => judged.candidate.mass.unwrap_or(f64::INFINITY),
        _ => judged.candidate.rated_power(),
    };
    let compare = |one: &Judged, other: &Judged| -> Ordering {
        let by_size = size(one).total_cmp(&size(other));
        let by_share = || one.share().total_cmp(&other.share());
        by_size.then_with(by_share).then_with(|| one.candidate.name.cmp(&other.candidate.name))
    };
    fitting.into_iter().min_by(compare)
}

/// The largest temperature of the winding over the job done again and again [°C].
fn temperature(judged: &Judged, options: &Options) -> Option<f64> {
    let Judged { candidate, course, .. } = judged;
    let (Motor::Dc(motor), Some(thermal)) = (&candidate.motor, &candidate.thermal) else {
        return None;
    };
    let squares: Vec<f64> =
        course.points.iter().map(|point| point.current * point.current).collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    let (resistance, ambient) = (motor.resistance, options.ambient);
    thermal::warmest(thermal, &squares, resistance, ambient)
        .or_else(|| thermal::steady(thermal, mean, resistance, ambient))
}
