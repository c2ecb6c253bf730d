//! Acceleration and force of the tool by direction (source 003 fig. 3-2, 4-2).

use core::f64::consts::TAU;

use machine::analysis::Place;
use messages::math;
use monitor::report::chart::{Curve, colour};
use nalgebra::Vector3;

use super::draw::plane;
use super::{Cell, Figure, FigureError, Figures, Name, Subject, Table};

/// Directions of a full turn, the first one twice.
const DIRECTIONS: usize = 721;

/// The torques of source 003 [N·m], figure by figure, with their errata: eq. 3.17 with its 2π, and half of
/// what sec. 4.5 prints.
const SOURCE_TORQUES: [(u32, &str, [f64; 2]); 2] =
    [(3, "3-2", [0.015_358, 0.002_626_1]), (4, "4-2", [0.008_687_5; 2])];

pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    let place = Place::home(&subject.machine)
        .map_err(|error| FigureError::Home { machine: subject.machine.name.clone(), error })?;
    let motors = place.standstill_torques();
    let own = format!("acceleration_{}", subject.stem);
    figures.figures.push(figure(subject, &place, &motors, own, "")?);
    for (chapter, source, torques) in SOURCE_TORQUES {
        if subject.chapter.is_some_and(|own| own.number == chapter) {
            let stem = format!("acceleration_{source}");
            figures.figures.push(figure(subject, &place, &torques, stem, source)?);
        }
    }
    Ok(())
}

fn figure(
    subject: &Subject,
    place: &Place,
    torques: &[f64],
    stem: String,
    source: &str,
) -> Result<Figure, FigureError> {
    let table = by_direction(subject, place, torques, stem);
    let curve = |name: &str, index: usize, column: &str| {
        let [angle, value] = ["angle", column].map(|name| table.column(name).unwrap_or_default());
        let line = angle.into_iter().zip(value).map(|(angle, value)| {
            let (sine, cosine) = math::sin_cos(angle);
            (value * cosine, value * sine)
        });
        Curve { name: name.to_owned(), colour: colour(index), lines: vec![line.collect()] }
    };
    let axes = ["acceleration in x [m/s²]", "acceleration in y [m/s²]"];
    let mut curves = vec![curve("without rotors", 1, "acceleration_without_rotors")];
    if source.is_empty() {
        curves.push(curve("with rotors", 0, "acceleration"));
    }
    let torques = torques.iter().map(|torque| format!("{:.1}", torque * 1e3));
    let torques = torques.collect::<Vec<_>>().join(", ");
    let name = &subject.machine.name;
    Ok(Figure {
        name: Name::Acceleration,
        source: source.to_owned(),
        title: if source.is_empty() {
            format!("{name}: largest acceleration of the tool by direction, at home")
        } else {
            format!("{name}: acceleration by direction with the source's torques")
        },
        caption: format!(
            "From rest with motors of {torques} mN·m, friction left out. The distance from the middle is the \
             largest acceleration in that direction."
        ),
        axes: axes.map(str::to_owned),
        svg: plane("acceleration", axes, &curves)?,
        table,
        more: Vec::new(),
    })
}

/// A row a direction in the x-y plane.
pub(super) fn by_direction(
    subject: &Subject,
    place: &Place,
    torques: &[f64],
    stem: String,
) -> Table {
    let columns =
        ["angle", "acceleration", "acceleration_without_rotors", "force", "limiting_axis"];
    let mut table = Table::new(stem, columns);
    for index in 0..DIRECTIONS {
        let angle = TAU * index as f64 / (DIRECTIONS - 1) as f64;
        let (sine, cosine) = math::sin_cos(angle);
        let along = Vector3::new(cosine, sine, 0.0);
        let with = place.acceleration(&along, torques, true);
        let without = place.acceleration(&along, torques, false);
        let force = place.force(&along, torques);
        let limiting = with.axis.and_then(|axis| subject.machine.axes.get(axis));
        table.rows.push(vec![
            angle.into(),
            with.value.into(),
            without.value.into(),
            force.value.into(),
            limiting.map_or(Cell::Number(f64::NAN), |axis| axis.name.as_str().into()),
        ]);
    }
    table
}
