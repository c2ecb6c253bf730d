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
mod check;
mod end_speed;
mod ends;
mod estimate;
mod passes;
mod program;
mod settings;
mod solver;
mod spline;
mod stretch;
mod stretch_planner;

#[cfg(test)]
mod tests;

pub(crate) use settings::Settings;
pub(crate) use stretch::{End, Infeasible};
pub(crate) use stretch_planner::Planner;
#[cfg(test)]
pub(crate) use {
    profile::Along,
    row::{Limits, Row, Side, Site},
    stretch_planner::plan,
    time_law::TimeLaw,
};
