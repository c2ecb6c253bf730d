//! Strokes for a screen: as many points as it can show, however many there are.

use crate::machine_facts::Box3;
use messages::artwork::distance;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The most points that are sent.
pub const MOST_POINTS: usize = 20_000;

/// From where on points are left out [m].
const FINEST: f64 = 1e-5;

/// Strokes, thinned as they come.
#[derive(Debug, Clone)]
pub struct Outline {
    strokes: Vec<Vec<[f64; 3]>>,
    points: usize,
    most: usize,
    /// Points nearer than this to the one before are left out [m].
    spacing: f64,
    /// Of so many strokes one is kept.
    every: u64,
    seen: u64,
    is_kept: bool,
    bounds: Option<Box3>,
}

/// What is shown of the strokes of a job, in the machine frame.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Strokes {
    /// Each stroke's points [m]; a dot has one.
    pub strokes: Vec<Vec<[f64; 3]>>,
    /// The box around all of it; null where there is nothing.
    pub bounds: Option<Box3>,
}

impl Outline {
    /// An empty one of at most `most` points.
    pub fn new(most: usize) -> Self {
        Self {
            strokes: Vec::new(),
            points: 0,
            most,
            spacing: 0.0,
            every: 1,
            seen: 0,
            is_kept: true,
            bounds: None,
        }
    }

    /// Adds a stroke, or what comes next of the last one.
    pub fn add(&mut self, goes_on: bool, points: &[[f64; 3]]) {
        points.iter().for_each(|point| self.include(point));
        let goes_on = goes_on && self.seen > 0;
        if !goes_on {
            self.is_kept = self.seen.is_multiple_of(self.every);
            self.seen += 1;
            if self.is_kept {
                self.strokes.push(Vec::new());
            }
        }
        if !self.is_kept {
            return;
        }
        let spacing = self.spacing;
        let Some(stroke) = self.strokes.last_mut() else { return };
        let before = stroke.len();
        // A part of a stroke begins where the one before ended.
        points.iter().skip(usize::from(goes_on)).for_each(|point| thin(stroke, *point, spacing));
        if let (Some(last), true) = (points.last(), stroke.len() > 1)
            && stroke.last() != Some(last)
        {
            stroke.push(*last);
        }
        self.points += stroke.len() - before;
        while self.points > self.most {
            self.coarsen();
        }
    }

    fn include(&mut self, point: &[f64; 3]) {
        let bounds = self.bounds.get_or_insert(Box3 { lower: *point, upper: *point });
        for (axis, value) in point.iter().enumerate() {
            bounds.lower[axis] = bounds.lower[axis].min(*value);
            bounds.upper[axis] = bounds.upper[axis].max(*value);
        }
    }

    /// Leaves out more: points first, whole strokes where hardly a point is left of each.
    fn coarsen(&mut self) {
        if self.points > 3 * self.strokes.len() {
            self.spacing = (2.0 * self.spacing).max(FINEST);
            for stroke in &mut self.strokes {
                let mut thinned = Vec::with_capacity(stroke.len());
                stroke.iter().for_each(|point| thin(&mut thinned, *point, self.spacing));
                if let Some(last) = stroke.last().filter(|last| thinned.last() != Some(*last)) {
                    thinned.push(*last);
                }
                *stroke = thinned;
            }
        } else {
            self.every *= 2;
            let mut index = 0;
            self.strokes.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.is_kept = (self.seen.saturating_sub(1)).is_multiple_of(self.every);
        }
        self.points = self.strokes.iter().map(Vec::len).sum();
    }

    /// What is shown of it.
    pub fn finish(self) -> Strokes {
        Strokes { strokes: self.strokes, bounds: self.bounds }
    }
}

/// Adds `point` unless it is nearer than `spacing` to the one before.
fn thin(stroke: &mut Vec<[f64; 3]>, point: [f64; 3], spacing: f64) {
    let is_near = stroke.last().is_some_and(|last| distance(last, &point) <= spacing);
    if !is_near {
        stroke.push(point);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::math;

    #[test]
    fn few_points_are_shown_as_they_are() {
        let mut outline = Outline::new(100);
        outline.add(false, &[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]);
        outline.add(true, &[[0.01, 0.0, 0.0], [0.01, 0.02, 0.0]]);
        outline.add(false, &[[0.5, 0.5, 0.1]]);
        let shown = outline.finish();
        let expected =
            vec![vec![[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.02, 0.0]], vec![[0.5, 0.5, 0.1]]];
        assert_eq!(shown.strokes, expected);
        let bounds = shown.bounds.unwrap();
        assert_eq!((bounds.lower, bounds.upper), ([0.0; 3], [0.5, 0.5, 0.1]));
    }

    #[test]
    fn a_long_stroke_keeps_its_ends_and_its_shape() {
        let mut outline = Outline::new(1000);
        for part in 0..100 {
            let angle =
                |index: usize| (part * 1000 + index) as f64 * std::f64::consts::TAU / 100_000.0;
            let points: Vec<_> = (0..=1000)
                .map(|index| [math::cos(angle(index)), math::sin(angle(index)), 0.0])
                .collect();
            outline.add(part > 0, &points);
        }
        let shown = outline.finish();
        assert_eq!(shown.strokes.len(), 1);
        let stroke = &shown.strokes[0];
        assert!((200..=1000).contains(&stroke.len()), "{}", stroke.len());
        assert_eq!(stroke[0], [1.0, 0.0, 0.0]);
        assert!((stroke[stroke.len() - 1][0] - 1.0).abs() < 1e-9);
        assert!(stroke.iter().all(|[x, y, _]| (math::hypot(*x, *y) - 1.0).abs() < 1e-12));
        assert_eq!(shown.bounds.unwrap().lower[0], -1.0);
    }

    #[test]
    fn of_a_great_many_dots_some_are_shown_from_everywhere() {
        let mut outline = Outline::new(1000);
        (0..100_000).for_each(|dot| outline.add(false, &[[f64::from(dot), 0.0, 0.0]]));
        let shown = outline.finish();
        assert!((400..=1000).contains(&shown.strokes.len()), "{}", shown.strokes.len());
        assert!(shown.strokes.iter().any(|stroke| stroke[0][0] > 99_000.0));
        assert!(shown.strokes.iter().any(|stroke| stroke[0][0] < 1_000.0));
        assert_eq!(shown.bounds.unwrap().upper[0], 99_999.0);
    }
}
