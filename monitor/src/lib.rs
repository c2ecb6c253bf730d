//! Watches a run without anybody waiting for it: latency histograms, the recording, the evaluation
//! of the marks, the summary and the report.
//!
//! What happens per sample ([`stage::MonitorStage::step`]) does no input or output; files are
//! written by functions that are told where to.

pub mod conclusion;
pub mod hub;
pub mod latency;
pub mod marks;
pub mod recording;
pub mod report;
pub mod run_analysis;
pub mod run_folder;
pub mod service;
pub mod stage;
pub mod summary;
pub mod tool;
pub mod trace;
