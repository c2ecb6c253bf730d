//! Where the tool has been in the job under way.

use machine::Machine;
use machine::document::Document;
use messages::math::hypot;
use operator::Status;
use std::collections::VecDeque;
use std::path::Path;

/// Places that are remembered: some minutes.
const REMEMBERED: usize = 3000;

/// How far the tool must be from the place before [m].
const STEP: f64 = 1e-5;

/// A place of the tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    pub(super) place: [f64; 2],
    pub(super) is_lit: bool,
}

/// The newest places, seen from above.
#[derive(Debug, Default)]
pub(super) struct Trail {
    stream: u64,
    spots: VecDeque<Spot>,
    /// The machine file that the area is from; `None` before a status came.
    file: Option<Option<String>>,
    /// The corners of the area, where they are known.
    area: Option<[[f64; 2]; 2]>,
}

impl Trail {
    /// Goes on to where the tool is now.
    pub(super) fn follow(&mut self, status: &Status) {
        if self.file.as_ref() != Some(&status.machine_file) {
            self.file = Some(status.machine_file.clone());
            self.area = area(status.machine_file.as_deref());
        }
        if status.stream != 0 && status.stream != self.stream {
            self.stream = status.stream;
            self.spots.clear();
        }
        let [x, y, _] = status.tool;
        let spot = Spot { place: [x, y], is_lit: status.lit };
        let is_there = |last: &Spot| hypot(last.place[0] - x, last.place[1] - y) < STEP;
        if self.spots.back().is_some_and(is_there) || !(x.is_finite() && y.is_finite()) {
            return;
        }
        if self.spots.len() == REMEMBERED {
            self.spots.pop_front();
        }
        self.spots.push_back(spot);
    }

    /// The lines between the places, each with whether the laser was on at its end.
    pub(super) fn lines(&self) -> impl Iterator<Item = (Spot, Spot)> {
        self.spots.iter().zip(self.spots.iter().skip(1)).map(|(from, to)| (*from, *to))
    }

    /// The corners of what is drawn: the area, or what the tool has seen of it.
    pub(super) fn bounds(&self) -> [[f64; 2]; 2] {
        if let Some(area) = self.area {
            return area;
        }
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for Spot { place: [x, y], .. } in &self.spots {
            let [lower, upper] = bounds;
            bounds = [[lower[0].min(*x), lower[1].min(*y)], [upper[0].max(*x), upper[1].max(*y)]];
        }
        if self.spots.is_empty() { [[0.0; 2], [1.0; 2]] } else { bounds }
    }
}

/// The area of the machine in the file, the built-in one without; `None` where that cannot be read here.
fn area(file: Option<&str>) -> Option<[[f64; 2]; 2]> {
    let machine = match file {
        None => Machine::builtin(),
        Some(file) => Machine::parse(file, &Document::text(Path::new(file)).ok()?, &[]).ok()?,
    };
    let (lower, upper) = (machine.area.lower, machine.area.upper);
    Some([[lower[0], lower[1]], [upper[0], upper[1]]])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, stream: u64) -> Status {
        Status { tool: [x, 0.0, 0.0], stream, lit: true, ..Status::default() }
    }

    #[test]
    fn a_new_stream_begins_a_new_trail_and_standing_still_adds_nothing() {
        let mut trail = Trail::default();
        for x in [0.0, 0.01, 0.01, 0.02] {
            trail.follow(&at(x, 1));
        }
        assert_eq!(trail.lines().count(), 2);
        assert!(trail.lines().all(|(_, to)| to.is_lit));
        trail.follow(&at(0.03, 2));
        assert_eq!(trail.lines().count(), 0);
        // Between two jobs the stream is 0.
        trail.follow(&at(0.04, 0));
        assert_eq!(trail.lines().count(), 1);
        trail.follow(&at(f64::NAN, 2));
        assert_eq!(trail.lines().count(), 1);
    }

    #[test]
    fn what_is_remembered_has_a_bound() {
        let mut trail = Trail::default();
        for step in 0..REMEMBERED + 10 {
            trail.follow(&at(step as f64 * 1e-3, 1));
        }
        assert_eq!(trail.lines().count(), REMEMBERED - 1);
    }

    #[test]
    fn the_area_is_the_machines_or_what_was_seen() {
        let mut trail = Trail::default();
        trail.follow(&at(0.05, 1));
        assert_eq!(trail.bounds(), [[0.0, 0.0], [0.2, 0.2]]);
        let mut trail = Trail::default();
        let elsewhere = |x| Status { machine_file: Some("/none/such.toml".to_owned()), ..at(x, 1) };
        trail.follow(&elsewhere(0.05));
        trail.follow(&elsewhere(0.07));
        assert_eq!(trail.bounds(), [[0.05, 0.0], [0.07, 0.0]]);
    }
}
