//! A fault in words: what was found, with its quantity and unit, and the limit that it broke.
//!
//! A [`Fault`] carries two numbers whose meaning its code gives, and 0 where it has none; whether
//! there is a limit is a matter of the code and never of the number.

use machine::{Axis, JointUnit};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use signals::{Fault, FaultCode};

/// A fault as summaries tell it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FaultSummary {
    /// The code, such as `following_error`.
    pub code: String,
    /// The axis by name; null when it belongs to none.
    pub axis: Option<String>,
    /// What was found, with value, unit and limit.
    pub detail: String,
}

impl FaultSummary {
    /// The summary of a fault of a machine with these axes; `None` when there is none.
    pub fn of(fault: &Fault, axes: &[Axis]) -> Option<Self> {
        let axis = (fault.axis as usize).checked_sub(1).and_then(|index| axes.get(index));
        fault.is_some().then(|| Self {
            code: fault.code().name().to_owned(),
            axis: axis.map(|axis| axis.name.clone()),
            detail: detail(fault, axis),
        })
    }
}

fn detail(fault: &Fault, axis: Option<&Axis>) -> String {
    let Fault { value, limit, .. } = *fault;
    let joint = |value: f64| joint(value, axis);
    match fault.code() {
        FaultCode::None => String::new(),
        FaultCode::FollowingError => {
            format!("following error {}, limit {}", joint(value), joint(limit))
        }
        FaultCode::PositionLimit => {
            format!("measured position {}, soft limit {}", joint(value), joint(limit))
        }
        // Position, velocity, acceleration, jerk, a jump between two setpoints, or torque.
        FaultCode::SetpointLimit if axis.is_some() => {
            format!("a planned value of {value:.6}, limit {limit:.6}, in SI units of the joint")
        }
        FaultCode::SetpointLimit if limit == 0.0 => {
            format!("setpoint {value:.0} is lit where the stream rests")
        }
        FaultCode::SetpointLimit => {
            format!("{value:.0} gate edges in one cycle, limit {limit:.0}")
        }
        FaultCode::NotFinite if axis.is_none() => {
            format!(
                "setpoint {value:.0} has a number that is not finite, or an impossible laser cycle"
            )
        }
        FaultCode::NotFinite if value.is_finite() => {
            "a measured velocity or current is not finite".to_owned()
        }
        FaultCode::NotFinite => format!("a number of the axis is {value}"),
        FaultCode::StaleFeedback if value == 0.0 => "feedback did not go on".to_owned(),
        FaultCode::StaleFeedback if value <= limit => {
            "feedback came of another run of drives".to_owned()
        }
        FaultCode::StaleFeedback => {
            format!("feedback skipped to the {value:.0}th cycle after the last, limit {limit:.0}")
        }
        FaultCode::StreamStarved => format!("no setpoints after {value:.3} s of the stream"),
        FaultCode::StreamBroken => {
            format!("setpoint {value:.0} came where setpoint {limit:.0} was due")
        }
        FaultCode::Overrun => format!("{value:.0} late cycles in a row, limit {limit:.0}"),
        FaultCode::StaleCommand => {
            format!("{value:.0} late or missing commands, limit {limit:.0}")
        }
        FaultCode::PlannerLost => ended("planner"),
        FaultCode::ControllerLost => ended("controller"),
        FaultCode::DrivesLost => ended("drives"),
        FaultCode::SupervisorLost => ended("supervisor"),
        // The port's own quantity.
        FaultCode::DriveFault if value == 0.0 && limit == 0.0 => {
            "the drives or the motors refuse".to_owned()
        }
        FaultCode::DriveFault => {
            format!("the drives or the motors refuse: {value:.6}, limit {limit:.6}")
        }
        FaultCode::Overload => {
            format!("motor current {value:.3} A for too long, continuous limit {limit:.3} A")
        }
        FaultCode::StreamStart => {
            format!("{} from where the stream starts, limit {}", joint(value), joint(limit))
        }
    }
}

