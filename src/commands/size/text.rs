//! What was found, for a person.

use crate::output::say;
use workbench::size::checks::Use;
use workbench::size::report::{AxisSize, Drive, SizeReport};

/// Prints it on standard error; `is_to_write` says whether a machine file was asked for.
pub(super) fn print(report: &SizeReport, is_to_write: bool) {
    say!("job       {} on {}", report.job, report.machine);
    say!("margin    {:.2} of every need, in air of {:.0} °C", report.margin, report.ambient);
    report.axes.iter().for_each(axis);
    supply(report);
    confirmation(report);
    if let Some(page) = &report.pictures {
        say!("pictures  {page}");
    }
    match &report.written {
        Some(written) => say!("written   {written}"),
        None if is_to_write => {
            say!("written   nothing: not every axis has a motor that was confirmed")
        }
        None => {}
    }
}

fn axis(axis: &AxisSize) {
    let need = &axis.need.demand;
    say!(
        "axis {:<4} needs {:.1} mN·m ({:.1} load, {:.1} rotor, {:.1} friction; {:.1} by efficiency), \
         {:.1} mN·m rms, {:.0} rpm, {:.1} W",
        axis.axis,
        need.torque_peak * 1e3,
        need.load_peak * 1e3,
        need.rotor_peak * 1e3,
        need.friction_peak * 1e3,
        need.by_efficiency_peak * 1e3,
        need.torque_rms * 1e3,
        rpm(need.speed_peak),
        need.power_peak
    );
    // A stepper's current is its driver's, whatever the load.
    let current = match need.current_rms {
        0.0 => String::new(),
        current => format!("{current:.2} A rms, "),
    };
    say!(
        "          {current}{:.1} J taken and {:.2} J given back in {:.2} s, moving for {:.0} % of it",
        need.energy,
        need.regenerated,
        need.time,
        need.duty * 100.0
    );
    if let Some(belt) = &axis.belt {
        say!(
            "          belt {:.1} N: preload {:.1} N, {:.1} N in the tight strand, {:.1} N in the slack one",
            belt.force,
            belt.preload,
            belt.tight,
            belt.slack
        );
    }
    if let Some(screw) = &axis.screw {
        say!(
            "          screw whips at {:.0} rpm, has {:.3e} kg·m²",
            rpm(screw.critical_speed),
            screw.inertia
        );
    }
    drive("  now   ", &axis.now);
    match &axis.chosen {
        Some(chosen) => drive("  chosen", chosen),
        None if axis.is_asked && axis.candidates == 0 => {
            say!("  none    the catalogue has no {}", axis.kind);
        }
        None if axis.is_asked => {
            say!("  none    no motor of the catalogue does it");
            for rejected in axis.rejected.iter().take(3) {
                let gear = rejected.gear.as_ref().map(|gear| format!(" with {gear}"));
                say!(
                    "          {}{}: {} {:.0} %",
                    rejected.motor,
                    gear.unwrap_or_default(),
                    rejected.check,
                    rejected.share * 100.0
                );
            }
        }
        None => {}
    }
}

fn drive(what: &str, drive: &Drive) {
    let gear = match &drive.gear {
        Some(gear) => format!(", gear {gear}"),
        None if drive.gear_ratio == 1.0 => ", no gear".to_owned(),
        None => format!(", ratio {}", drive.gear_ratio),
    };
    let mass = drive.mass.map(|mass| format!(", {:.0} g", mass * 1e3)).unwrap_or_default();
    let warm = drive.temperature.map(|warm| format!(", winding {warm:.0} °C")).unwrap_or_default();
    say!("{what}  {}{gear}{mass}, {:.1} W{warm}", drive.motor, drive.rated_power);
    let mut uses: Vec<&Use> = drive.uses.iter().collect();
    uses.sort_by(|one, other| other.share.total_cmp(&one.share));
    let told: Vec<String> = uses
        .iter()
        .map(|it| format!("{} {:.0} %", it.check.replace('_', " "), it.share * 100.0))
        .collect();
    say!("          {}", told.join(", "));
    drive.sources.iter().for_each(|source| say!("          source: {source}"));
}

fn supply(report: &SizeReport) {
    let supply = &report.supply;
    match (supply.voltage, supply.max_voltage) {
        (Some(voltage), Some(most)) => say!(
            "supply    up to {:.2} J come back at one time: {voltage:.1} V of at most {most:.1} V",
            supply.surplus
        ),
        _ => say!("supply    up to {:.2} J come back at one time", supply.surplus),
    }
}

fn confirmation(report: &SizeReport) {
    let Some(confirmation) = &report.confirmation else { return };
    let error = confirmation.error.map(|error| format!(", marks within {:.1} µm", error * 1e6));
    let error = error.unwrap_or_default();
    match &confirmation.because {
        None => say!(
            "confirmed planned with these motors it takes {:.3} s, {:.3} s without their limits{error}",
            confirmation.time.unwrap_or_default(),
            confirmation.time_asked
        ),
        Some(because) => say!("not right {because}{error}"),
    }
}

fn rpm(speed: f64) -> f64 {
    speed * 30.0 / core::f64::consts::PI
}
