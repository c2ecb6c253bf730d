//! A motor with a gear on an axis: what it must give for what the job asks.

use super::need::AxisNeed;
use crate::catalogue::{CatalogueGear, CatalogueMotor, Thermal};
use crate::operating::{AxisCourse, OperatingPoint};
use machine::transmission::gear::Efficiency;
use machine::{Friction, Motor};
use messages::time::SETPOINT_TIME;

/// A motor on an axis, with its gear.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What it is called.
    pub name: String,
    /// Its gear's name; `None` for none, or for the one of the machine.
    pub gear: Option<String>,
    /// Where its data come from, and the gear's.
    pub sources: Vec<String>,
    /// The motor; its inertia is all that turns stiffly with it.
    pub motor: Motor,
    /// Inertia of the rotor alone [kg·m²].
    pub rotor_inertia: f64,
    /// Turns of the motor per turn of the gear's output.
    pub gear_ratio: f64,
    /// Joint travel per radian of the motor [m/rad or rad/rad].
    pub ratio: f64,
    /// Losses of gear, screw or belt.
    pub efficiency: Efficiency,
    /// Friction at the shaft.
    pub friction: Friction,
    /// Torque that the motor takes by itself [N·m].
    pub own_friction: f64,
    /// Motor and gear together [kg].
    pub mass: Option<f64>,
    /// Largest speed that motor and gear allow [rad/s].
    pub max_speed: Option<f64>,
    /// How it warms.
    pub thermal: Option<Thermal>,
    /// What the gear bears.
    pub limits: Option<CatalogueGear>,
}

/// A gear to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GearChoice<'a> {
    /// The ratio that the machine has.
    Present,
    /// The motor's shaft drives the screw, pulley or arm.
    None,
    /// One of the catalogue.
    Of(&'a CatalogueGear),
    /// A ratio of which nothing else is known.
    Ratio(f64),
}

impl Candidate {
    /// `motor` with `gear` on the axis of `need`.
    pub fn new(need: &AxisNeed, motor: &CatalogueMotor, gear: GearChoice<'_>) -> Self {
        let (gear_ratio, of) = match gear {
            GearChoice::Present => (need.gear, None),
            GearChoice::None => (1.0, None),
            GearChoice::Ratio(ratio) => (ratio, None),
            GearChoice::Of(gear) => (gear.ratio, Some(gear)),
        };
        let ratio = need.travel / gear_ratio;
        let losses =
            of.map(|it| Efficiency { dynamic: it.efficiency, at_start: it.static_efficiency });
        let speeds = [motor.max_speed, of.and_then(|gear| gear.max_input_speed)];
        let masses = match gear {
            GearChoice::Of(gear) => motor.mass.zip(gear.mass).map(|(motor, gear)| motor + gear),
            _ => motor.mass,
        };
        let added =
            of.map_or(0.0, |gear| gear.inertia) + need.stiff_inertia / (gear_ratio * gear_ratio);
        let mut sources = vec![motor.source.clone()];
        sources.extend(of.map(|gear| gear.source.clone()));
        sources.dedup();
        let constant = motor.motor.dc().map_or(0.0, |motor| motor.torque_constant);
        Self {
            name: motor.name.clone(),
            gear: of.map(|gear| gear.name.clone()),
            sources,
            motor: with_inertia(&motor.motor, motor.motor.rotor_inertia() + added),
            rotor_inertia: motor.motor.rotor_inertia(),
            gear_ratio,
            ratio,
            efficiency: need.efficiency_with(losses),
            friction: need.friction_at(ratio),
            own_friction: constant * motor.no_load_current,
            mass: masses,
            max_speed: speeds.into_iter().flatten().reduce(f64::min),
            thermal: motor.thermal,
            limits: of.cloned(),
        }
    }

