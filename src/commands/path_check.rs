//! `graver plan --path-check`: how far the tool strays from every stroke, as it is executed and with its
//! joints interpolated between knots.

use crate::output::say;
use machine::path_check::{Deviation, Interpolation};
use planner::verify::path_check::{INTERPOLATIONS, StrokeCheck, Subdivided};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};

/// How far the tool strays from all strokes.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct PathCheckFacts {
    /// How far the tool may stray with interpolated joints [m].
    pub tolerance: f64,
    /// Strokes that were checked.
    pub strokes: usize,
    /// Between the setpoints of each millisecond, joined as the controller joins them.
    pub executed: Strayed,
    /// With joints that go straight from knot to knot.
    pub linear: Interpolating,
    /// With cubics of steady curvature, which do not bend at their ends.
    pub natural: Interpolating,
    /// With cubics of steady curvature that at their ends go on as beside them.
    pub not_a_knot: Interpolating,
}

/// The largest distances of all strokes, wherever each is.
#[derive(Debug, Clone, Copy, Serialize, schemars::JsonSchema)]
pub struct Strayed {
    /// From where the tool should be at that time, or at the same place between two knots [m].
    pub matched: f64,
    /// From the stroke [m].
    pub geometric: f64,
    /// From the surface that is marked on [m]; null where the job has none.
    pub surface: Option<f64>,
    /// Of the tool's axis from where it should point [rad].
    pub axis: f64,
}

/// What a way of interpolating takes for all strokes.
#[derive(Debug, Clone, Copy, Serialize, schemars::JsonSchema)]
pub struct Interpolating {
    /// Knots of all strokes, of which each is halved until it is within tolerance.
    pub knots: usize,
    /// Strokes for which 4096 knots are not enough; they are not in the rest.
    pub too_many: usize,
    /// What is left of the deviation.
    pub left: Strayed,
}

impl Strayed {
    fn of(worst: Deviation, has_surface: bool) -> Self {
        let Deviation { matched, geometric, surface, axis } = worst;
        Self { matched, geometric, surface: has_surface.then_some(surface), axis }
    }
}

/// What `checks` come to within `tolerance` [m], on a surface if the job `has_surface`.
pub fn facts(checks: &[StrokeCheck], tolerance: f64, has_surface: bool) -> PathCheckFacts {
    let worst = |deviations: &mut dyn Iterator<Item = Deviation>| {
        Strayed::of(deviations.fold(Deviation::default(), Deviation::worst), has_surface)
    };
    let of = |index: usize| {
        let found = || checks.iter().filter_map(move |check| check.interpolated[index]);
        Interpolating {
            knots: found().map(|subdivided| subdivided.knots).sum(),
            too_many: checks.len() - found().count(),
            left: worst(&mut found().map(|subdivided| subdivided.deviation)),
        }
    };
    PathCheckFacts {
        tolerance,
        strokes: checks.len(),
        executed: worst(&mut checks.iter().map(|check| check.executed)),
        linear: of(0),
        natural: of(1),
        not_a_knot: of(2),
    }
}

/// Four rows a stroke: its number, the way, the knots, and the largest deviations [m, rad]: from the same
/// place of the path, from the path, from the surface, of the axis. Empty where there is none.
///
/// # Errors
/// Whatever the file system reports.
pub fn write(file: File, checks: &[StrokeCheck], has_surface: bool) -> io::Result<()> {
    let mut file = BufWriter::new(file);
    writeln!(file, "stroke,interpolation,knots,matched,geometric,surface,axis")?;
    let mut row = |stroke: u64, name: &str, knots: Option<usize>, found: Option<Deviation>| {
        let knots = knots.map_or_else(String::new, |knots| knots.to_string());
        write!(file, "{stroke},{name},{knots},")?;
        let Some(Deviation { matched, geometric, surface, axis }) = found else {
            return writeln!(file, ",,,");
        };
        let surface = if has_surface { surface.to_string() } else { String::new() };
        writeln!(file, "{matched},{geometric},{surface},{axis}")
    };
    for check in checks {
        for (interpolation, found) in INTERPOLATIONS.into_iter().zip(check.interpolated) {
            let name = match interpolation {
                Interpolation::Linear => "linear",
                Interpolation::NaturalCubic => "natural",
                Interpolation::NotAKnot => "not_a_knot",
            };
            let (knots, left) =
                found.map(|Subdivided { knots, deviation }| (knots, deviation)).unzip();
            row(check.stroke, name, knots, left)?;
        }
        row(check.stroke, "executed", None, Some(check.executed))?;
    }
    file.flush()
}

/// Says it to a person.
pub fn print(facts: &PathCheckFacts) {
    if facts.strokes == 0 {
        say!("path      nothing is marked along a path");
        return;
    }
    let Strayed { matched, surface, axis, .. } = facts.executed;
    let surface = surface.map_or_else(String::new, |off| {
        format!(", {:.3} nm from the surface, {:.3} nrad of its axis", off * 1e9, axis * 1e9)
    });
    say!("path      executed within {:.3} nm of where the tool should be{surface}", matched * 1e9);
    let of = |name: &str, Interpolating { knots, too_many, .. }: Interpolating| {
        let missing = match too_many {
            0 => String::new(),
            count => format!(" ({count} strokes need too many)"),
        };
        format!("{name} {knots}{missing}")
    };
    say!(
        "          knots to stay within {:.3} µm: {}, {}, {}",
        facts.tolerance * 1e6,
        of("linear", facts.linear),
        of("natural cubics", facts.natural),
        of("not-a-knot cubics", facts.not_a_knot)
    );
}
