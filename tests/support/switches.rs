//! The machine file of a machine that is operated: ball screws with switches, a probe, a door, an interlock and an
//! emergency stop.

#![allow(unreachable_pub)]

/// The ball screws that ship.
const CARTESIAN: &str = include_str!("../../machines/cartesian.toml");

/// Where its switches are, and how its axes look for them.
pub struct Switches {
    /// The reference switch of x, which is its reference.
    pub x_home: &'static str,
    /// The reference switch of y, towards its upper end.
    pub y_home: &'static str,
    /// By what y is homed, from its switch on.
    pub y_method: &'static str,
    /// Where y is at its reference.
    pub y_reference: &'static str,
    /// Where the probe touches, along x.
    pub probe: &'static str,
    /// How fast they look, and how fast they take it.
    pub speeds: [&'static str; 2],
}

impl Switches {
    /// The whole machine file. Its inputs are x_home, x_min, x_max, y_home, y_index, estop, door, chiller, probe.
    pub fn machine(&self) -> String {
        let Self { x_home, y_home, y_method, y_reference, probe, speeds: [speed, latch] } = self;
        format!(
            r#"{CARTESIAN}
[inputs.x_home]
function = "home"
axis = "x"
at = "{x_home}"
[inputs.x_min]
function = "limit"
axis = "x"
side = "lower"
at = "-6 mm"
[inputs.x_max]
function = "limit"
axis = "x"
side = "upper"
at = "206 mm"
[inputs.y_home]
function = "home"
axis = "y"
side = "upper"
at = "{y_home}"
[inputs.y_index]
function = "index"
axis = "y"
at = "0 mm"
[inputs.estop]
function = "estop"
active = "low"
[inputs.door]
function = "door"
[inputs.chiller]
function = "interlock"
[inputs.probe]
function = "probe"
axis = "x"
side = "upper"
at = "{probe}"
[axis.x.homing]
position = "{x_home}"
speed = "{speed}"
latch_speed = "{latch}"
[axis.y.homing]
method = "{y_method}"
direction = "upper"
position = "{y_reference}"
speed = "{speed}"
latch_speed = "{latch}"
order = 1
"#
        )
    }
}
