//! A scan head by XY2-100: the board goes on between the cycles by velocity and acceleration.

use super::idrom::Module;
use super::lbp16::Request;
use super::path::Path;

/// Registers of an interface; X, and Y behind it.
mod register {
    pub(super) const ACCELERATION: u16 = 0;
    pub(super) const VELOCITY: u16 = 2;
    pub(super) const POSITION: u16 = 4;
    pub(super) const MODE: u16 = 6;
    pub(super) const APPLIED: u16 = 10;
}

/// Control code of both mirrors for a frame of 16 bits.
const CONTROL: u32 = 1 | 1 << 3;
/// Both mirrors with 18 bits.
const LONG: u32 = 3 << 10;
/// The overflows of both mirrors, cleared by a write.
const OVERFLOWS: u32 = 0xf << 6;
/// Those of X; Y's stand a bit higher.
const OWN_OVERFLOWS: u32 = 0b0101 << 6;
/// What is written waits for this timer of the board's clock.
const TIMER: u32 = 3;

/// Full scale of a position.
const FULL: f64 = 2_147_483_648.0;

/// One mirror.
#[derive(Debug, Clone)]
pub struct Mirror {
    module: Module,
    unit: u32,
    /// 0 for X, 1 for Y.
    axis: u16,
    /// The motor's angle at full scale [rad].
    scale: f64,
    long: bool,
    angle: f64,
    /// Whether a place or a speed was beyond the scale.
    overflown: bool,
}

impl Mirror {
    /// The mirror `axis` of the interface `unit` of `module`, whose full scale is `scale` [rad], with frames of
    /// 18 bits where they are `long`.
    pub fn new(module: Module, unit: u32, axis: u32, scale: f64, long: bool) -> Self {
        Self { module, unit, axis: u16::from(axis == 1), scale, long, angle: 0.0, overflown: false }
    }

    /// Sets the interface up, at the middle of its scale; where it `waits`, what is written acts at a timer of
    /// the board's clock.
    pub fn arm(&self, request: &mut Request, waits: bool) {
        let mode = if self.long { CONTROL | LONG } else { CONTROL };
        let applied = if waits { 1 << 15 | TIMER << 12 } else { 0 };
        request.write(self.module.address(register::APPLIED, 0), 0);
        for register in [register::ACCELERATION, register::VELOCITY, register::POSITION] {
            request.write(self.address(register), 0);
        }
        request.write(self.module.address(register::MODE, self.unit), mode | OVERFLOWS);
        request.write(self.module.address(register::APPLIED, 0), applied);
    }

    /// Begins a cycle along `path`, the angle from the middle of the scale.
    pub fn follow(&self, request: &mut Request, path: &Path) {
        let clock = f64::from(self.module.clock);
        let scaled = |value: f64, unit: f64| {
            (value / self.scale * unit).round().clamp(-FULL, FULL - 1.0) as i32 as u32
        };
        let [angle, speed] = path.from;
        request.write(self.address(register::POSITION), scaled(angle, FULL));
        // The interface adds the velocity up every 256 ticks, the acceleration with 20 bits more.
        request.write(self.address(register::VELOCITY), scaled(speed, 256.0 * FULL / clock));
        let acceleration = scaled(path.acceleration(), FULL * 1_048_576.0 / (clock * clock));
        request.write(self.address(register::ACCELERATION), acceleration);
    }

    /// Whether `angle` [rad] is on the scale.
    pub fn reaches(&self, angle: f64) -> bool {
        angle.abs() < self.scale
    }

    /// Reads the position, and the mode with its overflows.
    pub fn ask(&self, request: &mut Request) {
        request.read(self.address(register::POSITION), 1);
        request.read(self.module.address(register::MODE, self.unit), 1);
    }

    /// Its position and its mode read these words.
    pub fn take(&mut self, [position, mode]: [u32; 2]) {
        self.angle = f64::from(position as i32) / FULL * self.scale;
        self.overflown = mode & OWN_OVERFLOWS << self.axis != 0;
    }

    /// Whether the interface says that it was told a place beyond its scale.
    pub fn is_overflown(&self) -> bool {
        self.overflown
    }

    /// Forgets the overflows.
    pub fn reset(&self, request: &mut Request) {
        let mode = if self.long { CONTROL | LONG } else { CONTROL };
        request.write(self.module.address(register::MODE, self.unit), mode | OVERFLOWS);
    }

    /// The angle that the head was told when the newest request arrived [rad].
    pub fn angle(&self) -> f64 {
        self.angle
    }

    fn address(&self, register: u16) -> u16 {
        self.module.address(register + self.axis, self.unit)
    }
}
