//! The catalogues that are part of the build.

/// The catalogues that are part of the build, each by its name and text.
pub const BUILTIN: [(&str, &str); 5] = [
    ("thesis", include_str!("../../../catalogues/thesis.toml")),
    ("dc", include_str!("../../../catalogues/dc.toml")),
    ("bldc", include_str!("../../../catalogues/bldc.toml")),
    ("steppers", include_str!("../../../catalogues/steppers.toml")),
    ("gears", include_str!("../../../catalogues/gears.toml")),
];
