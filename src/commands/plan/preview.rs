//! What a job draws, before it is planned: an SVG drawing for people, JSON for programs.

use crate::exit::Failure;
use crate::files::Sources;
use crate::output;
use machine::Machine;
use messages::plan::Bounds;
use planner::preview::{Preview, PreviewLine};
use planner::request::Refusal;
use planner::{Job, PlanError};
use serde::Serialize;
use std::fmt::{self, Write as _};
use std::io::Write as _;
use std::path::Path;

/// The most points of marks.
const MOST_POINTS: usize = 20_000;

/// What a preview is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Svg,
    Json,
}

/// A preview as JSON.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct PreviewReport {
    /// What is marked, in order, each a run of light: points in the machine frame [m], no more than 20,000 in
    /// all. A dot has one point.
    pub strokes: Vec<Vec<[f64; 3]>>,
    /// The box around all that is marked; null where nothing is.
    pub bounds: Option<Bounds>,
    /// How far a stroke may be from what it stands for [m].
    pub tolerance: f64,
}

impl PreviewReport {
    fn of(preview: &Preview) -> Self {
        let mut strokes: Vec<Vec<[f64; 3]>> = Vec::new();
        for line in &preview.marks {
            let points = line.points.iter().map(|point| point.map(|value| rounded(value, 1e9)));
            match strokes.last_mut() {
                Some(last) if line.goes_on => last.extend(points.skip(1)),
                _ => strokes.push(points.collect()),
            }
        }
        Self { strokes, bounds: preview.bounds, tolerance: preview.tolerance }
    }
}

/// Whether `path` stands for standard output.
pub(super) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Writes what `job` draws to `path`, or prints it.
pub(super) fn write(
    path: &Path,
    machine: &Machine,
    job: &Job,
    sources: &mut Sources,
    refuse: impl Fn(PlanError) -> Refusal,
) -> Result<(), Failure> {
    let format = format(path)?;
    let preview = planner::preview::preview(machine, job, MOST_POINTS).map_err(refuse)?;
    let text = match format {
        Format::Svg => svg(&job.drawing.name, &preview).map_err(Failure::output)?,
        Format::Json => {
            let report = PreviewReport::of(&preview);
            serde_json::to_string(&report).map_err(Failure::output)? + "\n"
        }
    };
    if is_stdout(path) {
        return output::printed(std::io::stdout().lock().write_all(text.as_bytes()));
    }
    let mut file = sources.create("--preview", path)?;
    super::written(path, file.write_all(text.as_bytes()))
}

fn format(path: &Path) -> Result<Format, Failure> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    match extension.to_ascii_lowercase().as_str() {
        "svg" => Ok(Format::Svg),
        "json" => Ok(Format::Json),
        _ if is_stdout(path) => Ok(Format::Svg),
        _ => Err(Failure::bad_input(format!(
            "--preview {}: give a name that ends in .svg for a drawing or in .json for programs, or - for a \
             drawing on stdout",
            path.display()
        ))),
    }
}

/// The drawing, seen from above with y up, in mm; marks the darker the more power they have.
fn svg(name: &str, preview: &Preview) -> Result<String, fmt::Error> {
    /// Around everything, a share of its size.
    const MARGIN: f64 = 0.03;
    /// The least of that [mm].
    const LEAST_MARGIN: f64 = 0.5;
    let mut extent: Option<Bounds> = None;
    let lines = preview.marks.iter().chain(&preview.travels);
    lines.flat_map(|line| &line.points).for_each(|point| Bounds::widen(&mut extent, point));
    let Bounds { lower, upper } = extent.unwrap_or_default();
    let [width, height] = [0, 1].map(|row| (upper[row] - lower[row]) * 1e3);
    let margin = (width.max(height) * MARGIN).max(LEAST_MARGIN);
    let corner = [lower[0] * 1e3 - margin, -upper[1] * 1e3 - margin].map(|at| rounded(at, 1e3));
    let size = [width, height].map(|side| rounded(side + 2.0 * margin, 1e3));
    let mut text = String::new();
    writeln!(
        text,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" height=\"{}mm\" viewBox=\"{} {} {} {}\">",
        size[0], size[1], corner[0], corner[1], size[0], size[1]
    )?;
    writeln!(text, "<title>{}</title>", escaped(name))?;
    writeln!(
        text,
        "<style>path{{fill:none;stroke-linecap:round;stroke-linejoin:round;\
         vector-effect:non-scaling-stroke}}</style>"
    )?;
    writeln!(text, "<g id=\"travel\" stroke=\"#8a94a3\" stroke-width=\"0.4\">")?;
    preview.travels.iter().try_for_each(|line| path(&mut text, line, None))?;
    writeln!(text, "</g>\n<g id=\"marks\" stroke=\"#c0182a\" stroke-width=\"1.4\">")?;
    preview.marks.iter().try_for_each(|line| path(&mut text, line, Some(line.power)))?;
    writeln!(text, "</g>\n</svg>")?;
    Ok(text)
}

