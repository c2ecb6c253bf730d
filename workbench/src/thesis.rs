//! The tables of source 003, a comparison of four mechanisms on twelve letters: as printed, with the
//! errata applied, and as Graver models them.

pub mod convention;
mod corrected;
pub mod data;
pub mod errata;
pub mod machines;
pub mod model;
mod print;
pub mod table;
mod table_7_1;
pub mod tables;

pub use table::{Cell, Table};
pub use tables::{NAMES, TablesReport, tables};
