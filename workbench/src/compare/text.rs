//! A comparison as text: a column for each machine.

use core::fmt::Write;

use super::{Comparison, MachineReport};

/// Millimetres and micrometres in a metre, newtons per millimetre.
pub(super) const MILLI: f64 = 1e3;
pub(super) const MICRO: f64 = 1e6;

/// A row of figures, one of each machine.
pub(super) type Row = (&'static str, fn(&MachineReport) -> Option<String>);

fn pair(values: [f64; 2], factor: f64) -> String {
    format!("{:.0} × {:.0}", values[0] * factor, values[1] * factor)
}

fn per_axis(
    machine: &MachineReport,
    value: impl Fn(&super::AxisReport) -> String,
) -> Option<String> {
    let values: Vec<String> = machine.axes.iter().map(value).collect();
    (!values.is_empty()).then(|| values.join(" / "))
}

/// Revolutions per minute in a radian per second.
pub(super) const RPM: f64 = 30.0 / core::f64::consts::PI;

/// The figures that are compared.
pub(super) const ROWS: [Row; 26] = [
    ("rank", |it| it.rank.map(|rank| rank.to_string())),
    ("score, 1 for the best in all", |it| it.score.map(|score| format!("{score:.3}"))),
    ("time [s]", |it| it.time.map(|time| format!("{time:.3}"))),
    ("error of the marks [µm]", |it| it.error_max.map(|error| format!("{:.1}", error * MICRO))),
    ("  root mean square [µm]", |it| it.error_rms.map(|error| format!("{:.2}", error * MICRO))),
    ("  tracking [µm]", |it| it.tracking_max.map(|error| format!("{:.1}", error * MICRO))),
    ("error on other plants, median [µm]", |it| {
        let error = it.mismatch.as_ref()?.error_median?;
        Some(format!("{:.0}", error * MICRO))
    }),
    ("  largest [µm] / runs with a fault", |it| {
        let mismatch = it.mismatch.as_ref()?;
        let largest =
            mismatch.error_max.map_or("–".to_owned(), |it| format!("{:.0}", it * MICRO));
        Some(format!("{largest} / {}", mismatch.faults))
    }),
    ("motor speed [rpm]", |it| per_axis(it, |axis| format!("{:.0}", axis.demand.speed_peak * RPM))),
    ("motor torque [mN·m]", |it| {
        per_axis(it, |axis| format!("{:.1}", axis.demand.torque_peak * MILLI))
    }),
    ("  of the load", |it| per_axis(it, |axis| format!("{:.1}", axis.demand.load_peak * MILLI))),
    ("  of the rotor", |it| per_axis(it, |axis| format!("{:.1}", axis.demand.rotor_peak * MILLI))),
    ("  root mean square", |it| {
        per_axis(it, |axis| format!("{:.1}", axis.demand.torque_rms * MILLI))
    }),
    ("motor power [W]", |it| per_axis(it, |axis| format!("{:.2}", axis.demand.power_peak))),
    ("energy taken / given back [J]", |it| {
        let sum = |value: fn(&super::AxisReport) -> f64| it.axes.iter().map(value).sum::<f64>();
        let [taken, given] = [sum(|axis| axis.demand.energy), sum(|axis| axis.demand.regenerated)];
        (!it.axes.is_empty()).then(|| format!("{taken:.1} / {given:.2}"))
    }),
    ("largest use of a limit [%]", |it| it.utilisation.map(|it| format!("{:.0}", it * 100.0))),
    ("bound by", |it| {
        let first = it.binding.first()?;
        let axis = first.axis.as_ref().map_or_else(String::new, |axis| format!(" of {axis}"));
        Some(format!("{}{axis}, {:.0} %", first.limit, first.share * 100.0))
    }),
    ("moving mass [kg]", |it| Some(format!("{:.3}", it.mechanics.moving_mass))),
    ("mass felt at the tool [kg]", |it| {
        let [least, most] = it.mechanics.effective_mass?;
        Some(format!("{least:.2} to {most:.2}"))
    }),
    ("footprint of joints and tool [mm]", |it| Some(pair(it.mechanics.footprint?, MILLI))),
    ("area reached [mm]", |it| Some(pair(it.mechanics.area, MILLI))),
    ("  largest rectangle [mm]", |it| {
        Some(pair(it.mechanics.rectangle?.map(|[from, to]| to - from), MILLI))
    }),
    ("stiffness at the tool, least [N/mm]", |it| {
        Some(format!("{:.1}", it.mechanics.stiffness.as_ref()?.least / MILLI))
    }),
    ("first mode at home / least [Hz]", |it| {
        let modes = it.mechanics.modes.as_ref()?;
        Some(format!("{:.1} / {:.1}", modes.home.first()?, modes.least))
    }),
    ("isotropy at home / least", |it| {
        let figures = it.mechanics.manipulability.as_ref()?;
        Some(format!("{:.2} / {:.2}", figures.isotropy_home, figures.isotropy_least))
    }),
    ("manipulability at home / least", |it| {
        let figures = it.mechanics.manipulability.as_ref()?;
        Some(format!("{:.4} / {:.4}", figures.home, figures.least))
    }),
];

impl Comparison {
    /// For a terminal.
    pub fn text(&self) -> String {
        let machines: Vec<&MachineReport> = self.machines.iter().collect();
        let mut lines: Vec<Vec<String>> =
            vec![machines.iter().map(|machine| machine.name.clone()).collect()];
        let mut names = vec![String::new()];
        for (name, value) in ROWS {
            names.push(name.to_owned());
            let values = machines.iter().map(|machine| value(machine).unwrap_or("–".to_owned()));
            lines.push(values.collect());
        }
        let first = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..machines.len())
            .map(|column| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0))
            .collect();
        let mut text = format!("jobs  {}\n\n", self.jobs.join(", "));
        for (name, line) in names.iter().zip(&lines) {
            let _ = write!(text, "{name:first$}");
            for (entry, width) in line.iter().zip(&widths) {
                let _ = write!(text, "  {entry:>width$}");
            }
            text.push('\n');
        }
        for machine in machines {
            if let Some(reason) = &machine.refused {
                let _ = writeln!(text, "\n{} is refused: {reason}", machine.name);
            }
        }
        text
    }

    /// The figures as comma-separated values, in SI units: a row for each machine.
    pub fn csv(&self) -> String {
        let mut text = "machine,mechanism,rank,score,time,error_max,error_rms,tracking_max,\
                        mismatch_error_median,mismatch_error_max,utilisation,moving_mass,\
                        footprint_x,footprint_y,area_x,area_y,reached,stiffness_least,\
                        mode_least,isotropy_home,isotropy_least\n"
            .to_owned();
        let plain = |value: Option<f64>| value.map_or_else(String::new, |it| it.to_string());
        for machine in &self.machines {
            let figures = &machine.mechanics;
            let mismatch = machine.mismatch.as_ref();
            let even = figures.manipulability.as_ref();
            let fields = [
                machine.name.replace([',', '"'], " "),
                machine.mechanism.clone(),
                plain(machine.rank.map(f64::from)),
                plain(machine.score),
                plain(machine.time),
                plain(machine.error_max),
                plain(machine.error_rms),
                plain(machine.tracking_max),
                plain(mismatch.and_then(|it| it.error_median)),
                plain(mismatch.and_then(|it| it.error_max)),
                plain(machine.utilisation),
                plain(Some(figures.moving_mass)),
                plain(figures.footprint.map(|it| it[0])),
                plain(figures.footprint.map(|it| it[1])),
                plain(Some(figures.area[0])),
                plain(Some(figures.area[1])),
                plain(Some(figures.reached)),
                plain(figures.stiffness.as_ref().map(|it| it.least)),
                plain(figures.modes.as_ref().map(|it| it.least)),
                plain(even.map(|it| it.isotropy_home)),
                plain(even.map(|it| it.isotropy_least)),
            ];
            text += &fields.join(",");
            text.push('\n');
        }
        text
    }
}
