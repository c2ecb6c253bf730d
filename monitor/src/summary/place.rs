//! Where a job was when it ended before its end.

use super::text::length;
use messages::artwork::Artwork;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where a job was, in its file, in the drawing, and on the machine.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobPlace {
    /// The job file; null for the built-in job.
    pub file: Option<String>,
    /// Its line, from 1; null where the job has none.
    pub line: Option<u64>,
    /// The stroke that was marked last, from 1, as the whole job counts them; 0 before the first.
    pub stroke: u64,
    /// Where on the drawing it ended, as far as the marks tell it, else where the plan had the tool; machine frame, null
    /// of a job that did not move [m].
    pub tool: Option<[f64; 3]>,
    /// The box around what the line, or the stroke, draws: its lower and its upper corner, machine frame; null where that is
    /// not known [m].
    pub bounds: Option<[[f64; 3]; 2]>,
}

impl JobPlace {
    /// The same with the box around what is drawn there: by the line, as far as it has been planned, else by the stroke.
    #[must_use]
    pub fn within(mut self, artwork: &Artwork) -> Self {
        let of_line = artwork.strokes.iter().filter(|stroke| Some(stroke.line) == self.line);
        let at = usize::try_from(self.stroke).unwrap_or(usize::MAX);
        let of_stroke = at.checked_sub(1).and_then(|index| artwork.strokes.get(index));
        let bounds = |points: &mut dyn Iterator<Item = &[f64; 3]>| {
            points.fold(None, |bounds: Option<[[f64; 3]; 2]>, point| {
                let [mut lower, mut upper] = bounds.unwrap_or([*point, *point]);
                for axis in 0..3 {
                    lower[axis] = lower[axis].min(point[axis]);
                    upper[axis] = upper[axis].max(point[axis]);
                }
                Some([lower, upper])
            })
        };
        self.bounds = bounds(&mut of_line.flat_map(|stroke| &stroke.points))
            .or_else(|| bounds(&mut of_stroke.into_iter().flat_map(|stroke| &stroke.points)));
        self
    }
}

impl std::fmt::Display for JobPlace {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut parts = Vec::new();
        match (&self.file, self.line) {
            (Some(file), Some(line)) => parts.push(format!("{file}:{line}")),
            (Some(file), None) => parts.push(file.clone()),
            (None, Some(line)) => parts.push(format!("line {line}")),
            (None, None) => {}
        }
        if self.stroke > 0 {
            parts.push(format!("stroke {}", self.stroke));
        }
        if let Some([lower, upper]) = &self.bounds {
            let of = |axis: usize| format!("{} to {}", length(lower[axis]), length(upper[axis]));
            parts.push(format!("drawn in x {}, y {}", of(0), of(1)));
        }
        if let Some([x, y, z]) = self.tool {
            let z = if z == 0.0 { String::new() } else { format!(", z {}", length(z)) };
            parts.push(format!("tool at x {}, y {}{z}", length(x), length(y)));
        }
        write!(formatter, "{}", parts.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::artwork::Stroke;

    fn artwork() -> Artwork {
        let stroke =
            |line, x: f64| Stroke { points: vec![[x, 0.01, 0.0], [x + 0.02, 0.03, 0.0]], line };
        Artwork { strokes: vec![stroke(4, 0.1), stroke(7, 0.2), stroke(7, 0.3)] }
    }

    #[test]
    fn a_place_is_found_in_the_drawing_by_its_line_or_else_by_its_stroke() {
        let at = |line, stroke| JobPlace { line, stroke, ..JobPlace::default() };
        let bounds = |line, stroke| at(line, stroke).within(&artwork()).bounds;
        assert_eq!(bounds(Some(7), 1), Some([[0.2, 0.01, 0.0], [0.3 + 0.02, 0.03, 0.0]]));
        assert_eq!(bounds(Some(5), 1), Some([[0.1, 0.01, 0.0], [0.1 + 0.02, 0.03, 0.0]]));
        assert_eq!((bounds(None, 0), bounds(Some(9), 4)), (None, None));
    }

    #[test]
    fn a_place_is_told_by_what_is_known_of_it() {
        let place = JobPlace {
            file: Some("job.ngc".to_owned()),
            line: Some(4),
            stroke: 1,
            tool: Some([0.11, 0.02, 0.0]),
            bounds: None,
        };
        let told = "job.ngc:4, stroke 1, drawn in x 100.000 mm to 120.000 mm, y 10.000 mm to 30.000 mm, tool at \
                    x 110.000 mm, y 20.000 mm";
        assert_eq!(place.within(&artwork()).to_string(), told);
    }
}
