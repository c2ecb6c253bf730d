//! The motor and the gear of an axis: chosen by what the joint must do, and as they stand in the file.

use super::draft::{Asked, AxisDraft, Travel, Unit};
use super::text::{about, comment, exact, line, number, quantity};
use super::worst::Worst;
use super::{LESS, Short, TOLERANCE};
use crate::catalogue::{Catalogue, CatalogueMotor};
use crate::size::candidate::{Candidate, GearChoice};
use crate::size::checks::{self, Use};
use crate::size::need::{AxisNeed, NeedPoint};
use crate::size::{Gears, Options, Order};
use core::f64::consts::TAU;
use machine::{DcMotor, Friction, Motor, StepperMotor};

/// Loops of position and velocity [1/s, rad/s]: those of the shipped files.
const LOOPS: [f64; 2] = [40.0, 160.0];

/// Turns that a motor may have in hand: `graver check` warns from 60 on.
const MOST_SPEED_RESERVE: f64 = 30.0;

/// Tolerances of the path by which a weight may push the tool off when its brake opens: `graver check`
/// warns from 25 on.
const WEIGHT_TOLERANCES: f64 = 20.0;

/// Counts or pulses that the tolerance of the path must hold.
const COUNTS: f64 = 8.0;

/// A motor with its gear on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drive {
    /// What was chosen, and why, above the motor's table.
    why: String,
    gear: f64,
    gear_name: String,
    efficiency: f64,
    motor: Motor,
    /// Inertia of the rotor, and of the gear at its shaft [kg·m²].
    inertia: [f64; 2],
    friction: Friction,
    friction_why: String,
    /// [N·m]
    brake: Option<(f64, String)>,
    /// Counts of the encoder in a turn.
    counts: f64,
    /// Travel of the tool per count [m].
    count: f64,
    range: [f64; 2],
    following: f64,
    /// Largest speed and acceleration, where the file has them.
    own: Option<[f64; 2]>,
}

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
            time += messages::time::CYCLE_TIME;
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
        .map_or_else(String::new, |failed| format!(": the nearest, {}", failed.why));
    let why = format!("no motor of the catalogues does it on axis {}{why}", axis.name);
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
const MORE_THAN_SPEED: usize = 5;

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

