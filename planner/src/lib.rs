//! Job readers, paths, profiles, laser timing, sampling.
//!
//! [`job::Job::read`] turns a file into a drawing, [`plan()`] times it and checks every sample of
//! it, [`Plan::setpoints`] hands the samples out. Nothing here waits, locks or reads a clock.

mod arc_length;
mod artwork;
pub mod attitude;
mod between;
mod blend;
pub mod check;
mod demand;
pub mod drawing;
mod gap;
pub mod itinerary;
pub mod jet;
pub mod job;
pub mod joint_move;
mod joint_plan;
pub mod law;
mod lead;
pub mod margins;
mod outline;
pub mod plan;
mod posture;
pub mod profile;
mod projected;
#[cfg(test)]
mod random;
mod reach;
pub mod request;
mod retry;
mod route;
pub mod run_in;
mod sampler;
pub mod service;
mod speed;
pub mod stroke;
pub mod timing;
mod track;
pub mod trajectory;
mod unwind;

pub use job::{Job, Marking, MarkingSpeed};
pub use plan::{Plan, PlanError, PlanFacts, plan, plan_ideal};
