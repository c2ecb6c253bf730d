//! The choice of a motor and a gear for an axis, by what its joint must do.

use super::draft::{Asked, AxisDraft};
use super::drive::Drive;
use super::text::about;
use super::worst::Worst;
use super::{LESS, Short, TOLERANCE};
use crate::catalogue::{Catalogue, CatalogueMotor};
use crate::size::candidate::{Candidate, GearChoice};
use crate::size::checks::{self, Use};
use crate::size::need::{AxisNeed, NeedPoint};
use crate::size::{Gears, Options, Order};
use machine::{DcMotor, Friction, Motor};

/// Turns that a motor may have in hand: `graver check` warns from 60 on.
const MOST_SPEED_RESERVE: f64 = 30.0;

/// What the shaft does for the worst of `worst`: up to full speed with full acceleration, as long again
/// at full speed, and down, to and fro for ever. Half of the time is full acceleration.
fn course(worst: &Worst) -> Vec<NeedPoint> {
    /// Points of a phase.
    const COUNT: u32 = 60;
    /// Points in which the acceleration comes up, or goes down.
    const RISE: u32 = 20;
    let share =
        |step: u32| f64::from(step.min(COUNT - 1 - step)).min(f64::from(RISE)) / f64::from(RISE);
    let total: f64 = (0..COUNT).map(share).sum();
    let mut points = Vec::new();
    let mut time = 0.0;
    for way in [1.0, -1.0] {
        let gravity = worst.gravity;
        let moving = worst.effort - gravity;
        let mut push = |speed: f64, acceleration: f64| {
            points.push(NeedPoint {
                time,
                is_lit: false,
                stroke: 0,
                speed: way * speed * worst.speed,
                acceleration: way * acceleration * worst.acceleration,
                effort: gravity + way * acceleration * moving,
            });
            time += messages::time::SETPOINT_TIME;
        };
        let mut speed = 0.0;
        for step in 0..COUNT {
            speed += share(step) / total;
            push(speed, share(step));
        }
        (0..COUNT).for_each(|_| push(1.0, 0.0));
        for step in 0..COUNT {
            push(speed, -share(step));
            speed -= share(step) / total;
        }
    }
    points
}

/// The lightest motor with a gear for `axis`.
pub(super) fn choose(
    axis: &AxisDraft,
    worst: &Worst,
    need: AxisNeed,
    catalogue: &Catalogue,
    steppers: bool,
    asked: &Asked,
) -> Result<Drive, Short> {
    let need = AxisNeed {
        points: course(worst),
        load: worst.load.max(need.load),
        tolerance: TOLERANCE / worst.lever.max(1e-9),
        ..need
    };
    let options = Options {
        margin: asked.margin,
        ambient: 25.0,
        axes: Vec::new(),
        order: Order::Mass,
        gears: Gears::Catalogue,
    };
    let mut motors: Vec<&CatalogueMotor> = catalogue
        .motors
        .iter()
        .filter(|motor| match &motor.motor {
            Motor::Dc(_) => !steppers,
            Motor::Stepper(motor) => steppers && !motor.is_planar(),
        })
        .collect();
    let mass = |mass: Option<f64>| mass.unwrap_or(f64::INFINITY);
    motors.sort_by(|one, other| mass(one.mass).total_cmp(&mass(other.mass)));
    let power = asked.margin * worst.effort * worst.speed / 2.0;
    let search = Search { worst, need: &need, options: &options, most_load: asked.most_load };
    let mut nearest: Option<Failed> = None;
    // Gears that can be bought come first; then any ratio, which somebody may make.
    for any in [false, true] {
        let mut best: Option<(Candidate, Vec<Use>)> = None;
        for motor in &motors {
            let lighter = |it: &(Candidate, Vec<Use>)| mass(it.0.mass) <= mass(motor.mass);
            if best.as_ref().is_some_and(lighter) {
                break;
            }
            if most_power(&motor.motor) < power {
                continue;
            }
            let gears: Vec<GearChoice<'_>> = if any {
                search.ratios(motor).map(GearChoice::Ratio).collect()
            } else {
                let gears = catalogue.gears.iter().map(GearChoice::Of);
                core::iter::once(GearChoice::None).chain(gears).collect()
            };
            for gear in gears {
                match search.judge(motor, gear) {
                    Ok(found) => {
                        let lighter =
                            |best: &(Candidate, Vec<Use>)| mass(found.0.mass) < mass(best.0.mass);
                        if best.as_ref().is_none_or(lighter) {
                            best = Some(found);
                        }
                    }
                    Err(failed) => {
                        if nearest.as_ref().is_none_or(|nearest| failed.is_nearer(nearest)) {
                            nearest = Some(failed);
                        }
                    }
                }
            }
        }
        if let Some((candidate, uses)) = best {
            return Ok(Drive::new(axis, worst, &search, &candidate, &uses));
        }
    }
    let why = nearest
        .as_ref()
        .map_or_else(String::new, |failed| format!(". The nearest is {}", failed.why));
    let why = format!("no motor of the catalogues is enough for axis {}{why}", axis.name);
    Err(match nearest {
        // What a motor feels of its load goes with the square of the speed that its gear leaves it.
        Some(Failed { is_speed: true, share, .. }) => {
            Short::Slower((1.0 / share.sqrt()).clamp(0.3, 0.95), why)
        }
        Some(Failed { held: MORE_THAN_SPEED.., share, .. }) if share < FAR => {
            Short::Acceleration((1.0 / share).clamp(0.6, 0.95), why)
        }
        _ => Short::Acceleration(LESS, why),
    })
}

