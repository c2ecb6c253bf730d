//! Velocity and force ellipses (source 003 fig. 5-8, 5-9), their eigenvalues along a line (fig. 6-5, 6-6), and
//! how alike all directions are over the area.

use machine::analysis::{Place, places};
use machine::mechanisms::MechanismKind;
use monitor::report::chart::{Chart, Curve, colour, stack};
use monitor::report::path::PLACE;

use super::draw::{MILLIMETRES, Map, ellipse, plane};
use super::stiffness::{GRID, area};
use super::{Figure, FigureError, Figures, Name, Subject, Table};

/// Ellipses along a line.
const ALONG: usize = 13;

/// Of them, each so many is drawn.
const DRAWN: usize = 2;

/// The part of the distance of two that are drawn that the largest semi-axis takes.
const FILLED: f64 = 0.48;

pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    for along in [1, 0] {
        figures.figures.push(line(subject, along)?);
    }
    figures.figures.push(isotropy(subject)?);
    if let MechanismKind::Prrrp(prrrp) = &subject.machine.mechanism {
        figures.figures.push(eigenvalues(subject, prrrp.link, prrrp.branch.side)?);
    }
    Ok(())
}

/// Ellipses along the direction `along`, 0 for x, through home.
fn line(subject: &Subject, along: usize) -> Result<Figure, FigureError> {
    let machine = &subject.machine;
    let letter = ["x", "y"][along];
    let columns = ["x", "y", "major", "minor", "angle", "force_major", "force_minor", "det"];
    let mut table = Table::new(format!("ellipses_{letter}_{}", subject.stem), columns);
    let [from, to] = area(subject)[along];
    for index in 0..ALONG {
        let share = index as f64 / (ALONG - 1) as f64;
        let mut position = machine.home;
        position[along] = from * (1.0 - share) + to * share;
        let Ok(place) = Place::with_tool_at(machine, position) else { continue };
        if let Some(row) = row(&place) {
            table.numbers(row);
        }
    }
    let largest = |column: &str| {
        table.column(column).unwrap_or_default().into_iter().fold(f64::MIN_POSITIVE, f64::max)
    };
    let room = FILLED * DRAWN as f64 * (to - from) / (ALONG - 1) as f64 * MILLIMETRES;
    let (velocity, force) = (room / largest("major"), room / largest("force_major"));
    let column = |name: &str| table.column(name).unwrap_or_default();
    let [x, y, major, minor, angle] = ["x", "y", "major", "minor", "angle"].map(column);
    let [force_major, force_minor] = ["force_major", "force_minor"].map(column);
    let mut curves = [("velocity", 0), ("force", 1)].map(|(name, index)| Curve {
        name: name.to_owned(),
        colour: colour(index),
        lines: Vec::new(),
    });
    for index in (0..x.len()).step_by(DRAWN) {
        let centre = (x[index] * MILLIMETRES, y[index] * MILLIMETRES);
        let axes = [major[index] * velocity, minor[index] * velocity];
        curves[0].lines.push(ellipse(centre, axes, angle[index]));
        // Forces are large where velocities are small: the axes are the same ones.
        let axes = [force_minor[index] * force, force_major[index] * force];
        curves[1].lines.push(ellipse(centre, axes, angle[index]));
    }
    let source = match (subject.chapter.map(|chapter| chapter.number), along) {
        (Some(5), 1) => "5-8",
        (Some(5), 0) => "5-9",
        _ => "",
    };
    Ok(Figure {
        name: Name::Ellipses,
        source: source.to_owned(),
        title: format!("{}: ellipses of velocity and force along {letter}, through home", machine.name),
        caption: "What joint rates, and joint efforts, of length 1 do at the tool, in x and y; each kind has a \
                  scale of its own, the same for all places. Numbers are in joint units."
            .to_owned(),
        axes: PLACE.map(str::to_owned),
        svg: plane("ellipses", PLACE, &curves)?,
        table,
        more: Vec::new(),
    })
}

/// A place's ellipse in x and y: where it is, semi-axes and angle of the velocity, semi-axes of the force,
/// determinant; `None` where the tool cannot move in one direction.
fn row(place: &Place) -> Option<[f64; 8]> {
    let found = place.manipulability_in_plane()?;
    let [major, minor] = [found.velocity.first()?, found.velocity.get(1)?];
    let force = found.force()?;
    Some([
        place.position.x,
        place.position.y,
        major.value,
        minor.value,
        major.angle(),
        force.first()?.value,
        force.get(1)?.value,
        place.determinant().unwrap_or(f64::NAN),
    ])
}

