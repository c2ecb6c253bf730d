//! What path, joints, motors and laser allow at a place: every limit as a row of the time law.

pub(crate) mod along;
pub(crate) mod limit_id;
pub(crate) mod local;
pub(crate) mod motion_limits;
pub(crate) mod motor_rows;
pub(crate) mod tightening;