/// A use from which on the need says nothing of how much too much it is, as a temperature without end.
const FAR: f64 = 10.0;

/// From here on [`Failed::held`] means that the motor fits by speed and inertia.
const MORE_THAN_SPEED: usize = 4;

/// Why a motor with a gear does not do it.
#[derive(Debug, Clone, PartialEq)]
struct Failed {
    /// What was held before: more is nearer.
    held: usize,
    /// By how much the next is not.
    share: f64,
    /// Whether it would be with less speed.
    is_speed: bool,
    why: String,
}

impl Failed {
    fn is_nearer(&self, other: &Self) -> bool {
        self.held > other.held || (self.held == other.held && self.share < other.share)
    }
}

/// What is asked of every motor and gear.
pub(super) struct Search<'a> {
    worst: &'a Worst,
    pub(super) need: &'a AxisNeed,
    pub(super) options: &'a Options,
    most_load: f64,
}

impl Search<'_> {
    /// `motor` with `gear`, where it does it; else at what it fails.
    fn judge(
        &self,
        motor: &CatalogueMotor,
        gear: GearChoice<'_>,
    ) -> Result<(Candidate, Vec<Use>), Failed> {
        let candidate = Candidate::new(self.need, motor, gear);
        let failed = |held: usize, share: f64, what: &str| {
            let gear = candidate.gear.as_ref().map_or_else(
                || format!("a ratio of {}", about(candidate.gear_ratio)),
                |gear| format!("the gear {gear}"),
            );
            let used = if share < FAR {
                format!("at {:.0} % of", share * 100.0)
            } else {
                "far beyond".to_owned()
            };
            let why = format!("{} with {gear}: {what} would be {used} the limit", candidate.name);
            let is_speed =
                ["speed", "load inertia", "mechanical time constant", "resolution", "pulse rate"];
            Failed { held, share, is_speed: is_speed.contains(&what), why }
        };
        let speed = checks::speed(&candidate, self.need, self.options.margin);
        let reached = candidate.motor.largest_speed() * candidate.ratio;
        let reserve = match &candidate.motor {
            Motor::Dc(_) => reached / (MOST_SPEED_RESERVE * self.worst.speed),
            Motor::Stepper(_) => 0.0,
        };
        let load = candidate.inertia_ratio(self.need) / self.most_load;
        let before: [(f64, &str); MORE_THAN_SPEED] = [
            (speed.share, "speed"),
            (reserve, "reserve of speed"),
            (load, "load inertia"),
            (self.slowness(&candidate), "mechanical time constant"),
        ];
        if let Some((held, (share, what))) =
            before.into_iter().enumerate().find(|(_, (share, _))| *share > 1.0)
        {
            return Err(failed(held, share, what));
        }
        let course = candidate.course(self.need);
        let uses =
            checks::uses(&candidate, self.need, &course, &Catalogue::default(), self.options);
        match checks::worst(&uses).filter(|worst| !worst.holds()) {
            Some(worst) => Err(failed(before.len(), worst.share, &worst.check.replace('_', " "))),
            None => Ok((candidate, uses)),
        }
    }

    /// The time constant with which the motor comes to its speed with the load, as a share of the
    /// longest that `graver check` takes for usual.
    fn slowness(&self, candidate: &Candidate) -> f64 {
        /// A tenth less than there [s].
        const LONGEST: f64 = 1.8;
        let Motor::Dc(motor) = &candidate.motor else { return 0.0 };
        let inertia = motor.rotor_inertia + candidate.ratio * candidate.ratio * self.need.load;
        let constant = motor.torque_constant;
        inertia * motor.resistance / (constant * constant) / LONGEST
    }

    /// Ratios to try with `motor`: from the one that uses most of its speed down.
    fn ratios(&self, motor: &CatalogueMotor) -> impl Iterator<Item = f64> {
        const SHARES: [f64; 7] = [0.75, 0.6, 0.45, 0.33, 0.22, 0.12, 0.06];
        let most = motor.max_speed.unwrap_or(f64::INFINITY).min(motor.motor.largest_speed());
        let turning = self.worst.speed / self.need.travel;
        SHARES.into_iter().map(move |share| two_digits((share * most / turning).clamp(0.2, 1000.0)))
    }
}

fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// The most that a motor can give at its shaft for a moment [W].
fn most_power(motor: &Motor) -> f64 {
    match motor {
        Motor::Dc(DcMotor { voltage, current, resistance, .. }) => {
            let current = current.min(voltage / (2.0 * resistance));
            current * (voltage - resistance * current)
        }
        Motor::Stepper(motor) => motor.holding_torque * motor.largest_speed(),
    }
}

/// Friction at the shaft: the motor's own, and a twentieth of what the motor gives for ever.
pub(super) fn friction(motor: &Motor, candidate: &Candidate) -> Friction {
    let coulomb = match motor {
        Motor::Dc(motor) => {
            let current = motor.continuous_current.unwrap_or(motor.current / 3.0);
            candidate.own_friction + 0.05 * current * motor.torque_constant
        }
        Motor::Stepper(motor) => 0.02 * motor.holding_torque,
    };
    Friction { coulomb, viscous: 0.1 * coulomb / motor.largest_speed() }
}
