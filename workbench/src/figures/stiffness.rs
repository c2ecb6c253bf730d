//! Stiffness of the source's screw and belts (source 003 fig. 3-8, 3-9, 4-4), and of a machine's tool.

use core::f64::consts::TAU;

use machine::analysis::{Hold, places};
use machine::transmission::belt::Belt;
use machine::transmission::in_series;
use machine::transmission::screw::ScrewShaft;
use monitor::report::chart::{Chart, Curve, colour};

use super::draw::{MILLIMETRES, Map};
use super::{Figure, FigureError, Figures, Name, Subject, Table};

/// Places of a map along x, and along y.
pub(super) const GRID: usize = 21;

/// The shaft of table 3-5, 14 mm thick; the source gives no shear modulus, nor anything of the nut.
const SHAFT: ScrewShaft = ScrewShaft {
    core_diameter: 14e-3,
    bore: 0.0,
    length: 0.25,
    modulus: 22e10,
    shear_modulus: 22e10 / 2.6,
    nut_stiffness: f64::INFINITY,
    nut_accuracy: 1.0,
};

/// Its lead, 15 mm a turn [m/rad].
const LEAD: f64 = 15e-3 / TAU;

/// The belt of table 4-2, 0.95 m round.
const BELT: Belt = Belt { modulus: 150e6, section: 0.5e-4 };
const BELT_LENGTH: f64 = 0.95;

/// Side of the area that the belts move the head in [m].
const BELT_AREA: f64 = 0.2;

/// Newtons a metre to newtons a millimetre.
const PER_MILLIMETRE: f64 = 1e-3;

/// The tool's stiffness over the area.
pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    let machine = &subject.machine;
    if !machine.mechanism.is_elastic() {
        let why = "its transmission is rigid: the machine file names no spring";
        figures.skip(Name::Stiffness, &subject.stem, why);
        return Ok(());
    }
    let found = places(machine, [GRID, GRID])
        .map_err(|error| FigureError::Home { machine: machine.name.clone(), error })?;
    let mut table = Table::new(format!("stiffness_{}", subject.stem), ["x", "y", "least", "most"]);
    let mut least = vec![None; found.len()];
    for (place, least) in found.iter().zip(&mut least) {
        let Some(place) = place else { continue };
        let Some(axes) = place.tool_stiffness(Hold::Clamped) else { continue };
        let (Some(first), Some(last)) = (axes.first(), axes.last()) else { continue };
        table.numbers([place.position.x, place.position.y, first.value, last.value]);
        *least = Some(first.value * PER_MILLIMETRE);
    }
    let map = Map {
        title: "stiffness",
        area: area(subject),
        size: [GRID, GRID],
        values: &least,
        quantity: "stiffness [N/mm]",
        curves: &[],
    };
    figures.figures.push(Figure {
        name: Name::Stiffness,
        source: String::new(),
        title: format!("{}: least stiffness of the tool against a push", machine.name),
        caption: "The tool's stiffness in its softest direction, the motors' shafts held. White places are \
                  not reached."
            .to_owned(),
        axes: ["x [mm]", "y [mm]"].map(str::to_owned),
        svg: map.picture()?,
        table,
        more: Vec::new(),
    });
    Ok(())
}

/// The area of a machine, along x and y [m].
pub(super) fn area(subject: &Subject) -> [[f64; 2]; 2] {
    let area = &subject.machine.area;
    [[area.lower[0], area.upper[0]], [area.lower[1], area.upper[1]]]
}

/// Screw and belts of the source.
pub(super) fn add_source(figures: &mut Figures) -> Result<(), FigureError> {
    figures.figures.push(axial()?);
    figures.figures.push(torsional()?);
    figures.figures.push(span()?);
    figures.figures.push(belts()?);
    Ok(())
}

/// Strokes of the nut, 1 mm apart, from near its bearing to the end of the shaft.
fn shafts() -> impl Iterator<Item = ScrewShaft> {
    (10..=250).map(|stroke: u32| ScrewShaft { length: f64::from(stroke) * 1e-3, ..SHAFT })
}

fn axial() -> Result<Figure, FigureError> {
    let mut table = Table::new("screw_axial", ["stroke", "shaft", "shaft_and_nut"]);
    for shaft in shafts() {
        table.numbers([shaft.length, shaft.shaft_stiffness(), shaft.axial_stiffness()]);
    }
    let curves = vec![curve("shaft", 0, &table, ["stroke", "shaft"], 1e-6)];
    chart(
        "3-8",
        "Axial stiffness of the screw by the nut's place",
        "Source 003 eq. 3.25, the screw of table 3-5 with its bearing at stroke 0. The source gives nothing \
         of the nut, which is taken as rigid.",
        ["stroke [mm]", "stiffness [N/µm]"],
        curves,
        table,
    )
}

