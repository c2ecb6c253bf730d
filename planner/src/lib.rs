//! Turns a job file into checked setpoints.
//!
//! - [`job`]: readers of G-code, letters, points, clouds and paths; each makes a [`drawing`].
//! - [`geometry`]: the drawing's curves, fitted and rounded into paths.
//! - [`limits`]: what tool, joints, motors and laser allow at each place of a path.
//! - [`law`]: the time law (velocity profile) of a path, the fastest within them, and flights in the dark.
//! - [`joint_space`]: configurations, moves of the joints, unwinding.
//! - [`light`]: gate and power along a path.
//! - `planning`: puts these together, window by window. [`trajectory`]: the result, as functions of time.
//! - [`sampling`]: one setpoint each millisecond, with deflection and backlash. [`verify`]: their checker.
//! - [`preview`]: what a job draws, before it is planned.
//! - [`paper`]: a drawing by the speed profiles of the sources, for comparison.
//! - [`service`]: the planner process. It alone waits, locks or reads a clock.
//!
//! [`plan()`] keeps the whole plan; [`plan_through`] hands it on window by window and keeps nothing, [`plan_while`]
//! as far as somebody wants it.

pub mod drawing;
pub mod error;
pub mod geometry;
pub mod job;
pub mod joint_space;
pub mod law;
pub mod light;
pub mod limits;
pub mod paper;
pub mod plan;
pub(crate) mod planning;
pub mod preview;
#[cfg(test)]
mod random;
pub mod request;
pub mod sampling;
mod search;
pub mod service;
pub mod trajectory;
pub mod verify;

pub use error::PlanError;
pub use job::{Job, Marking, MarkingSpeed};
pub use plan::{
    Plan, PlanFacts, PlannedStretch, plan, plan_ideal, plan_telling, plan_through, plan_while,
};
pub use verify::margins::plan_with_margins;
