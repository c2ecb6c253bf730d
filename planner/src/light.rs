//! The light: how its power goes with the motion.

pub(crate) mod exposure;

/// How light and speed go together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Policy {
    /// One speed while the light is on: the tool comes up to it in the dark and slows down in the
    /// dark.
    Constant,
    /// The light is on from rest to rest, its power in proportion to the speed.
    Proportional,
}

machine::keyword! {
    Policy, "a policy of the light",
    "constant" => Self::Constant,
    "proportional" => Self::Proportional,
}
