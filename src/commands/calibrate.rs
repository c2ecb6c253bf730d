//! `graver calibrate`: leg lengths and mounting of a tri-planar platform from measured poses.

use crate::arguments::{CalibrateArguments, CalibratePart};
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::inputs::{self, Overrides};
use crate::output::{self, say};
use machine::Machine;
use workbench::calibrate::{self, CalibrationReport, Fit, Identified, Part, write};

/// Runs the command.
///
/// # Errors
/// A machine or measurements that do not hold, or a machine file that cannot be written.
pub fn run(arguments: &CalibrateArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    if arguments.out.is_some() && !Overrides::sort(&arguments.machine.set)?.machine.is_empty() {
        return Err(Failure::bad_input(
            "--out does not write the changes that --set makes to the machine: change the machine file \
             instead",
        ));
    }
    let file = arguments.measurements.display().to_string();
    let text = std::fs::read_to_string(&arguments.measurements)
        .map_err(|error| Failure::bad_input(format!("{file}: cannot be read: {error}")))?;
    let free = parts(&arguments.free);
    let measurements = calibrate::read(&file, &text).map_err(Failure::bad_input)?;
    let mut report = calibrate::calibrate(&input.machine, &file, &measurements, &free)
        .map_err(Failure::bad_input)?;
    if let Some(out) = &arguments.out {
        let (_, text) = input.source.file();
        let written = write::machine_file(text, &report, &free).map_err(Failure::bad_input)?;
        // What is written must be sound.
        let moved = super::size::moved(&input, &written, out)?;
        Machine::parse(&out.display().to_string(), &moved, &[])?;
        let sources = [arguments.measurements.clone()];
        let mut sources = Sources::new(arguments.machine.machine.as_deref(), &sources);
        super::size::write_machine(&input, &written, out, &mut sources)?;
        report.written = Some(out.display().to_string());
    }
    if arguments.json {
        output::json(&report)?;
    } else {
        print(&report);
    }
    Ok(Exit::Done)
}

/// What is asked for, each once and in one order.
fn parts(free: &[CalibratePart]) -> Vec<Part> {
    [
        (CalibratePart::Legs, Part::Legs),
        (CalibratePart::Base, Part::Base),
        (CalibratePart::Tool, Part::Tool),
    ]
    .into_iter()
    .filter(|(asked, _)| free.contains(asked))
    .map(|(_, part)| part)
    .collect()
}

/// Prints it on standard error.
fn print(report: &CalibrationReport) {
    say!(
        "machine   {}, {} poses, {} of {} numbers are determined",
        report.machine,
        report.poses,
        report.rank,
        report.unknowns
    );
    fit("before", &report.before);
    fit("after", &report.after);
    report.numbers.iter().for_each(number);
    for direction in &report.open {
        let shares: Vec<String> =
            direction.iter().map(|share| format!("{:+.2} {}", share.part, share.name)).collect();
        let combination = shares.join(" ");
        say!(
            "open      {combination}: these poses do not determine it; the file's values are kept"
        );
        say!("          measure poses at other heights and other angles to determine it");
    }
    if let Some(written) = &report.written {
        say!("written   {written}");
    }
}

fn fit(name: &str, fit: &Fit) {
    let Fit { rms, max, line } = fit;
    say!("{name:<9} {:.2} µm rms, {:.2} µm at most, in line {line}", rms * 1e6, max * 1e6);
}

fn number(number: &Identified) {
    let Identified { name, unit, value, deviation, .. } = number;
    let (scale, unit, small) = match *unit {
        "rad" => (1e3, "mrad", "µrad"),
        _ => (1e3, "mm", "µm"),
    };
    let change = number.change() * 1e6;
    let sure = match deviation {
        Some(deviation) => format!("± {:.2} {small}", deviation * 1e6),
        None => "not determined by these poses".to_owned(),
    };
    say!("{name:<13} {:>12.5} {unit}, {change:+.2} {small} ({sure})", value * scale);
}
