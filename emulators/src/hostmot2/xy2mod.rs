//! The interface to a scan head: position, velocity and acceleration of two mirrors, by XY2-100.
//!
//! From what was last written a mirror goes on by its velocity and acceleration. ±2³¹ is the full scale, of
//! which a frame carries 16 bits, or 18. At an end of the scale it stops, and the overflow is told until it
//! is cleared.

use messages::Nanoseconds;

use super::clock::Clock;
use super::layout::XY2MODS;

/// Registers by their number; X before Y.
mod register {
    pub(super) const ACCELERATION: u16 = 0;
    pub(super) const VELOCITY: u16 = 2;
    pub(super) const POSITION: u16 = 4;
    pub(super) const MODE: u16 = 6;
    pub(super) const COMMAND: u16 = 7;
    pub(super) const STATUS: u16 = 8;
    pub(super) const SAMPLED: u16 = 9;
    pub(super) const APPLIED: u16 = 10;
}

/// Bits of the mode.
mod mode {
    /// Position overflow of X; Y follows.
    pub(super) const POSITION_OVERFLOW: u32 = 1 << 6;
    /// Velocity overflow of X; Y follows.
    pub(super) const VELOCITY_OVERFLOW: u32 = 1 << 8;
    pub(super) const OVERFLOWS: u32 = 0xf << 6;
    /// X with 18 bits; Y follows.
    pub(super) const LONG: u32 = 1 << 10;
}

/// Full scale.
const FULL: f64 = 2_147_483_648.0;

#[derive(Debug, Clone, Copy, Default)]
struct Mirror {
    /// In units of the register.
    position: f64,
    /// In units of the register: position for every 256 ticks.
    velocity: f64,
    acceleration: i32,
}

impl Mirror {
    fn advance(&mut self, seconds: f64) -> [bool; 2] {
        let clock = f64::from(Clock::Low.hertz());
        let speed = self.velocity * clock / 256.0;
        let acceleration = f64::from(self.acceleration) * clock * clock / f64::from(1 << 20);
        self.position += (speed + 0.5 * acceleration * seconds) * seconds;
        self.velocity += acceleration * seconds * 256.0 / clock;
        let beyond = |value: f64| !(-FULL..FULL).contains(&value);
        let overflows = [beyond(self.position), beyond(self.velocity)];
        self.position = self.position.clamp(-FULL, FULL - 1.0);
        self.velocity = self.velocity.clamp(-FULL, FULL - 1.0);
        overflows
    }

    fn registers(&self) -> [u32; 3] {
        [self.acceleration, self.velocity as i32, self.position as i32].map(|value| value as u32)
    }

    fn write(&mut self, index: u16, value: u32) {
        let value = value as i32;
        match index {
            register::ACCELERATION => self.acceleration = value,
            register::VELOCITY => self.velocity = f64::from(value),
            register::POSITION => self.position = f64::from(value),
            _ => {}
        }
    }
}

/// One scan head.
#[derive(Debug, Clone, Copy, Default)]
struct Head {
    mirrors: [Mirror; 2],
    /// What was written and waits for the DPLL, in the order of its registers.
    pending: [Option<u32>; 6],
    sample: [[u32; 3]; 2],
    mode: u32,
    command: u32,
}

/// All of them.
#[derive(Debug, Clone, Default)]
pub struct Xy2mods {
    heads: [Head; XY2MODS],
    sampled: u32,
    applied: u32,
}

impl Xy2mods {
    /// The register `index` of `instance`.
    pub fn read(&self, index: u16, instance: usize) -> u32 {
        let head = self.heads.get(instance).copied().unwrap_or_default();
        match index {
            0..=5 => {
                let mirror = usize::from(index % 2);
                let registers = match self.timers()[0] {
                    Some(_) => head.sample[mirror],
                    None => head.mirrors[mirror].registers(),
                };
                registers[usize::from(index / 2)]
            }
            register::MODE => head.mode,
            register::COMMAND => head.command,
            // A head that is well: power and temperature, position reached, of both.
            register::STATUS => 0x000f_0fff,
            register::SAMPLED => self.sampled,
            register::APPLIED => self.applied,
            _ => 0,
        }
    }

    /// Writes the register `index` of `instance`.
    pub fn write(&mut self, index: u16, instance: usize, value: u32) {
        let waits = self.timers()[1].is_some();
        match index {
            register::SAMPLED => self.sampled = value,
            register::APPLIED => self.applied = value,
            _ => {
                let Some(head) = self.heads.get_mut(instance) else { return };
                match index {
                    0..=5 if waits => head.pending[usize::from(index)] = Some(value),
                    0..=5 => head.mirrors[usize::from(index % 2)].write(index & !1, value),
                    register::MODE => {
                        let left = head.mode & mode::OVERFLOWS & !value;
                        head.mode = value & !mode::OVERFLOWS | left;
                    }
                    register::COMMAND => head.command = value,
                    _ => {}
                }
            }
        }
    }