fn ended(process: &str) -> String {
    format!("the {process} process died or left")
}

/// A place or distance of a joint [m or rad].
fn joint(value: f64, axis: Option<&Axis>) -> String {
    match axis.map(|axis| axis.unit) {
        Some(JointUnit::Length) => format!("{:.4} mm", value * 1e3),
        Some(JointUnit::Angle) => format!("{value:.6} rad"),
        None => format!("{value:.6} m or rad"),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use machine::Machine;

    /// A CoreXY, whose joints are belts, with the second made to turn.
    fn axes() -> Vec<Axis> {
        let mut axes = Machine::builtin().axes;
        axes[1].unit = JointUnit::Angle;
        axes
    }

    fn check(code: FaultCode, axis: u32, value: f64, limit: f64, expect: &str) {
        let fault = Fault { code: code as u32, axis, value, limit, ..Fault::default() };
        let summary = FaultSummary::of(&fault, &axes()).unwrap();
        assert_eq!(summary.detail, expect);
        assert_eq!(summary.code, code.name());
    }

    #[test]
    fn quantity_and_unit_follow_from_the_code_and_the_axis() {
        use FaultCode::*;
        check(FollowingError, 1, 2.1e-3, 2e-3, "following error 2.1000 mm, limit 2.0000 mm");
        check(FollowingError, 2, 0.0125, 0.01, "following error 0.012500 rad, limit 0.010000 rad");
        check(
            StreamStart,
            1,
            3e-5,
            1e-5,
            "0.0300 mm from where the stream starts, limit 0.0100 mm",
        );
        check(
            Overload,
            1,
            1.25,
            1.0,
            "motor current 1.250 A for too long, continuous limit 1.000 A",
        );
        check(StreamStarved, 0, 1.5, 0.0, "no setpoints after 1.500 s of the stream");
        check(StreamBroken, 0, 12.0, 10.0, "setpoint 12 came where setpoint 10 was due");
        check(Overrun, 0, 4.0, 3.0, "4 late cycles in a row, limit 3");
        check(StaleCommand, 0, 3.0, 3.0, "3 late or missing commands, limit 3");
        let planned = "a planned value of 0.300000, limit 0.200000, in SI units of the joint";
        check(SetpointLimit, 1, 0.3, 0.2, planned);
        check(SetpointLimit, 0, 9.0, 8.0, "9 gate edges in one cycle, limit 8");
    }

    #[test]
    fn a_limit_of_zero_is_a_limit() {
        let expect = "measured position -1.5000 mm, soft limit 0.0000 mm";
        check(FaultCode::PositionLimit, 1, -1.5e-3, 0.0, expect);
    }

    #[test]
    fn what_has_no_number_names_none() {
        use FaultCode::{DriveFault, NotFinite, PlannerLost, StaleFeedback};
        check(PlannerLost, 0, 0.0, 0.0, "the planner process died or left");
        check(DriveFault, 0, 0.0, 0.0, "the drives or the motors refuse");
        check(NotFinite, 1, f64::NAN, 0.0, "a number of the axis is NaN");
        check(NotFinite, 1, 0.5, 0.0, "a measured velocity or current is not finite");
        check(StaleFeedback, 0, 0.0, 3.0, "feedback did not go on");
        check(StaleFeedback, 0, 1.0, 3.0, "feedback came of another run of drives");
        assert_eq!(FaultSummary::of(&Fault::default(), &axes()), None);
    }

    #[test]
    fn a_fault_names_its_axis() {
        let on = |axis| {
            let code = FaultCode::FollowingError as u32;
            FaultSummary::of(&Fault { code, axis, ..Fault::default() }, &axes()).unwrap().axis
        };
        assert_eq!(on(2), Some(axes()[1].name.clone()));
        assert_eq!((on(0), on(8)), (None, None));
    }
}
