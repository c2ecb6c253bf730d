//! Job readers, paths, profiles, laser timing, sampling.
//!
//! [`job::Job::read`] turns a file into a drawing, [`plan()`] times it and checks every sample of
//! it, [`Plan::setpoints`] hands the samples out. Nothing here waits, locks or reads a clock.

mod arc_length;
mod artwork;
mod blend;
pub mod check;
pub mod drawing;
pub mod itinerary;
pub mod jet;
pub mod job;
mod lead;
mod outline;
pub mod plan;
pub mod profile;
#[cfg(test)]
mod random;
pub mod request;
pub mod run_in;
mod sampler;
pub mod service;
mod speed;
pub mod stroke;
pub mod timing;
mod track;
pub mod trajectory;

pub use job::{Job, Marking, MarkingSpeed};
pub use plan::{Plan, PlanError, PlanFacts, plan, plan_ideal};
