//! What a machine is before any job: how much moves, what ground it covers, how stiff it is, how it swings
//! and how evenly it moves, at home and where it is worst in its area.

use machine::analysis::{Hold, Place, Principal, Rotors, footprint, places};
use machine::kinematics::KinematicsError;
use machine::{Machine, analysis};
use schemars::JsonSchema;
use serde::Serialize;

/// Places of the grid along x, and along y.
pub const GRID: usize = 41;

/// A value at home and where it is worst in the area.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AtWorst {
    /// At home, in each principal direction, the least first.
    pub home: Vec<f64>,
    /// The least in the area.
    pub least: f64,
    /// Where that is [m].
    pub at: [f64; 2],
}

/// How evenly joint rates come to the tool.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ManipulabilityFigures {
    /// Product of the velocity ellipse's semi-axes at home.
    pub home: f64,
    /// The least in the area.
    pub least: f64,
    /// The least semi-axis over the largest at home; 1 where all directions are alike.
    pub isotropy_home: f64,
    /// The least of that in the area.
    pub isotropy_least: f64,
}

/// The figures of a machine.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Mechanics {
    /// Mass of all that moves at home [kg].
    pub moving_mass: f64,
    /// Least and largest mass that a push at the tool feels at home, rotors included [kg]; null where the
    /// tool cannot be moved in one direction.
    pub effective_mass: Option<[f64; 2]>,
    /// Length in x and y of the box around joints, motors and tool over the area [m]: a machine file does
    /// not say how wide bodies are.
    pub footprint: Option<[f64; 2]>,
    /// Length in x and y of the box around what is reached of the area [m].
    pub area: [f64; 2],
    /// Share of the area's places that are reached.
    pub reached: f64,
    /// The largest rectangle along the axes of which all is reached, from and to in x and y [m]; null where
    /// there is none.
    pub rectangle: Option<[[f64; 2]; 2]>,
    /// Stiffness of the tool against forces, the motors held [N/m]; null where it is rigid.
    pub stiffness: Option<AtWorst>,
    /// Frequencies of the load's modes, the motors held [Hz]; null where it is rigid.
    pub modes: Option<AtWorst>,
    /// Manipulability; null where it has no numbers.
    pub manipulability: Option<ManipulabilityFigures>,
}

impl Mechanics {
    /// The figures of `machine`.
    ///
    /// # Errors
    /// Where its mechanism has no solution at home.
    pub fn of(machine: &Machine) -> Result<Self, KinematicsError> {
        let home = Place::home(machine)?;
        let grid = places(machine, [GRID, GRID])?;
        let reached: Vec<&Place> = grid.iter().flatten().collect();
        let span = |axis: usize| {
            let along = reached.iter().map(|place| place.position[axis]);
            let ends = along.fold(None, |ends: Option<[f64; 2]>, at| {
                let [from, to] = ends.unwrap_or([at; 2]);
                Some([from.min(at), to.max(at)])
            });
            ends.map_or(0.0, |[from, to]| to - from)
        };
        let values = |axes: Option<Vec<Principal>>| -> Option<Vec<f64>> {
            Some(axes?.iter().map(|axis| axis.value).collect())
        };
        let is_reached: Vec<bool> = grid.iter().map(Option::is_some).collect();
        let manipulability = home.manipulability().map(|figures| {
            let all = || reached.iter().filter_map(|place| place.manipulability());
            ManipulabilityFigures {
                home: figures.value(),
                least: all().map(|it| it.value()).fold(figures.value(), f64::min),
                isotropy_home: figures.isotropy(),
                isotropy_least: all().map(|it| it.isotropy()).fold(figures.isotropy(), f64::min),
            }
        });
        Ok(Self {
            moving_mass: home.bodies.moving_mass,
            effective_mass: home.effective_mass().and_then(|axes| {
                let masses = values(Some(axes))?;
                let least = masses.iter().copied().fold(f64::INFINITY, f64::min);
                Some([least, masses.iter().copied().fold(0.0, f64::max)])
            }),
            footprint: footprint(reached.iter().copied()).map(|box_| box_.map(|[a, b]| b - a)),
            area: [span(0), span(1)],
            reached: reached.len() as f64 / grid.len().max(1) as f64,
            rectangle: largest_rectangle(&is_reached, GRID).map(|[low, high]| {
                let at = |corner| analysis::grid_position(machine, [GRID, GRID], corner);
                let (low, high) = (at(low), at(high));
                [[low.x, high.x], [low.y, high.y]]
            }),
            stiffness: at_worst(&home, &reached, |place| {
                values(place.tool_stiffness(Hold::Clamped))
            }),
            modes: at_worst(&home, &reached, |place| {
                let modes = place.modes(Rotors::Held);
                Some(modes.iter().map(|mode| mode.frequency).collect())
            }),
            manipulability,
        })
    }
}