fn torsional() -> Result<Figure, FigureError> {
    let columns = ["stroke", "torsional", "axial_in_rotation", "series"];
    let mut table = Table::new("screw_torsional", columns);
    for shaft in shafts() {
        let axial = shaft.axial_stiffness() * LEAD * LEAD;
        let torsional = shaft.torsional_stiffness();
        table.numbers([shaft.length, torsional, axial, in_series([axial, torsional])]);
    }
    let curves =
        [("torsion", "torsional"), ("axial", "axial_in_rotation"), ("in series", "series")];
    let curves = (0..)
        .zip(curves)
        .map(|(index, (name, column))| curve(name, index, &table, ["stroke", column], 1.0));
    let curves = curves.collect();
    chart(
        "3-9",
        "Torsional stiffness of the screw by the nut's place",
        "Source 003 eq. 3.29, the axial stiffness seen in rotation, and both in series (eq. 3.30, which says \
         parallel). The shear modulus is E/2.6.",
        ["stroke [mm]", "stiffness [N·m/rad]"],
        curves,
        table,
    )
}

fn span() -> Result<Figure, FigureError> {
    let mut table = Table::new("belt_span", ["length", "stiffness"]);
    for step in 10..=190 {
        let length = f64::from(step) * 5e-3;
        table.numbers([length, BELT.span_stiffness(length)]);
    }
    let curves = vec![curve("span", 0, &table, ["length", "stiffness"], PER_MILLIMETRE)];
    chart(
        "4-4",
        "Stiffness of a belt's span by its length",
        "Source 003 eq. 4.15 with the belt of table 4-2. The source takes 15 N/mm, that of half the belt.",
        ["length of the span [mm]", "stiffness [N/mm]"],
        curves,
        table,
    )
}

/// Both belts with their two spans each, the head at (`x`, `y`) [N/m].
///
/// Source 003 eq. 4.16 to 4.18, with half the belt for what stands before x and y there.
pub(super) fn belt_stiffness(x: f64, y: f64) -> [f64; 2] {
    [y + x, y - x].map(|out| {
        let short = BELT_LENGTH / 2.0 - out;
        BELT.stiffness([short, BELT_LENGTH - short])
    })
}

fn belts() -> Result<Figure, FigureError> {
    let mut table = Table::new("belts", ["x", "y", "belt_1", "belt_2"]);
    let mut values = Vec::with_capacity(GRID * GRID);
    for index in 0..GRID * GRID {
        let along = |step: usize| BELT_AREA * step as f64 / (GRID - 1) as f64;
        let (x, y) = (along(index % GRID), along(index / GRID));
        let [first, second] = belt_stiffness(x, y);
        table.numbers([x, y, first, second]);
        values.push(Some(first * PER_MILLIMETRE));
    }
    let map = Map {
        title: "belts",
        area: [[0.0, BELT_AREA]; 2],
        size: [GRID, GRID],
        values: &values,
        quantity: "belt 1 [N/mm]",
        curves: &[],
    };
    Ok(Figure {
        name: Name::Stiffness,
        source: String::new(),
        title: "Stiffness of the first belt of a CoreXY by the place of the head".to_owned(),
        caption: "Source 003 eq. 4.15 to 4.18, both spans of the belt of table 4-2 together. The second belt's \
                  is the mirror image about x = 0: y − x in place of y + x."
            .to_owned(),
        axes: ["x [mm]", "y [mm]"].map(str::to_owned),
        svg: map.picture()?,
        table,
        more: Vec::new(),
    })
}

/// A curve of two columns, the first in millimetres.
fn curve(name: &str, index: usize, table: &Table, [across, up]: [&str; 2], scale: f64) -> Curve {
    let column = |name| table.column(name).unwrap_or_default();
    let line = column(across).into_iter().zip(column(up));
    let line = line.map(|(x, y)| (x * MILLIMETRES, y * scale)).collect();
    Curve { name: name.to_owned(), colour: colour(index), lines: vec![line] }
}

fn chart(
    source: &str,
    title: &str,
    caption: &str,
    axes: [&str; 2],
    curves: Vec<Curve>,
    table: Table,
) -> Result<Figure, FigureError> {
    let chart = Chart {
        title,
        across: axes[0],
        up: axes[1],
        height: 380,
        at_least: Some((0.0, 0.0)),
        curves,
    };
    Ok(Figure {
        name: Name::Stiffness,
        source: source.to_owned(),
        title: title.to_owned(),
        caption: caption.to_owned(),
        axes: axes.map(str::to_owned),
        svg: chart.draw()?,
        table,
        more: Vec::new(),
    })
}
