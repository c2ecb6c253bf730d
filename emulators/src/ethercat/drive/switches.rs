//! The switches that are wired to a drive: a limit switch at either end, and a home switch.

use machine::operating::{InputFunction, Side};
use machine::{Actuator, Axis, Machine};

use super::homing::Way;

/// Where the switches of a motor close.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switches {
    /// Counts below which the negative limit switch is closed, and above which the positive one is.
    pub limits: [i64; 2],
    /// Counts from which the home switch is closed, and in which direction.
    pub home: Option<(i64, Way)>,
}

/// Which of them are closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Closed {
    /// The negative limit switch.
    pub below: bool,
    /// The positive one.
    pub above: bool,
    /// The home switch.
    pub home: bool,
}

impl Switches {
    /// Those of the motor `index` of `actuator`, which drives `axis` from its `home` [m or rad] on: where `machine` has
    /// them, else the limit switches are at the ends of the axis, and no home switch is there.
    pub fn of(
        machine: &Machine,
        index: usize,
        (actuator, axis, home): (&Actuator, &Axis, f64),
    ) -> Self {
        let counts =
            |joint: f64| ((joint - home) / (actuator.encoder.resolution() * actuator.ratio)) as i64;
        let way = |side: Side| if side.sign() * actuator.ratio < 0.0 { Way::Down } else { Way::Up };
        let mut ends = axis.limits.position;
        let mut switch = None;
        for input in &machine.operating.inputs {
            let Some(place) = input.simulated.filter(|it| it.axis == actuator.axis) else {
                continue;
            };
            match input.function {
                InputFunction::Limit { side: Side::Lower, .. } => ends[0] = place.at,
                InputFunction::Limit { side: Side::Upper, .. } => ends[1] = place.at,
                InputFunction::Home { actuator, .. } if actuator.is_none_or(|own| own == index) => {
                    switch = Some((counts(place.at), way(place.side)));
                }
                _ => {}
            }
        }
        let [lower, upper] = ends.map(counts);
        Self { limits: [lower.min(upper), lower.max(upper)], home: switch }
    }

    /// Which are closed with the motor at `counts`.
    pub fn closed(&self, counts: i64) -> Closed {
        let [below, above] = self.limits;
        let home = self.home.is_some_and(|(at, way)| match way {
            Way::Down => counts <= at,
            Way::Up => counts >= at,
        });
        Closed { below: counts <= below, above: counts >= above, home }
    }
}

impl Closed {
    /// The bits of the digital inputs (60FDh).
    pub fn bits(self) -> u32 {
        u32::from(self.below) | u32::from(self.above) << 1 | u32::from(self.home) << 2
    }

    /// The limit switch on a side.
    pub fn limit(self, way: Way) -> bool {
        match way {
            Way::Down => self.below,
            Way::Up => self.above,
        }
    }
}