/// The least semi-axis by the largest over the area.
fn isotropy(subject: &Subject) -> Result<Figure, FigureError> {
    let machine = &subject.machine;
    let found = places(machine, [GRID, GRID])
        .map_err(|error| FigureError::Home { machine: machine.name.clone(), error })?;
    let columns = ["x", "y", "major", "minor", "isotropy", "manipulability"];
    let mut table = Table::new(format!("ellipses_area_{}", subject.stem), columns);
    let mut values = vec![None; found.len()];
    for (place, value) in found.iter().zip(&mut values) {
        let Some(place) = place else { continue };
        let Some(found) = place.manipulability() else { continue };
        let (Some(major), Some(minor)) = (found.velocity.first(), found.velocity.last()) else {
            continue;
        };
        let [x, y] = [place.position.x, place.position.y];
        table.numbers([x, y, major.value, minor.value, found.isotropy(), found.value()]);
        *value = Some(found.isotropy());
    }
    let map = Map {
        title: "isotropy",
        area: area(subject),
        size: [GRID, GRID],
        values: &values,
        quantity: "isotropy [1]",
        curves: &[],
    };
    Ok(Figure {
        name: Name::Ellipses,
        source: String::new(),
        title: format!("{}: how alike all directions are over the area", machine.name),
        caption: "The least semi-axis of the velocity ellipse by the largest, all directions of the tool \
                  together: 1 where all are alike, 0 in a singularity. White places are not reached."
            .to_owned(),
        axes: PLACE.map(str::to_owned),
        svg: map.picture()?,
        table,
        more: Vec::new(),
    })
}

/// Eigenvalues of J·Jᵀ and of its inverse by the distance x of the tool from the carts' rail, from a tenth of
/// the link's length to nine tenths; J is per metre of a cart.
fn eigenvalues(subject: &Subject, link: f64, side: i32) -> Result<Figure, FigureError> {
    let columns = ["x", "velocity_x", "velocity_y", "force_x", "force_y"];
    let mut table = Table::new(format!("eigenvalues_{}", subject.stem), columns);
    for step in 0..=160 {
        let x = link * (0.1 + f64::from(step) * 0.005);
        let position = [f64::from(side) * x, subject.machine.home[1], 0.0];
        let Ok(place) = Place::with_tool_at(&subject.machine, position) else { continue };
        let Some(found) = place.manipulability() else { continue };
        let along = |axis: usize| {
            let of = |one: &&machine::analysis::Principal| one.direction[axis].abs() > 0.5;
            found.velocity.iter().find(of).map_or(f64::NAN, |one| one.value * one.value)
        };
        let (across, up) = (along(0), along(1));
        table.numbers([x, across, up, 1.0 / across, 1.0 / up]);
    }
    let column = |name: &str| table.column(name).unwrap_or_default();
    let curve = |name: &str, index: usize, of: &str| {
        let line = column("x").into_iter().zip(column(of));
        let line = line.map(|(x, value)| (x * MILLIMETRES, value)).collect();
        Curve { name: name.to_owned(), colour: colour(index), lines: vec![line] }
    };
    let axes = ["x [mm]", "velocity: eigenvalues [1]"];
    let chart = |up, curves| Chart {
        title: "eigenvalues",
        across: axes[0],
        up,
        height: 300,
        at_least: Some((0.0, 0.0)),
        curves,
    };
    let velocity = vec![curve("in x", 0, "velocity_x"), curve("in y", 1, "velocity_y")];
    let force = vec![curve("in x", 0, "force_x"), curve("in y", 1, "force_y")];
    let charts = [chart(axes[1], velocity), chart("force: eigenvalues [1]", force)];
    Ok(Figure {
        name: Name::Ellipses,
        source: if subject.chapter.is_some() { "6-5, 6-6".to_owned() } else { String::new() },
        title: format!("{}: eigenvalues by the distance from the rail", subject.machine.name),
        caption: "Of J·Jᵀ above and of its inverse below, per metre of a cart. The source's captions say over \
                  time; the axis is x, from 0.1 to 0.9 of the link's length."
            .to_owned(),
        axes: axes.map(str::to_owned),
        svg: stack("eigenvalues", &charts)?,
        table,
        more: Vec::new(),
    })
}
