//! Pulse widths: the voltage of a DC motor's bridge, and the power of the laser.

use machine::DcMotor;

use super::idrom::Module;
use super::lbp16::Request;

/// Registers of the PWM generators.
mod register {
    pub(super) const VALUE: u16 = 0;
    pub(super) const MODE: u16 = 1;
    pub(super) const RATE: u16 = 2;
    pub(super) const ENABLE: u16 = 4;
}

/// How often the pulses come [Hz].
const FREQUENCY: f64 = 20e3;
/// 12 bits, pulse and direction, taken over at the beginning of a pulse.
const MODE: u32 = 3 | 1 << 5;
/// The largest value: a pulse without an end.
const FULL: f64 = 4095.0;
/// Bit of the direction.
const BACKWARDS: u32 = 1 << 31;

/// All PWM generators that the machine uses.
#[derive(Debug, Clone)]
pub struct Pwms {
    module: Module,
    units: Vec<u32>,
}

impl Pwms {
    /// The instances `units` of `module`.
    pub fn new(module: Module, units: Vec<u32>) -> Self {
        Self { module, units }
    }

    /// Sets the generators up, at 0 and disabled.
    pub fn arm(&self, request: &mut Request) {
        let rate = FREQUENCY * 65_536.0 * 4096.0 / f64::from(self.module.clock);
        for unit in &self.units {
            request.write(self.module.address(register::VALUE, *unit), 0);
            request.write(self.module.address(register::MODE, *unit), MODE);
        }
        request.write(self.module.address(register::RATE, 0), rate.clamp(1.0, 65_535.0) as u32);
        self.enable(request, 0);
    }

    /// Enables the generators with a bit in `mask`.
    pub fn enable(&self, request: &mut Request, mask: u32) {
        request.write(self.module.address(register::ENABLE, 0), mask);
    }

    /// Sets the mean of `unit`, −1..=1.
    pub fn set(&self, request: &mut Request, unit: u32, duty: f64) {
        let value = ((duty.abs().min(1.0) * FULL).round() as u32) << 16;
        let value = if duty < 0.0 { value | BACKWARDS } else { value };
        request.write(self.module.address(register::VALUE, unit), value);
    }
}

/// The current of a DC motor, which no such board measures: from the voltage, the speed and the winding's data,
/// `L·di/dt = V − R·i − k·ω`, with both held over a cycle.
#[derive(Debug, Clone, Copy)]
pub struct Winding {
    motor: DcMotor,
    /// What is left of a deviation after a cycle.
    decay: f64,
    current: f64,
}

impl Winding {
    /// The winding of `motor` without current, in cycles of `period` [s].
    pub fn new(motor: DcMotor, period: f64) -> Self {
        let decay = messages::math::exp(-motor.resistance * period / motor.inductance);
        Self { motor, decay, current: 0.0 }
    }

    /// A cycle at `voltage` [V] and `speed` [rad/s].
    pub fn pass(&mut self, voltage: f64, speed: f64) {
        let settled = (voltage - self.motor.torque_constant * speed) / self.motor.resistance;
        self.current = settled + (self.current - settled) * self.decay;
    }

    /// Without power the current is gone at once.
    pub fn open(&mut self) {
        self.current = 0.0;
    }

    /// The current [A].
    pub fn current(&self) -> f64 {
        self.current
    }

    /// The share of its supply that is `voltage` [V].
    pub fn duty(&self, voltage: f64) -> f64 {
        (voltage / self.motor.voltage).clamp(-1.0, 1.0)
    }

    /// The voltage that the motor has at `speed` [rad/s] by itself [V].
    pub fn back_voltage(&self, speed: f64) -> f64 {
        self.motor.torque_constant * speed
    }
}
