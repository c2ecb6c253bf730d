//! A drive's own loops: position P, velocity PI, current P with the motor's data, all at one rate.

use machine::{Actuator, DcMotor};

/// Bandwidth that the loops outside count on of the current loop, as a share of the loops' rate.
const CURRENT_SHARE: f64 = 0.15;

/// What of the way to its target the current goes in each period: all of it, which makes it as quick as those of drives
/// that are bought, of a bandwidth of some 1 kHz. The voltage acts in the next period, and the current until then is known
/// from the voltage at hand.
const CURRENT_STEP: f64 = 1.0;

/// Each loop outside another is as many times slower, unless the machine file asks for a faster one.
const RATIO: f64 = 4.0;

/// Corner of the velocity PI as a share of its bandwidth.
const INTEGRAL_CORNER: f64 = 0.25;

/// Bandwidth of the estimate of the speed as a multiple of the velocity loop's.
const ESTIMATE_RATIO: f64 = 4.0;

/// What the loops follow, in units of the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// A position [rad] at a speed [rad/s], with a torque [N·m] ahead of the loops.
    Position([f64; 3]),
    /// A speed [rad/s], with a torque [N·m] ahead of the loops.
    Velocity([f64; 2]),
    /// A torque [N·m].
    Torque(f64),
}

/// The loops of one motor.
#[derive(Debug, Clone)]
pub struct Servo {
    motor: DcMotor,
    inertia: f64,
    /// Bandwidths of the position, the velocity and the current loop [1/s].
    bandwidths: [f64; 3],
    viscous: f64,
    resolution: f64,
    step: f64,
    angle: f64,
    speed: f64,
    /// What speeds the motor up beside its own torque [rad/s²].
    disturbance: f64,
    integral: f64,
    limited: bool,
    /// How fast the voltage that acts in this period changes the current [A/s].
    rate: f64,
}

impl Servo {
    /// The loops of `actuator`, run every `step` [s]; `None` if it has no servo motor.
    pub fn new(actuator: &Actuator, step: f64) -> Option<Self> {
        let gains = &actuator.gains;
        let current = (CURRENT_SHARE / step).max(gains.current);
        let velocity = (current / RATIO).max(gains.velocity);
        let position = (velocity / RATIO).max(gains.position);
        Some(Self {
            motor: *actuator.motor.dc()?,
            inertia: gains.inertia,
            bandwidths: [position, velocity, current],
            viscous: actuator.friction.viscous,
            resolution: actuator.encoder.resolution(),
            step,
            angle: 0.0,
            speed: 0.0,
            disturbance: 0.0,
            integral: 0.0,
            limited: false,
            rate: 0.0,
        })
    }

    /// Angle of a count [rad].
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// The motor's largest torque [N·m].
    pub fn largest_torque(&self) -> f64 {
        self.motor.largest_torque()
    }

    /// Torque of a current [N·m].
    pub fn torque(&self, current: f64) -> f64 {
        self.motor.torque_constant * current
    }

    /// Estimated speed [rad/s].
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether torque or voltage is at its limit.
    pub fn is_limited(&self) -> bool {
        self.limited
    }

    /// Takes the measured `angle` [rad] and `current` [A], `step` after those before.
    pub fn observe(&mut self, angle: f64, current: f64) {
        // The speed follows the torque and what stands against it, weight and friction; both are corrected by the
        // encoder, with a memory that fades (Zarchan, Musoff: Fundamentals of Kalman filtering, ch. 3). Filtering the
        // encoder alone would tell the speed late by many steps while the motor speeds up.
        let [_, velocity, _] = self.bandwidths;
        let fresh = (ESTIMATE_RATIO * velocity * self.step).min(0.5);
        let kept = 1.0 - fresh;
        let torque = self.torque(current) - self.viscous * self.speed;
        let change = (torque / self.inertia + self.disturbance) * self.step;
        let predicted = self.angle + (self.speed + 0.5 * change) * self.step;
        let error = angle - predicted;
        self.angle = predicted + (1.0 - kept * kept * kept) * error;
        self.speed += change + 1.5 * fresh * fresh * (1.0 + kept) * error / self.step;
        self.disturbance += fresh * fresh * fresh * error / (self.step * self.step);
    }

    /// Forgets what the loops have summed up, the motor standing at `angle` [rad].
    pub fn reset(&mut self, angle: f64) {
        (self.angle, self.speed, self.disturbance) = (angle, 0.0, 0.0);
        self.release();
    }

    /// Forgets what the velocity loop has summed up, the motor having been unpowered.
    pub fn release(&mut self) {
        (self.integral, self.limited, self.rate) = (0.0, false, 0.0);
    }

    /// The voltage with which the motor at `angle` [rad] with `current` [A] follows `target`, with no more torque
    /// than `bound` [N·m], in V.
    pub fn follow(&mut self, target: Target, bound: f64, angle: f64, current: f64) -> f64 {
        let [stiffness, ..] = self.bandwidths;
        let torque = match target {
            Target::Torque(torque) => torque,
            Target::Velocity([speed, torque]) => self.velocity(speed, torque),
            Target::Position([position, speed, torque]) => {
                self.velocity(speed + stiffness * (position - angle), torque)
            }
        };
        let limit = self.motor.current.min((bound / self.motor.torque_constant).max(0.0));
        let wanted = torque / self.motor.torque_constant;
        let bounded = wanted.clamp(-limit, limit);
        let ahead = current + self.rate * self.step;
        let rate = CURRENT_STEP * (bounded - ahead) / self.step;
        let voltage = self.motor.voltage(ahead, rate, self.speed);
        let supplied = voltage.clamp(-self.motor.voltage, self.motor.voltage);
        self.rate = self.motor.current_rate(supplied, ahead, self.speed);
        self.limited = wanted != bounded || voltage != supplied;
        if supplied.is_finite() { supplied } else { 0.0 }
    }

    fn velocity(&mut self, wanted: f64, torque: f64) -> f64 {
        let [_, bandwidth, _] = self.bandwidths;
        let error = wanted - self.speed;
        if !self.limited {
            self.integral += INTEGRAL_CORNER * bandwidth * error * self.step;
        }
        self.inertia * bandwidth * (error + self.integral) + self.viscous * wanted + torque
    }
}
