//! Where a mechanism loses or gains a freedom: the edges of what its equations allow, whatever margin it keeps
//! from them.

use std::collections::BTreeMap;

use machine::Machine;
use machine::analysis::{Place, footprint, places};
use machine::mechanisms::MechanismKind;
use monitor::report::chart::{Curve, INK, colour};
use monitor::report::path::PLACE;
use nalgebra::Vector2;

use super::draw::{MILLIMETRES, plane};
use super::stiffness::area;
use super::{Figure, FigureError, Figures, Name, Subject, Table};

/// Places along x, and along y.
const GRID: usize = 201;

/// Places of the survey that tells how large the machine is.
const COARSE: usize = 5;

/// Halvings of a grid's step: to rounding.
const HALVINGS: usize = 45;

/// Where the code of an edge is asked for, in steps of the grid from it.
const BEYOND: f64 = 1e-3;

/// What one outcome of the inverse is not, edge by edge: connected points [m].
type Curves = BTreeMap<&'static str, Vec<Vec<Vector2<f64>>>>;

pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    let machine = without_margins(&subject.machine);
    let [x, y] = surroundings(&machine)
        .map_err(|error| FigureError::Home { machine: machine.name.clone(), error })?;
    let found = curves(&machine, [x, y]);
    if found.is_empty() {
        let why = "its equations have a solution everywhere: it knows no singularity";
        figures.skip(Name::Singular, &subject.stem, why);
        return Ok(());
    }
    let mut table = Table::new(format!("singular_{}", subject.stem), ["kind", "curve", "x", "y"]);
    let mut drawn = Vec::new();
    let mut number = 0.0;
    for (index, (kind, lines)) in found.iter().enumerate() {
        for line in lines {
            number += 1.0;
            for point in line {
                table.rows.push(vec![
                    (*kind).into(),
                    number.into(),
                    point.x.into(),
                    point.y.into(),
                ]);
            }
        }
        let millimetres = |line: &Vec<Vector2<f64>>| {
            line.iter().map(|point| (point.x * MILLIMETRES, point.y * MILLIMETRES)).collect()
        };
        drawn.push(Curve {
            name: short(kind),
            colour: colour(index),
            lines: lines.iter().map(millimetres).collect(),
        });
    }
    let [[left, right], [below, above]] =
        area(subject).map(|range| range.map(|at| at * MILLIMETRES));
    drawn.push(Curve {
        name: "area".to_owned(),
        colour: INK,
        lines: vec![vec![
            (left, below),
            (right, below),
            (right, above),
            (left, above),
            (left, below),
        ]],
    });
    figures.figures.push(Figure {
        name: Name::Singular,
        source: if subject.chapter.is_some() { source(subject).to_owned() } else { String::new() },
        title: format!("{}: the edges of its equations, and the area within", machine.name),
        caption: "Each curve is where the tool's place stops having joints on the branch in which the machine is \
                  built: arms stretched or folded, bodies in line. Margins of the machine file are left out, and \
                  limits of the axes but those that the equations themselves know, such as a stator's edge."
            .to_owned(),
        axes: PLACE.map(str::to_owned),
        svg: plane("singularities", PLACE, &drawn)?,
        table,
        more: Vec::new(),
    });
    Ok(())
}

fn source(subject: &Subject) -> &'static str {
    match subject.chapter.map(|chapter| chapter.number) {
        Some(5) => "5-3",
        Some(6) => "6-2",
        _ => "",
    }
}

/// A code in the width of a legend.
fn short(code: &str) -> String {
    code.replace("unreachable_", "").replace("wrong_", "").replace('_', " ")
}

/// The machine with no margin about its singularities.
fn without_margins(machine: &Machine) -> Machine {
    let mut machine = machine.clone();
    match &mut machine.mechanism {
        MechanismKind::FiveBar(linkage) => {
            (linkage.type_1_limit, linkage.type_2_limit) = (0.0, 0.0);
        }
        MechanismKind::Prrrp(linkage) => {
            (linkage.type_1_limit, linkage.type_2_limit) = (0.0, 0.0);
        }
        MechanismKind::TwinActuator(linkage) => {
            (linkage.baseline_limit, linkage.near_limit) = (0.0, 0.0);
        }
        MechanismKind::Polar(polar) => polar.singular_radius = 0.0,
        MechanismKind::Mcm(head) => head.singular_distance = 0.0,
        _ => {}
    }
    machine
}

/// The box of area and bodies with half of its size around it [m].
fn surroundings(machine: &Machine) -> Result<[[f64; 2]; 2], machine::kinematics::KinematicsError> {
    let found = places(machine, [COARSE, COARSE])?;
    let bodies = footprint(found.iter().flatten()).unwrap_or([[0.0; 2]; 2]);
    Ok([0, 1].map(|axis| {
        let low = bodies[axis][0].min(machine.area.lower[axis]);
        let high = bodies[axis][1].max(machine.area.upper[axis]);
        let air = 0.55 * (high - low);
        [low - air, high + air]
    }))
}