/// `values` at home, and their least over the area; `None` where there are none.
fn at_worst(
    home: &Place,
    reached: &[&Place],
    values: impl Fn(&Place) -> Option<Vec<f64>>,
) -> Option<AtWorst> {
    let at_home = values(home).filter(|values| !values.is_empty())?;
    let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
    let place = |place: &Place| [place.position.x, place.position.y];
    let mut worst = (least(&at_home), place(home));
    for one in reached {
        let found = values(one).map_or(f64::INFINITY, |values| least(&values));
        if found < worst.0 {
            worst = (found, place(one));
        }
    }
    Some(AtWorst { home: at_home, least: worst.0, at: worst.1 })
}

/// The largest rectangle of a grid of `columns` with all places in it, as the columns and rows of its lower
/// and upper corner; `None` where no four places are.
fn largest_rectangle(grid: &[bool], columns: usize) -> Option<[[usize; 2]; 2]> {
    let rows = grid.len() / columns.max(1);
    let mut best = (0, None);
    for low in 0..rows {
        let mut all: Vec<bool> = vec![true; columns];
        for high in low..rows {
            for (column, all) in all.iter_mut().enumerate() {
                *all &= grid[high * columns + column];
            }
            let mut start = 0;
            for run in all.chunk_by(|one, other| one == other) {
                let end = start + run.len();
                let size = (run.len() - 1) * (high - low);
                if run[0] && size > best.0 {
                    best = (size, Some([[start, low], [end - 1, high]]));
                }
                start = end;
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn the_largest_rectangle_is_found() {
        let grid: Vec<bool> = ["#..##", "#.###", "#.###", "#####", "....#"]
            .concat()
            .chars()
            .map(|place| place == '#')
            .collect();
        // Rows from the lowest on: columns 2 to 4 over rows 1 to 3, before 3 to 4 over 0 to 3.
        assert_eq!(largest_rectangle(&grid, 5), Some([[2, 1], [4, 3]]));
        assert_eq!(largest_rectangle(&[false; 4], 2), None);
    }

    #[test]
    fn the_corexy_is_what_a_hand_computes() {
        let figures = Mechanics::of(&Machine::builtin()).unwrap();
        let close = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} for {expected}");
        };
        close(figures.moving_mass, 1.06);
        assert_eq!(figures.reached, 1.0);
        for length in figures.area.into_iter().chain(figures.footprint.unwrap()) {
            close(length, 0.2);
        }
        let [x, y] = figures.rectangle.unwrap();
        assert!(x == [0.0, 0.2] && y == [0.0, 0.2]);
        close(figures.stiffness.unwrap().least, 60e3);
        // √(60 kN/m / 0.33 kg) and √(60 kN/m / 1.06 kg).
        let modes = figures.modes.unwrap();
        close(modes.home[0], 37.865);
        close(modes.home[1], 67.864);
        close(figures.manipulability.unwrap().isotropy_home, 1.0);
        // Along x both motors turn: 0.33 kg and two rotors at 1.25 mm a radian.
        let [least, most] = figures.effective_mass.unwrap();
        let rotors = 2.0 * 2e-6 / (1.25e-3 * 1.25e-3);
        close(least, 0.33 + rotors);
        close(most, 1.06 + rotors);
    }
}