/// One line as a path.
fn path(text: &mut String, line: &PreviewLine, power: Option<f64>) -> fmt::Result {
    /// Of a mark with hardly any power.
    const FAINTEST: f64 = 0.2;
    write!(text, "<path d=\"")?;
    for (index, [x, y, _]) in line.points.iter().enumerate() {
        let letter = if index == 0 { 'M' } else { 'L' };
        // No minus zero.
        let [x, y] = [x * 1e3, -y * 1e3].map(|value| rounded(value, 1e4) + 0.0);
        write!(text, "{letter}{x} {y}")?;
    }
    if line.points.len() == 1 {
        text.push_str("h0");
    }
    match power {
        None => writeln!(text, "\"/>"),
        Some(power) => {
            let share = rounded(FAINTEST + (1.0 - FAINTEST) * power, 100.0);
            let percent = rounded(power * 100.0, 10.0);
            writeln!(text, "\" stroke-opacity=\"{share}\" data-power=\"{percent}\"/>")
        }
    }
}

/// To whole parts of one.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn line(points: &[[f64; 3]], power: f64, goes_on: bool) -> PreviewLine {
        PreviewLine { points: points.to_vec(), power, goes_on }
    }

    fn some() -> Preview {
        let [one, two, three] = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.02, 0.0]];
        Preview {
            marks: vec![
                line(&[one, two], 0.5, false),
                line(&[two, three], 1.0, true),
                line(&[one], 1.0, false),
            ],
            travels: vec![line(&[three, one], 0.0, false)],
            bounds: Some(Bounds { lower: one, upper: three }),
            tolerance: 1e-6,
        }
    }

    #[test]
    fn a_drawing_is_in_millimetres_with_y_up_and_shows_powers() {
        let text = svg("a < b", &some()).unwrap();
        for part in [
            "width=\"11.2mm\" height=\"21.2mm\" viewBox=\"-0.6 -20.6 11.2 21.2\"",
            "<title>a &lt; b</title>",
            "<path d=\"M10 -20L0 0\"/>",
            "<path d=\"M0 0L10 0\" stroke-opacity=\"0.6\" data-power=\"50\"/>",
            "<path d=\"M0 0h0\" stroke-opacity=\"1\" data-power=\"100\"/>",
        ] {
            assert!(text.contains(part), "no {part} in\n{text}");
        }
    }

    #[test]
    fn a_stroke_goes_on_where_only_its_power_changes() {
        let strokes = PreviewReport::of(&some()).strokes;
        let right = [vec![[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.02, 0.0]], vec![[0.0; 3]]];
        assert_eq!(strokes, right);
    }

    #[test]
    fn the_end_of_the_name_says_what_is_written() {
        assert_eq!(format(Path::new("-")).unwrap(), Format::Svg);
        assert_eq!(format(Path::new("a.SVG")).unwrap(), Format::Svg);
        assert_eq!(format(Path::new("a.json")).unwrap(), Format::Json);
        let text = format(Path::new("a.png")).unwrap_err().refusal.message;
        assert!(text.contains("a.png") && text.contains(".json"), "{text}");
    }
}
