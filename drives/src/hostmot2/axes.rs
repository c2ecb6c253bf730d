//! What drives each actuator on the board, and what measures it.

use machine::{Actuator, Axis};
use messages::{CommandMode, Nanoseconds};

use super::config::Connection;
use super::encoder::Counter;
use super::galvo::Mirror;
use super::idrom::{Board, BoardError, Kind};
use super::lbp16::{Reply, Request};
use super::path::{Path, is_driven};
use super::pwm::{Pwms, Winding};
use super::steps::Steps;
use crate::plant::brake::deceleration;
use crate::port::Actuation;

/// Rounding by which a pulse rate may exceed its limit.
const EXCESS: f64 = 1.001;
/// By what an encoder may be faster than its motor can turn before its reply is not believed.
const BELIEF: f64 = 2.0;

/// One actuator on the board.
#[derive(Debug, Clone)]
pub struct Drive {
    kind: DriveKind,
    counter: Option<Counter>,
    /// What the motor is told, from home; of a mirror from the middle of its scale.
    path: Path,
    /// The motor's angle at home [rad].
    origin: f64,
    /// The angle of one count [rad].
    resolution: f64,
    /// What its ramp takes from the motor's speed [rad/s²].
    deceleration: f64,
    /// The most counts that are believed in a second.
    believed: f64,
    /// Counts from home, and the motor's angle, at the newest reply.
    counts: i64,
    position: f64,
    /// The speed between the newest two replies [rad/s].
    speed: f64,
    /// What the newest reply says and nothing has checked: the place, and the encoder or a mirror's mode.
    words: [u32; 2],
}

#[derive(Debug, Clone)]
enum DriveKind {
    Steps { steps: Steps, fastest: f64 },
    Bridge { pwm: u32, winding: Winding, voltage: f64 },
    Mirror(Mirror),
}

impl Drive {
    /// `actuator`, which drives `axis`, on the modules of `board` that `on` names, in cycles of `period` [s];
    /// its motor stands at `home` [rad].
    ///
    /// # Errors
    /// A module that the board lacks.
    pub fn new(
        board: &Board,
        (on, latency): &(Connection, Nanoseconds),
        actuator: &Actuator,
        axis: &Axis,
        period: f64,
        home: f64,
    ) -> Result<Self, BoardError> {
        let latency = latency.seconds() / period;
        let counter = |unit: u32| Ok(Counter::new(board.module(Kind::Encoder, unit)?, unit));
        let (kind, counter) = match (*on, actuator.motor.stepper(), actuator.motor.dc()) {
            (Connection::Stepgen { stepgen, encoder }, Some(motor), _) => {
                let module = board.module(Kind::Stepgen, stepgen)?;
                let (rate, fastest) = (motor.pulses_per_radian(), motor.pulse_rate);
                let steps = Steps::new(module, stepgen, rate, fastest, period, latency);
                let kind = DriveKind::Steps { steps, fastest: fastest / rate };
                (kind, encoder.map(counter).transpose()?)
            }
            (Connection::Pwm { pwm, encoder }, _, Some(motor)) => {
                board.module(Kind::Pwm, pwm)?;
                let winding = Winding::new(*motor, period);
                (DriveKind::Bridge { pwm, winding, voltage: 0.0 }, Some(counter(encoder)?))
            }
            (Connection::Xy2mod { xy2mod, channel, full_scale, long }, Some(_), _) => {
                let module = board.module(Kind::Xy2mod, xy2mod)?;
                (DriveKind::Mirror(Mirror::new(module, xy2mod, channel, full_scale, long)), None)
            }
            _ => {
                return Err(BoardError::Inconsistent {
                    board: board.name.clone(),
                    what: format!("`{}` has a motor that its module cannot drive", actuator.name),
                });
            }
        };
        let fastest = BELIEF * actuator.motor.largest_speed();
        let mut path = Path::new(period);
        if matches!(kind, DriveKind::Mirror(_)) {
            path.rest(home);
        }
        let resolution = actuator.encoder.resolution();
        Ok(Self {
            kind,
            counter,
            path,
            origin: home,
            resolution,
            deceleration: deceleration(axis, actuator),
            believed: fastest / resolution,
            counts: 0,
            position: home,
            speed: 0.0,
            words: [0; 2],
        })
    }

