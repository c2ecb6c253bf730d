//! What a run did, for whoever asks afterwards: the light with its power, the tool's way, the watchdog.

use messages::Nanoseconds;

/// The light from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// From when.
    pub at: Nanoseconds,
    /// The power while the gate is open, as a fraction of full scale; 0 is dark.
    pub power: f64,
}

/// Where the tool was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// When.
    pub at: Nanoseconds,
    /// The tool in the machine frame [m].
    pub tool: [f64; 3],
}

/// The record of a run.
#[derive(Debug, Clone, Default)]
pub struct Record {
    /// Every change of the light, in order; before the first it is dark.
    pub light: Vec<Light>,
    /// The tool, once a cycle of the plant; only where it is wanted.
    pub way: Vec<Place>,
    /// When the watchdog bit.
    pub bites: Vec<Nanoseconds>,
    keep_way: bool,
}

impl Record {
    /// A record that keeps the tool's way as well, 32 bytes for each cycle of the plant.
    pub fn with_way() -> Self {
        Self { keep_way: true, ..Self::default() }
    }

    /// The light is `power` from `at` on.
    pub fn light(&mut self, at: Nanoseconds, power: f64) {
        let before = self.light.last().map_or(0.0, |light| light.power);
        if before == power {
            return;
        }
        // Several registers written at one time are one change.
        if self.light.last().is_some_and(|last| last.at == at) {
            self.light.pop();
            return self.light(at, power);
        }
        self.light.push(Light { at, power });
    }

    /// The tool was at `tool` [m] at `at`.
    pub fn tool(&mut self, at: Nanoseconds, tool: [f64; 3]) {
        if self.keep_way {
            self.way.push(Place { at, tool });
        }
    }

    /// When it was lit, from and to; what still is, to `now`.
    pub fn lit(&self, now: Nanoseconds) -> Vec<[Nanoseconds; 2]> {
        let mut spans = Vec::new();
        let mut from = None;
        for Light { at, power } in &self.light {
            match (from, *power > 0.0) {
                (None, true) => from = Some(*at),
                (Some(start), false) => {
                    spans.push([start, *at]);
                    from = None;
                }
                _ => {}
            }
        }
        spans.extend(from.map(|start| [start, now]));
        spans
    }

    /// Whether it is lit.
    pub fn is_lit(&self) -> bool {
        self.light.last().is_some_and(|light| light.power > 0.0)
    }

    /// Where the tool was at `at` [m], between two places in proportion; `None` outside of the record.
    pub fn tool_at(&self, at: Nanoseconds) -> Option<[f64; 3]> {
        let after = self.way.partition_point(|place| place.at <= at);
        let from = self.way.get(after.checked_sub(1)?)?;
        let Some(to) = self.way.get(after) else { return (from.at == at).then_some(from.tool) };
        let share = (at - from.at).seconds() / (to.at - from.at).seconds();
        Some(core::array::from_fn(|axis| {
            let [start, end] = [from, to].map(|place| place.tool.get(axis).copied().unwrap_or(0.0));
            start + share * (end - start)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_light_is_told_by_its_spans() {
        let mut record = Record::default();
        for (at, power) in
            [(5, 0.0), (10, 0.5), (20, 0.7), (30, 0.0), (40, 1.0), (40, 0.0), (50, 1.0)]
        {
            record.light(Nanoseconds(at), power);
        }
        let spans = record.lit(Nanoseconds(60)).iter().map(|span| span.map(|at| at.0)).collect();
        let spans: Vec<[i64; 2]> = spans;
        assert_eq!(spans, [[10, 30], [50, 60]]);
        assert!(record.is_lit());
    }

    #[test]
    fn the_tool_is_where_it_was() {
        let mut record = Record::with_way();
        record.tool(Nanoseconds(100), [0.0, 1.0, 0.0]);
        record.tool(Nanoseconds(200), [1.0, 1.0, 0.0]);
        assert_eq!(record.tool_at(Nanoseconds(125)), Some([0.25, 1.0, 0.0]));
        assert_eq!(record.tool_at(Nanoseconds(200)), Some([1.0, 1.0, 0.0]));
        assert_eq!(record.tool_at(Nanoseconds(99)), None);
    }
}
