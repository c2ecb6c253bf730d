//! Tests of whole laws.

#![allow(clippy::unwrap_used)]

mod extremes;
mod jets;
mod motor;
mod moving;
mod path;
mod quality;
mod shape;
