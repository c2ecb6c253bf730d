//! Job readers, paths, the time law, laser timing, sampling.
//!
//! [`job::Job::read`] turns a file into a drawing, [`plan()`] times it and checks every sample of
//! it, [`Plan::setpoints`] hands the samples out; [`plan_through`] does both as it goes, and keeps
//! nothing. Nothing here but [`service`] waits, locks or reads a clock.

pub mod drawing;
pub mod error;
pub mod geometry;
pub mod job;
pub mod joint_space;
pub mod law;
pub mod light;
pub mod limits;
pub mod plan;
pub(crate) mod planning;
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
pub use plan::{Plan, PlanFacts, plan, plan_ideal, plan_through};
