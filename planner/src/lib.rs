//! Job readers, paths, profiles, laser timing, sampling.

pub mod drawing;