    /// Moves all mirrors on by `duration`.
    pub fn advance(&mut self, duration: Nanoseconds) {
        for head in &mut self.heads {
            for (axis, mirror) in head.mirrors.iter_mut().enumerate() {
                let [position, velocity] = mirror.advance(duration.seconds());
                if position {
                    head.mode |= mode::POSITION_OVERFLOW << axis;
                }
                if velocity {
                    head.mode |= mode::VELOCITY_OVERFLOW << axis;
                }
            }
        }
    }

    /// The timers of the DPLL, 0..=4, that sample what is read and apply what was written, if they do.
    pub fn timers(&self) -> [Option<u8>; 2] {
        [self.sampled, self.applied]
            .map(|word| (word & 1 << 15 != 0).then_some((word >> 12 & 7) as u8))
    }

    /// The `timer` of the DPLL fires.
    pub fn dpll(&mut self, timer: u8) {
        let [samples, applies] = self.timers().map(|own| own == Some(timer));
        for head in &mut self.heads {
            if applies {
                for (index, value) in head.pending.iter_mut().enumerate() {
                    if let Some(value) = value.take() {
                        head.mirrors[index % 2].write(index as u16 & !1, value);
                    }
                }
            }
            if samples {
                head.sample = head.mirrors.map(|mirror| mirror.registers());
            }
        }
    }

    /// What the head is told, −1..1 of its full scale, of an `axis`, 0 or 1.
    pub fn position(&self, instance: usize, axis: usize) -> f64 {
        let [position, _] = self.after(instance, axis, 0.0);
        position
    }

    /// What it will be told `time` [s] from now, −1..1 of its full scale, and how fast that goes on then [1/s],
    /// unless something is written before.
    pub fn after(&self, instance: usize, axis: usize, time: f64) -> [f64; 2] {
        let Some(head) = self.heads.get(instance) else { return [0.0; 2] };
        let Some(mut mirror) = head.mirrors.get(axis).copied() else { return [0.0; 2] };
        mirror.advance(time);
        let bits = if head.mode & mode::LONG << axis == 0 { 16 } else { 18 };
        let step = f64::from(1_u32 << (32 - bits));
        let speed = mirror.velocity * f64::from(Clock::Low.hertz()) / 256.0 / FULL;
        [(mirror.position / step).floor() * step / FULL, speed]
    }

    /// How fast it goes on, of its full scale [1/s].
    pub fn speed(&self, instance: usize, axis: usize) -> f64 {
        let [_, speed] = self.after(instance, axis, 0.0);
        speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the driver scales them: full scales per second, and per second².
    fn velocity(scales: f64) -> u32 {
        (scales * 256.0 * FULL / 1e8) as i32 as u32
    }
    fn acceleration(scales: f64) -> u32 {
        (scales * 4096.0 * 4_294_967_296.0 * 32768.0 / (1e8 * 1e8 * 256.0)) as i32 as u32
    }

    #[test]
    fn a_mirror_goes_on_by_velocity_and_acceleration() {
        let mut heads = Xy2mods::default();
        heads.write(4, 0, (0.25 * FULL) as u32);
        heads.write(2, 0, velocity(-10.0));
        heads.write(0, 0, acceleration(2000.0));
        for _ in 0..10 {
            heads.advance(Nanoseconds(100_000));
        }
        // 0.25 − 10·0.001 + ½·2000·0.001².
        assert!((heads.position(0, 0) - 0.241).abs() < 1e-4, "{}", heads.position(0, 0));
        // The register's step is 4.4 of 2000.
        assert!((heads.speed(0, 0) + 8.0).abs() < 5e-3, "{}", heads.speed(0, 0));
        assert_eq!(heads.position(0, 1), 0.0);
    }

    #[test]
    fn a_frame_has_16_or_18_bits() {
        let mut heads = Xy2mods::default();
        heads.write(5, 0, 0x1234_ffff);
        assert_eq!(heads.position(0, 1), f64::from(0x1234_0000) / FULL);
        heads.write(6, 0, mode::LONG << 1);
        assert_eq!(heads.position(0, 1), f64::from(0x1234_c000) / FULL);
    }

    #[test]
    fn it_stops_at_the_end_of_the_scale_and_says_so() {
        let mut heads = Xy2mods::default();
        heads.write(2, 0, velocity(100.0));
        heads.advance(Nanoseconds(20_000_000));
        assert_eq!(heads.read(4, 0), i32::MAX as u32);
        assert_eq!(heads.read(6, 0), mode::POSITION_OVERFLOW);
        heads.write(4, 0, 0);
        heads.write(6, 0, mode::OVERFLOWS);
        assert_eq!(heads.read(6, 0), 0);
    }

    #[test]
    fn what_is_written_waits_for_its_timer() {
        let mut heads = Xy2mods::default();
        heads.write(10, 0, 1 << 15 | 2 << 12);
        heads.write(4, 0, 0x1000_0000);
        heads.dpll(1);
        assert_eq!(heads.position(0, 0), 0.0);
        heads.dpll(2);
        assert_eq!(heads.position(0, 0), 0.125);
    }
}
