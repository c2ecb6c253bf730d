//! What a plan asks of each motor: its operating points over the job, and what they come to.

use machine::transmission::gear::Efficiency;
use machine::{Actuator, Friction, Machine, Motor};
use messages::Setpoint;
use messages::time::SETPOINT_TIME;
use planner::Plan;
use schemars::JsonSchema;
use serde::Serialize;

/// A motor that turns slower than this stands [rad/s].
const STANDING: f64 = 1e-6;

/// What a motor does in the cycle that ends at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OperatingPoint {
    /// Stream time [s].
    pub time: f64,
    /// Whether the laser is lit in the cycle that begins then.
    pub is_lit: bool,
    /// The stroke that it marks, from 1; 0 for none.
    pub stroke: u64,
    /// Speed of the shaft [rad/s].
    pub speed: f64,
    /// Acceleration of the shaft [rad/s²].
    pub acceleration: f64,
    /// Torque that the load takes at the shaft, without losses [N·m].
    pub load: f64,
    /// Torque that the rotor takes [N·m].
    pub rotor: f64,
    /// Torque that friction takes [N·m].
    pub friction: f64,
    /// Torque of the motor where a gear's efficiency stands for friction [N·m]: rotor, and load with its
    /// losses.
    pub by_efficiency: f64,
    /// Current of a DC motor [A]; 0 of a stepper.
    pub current: f64,
    /// Voltage of a DC motor [V]; 0 of a stepper.
    pub voltage: f64,
    /// Power that the motor takes from its supply [W], negative where it gives some back; of a stepper, its
    /// mechanical power.
    pub supplied: f64,
}

impl OperatingPoint {
    /// Torque of the motor, friction included [N·m].
    pub fn torque(&self) -> f64 {
        self.load + self.rotor + self.friction
    }

    /// Power at the shaft [W].
    pub fn power(&self) -> f64 {
        self.torque() * self.speed
    }
}

/// What one motor does over a job, cycle by cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisCourse {
    /// Name of the actuator.
    pub name: String,
    /// Its operating points, one a cycle.
    pub points: Vec<OperatingPoint>,
}

/// What each motor of `machine` does over `plan`, in the order of the actuators.
pub fn courses(machine: &Machine, plan: &Plan) -> Vec<AxisCourse> {
    let mut courses: Vec<AxisCourse> = machine
        .actuators
        .iter()
        .map(|actuator| AxisCourse { name: actuator.name.clone(), points: Vec::new() })
        .collect();
    let mut before: Vec<Option<Shaft>> = vec![None; machine.actuators.len()];
    for setpoint in plan.setpoints(1) {
        for (index, (actuator, course)) in machine.actuators.iter().zip(&mut courses).enumerate() {
            let (point, shaft) = operate(actuator, index, &setpoint, before[index]);
            before[index] = Some(shaft);
            course.points.push(point);
        }
    }
    for (actuator, course) in machine.actuators.iter().zip(&mut courses) {
        lead(actuator, &mut course.points);
    }
    courses
}

/// Gives each point the acceleration of the shaft itself, from its speeds before and after: springs let it
/// lead the joint, and what the rotor takes for that is not the load's.
fn lead(actuator: &Actuator, points: &mut [OperatingPoint]) {
    for index in 1..points.len().saturating_sub(1) {
        let next = points[index + 1].speed;
        let point = &mut points[index];
        let torque = point.load + point.rotor;
        point.acceleration = (next - point.speed) / SETPOINT_TIME;
        point.rotor = actuator.motor.rotor_inertia() * point.acceleration;
        point.load = torque - point.rotor;
        point.by_efficiency =
            point.rotor + with_losses(&actuator.efficiency, point.load, point.speed);
    }
}

/// A motor at a setpoint.
#[derive(Debug, Clone, Copy)]
struct Shaft {
    /// [rad].
    angle: f64,
    /// Of a DC motor [A].
    current: f64,
}