    /// Sets its modules up, at rest; a mirror that `waits` acts at a timer of the board's clock.
    pub fn arm(&self, request: &mut Request, waits: bool) {
        match &self.kind {
            DriveKind::Steps { steps, .. } => steps.arm(request),
            DriveKind::Bridge { .. } => {}
            DriveKind::Mirror(mirror) => mirror.arm(request, waits),
        }
        if let Some(counter) = &self.counter {
            counter.arm(request);
        }
    }

    /// The PWM generator of its bridge.
    pub fn pwm(&self) -> Option<u32> {
        match self.kind {
            DriveKind::Bridge { pwm, .. } => Some(pwm),
            _ => None,
        }
    }

    /// The value of `actuation` for the actuator `row` that it cannot follow, with its limit: a rate of pulses,
    /// or an angle.
    pub fn refusal(&self, actuation: &Actuation, row: usize) -> Option<Refusal> {
        if !is_driven(actuation.mode) {
            return None;
        }
        let [angle, speed] = target(actuation, row);
        match &self.kind {
            DriveKind::Steps { fastest, .. } => {
                let rate = speed.abs() / fastest;
                (rate > EXCESS || rate.is_nan()).then_some(Refusal::TooFast(rate))
            }
            DriveKind::Mirror(mirror) => (!mirror.reaches(angle)).then_some(Refusal::Beyond(angle)),
            DriveKind::Bridge { .. } => None,
        }
    }

    /// Begins a cycle under `actuation`, whose target for it stands at `row`.
    pub fn follow(
        &mut self,
        request: &mut Request,
        pwms: Option<&Pwms>,
        actuation: &Actuation,
        row: usize,
    ) {
        let [angle, speed] = target(actuation, row);
        let origin = if matches!(self.kind, DriveKind::Mirror(_)) { 0.0 } else { self.origin };
        let braking = actuation.mode == CommandMode::QuickStop;
        if matches!(self.kind, DriveKind::Bridge { .. }) && !braking {
            // A ramp to rest begins at the speed that the motor has then.
            self.path.to = [self.position - origin, self.speed];
        }
        self.path.engage(actuation, [angle - origin, speed], self.deceleration);
        if actuation.mode == CommandMode::Disabled {
            // What is enabled later begins where the motor stands then.
            self.path.rest(self.position - origin);
        }
        match &mut self.kind {
            DriveKind::Steps { steps, .. } => steps.follow(request, &self.path),
            DriveKind::Mirror(mirror) => mirror.follow(request, &self.path),
            DriveKind::Bridge { pwm, winding, voltage } => {
                *voltage = match actuation.mode {
                    CommandMode::Disabled => 0.0,
                    CommandMode::QuickStop => winding.back_voltage(self.path.to[1]),
                    _ => actuation.voltage.get(row).copied().unwrap_or(0.0),
                };
                let duty = winding.duty(*voltage);
                pwms.iter().for_each(|pwms| pwms.set(request, *pwm, duty));
            }
        }
    }

    /// A cycle goes by in which it is told nothing: it goes on as it did.
    pub fn pass(&mut self) {
        self.path.coast();
        if let DriveKind::Steps { steps, .. } = &mut self.kind {
            steps.pass();
        }
    }

    /// Asks where it is.
    pub fn ask(&self, request: &mut Request) {
        match &self.kind {
            DriveKind::Steps { steps, .. } => steps.ask(request),
            DriveKind::Mirror(mirror) => mirror.ask(request),
            DriveKind::Bridge { .. } => {}
        }
        self.counter.iter().for_each(|counter| counter.ask(request));
    }

