//! The way of the tool as it is marked, thinned as it comes: what a page draws.

use messages::artwork::distance;
use messages::{Command, Feedback, feedback::status};
use serde::Serialize;
use std::collections::VecDeque;

/// Points that are kept of a stream; the oldest make room.
pub const KEPT: usize = 200_000;

/// A place is noted when the tool is so far from the one before [m].
const SPACING: f64 = 1e-4;

/// Below that a tool counts as standing [m].
const STANDS: f64 = 1e-6;

/// A tool that moves slowly is noted after so many cycles.
const SLOWLY: u32 = 64;

/// A place of the tool: x, y, z [m], the share of the way to it that was lit, 0 to 1, and its stroke, 0 in the dark.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PathPoint(pub f64, pub f64, pub f64, pub f64, pub u32);

/// The places of the tool in the stream under way.
#[derive(Debug, Default)]
pub struct ToolPath {
    /// Counts the streams, so that a page knows when to begin anew.
    generation: u64,
    stream: u64,
    points: VecDeque<PathPoint>,
    /// Points before the first that is kept.
    dropped: u64,
    /// Lit share summed up since the last point, and over how many cycles.
    lit: f64,
    cycles: u32,
    is_lit: bool,
}

/// How far somebody has read a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PathCursor {
    generation: u64,
    next: u64,
}

impl ToolPath {
    /// Takes a cycle, of which the share `lit` was lit.
    pub fn push(&mut self, feedback: &Feedback, command: Option<&Command>, lit: f64) {
        if let Some(stream) = command.map(|command| command.stream).filter(|stream| *stream != 0)
            && stream != self.stream
        {
            *self = Self { generation: self.generation + 1, stream, ..Self::default() };
        }
        if self.stream == 0 {
            return;
        }
        let tool = match command {
            _ if feedback.has(status::TOOL_KNOWN) => feedback.tool,
            Some(command) => command.tool,
            None => return,
        };
        let stroke = feedback.laser.edges().iter().map(|edge| edge.gate);
        let stroke = std::iter::once(feedback.laser.gate).chain(stroke).max().unwrap_or_default();
        let Some(last) = self.points.back().copied() else {
            self.add(tool, 0.0, 0);
            return;
        };
        (self.lit, self.cycles) = (self.lit + lit, self.cycles + 1);
        let way = distance(&[last.0, last.1, last.2], &tool);
        if way < STANDS && lit == 0.0 && !self.is_lit {
            // Time in which it stood in the dark is no part of the way to the next place.
            (self.lit, self.cycles) = (0.0, 0);
            return;
        }
        let changes = (lit > 0.0) != self.is_lit || (lit > 0.0 && stroke != last.4);
        let moved = way >= SPACING || (way >= STANDS && self.cycles >= SLOWLY);
        // A dot is lit where the tool stands.
        if changes || moved {
            let share = self.lit / f64::from(self.cycles.max(1));
            self.is_lit = lit > 0.0;
            self.add(tool, share.clamp(0.0, 1.0), if share > 0.0 { stroke.max(last.4) } else { 0 });
            (self.lit, self.cycles) = (0.0, 0);
        }
    }

    fn add(&mut self, tool: [f64; 3], lit: f64, stroke: u32) {
        // Whole nanometres and thousandths: what follows is noise that every page would be sent.
        let [x, y, z] = tool.map(|place| (place * 1e9).round() / 1e9);
        self.points.push_back(PathPoint(x, y, z, (lit * 1e3).round() / 1e3, stroke));
        if self.points.len() > KEPT {
            self.points.pop_front();
            self.dropped += 1;
        }
    }

    /// The next points after `cursor`, at most `most`, and whether they begin a new stream; moves it on.
    pub fn after(&self, cursor: &mut PathCursor, most: usize) -> (Vec<PathPoint>, bool) {
        let begins = cursor.generation != self.generation;
        if begins {
            *cursor = PathCursor { generation: self.generation, next: self.dropped };
        }
        let from = cursor.next.saturating_sub(self.dropped) as usize;
        let points: Vec<_> = self.points.iter().skip(from).take(most).copied().collect();
        cursor.next = self.dropped + (from + points.len()) as u64;
        (points, begins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cycle(path: &mut ToolPath, stream: u64, x: f64, stroke: u32, lit: f64) {
        let mut feedback =
            Feedback { tool: [x, 0.0, 0.0], status: status::TOOL_KNOWN, ..Feedback::default() };
        feedback.laser.gate = stroke;
        let command = Command { stream, ..Command::default() };
        path.push(&feedback, Some(&command), lit);
    }

    #[test]
    fn what_is_marked_comes_with_its_stroke_and_its_share_of_light() {
        let mut path = ToolPath::default();
        cycle(&mut path, 0, 0.5, 0, 0.0);
        for (x, stroke, lit) in
            [(0.0, 0, 0.0), (0.001, 0, 0.0), (0.002, 1, 0.25), (0.003, 1, 1.0), (0.004, 0, 0.0)]
        {
            cycle(&mut path, 7, x, stroke, lit);
        }
        let mut cursor = PathCursor::default();
        let (points, begins) = path.after(&mut cursor, 100);
        assert!(begins, "the first stream is a new one");
        let expected = [
            PathPoint(0.0, 0.0, 0.0, 0.0, 0),
            PathPoint(0.001, 0.0, 0.0, 0.0, 0),
            PathPoint(0.002, 0.0, 0.0, 0.25, 1),
            PathPoint(0.003, 0.0, 0.0, 1.0, 1),
            PathPoint(0.004, 0.0, 0.0, 0.0, 0),
        ];
        assert_eq!(points, expected);
        assert_eq!(path.after(&mut cursor, 100), (Vec::new(), false));
        cycle(&mut path, 8, 0.1, 0, 0.0);
        assert_eq!(path.after(&mut cursor, 100), (vec![PathPoint(0.1, 0.0, 0.0, 0.0, 0)], true));
    }

    #[test]
    fn a_tool_that_stands_adds_nothing_but_its_dots() {
        let mut path = ToolPath::default();
        (0..10_000).for_each(|_| cycle(&mut path, 1, 0.0, 0, 0.0));
        let mut cursor = PathCursor::default();
        assert_eq!(path.after(&mut cursor, 100).0.len(), 1);
        cycle(&mut path, 1, 0.0, 1, 0.5);
        cycle(&mut path, 1, 0.0, 0, 0.0);
        let dots = path.after(&mut cursor, 100).0;
        assert_eq!(dots.iter().filter(|dot| dot.3 > 0.0).count(), 1, "{dots:?}");
    }

    #[test]
    fn a_reader_that_is_slow_gets_what_is_kept_and_a_long_stream_stays_bounded() {
        let mut path = ToolPath::default();
        (0..KEPT + 10).for_each(|n| cycle(&mut path, 1, n as f64 * 1e-3, 1, 1.0));
        assert_eq!(path.points.len(), KEPT);
        let mut cursor = PathCursor::default();
        let (points, _) = path.after(&mut cursor, 5);
        assert_eq!((points.len(), points[0].0), (5, 0.01));
        let (next, begins) = path.after(&mut cursor, 1);
        assert_eq!((next[0].0, begins), (0.015, false));
    }
}