fn operate(
    actuator: &Actuator,
    index: usize,
    setpoint: &Setpoint,
    before: Option<Shaft>,
) -> (OperatingPoint, Shaft) {
    let angle = (setpoint.position[actuator.axis] + setpoint.lead[index]) / actuator.ratio;
    let speed = before.map_or(0.0, |before| (angle - before.angle) / SETPOINT_TIME);
    let acceleration = setpoint.acceleration[actuator.axis] / actuator.ratio;
    let rotor = actuator.motor.rotor_inertia() * acceleration;
    let load = setpoint.effort[index] - rotor;
    let friction = actuator.friction.torque(speed);
    let torque = setpoint.effort[index] + friction;
    let (current, voltage, supplied) = match &actuator.motor {
        Motor::Dc(motor) => {
            let current = torque / motor.torque_constant;
            let earlier = before.map_or(current, |before| before.current);
            let rate = (current - earlier) / SETPOINT_TIME;
            let voltage = motor.voltage((current + earlier) / 2.0, rate, speed);
            (current, voltage, voltage * current)
        }
        Motor::Stepper(_) => (0.0, 0.0, torque * speed),
    };
    let point = OperatingPoint {
        time: setpoint.sequence as f64 * SETPOINT_TIME,
        is_lit: setpoint.laser.is_lit(),
        stroke: setpoint.stroke,
        speed,
        acceleration,
        load,
        rotor,
        friction,
        by_efficiency: rotor + with_losses(&actuator.efficiency, load, speed),
        current,
        voltage,
        supplied,
    };
    (point, Shaft { angle, current })
}

/// What `load` [N·m] takes of the motor at `speed` [rad/s] by the gear's efficiency; what stands is taken to
/// be starting.
fn with_losses(efficiency: &Efficiency, load: f64, speed: f64) -> f64 {
    efficiency.torque(load, if Friction::is_standing(speed) { 0.0 } else { speed })
}

/// What a motor must give over a job, or over several.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Demand {
    /// Time over which it was looked at [s].
    pub time: f64,
    /// Largest torque, friction included [N·m].
    pub torque_peak: f64,
    /// Root mean square of the torque [N·m].
    pub torque_rms: f64,
    /// Largest torque of the load alone [N·m].
    pub load_peak: f64,
    /// Largest torque of the rotor alone [N·m].
    pub rotor_peak: f64,
    /// Largest torque of friction alone [N·m].
    pub friction_peak: f64,
    /// Largest torque where a gear's efficiency stands for friction [N·m].
    pub by_efficiency_peak: f64,
    /// Largest speed [rad/s].
    pub speed_peak: f64,
    /// Largest speed while the laser is lit [rad/s].
    pub speed_lit_peak: f64,
    /// Root mean square of the speed [rad/s].
    pub speed_rms: f64,
    /// Largest power at the shaft [W].
    pub power_peak: f64,
    /// Largest torque times largest speed [W], which is how some sources give the power.
    pub power_product: f64,
    /// Energy taken from the supply [J].
    pub energy: f64,
    /// Energy given back to it [J].
    pub regenerated: f64,
    /// Part of the time in which the motor turns.
    pub duty: f64,
    /// Root mean square of a DC motor's current [A].
    pub current_rms: f64,
    /// Largest current of a DC motor [A].
    pub current_peak: f64,
    /// Largest voltage of a DC motor [V].
    pub voltage_peak: f64,
}

impl Demand {
    /// What the motor of `course` must give.
    pub fn of(course: &AxisCourse) -> Self {
        let most = |value: fn(&OperatingPoint) -> f64| {
            course.points.iter().fold(0.0, |most: f64, point| most.max(value(point).abs()))
        };
        let count = course.points.len().max(1) as f64;
        let mean = |value: fn(&OperatingPoint) -> f64| {
            course.points.iter().map(value).sum::<f64>() / count
        };
        let (torque_peak, speed_peak) = (most(OperatingPoint::torque), most(|point| point.speed));
        Self {
            time: course.points.len() as f64 * SETPOINT_TIME,
            torque_peak,
            torque_rms: mean(|point| point.torque() * point.torque()).sqrt(),
            load_peak: most(|point| point.load),
            rotor_peak: most(|point| point.rotor),
            friction_peak: most(|point| point.friction),
            by_efficiency_peak: most(|point| point.by_efficiency),
            speed_peak,
            speed_lit_peak: most(|point| if point.is_lit { point.speed } else { 0.0 }),
            speed_rms: mean(|point| point.speed * point.speed).sqrt(),
            power_peak: most(OperatingPoint::power),
            power_product: torque_peak * speed_peak,
            energy: mean(|point| point.supplied.max(0.0)) * count * SETPOINT_TIME,
            regenerated: mean(|point| (-point.supplied).max(0.0)) * count * SETPOINT_TIME,
            duty: mean(|point| f64::from(u8::from(point.speed.abs() > STANDING))),
            current_rms: mean(|point| point.current * point.current).sqrt(),
            current_peak: most(|point| point.current),
            voltage_peak: most(|point| point.voltage),
        }
    }