    /// Reads what was asked; whether it can be, `elapsed` [s] after the newest reply before.
    pub fn read(&mut self, reply: &mut Reply<'_>, elapsed: f64) -> bool {
        let asked = !matches!(self.kind, DriveKind::Bridge { .. });
        let place = if asked { reply.word() } else { 0 };
        let mirror = matches!(self.kind, DriveKind::Mirror(_));
        let count = if self.counter.is_some() || mirror { reply.word() } else { 0 };
        self.words = [place, count];
        let steps = match &self.kind {
            DriveKind::Steps { steps, .. } => steps.moved(place, elapsed).is_some(),
            _ => true,
        };
        let most = self.believed * elapsed + 2.0;
        steps && self.counter.as_ref().is_none_or(|counter| counter.moved(count, most).is_some())
    }

    /// Takes what [`Self::read`] has checked, `elapsed` [s] after the newest reply before, of a request that
    /// was `late` [s].
    pub fn take(&mut self, elapsed: f64, late: f64) {
        let [place, count] = self.words;
        let before = self.position;
        match &mut self.kind {
            DriveKind::Steps { steps, .. } => {
                if let Some(moved) = steps.moved(place, elapsed) {
                    steps.take(place, moved, late);
                }
                (self.counts, self.position) =
                    (steps.count(), self.origin + self.resolution * steps.steps());
            }
            DriveKind::Mirror(mirror) => {
                mirror.take([place, count]);
                self.position = mirror.angle();
                self.counts = ((self.position - self.origin) / self.resolution).round() as i64;
            }
            DriveKind::Bridge { .. } => {}
        }
        if let Some(counter) = &mut self.counter {
            if let Some(moved) = counter.moved(count, self.believed * elapsed + 2.0) {
                counter.take(count, moved);
            }
            self.counts = counter.count();
            self.position = self.origin + self.resolution * self.counts as f64;
        }
        self.speed = (self.position - before) / elapsed;
        if let DriveKind::Bridge { winding, voltage, .. } = &mut self.kind {
            winding.pass(*voltage, self.speed);
        }
    }

    /// Whether its module has said that it cannot follow.
    pub fn is_overflown(&self) -> bool {
        matches!(&self.kind, DriveKind::Mirror(mirror) if mirror.is_overflown())
    }

    /// Forgets what its module has said.
    pub fn reset(&self, request: &mut Request) {
        if let DriveKind::Mirror(mirror) = &self.kind {
            mirror.reset(request);
        }
    }

    /// What was read is home.
    pub fn home(&mut self) {
        let [place, count] = self.words;
        match &mut self.kind {
            DriveKind::Steps { steps, .. } => steps.home(place),
            DriveKind::Bridge { winding, .. } => winding.open(),
            DriveKind::Mirror(_) => {}
        }
        self.counter.iter_mut().for_each(|counter| counter.home(count));
        (self.counts, self.position, self.speed) = (0, self.origin, 0.0);
    }

    /// Counts from home, the motor's angle [rad] and its current [A], having gone on at its speed for `coasted` [s] since
    /// they were read.
    pub fn measured(&self, coasted: f64) -> (i64, f64, f64) {
        let current = match &self.kind {
            DriveKind::Bridge { winding, .. } => winding.current(),
            _ => 0.0,
        };
        let way = self.speed * coasted;
        let counts = self.counts + (way / self.resolution).round() as i64;
        (counts, self.position + way, current)
    }
}

/// What an actuator cannot do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// Its speed is this many times what its driver takes in pulses.
    TooFast(f64),
    /// Its angle is beyond the scale [rad].
    Beyond(f64),
}

/// Angle [rad] and speed [rad/s] that `actuation` has for the actuator `row`.
fn target(actuation: &Actuation, row: usize) -> [f64; 2] {
    [&actuation.position, &actuation.velocity].map(|all| all.get(row).copied().unwrap_or(0.0))
}
