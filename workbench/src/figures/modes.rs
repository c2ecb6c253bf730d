//! Natural frequencies of a machine over its area, its motors held.

use machine::analysis::{Rotors, places};
use monitor::report::path::PLACE;

use super::draw::Map;
use super::stiffness::{GRID, area};
use super::{Cell, Figure, FigureError, Figures, Name, Subject, Table};

pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    let machine = &subject.machine;
    if !machine.mechanism.is_elastic() {
        let why = "its transmission is rigid: the machine file names no spring";
        figures.skip(Name::Modes, &subject.stem, why);
        return Ok(());
    }
    let found = places(machine, [GRID, GRID])
        .map_err(|error| FigureError::Home { machine: machine.name.clone(), error })?;
    let modes = (1..=machine.axes.len()).map(|mode| format!("mode_{mode}"));
    let columns = ["x", "y"].map(str::to_owned).into_iter().chain(modes);
    let mut table = Table::new(format!("modes_{}", subject.stem), columns);
    let mut values = vec![None; found.len()];
    for (place, value) in found.iter().zip(&mut values) {
        let Some(place) = place else { continue };
        let modes = place.modes(Rotors::Held);
        let Some(lowest) = modes.first() else { continue };
        *value = Some(lowest.frequency);
        let row = [place.position.x, place.position.y].into_iter();
        let row = row.chain(modes.iter().map(|mode| mode.frequency));
        table.rows.push(row.map(Cell::Number).collect());
    }
    let map = Map {
        title: "modes",
        area: area(subject),
        size: [GRID, GRID],
        values: &values,
        quantity: "lowest [Hz]",
        curves: &[],
    };
    figures.figures.push(Figure {
        name: Name::Modes,
        source: String::new(),
        title: format!("{}: lowest natural frequency over the area", machine.name),
        caption: "The load on its transmissions without damping, the motors' shafts held. White places are not \
                  reached; one colour means that it is the same everywhere."
            .to_owned(),
        axes: PLACE.map(str::to_owned),
        svg: map.picture()?,
        table,
        more: Vec::new(),
    });
    Ok(())
}
