//! When the tool is where: the time law of a path, moves between states in the dark, and the speed
//! that a job leaves open.

pub(crate) mod flight;
pub(crate) mod optimum;
pub mod profile;
pub(crate) mod row;
pub mod time_law;
pub(crate) mod windows;

mod build;
mod cell;
mod cells;
mod ends;
mod estimate;
mod passes;
mod plan;
mod program;
mod reach;
mod settings;
mod solver;
mod spline;
mod stretch;
mod verify;

#[cfg(test)]
mod tests;

pub(crate) use plan::Planner;
pub(crate) use settings::Settings;
pub(crate) use stretch::{End, Infeasible};
#[cfg(test)]
pub(crate) use {
    plan::plan,
    profile::Along,
    row::{Limits, Row, Side, Site},
    time_law::TimeLaw,
};