struct Search<'a> {
    worst: &'a Worst,
    need: &'a AxisNeed,
    options: &'a Options,
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
            let why = format!("{} with {gear}, would be {used} its {what}", candidate.name);
            let is_speed = [
                "speed",
                "load inertia",
                "hold of the weight",
                "mechanical time constant",
                "resolution",
                "pulse rate",
            ];
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
            (self.weight(&candidate), "hold of the weight"),
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

    /// How far the loops give way to the weight when its brake opens, as a share of what they may.
    fn weight(&self, candidate: &Candidate) -> f64 {
        let Motor::Dc(motor) = &candidate.motor else { return 0.0 };
        let torque =
            self.worst.gravity * candidate.ratio - friction(&candidate.motor, candidate).coulomb;
        let inertia = motor.rotor_inertia + candidate.ratio * candidate.ratio * self.need.load;
        let push = torque / (inertia * LOOPS[0] * LOOPS[1]) * candidate.ratio * self.worst.lever;
        push / (WEIGHT_TOLERANCES * TOLERANCE)
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
fn friction(motor: &Motor, candidate: &Candidate) -> Friction {
    let coulomb = match motor {
        Motor::Dc(motor) => {
            let current = motor.continuous_current.unwrap_or(motor.current / 3.0);
            candidate.own_friction + 0.05 * current * motor.torque_constant
        }
        Motor::Stepper(motor) => 0.02 * motor.holding_torque,
    };
    Friction { coulomb, viscous: 0.1 * coulomb / motor.largest_speed() }
}

impl Drive {
    fn new(
        axis: &AxisDraft,
        worst: &Worst,
        search: &Search<'_>,
        candidate: &Candidate,
        uses: &[Use],
    ) -> Self {
        let Search { need, options: Options { margin, .. }, .. } = search;
        let Candidate { ratio, motor, .. } = candidate;
        let mut motor = *motor;
        let own = need.stiff_inertia / (candidate.gear_ratio * candidate.gear_ratio);
        let gear_inertia = motor.rotor_inertia() - candidate.rotor_inertia - own;
        let load = ratio * ratio * need.load;
        if let Motor::Stepper(stepper) = &mut motor {
            // 0.3 of what is critical.
            let inertia = stepper.rotor_inertia + load;
            stepper.damping = 0.6 * (stepper.stiffness() * inertia).sqrt();
        }
        let friction = friction(&motor, candidate);
        let friction_why = match &motor {
            Motor::Dc(_) => "the motor's own, and 5 % of what it gives for ever",
            Motor::Stepper(_) => "2 % of the holding torque",
        };
        let mut counts = 4096.0;
        let count = |counts: f64| TAU / counts * ratio * worst.lever;
        while count(counts) > TOLERANCE / COUNTS && counts < 1e9 {
            counts *= 4.0;
        }
        if let Motor::Stepper(stepper) = &motor {
            counts = stepper.pulses_per_turn();
        }
        let hold = worst.gravity * ratio;
        let weight = 2.0 * hold;
        let brake = (hold > friction.coulomb * 0.9)
            .then(|| (weight, format!("twice the weight, {} mN m here", about(hold * 1e3))));
        let uses: Vec<String> = sorted(uses)
            .iter()
            .take(4)
            .map(|it| format!("{} {:.0} %", it.check.replace('_', " "), it.share * 100.0))
            .collect();
        let joint = match axis.unit {
            Unit::Length => format!(
                "{} m/s, {} m/s^2 and {} N",
                about(worst.speed),
                about(worst.acceleration),
                about(worst.effort)
            ),
            Unit::Angle => format!(
                "{} rad/s, {} rad/s^2 and {} N m",
                about(worst.speed),
                about(worst.acceleration),
                about(worst.effort)
            ),
        };
        let mut why = comment(&format!(
            "{}{}: the lightest that does {joint} of load at the worst place of the area, half of the \
             time; with {margin} of every need it uses {}.",
            candidate.name,
            candidate
                .gear
                .as_ref()
                .map_or_else(String::new, |gear| format!(" with the gear {gear}")),
            uses.join(", ")
        ));
        for source in &candidate.sources {
            why += &comment(&format!("Data: {}.", source.trim_end_matches('.')));
        }
        let gear_name = match (&candidate.gear, candidate.gear_ratio) {
            (Some(gear), _) => gear.clone(),
            (None, 1.0) => "no gear".to_owned(),
            (None, _) => "a gear of no catalogue: to be found or made".to_owned(),
        };
        Self {
            why,
            gear: candidate.gear_ratio,
            gear_name,
            efficiency: candidate.efficiency.dynamic.min(axis.efficiency.0),
            inertia: [candidate.rotor_inertia, gear_inertia.max(0.0)],
            friction,
            friction_why: friction_why.to_owned(),
            brake,
            count: count(counts),
            counts,
            range: worst.range,
            following: following(axis, worst, TAU / counts * ratio),
            own: axis.own.map(|[speed, acceleration]| {
                [speed.min(0.95 * motor.largest_speed() * ratio), acceleration]
            }),
            motor,
        }
    }

    /// Tables of an axis that can do anything, to ask the mechanism.
    pub(super) fn bare(axis: &AxisDraft) -> String {
        let motor = if axis.transmission.contains("planar") {
            "stepper]\nfull_steps = 4\nmicrosteps = 1000\nholding_torque = \"1e4 N m\"\n\
             rotor_inertia = \"1e-12 kg m^2\"\ncurrent = \"1 A\"\nresistance = \"1 ohm\"\n\
             inductance = \"1e-8 H\"\nvoltage = \"1e5 V\"\npulse_rate = \"1e6 kHz\""
        } else {
            "dc]\nvoltage = \"1e5 V\"\ncurrent = \"1e5 A\"\nresistance = \"1 ohm\"\n\
             inductance = \"1 mH\"\ntorque_constant = \"1 N m/A\"\nrotor_inertia = \"1e-12 kg m^2\""
        };
        let mut text = format!("[axis.{0}.motor.{motor}\n\n[axis.{0}.friction]\n", axis.name);
        text += "coulomb = \"0 N m\"\nviscous = \"0 N m s/rad\"\n\n";
        if !axis.transmission.contains("planar") {
            text +=
                &format!("[axis.{}.encoder]\nresolution = \"1000000 counts/rev\"\n\n", axis.name);
        }
        let position = position(axis, None);
        text + &format!("[axis.{}.limits]\n{position}\n", axis.name)
    }

    /// The tables of the axis; what is the same for every axis is explained at the first.
    pub(super) fn tables(&self, axis: &AxisDraft, is_first: bool) -> String {
        let AxisDraft { name, transmission, output, efficiency, .. } = axis;
        let first = |text: &'static str| if is_first { text } else { "" };
        let is_planar = self.motor.stepper().is_some_and(StepperMotor::is_planar);
        let mut text = "\n".to_owned();
        if !axis.about.is_empty() {
            text += &comment(&axis.about);
        }
        text += &format!("[axis.{name}]\n");
        if !is_planar {
            let turns = format!("turns of the motor per turn of {output}: {}", self.gear_name);
            text += &line("gear", &number(self.gear), &turns);
            text += &line(
                "efficiency",
                &number(self.efficiency),
                &format!("for sizing: {}", efficiency.1),
            );
        }
        text.push('\n');
        text += transmission;
        text += &self.why;
        text += &self.motor_table(name, is_first);
        text += &format!("\n[axis.{name}.friction]\n");
        text +=
            &line("coulomb", &quantity(self.friction.coulomb * 1e3, "mN m"), &self.friction_why);
        let tenth = first("a tenth of that at the motor's largest speed");
        text += &line("viscous", &quantity(self.friction.viscous, "N m s/rad"), tenth);
        if let Some((brake, why)) = &self.brake {
            text += &line("brake", &quantity(*brake * 1e3, "mN m"), why);
        }
        if self.motor.dc().is_some() {
            text += &format!("\n[axis.{name}.encoder]\n");
            let count = format!("{} um at the tool", about(self.count * 1e6));
            text += &line("resolution", &format!("\"{} counts/rev\"", self.counts), &count);
        }
        text += &format!("\n[axis.{name}.limits]\n");
        text += &position(axis, Some(self.range));
        let [length, speed, acceleration] = match axis.unit {
            Unit::Length => ["mm", "m/s", "m/s^2"],
            Unit::Angle => ["mrad", "rad/s", "rad/s^2"],
        };
        if let Some([most, rise]) = self.own {
            text += &line("velocity", &quantity(most, speed), first("of the joint"));
            text += &line("acceleration", &quantity(rise, acceleration), "");
        }
        let stops = first("setpoint minus feedback that stops the machine");
        text += &line("following_error", &quantity(self.following * 1e3, length), stops);
        if self.motor.dc().is_some() {
            if is_first {
                text += "\n# Bandwidths; the gains follow from the data above.";
            }
            text += &format!(
                "\n[axis.{name}.loops]\nposition = \"{} 1/s\"\nvelocity = \"{} rad/s\"\n\
                 current = \"349 rad/s\"\n",
                LOOPS[0], LOOPS[1]
            );
        }
        text
    }

    fn motor_table(&self, name: &str, is_first: bool) -> String {
        let first = |text: &'static str| if is_first { text } else { "" };
        let [rotor, gear] = self.inertia;
        let inertia = if gear > 1e-6 * rotor {
            format!("{} of the rotor, the rest of the gear", about(rotor))
        } else {
            String::new()
        };
        let total = exact(rotor + gear, "kg m^2");
        match &self.motor {
            Motor::Dc(motor) => {
                let mut text = format!("[axis.{name}.motor.dc]\n");
                text += &line("voltage", &exact(motor.voltage, "V"), "");
                text +=
                    &line("current", &exact(motor.current, "A"), first("limit of the power stage"));
                if let Some(continuous) = motor.continuous_current {
                    let what = first("what the winding bears for ever");
                    text += &line("continuous_current", &exact(continuous, "A"), what);
                }
                text += &line("resistance", &exact(motor.resistance, "ohm"), "");
                text += &line("inductance", &exact(motor.inductance * 1e3, "mH"), "");
                text += &line("torque_constant", &exact(motor.torque_constant, "N m/A"), "");
                text + &line("rotor_inertia", &total, &inertia)
            }
            Motor::Stepper(motor) => {
                let mut text = format!("[axis.{name}.motor.stepper]\n");
                text += &line("full_steps", &number(motor.full_steps), "");
                text += &line("microsteps", &number(motor.microsteps), "");
                text += &line("holding_torque", &exact(motor.holding_torque, "N m"), "");
                text += &line("detent_torque", &exact(motor.detent_torque, "N m"), "");
                text += &line("rotor_inertia", &total, &inertia);
                text += &line("current", &exact(motor.current, "A"), first("peak of a phase"));
                text += &line("resistance", &exact(motor.resistance, "ohm"), "");
                text += &line("inductance", &exact(motor.inductance * 1e3, "mH"), "");
                text += &line("voltage", &exact(motor.voltage, "V"), "");
                let damping = first("of the driver: 0.3 of what is critical");
                text += &line("damping", &quantity(motor.damping, "N m s/rad"), damping);
                let rate = first("of the driver");
                text + &line("pulse_rate", &exact(motor.pulse_rate * 1e-3, "kHz"), rate)
            }
        }
    }
}

/// The line with the soft limits, from where the joint goes where that is known.
fn position(axis: &AxisDraft, range: Option<[f64; 2]>) -> String {
    let write = |[from, to]: [f64; 2], why: &str| {
        let text = match axis.unit {
            Unit::Length => super::text::lengths(&[from, to]),
            Unit::Angle => {
                let degrees = |value: f64| (value.to_degrees() * 10.0).round() / 10.0;
                format!("[\"{} deg\", \"{} deg\"]", degrees(from), degrees(to))
            }
        };
        line("position", &text, why)
    };
    match (&axis.travel, range) {
        (Travel::OfArea, _) => String::new(),
        (Travel::Given(range, why), _) => write(*range, why),
        (Travel::Unlimited, _) => line("position", "\"unlimited\"", "it turns without end"),
        (Travel::Found(wide, _), None) => write(*wide, ""),
        (Travel::Found(_, beyond), Some([from, to])) => {
            write([from - beyond, to + beyond], "what the area needs, and some more")
        }
    }
}

/// The following error that stops the machine: 1 mm at the tool, and no less than twenty counts.
fn following(axis: &AxisDraft, worst: &Worst, count: f64) -> f64 {
    const ERROR: f64 = 1e-3;
    match axis.unit {
        Unit::Length => ERROR.max(20.0 * count),
        Unit::Angle => (ERROR / worst.lever.max(1e-3)).clamp(1e-3, 0.1).max(20.0 * count),
    }
}

/// `uses`, the largest first.
fn sorted(uses: &[Use]) -> Vec<&Use> {
    let mut sorted: Vec<&Use> = uses.iter().collect();
    sorted.sort_by(|one, other| other.share.total_cmp(&one.share));
    sorted
}

/// The planar motor of `axis` with a holding force [N].
pub(super) fn planar(axis: &AxisDraft, worst: &Worst, force: f64) -> Result<Drive, Short> {
    super::kinds::tri_planar::motor(worst, force).map(|(motor, why)| {
        let ratio = super::kinds::tri_planar::PITCH / TAU;
        let pulse = TAU / motor.pulses_per_turn() * ratio;
        Drive {
            why,
            gear: 1.0,
            gear_name: String::new(),
            efficiency: 1.0,
            inertia: [motor.rotor_inertia, 0.0],
            friction: Friction { coulomb: 0.0, viscous: 1e-8 },
            friction_why: "it floats on air".to_owned(),
            brake: Some((
                1.25 * motor.holding_torque,
                "the magnets clamp the motor while its air is off".to_owned(),
            )),
            counts: motor.pulses_per_turn(),
            count: pulse,
            range: worst.range,
            following: following(axis, worst, pulse),
            own: None,
            motor: Motor::Stepper(motor),
        }
    })
}
