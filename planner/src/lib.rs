//! Job readers, paths, profiles, laser timing, sampling.
//!
//! [`job::Job::read`] turns a file into a drawing, [`plan()`] times it and checks every sample of
//! it, [`Plan::setpoints`] hands the samples out. Nothing here waits, locks or reads a clock.

pub mod drawing;
pub mod job;
pub mod plan;

pub use job::{Job, Marking, MarkingSpeed};
pub use plan::{Plan, PlanError, PlanFacts, plan, plan_ideal};