    /// This and `other` one after the other.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let time = self.time + other.time;
        let parts = if time > 0.0 { [self.time / time, other.time / time] } else { [0.0; 2] };
        let most = |value: fn(&Self) -> f64| value(self).max(value(other));
        let mean = |value: fn(&Self) -> f64| parts[0] * value(self) + parts[1] * value(other);
        let rms = |value: fn(&Self) -> f64| {
            let [mine, others] = [value(self), value(other)];
            (parts[0] * mine * mine + parts[1] * others * others).sqrt()
        };
        let (torque_peak, speed_peak) = (most(|one| one.torque_peak), most(|one| one.speed_peak));
        Self {
            time,
            torque_peak,
            torque_rms: rms(|one| one.torque_rms),
            load_peak: most(|one| one.load_peak),
            rotor_peak: most(|one| one.rotor_peak),
            friction_peak: most(|one| one.friction_peak),
            by_efficiency_peak: most(|one| one.by_efficiency_peak),
            speed_peak,
            speed_lit_peak: most(|one| one.speed_lit_peak),
            speed_rms: rms(|one| one.speed_rms),
            power_peak: most(|one| one.power_peak),
            power_product: torque_peak * speed_peak,
            energy: self.energy + other.energy,
            regenerated: self.regenerated + other.regenerated,
            duty: mean(|one| one.duty),
            current_rms: rms(|one| one.current_rms),
            current_peak: most(|one| one.current_peak),
            voltage_peak: most(|one| one.voltage_peak),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use messages::axis::axis_array;

    /// The first motor of the built-in CoreXY along the diagonal of its area with 10 m/s², at 0.2 m/s.
    #[test]
    fn an_operating_point_is_what_a_hand_computes() {
        let machine = Machine::builtin();
        let axis = &machine.actuators[0];
        // Both belts' coordinates are x + y and x − y: along the diagonal the first goes √2 times as fast.
        let [speed, acceleration] = [0.2 * 2_f64.sqrt(), 10.0 * 2_f64.sqrt()];
        let force = (0.33 + 1.06) / 4.0 * acceleration;
        let inertia = 2e-6;
        let effort = axis.ratio * force + inertia * acceleration / axis.ratio;
        let setpoint = Setpoint {
            position: axis_array(&[0.01]),
            acceleration: axis_array(&[acceleration]),
            effort: core::array::from_fn(|index| if index == 0 { effort } else { 0.0 }),
            ..Setpoint::default()
        };
        let torque = effort + 5e-3 + 1e-6 * speed / axis.ratio;
        let before = Shaft {
            angle: 0.01 / axis.ratio - speed / axis.ratio * SETPOINT_TIME,
            current: torque / 0.021,
        };
        let (point, _) = operate(axis, 0, &setpoint, Some(before));
        let close = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} for {expected}");
        };
        close(axis.ratio, 1.25e-3);
        close(point.speed, 226.274);
        close(point.load, 6.143_0e-3);
        close(point.rotor, 22.627_4e-3);
        close(point.friction, 5.226_27e-3);
        close(point.torque(), 33.996_7e-3);
        close(point.current, 1.618_89);
        close(point.voltage, 2.3 * 1.618_89 + 0.021 * 226.274);
        close(point.by_efficiency, 22.627_4e-3 + 6.143e-3 / 0.8);
        close(point.power(), 7.692_6);
    }

    #[test]
    fn demands_of_two_jobs_add_up() {
        let point = |speed: f64, load: f64| OperatingPoint {
            speed,
            load,
            supplied: speed * load,
            ..OperatingPoint::default()
        };
        let course = |points: Vec<OperatingPoint>| AxisCourse { name: "x".to_owned(), points };
        let [one, two] = [vec![point(3.0, 1.0), point(0.0, 2.0)], vec![point(-4.0, 0.5)]];
        let both = Demand::of(&course([one.clone(), two.clone()].concat()));
        let added = Demand::of(&course(one)).and(&Demand::of(&course(two)));
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12);
        close(both.torque_rms, ((1.0 + 4.0 + 0.25) / 3.0_f64).sqrt());
        close(added.torque_rms, both.torque_rms);
        close(added.speed_rms, both.speed_rms);
        close(added.duty, 2.0 / 3.0);
        close(added.speed_peak, 4.0);
        close(added.power_peak, 3.0);
        close(added.power_product, 8.0);
        close(added.energy, 3e-3);
        close(added.regenerated, 2e-3);
    }
}