/// What the inverse says of a place: `None` where it has an answer, else the code.
fn outcome(machine: &Machine, at: Vector2<f64>) -> Option<&'static str> {
    Place::with_tool_at(machine, [at.x, at.y, machine.home[2]]).err().map(|error| error.code)
}

/// The edges between places with an answer and places without, by the code of the latter.
fn curves(machine: &Machine, [x, y]: [[f64; 2]; 2]) -> Curves {
    let at = |column: usize, row: usize| {
        let along = |[from, to]: [f64; 2], index: usize| {
            from + (to - from) * index as f64 / (GRID - 1) as f64
        };
        Vector2::new(along(x, column), along(y, row))
    };
    let codes: Vec<Option<&'static str>> =
        (0..GRID * GRID).map(|index| outcome(machine, at(index % GRID, index / GRID))).collect();
    let code = |column: usize, row: usize| codes[row * GRID + column];
    let crossing_at = |(node, axis): Side| {
        let other = if axis == 0 { [node[0] + 1, node[1]] } else { [node[0], node[1] + 1] };
        let ends = [node, other].map(|[column, row]| code(column, row).is_none());
        let [from, to] = [node, other].map(|[column, row]| at(column, row));
        (ends[0] != ends[1]).then(|| crossing(machine, from, to))
    };
    let mut places: BTreeMap<Side, (Vector2<f64>, &'static str)> = BTreeMap::new();
    for row in 0..GRID {
        for column in 0..GRID {
            let on = [column + 1 < GRID, row + 1 < GRID];
            for side in (0..2).filter(|axis| on[*axis]).map(|axis| ([column, row], axis)) {
                if let Some(found) = crossing_at(side).flatten() {
                    places.insert(side, found);
                }
            }
        }
    }
    // Each cell joins the crossings of its sides two by two, of one kind with one another.
    let mut joints: BTreeMap<&'static str, Links> = BTreeMap::new();
    for row in 0..GRID - 1 {
        for column in 0..GRID - 1 {
            let sides = [
                ([column, row], 0),
                ([column + 1, row], 1),
                ([column, row + 1], 0),
                ([column, row], 1),
            ];
            let mut crossings: BTreeMap<&'static str, Vec<Side>> = BTreeMap::new();
            for side in sides {
                if let Some((_, kind)) = places.get(&side) {
                    crossings.entry(kind).or_default().push(side);
                }
            }
            for (kind, sides) in crossings {
                for pair in sides.chunks(2) {
                    if let [one, two] = *pair {
                        let links = joints.entry(kind).or_default();
                        links.entry(one).or_default().push(two);
                        links.entry(two).or_default().push(one);
                    }
                }
            }
        }
    }
    let line = |sides: Vec<Side>| {
        sides.iter().filter_map(|side| places.get(side)).map(|(place, _)| *place).collect()
    };
    joints
        .into_iter()
        .map(|(kind, links)| (kind, chains(links).into_iter().map(line).collect()))
        .collect()
}

/// A side of a cell: its lower or left node, and the axis along which it goes on from there, 0 for x.
type Side = ([usize; 2], usize);

/// Sides that a curve joins.
type Links = BTreeMap<Side, Vec<Side>>;

/// Joined sides in a row, the open curves first.
fn chains(mut links: Links) -> Vec<Vec<Side>> {
    let mut lines = Vec::new();
    loop {
        let open = links.iter().find(|(_, next)| next.len() == 1).or_else(|| links.iter().next());
        let Some((&first, _)) = open else { return lines };
        let mut line = vec![first];
        let mut here = first;
        while let Some(next) = links.get_mut(&here).and_then(Vec::pop) {
            if let Some(back) = links.get_mut(&next)
                && let Some(index) = back.iter().position(|side| *side == here)
            {
                back.remove(index);
            }
            line.push(next);
            here = next;
        }
        links.retain(|_, next| !next.is_empty());
        if line.len() > 1 {
            lines.push(line);
        }
    }
}

/// Where between two places the answer ends, of which one has it, and the code beyond.
fn crossing(
    machine: &Machine,
    from: Vector2<f64>,
    to: Vector2<f64>,
) -> Option<(Vector2<f64>, &'static str)> {
    let (mut one, mut other) = (from, to);
    let answered = outcome(machine, one).is_none();
    for _ in 0..HALVINGS {
        let middle = (one + other) / 2.0;
        if outcome(machine, middle).is_none() == answered {
            one = middle;
        } else {
            other = middle;
        }
    }
    let place = (one + other) / 2.0;
    // A little beyond: on the edge itself rounding decides what is wrong.
    let outwards = if answered { to - from } else { from - to };
    Some((place, outcome(machine, place + outwards * BEYOND)?))
}