    /// What the machine has on the axis of `need`.
    pub fn present(need: &AxisNeed) -> Self {
        Self {
            name: "the machine's".to_owned(),
            gear: None,
            sources: Vec::new(),
            motor: need.actuator.motor,
            rotor_inertia: need.rotor_inertia,
            gear_ratio: need.gear,
            ratio: need.actuator.ratio,
            efficiency: need.actuator.efficiency,
            friction: need.actuator.friction,
            own_friction: 0.0,
            mass: None,
            max_speed: None,
            thermal: None,
            limits: None,
        }
    }

    /// Load inertia over the inertia of rotor and gear, seen at the shaft. Source 003 eq. 5.17. // f_a
    pub fn inertia_ratio(&self, need: &AxisNeed) -> f64 {
        self.ratio * self.ratio * need.load / self.motor.rotor_inertia()
    }

    /// What the motor does over the job.
    pub fn course(&self, need: &AxisNeed) -> AxisCourse {
        let mut points: Vec<OperatingPoint> = need
            .points
            .iter()
            .map(|point| {
                let [speed, acceleration] =
                    [point.speed, point.acceleration].map(|of| of / self.ratio);
                let rotor = self.motor.rotor_inertia() * acceleration;
                let load = self.ratio * point.effort;
                let is_standing = Friction::is_standing(speed);
                let turning = if is_standing { 0.0 } else { speed };
                let own = if is_standing { 0.0 } else { self.own_friction * speed.signum() };
                OperatingPoint {
                    time: point.time,
                    is_lit: point.is_lit,
                    stroke: point.stroke,
                    speed,
                    acceleration,
                    load,
                    rotor,
                    friction: self.friction.torque(speed),
                    by_efficiency: rotor + self.efficiency.torque(load, turning) + own,
                    ..OperatingPoint::default()
                }
            })
            .collect();
        self.drive(&mut points);
        AxisCourse { name: need.name.clone(), points }
    }

    /// Fills in what the motor takes from its supply.
    fn drive(&self, points: &mut [OperatingPoint]) {
        match &self.motor {
            Motor::Stepper(_) => {
                points.iter_mut().for_each(|point| point.supplied = point.power());
            }
            Motor::Dc(motor) => {
                let mut before = None;
                for point in points {
                    point.current = point.torque() / motor.torque_constant;
                    let earlier = before.unwrap_or(point.current);
                    let rate = (point.current - earlier) / SETPOINT_TIME;
                    let mean = (point.current + earlier) / 2.0;
                    point.voltage = motor.voltage(mean, rate, point.speed);
                    point.supplied = point.voltage * point.current;
                    before = Some(point.current);
                }
            }
        }
    }

    /// Power for which the motor is made [W]: of a DC motor at what its winding bears for ever, or a third
    /// of the power stage's current, and the speed that its voltage leaves it then; of a stepper the largest
    /// that its pull-out torque gives.
    pub fn rated_power(&self) -> f64 {
        /// Speeds at which a stepper's power is looked at.
        const SPEEDS: u32 = 200;
        match &self.motor {
            Motor::Dc(motor) => {
                let current = motor.continuous_current.unwrap_or(motor.current / 3.0);
                let speed = (motor.voltage - motor.resistance * current) / motor.torque_constant;
                motor.torque_constant * current * speed.max(0.0)
            }
            Motor::Stepper(motor) => {
                let most = motor.largest_speed();
                (1..=SPEEDS)
                    .map(|step| most * f64::from(step) / f64::from(SPEEDS))
                    .map(|speed| motor.pull_out_torque(speed) * speed)
                    .fold(0.0, f64::max)
            }
        }
    }
}

/// `motor` with another inertia [kg·m²].
fn with_inertia(motor: &Motor, inertia: f64) -> Motor {
    let mut motor = *motor;
    match &mut motor {
        Motor::Dc(dc) => dc.rotor_inertia = inertia,
        Motor::Stepper(stepper) => stepper.rotor_inertia = inertia,
    }
    motor
}
