//! The report for a person.

use super::axes::{AxisReport, Unit};
use super::job::{JobReport, MotorUse};
use super::{CheckReport, CheckWarning};
use crate::output::say;
use monitor::summary::{DrivesSummary, MachineSummary};
use workbench::reach::{Obstacle, ReachReport};

/// Prints it on standard error.
pub(super) fn print(report: &CheckReport) {
    let MachineSummary { name, mechanism, .. } = &report.machine;
    say!("machine   {name} ({mechanism})");
    for axis in &report.axes {
        say!("{}", axis_line(axis));
        say!("{}", transmission_line(axis));
    }
    drives(report);
    reach(&report.reach);
    report.warnings.iter().for_each(warning);
    match &report.job {
        Some(found) => job(found),
        None => {
            if let Some(sample) = &report.sample_job {
                say!("sample    {sample}, not checked: name it to check it too");
            }
            say!("the machine file is sound");
        }
    }
}

fn axis_line(axis: &AxisReport) -> String {
    let (name, torque) = (&axis.name, axis.stall_torque * 1e3);
    let (speed, most) = (axis.velocity, axis.no_load_velocity);
    let range = range(axis);
    match axis.unit {
        Unit::Metre => format!(
            "axis {name:<4} {range}, {speed:.3} of {most:.3} m/s, {torque:.1} mN·m at standstill, \
             {:.2} µm a count",
            axis.resolution * 1e6
        ),
        Unit::Radian => format!(
            "axis {name:<4} {range}, {speed:.3} of {most:.3} rad/s, {torque:.1} mN·m at \
             standstill, {:.5}° a count",
            axis.resolution.to_degrees()
        ),
    }
}

/// What the gear bears, and what its motor brings to the joint.
fn transmission_line(axis: &AxisReport) -> String {
    let effort = axis.stall_effort;
    let (effort, play) = match axis.unit {
        Unit::Metre => (format!("{effort:.1} N"), format!("{:.1} µm", axis.backlash * 1e6)),
        Unit::Radian => (format!("{effort:.3} N·m"), format!("{:.4}°", axis.backlash.to_degrees())),
    };
    let load = match (axis.inertia_ratio, axis.load_class) {
        (Some(ratio), Some(class)) => {
            format!(", load of {ratio:.2} rotor inertias ({})", class.name())
        }
        _ => String::new(),
    };
    let play = if axis.backlash > 0.0 { format!(", backlash {play}") } else { String::new() };
    format!("          {effort} at the joint from standstill{load}{play}")
}

/// The soft limits, in millimetres or degrees.
fn range(axis: &AxisReport) -> String {
    let shown = |limit: f64| match axis.unit {
        Unit::Metre => format!("{:.1}", limit * 1e3),
        Unit::Radian => format!("{:.1}", limit.to_degrees()),
    };
    let unit = match axis.unit {
        Unit::Metre => " mm",
        Unit::Radian => "°",
    };
    match axis.position {
        [Some(lower), Some(upper)] => format!("{} to {}{unit}", shown(lower), shown(upper)),
        [Some(lower), None] => format!("from {}{unit}", shown(lower)),
        [None, Some(upper)] => format!("up to {}{unit}", shown(upper)),
        [None, None] => "unlimited".to_owned(),
    }
}

/// The port, and what is said of each actuator's drive and of the gate.
fn drives(report: &CheckReport) {
    let DrivesSummary { port, mode, latency, gate_latency, .. } = &report.drives;
    say!("drives    {port}");
    for ((name, mode), latency) in report.machine.actuators.iter().zip(mode).zip(latency) {
        let latency = latency * 1e6;
        say!("          {name} follows a {mode}, {latency:.1} µs after the deadline");
    }
    say!("          the gate follows {:.1} µs after the deadline", gate_latency * 1e6);
}

fn reach(reach: &ReachReport) {
    let percent = |share: f64| share * 100.0;
    say!(
        "reach     {:.1} % of the area at z {:.1} mm and home's attitude, {:.1} % singular",
        percent(reach.reached),
        reach.height * 1e3,
        percent(reach.singular)
    );
    if let Some(bounds) = &reach.bounds {
        let [x, y] = [bounds.x, bounds.y].map(|range| range.map(|at| at * 1e3));
        say!("reached   x {:.1} to {:.1} mm, y {:.1} to {:.1} mm", x[0], x[1], y[0], y[1]);
    }
    if let Some(error) = reach.count_error {
        let error = error * 1e6;
        say!("counts    half a count on each axis puts the tool off by up to {error:.1} µm");
    }
    for margin in &reach.margins {
        let [x, y, _] = margin.position.map(|at| at * 1e3);
        say!(
            "margin    {} {:.4} of at least {:.4}, at x {x:.1} mm, y {y:.1} mm",
            margin.name,
            margin.value,
            margin.limit
        );
    }
    for Obstacle { code, axis, share } in &reach.refusals {
        let axis = axis.as_ref().map(|axis| format!(" of axis {axis}")).unwrap_or_default();
        say!("refused   {:.1} % of the area: {code}{axis}", percent(*share));
    }
}

fn warning(warning: &CheckWarning) {
    match warning.line {
        0 => say!("warning   {}", warning.message),
        line => say!("warning   line {line}, column {}: {}", warning.column, warning.message),
    }
}

fn job(job: &JobReport) {
    let facts = &job.facts;
    say!("job       {}: {} strokes, {:.3} s", facts.name, facts.strokes, facts.duration);
    job.motors.iter().for_each(|motor| say!("{}", motor_line(motor)));
    say!(
        "path      acceleration {:.0} %, jerk {:.0} %",
        facts.uses.path_acceleration * 100.0,
        facts.uses.path_jerk * 100.0
    );
    for margin in &job.margins {
        let place = match margin.stroke {
            0 => String::new(),
            stroke => format!(", stroke {stroke}"),
        };
        say!(
            "nearest   {} {:.4} against a limit of {:.4}, at {:.3} s{place}",
            margin.name,
            margin.value,
            margin.limit,
            margin.time
        );
    }
    for note in &facts.notes {
        say!("note      line {}: {}", note.line, note.text);
    }
    say!("the machine file is sound, and the machine can do the job");
}

fn motor_line(motor: &MotorUse) -> String {
    let mut line = format!("motor {:<3} speed {:.0} %", motor.axis, motor.speed * 100.0);
    let torque = if motor.pulse_rate.is_some() { "pull-out torque" } else { "current" };
    for (name, share) in [
        (torque, Some(motor.torque)),
        ("torque by efficiency", Some(motor.sizing)),
        ("voltage", motor.voltage),
        ("heat", motor.heat),
        ("pulse rate", motor.pulse_rate),
    ] {
        if let Some(share) = share {
            line += &format!(", {name} {:.0} %", share * 100.0);
        }
    }
    line
}
