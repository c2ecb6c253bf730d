//! What a motor gives by its speed, and where a job uses it (source 003 fig. 3-23, 3-24).

use machine::{DcMotor, Motor, StepperMotor};
use monitor::report::chart::{Chart, Curve, colour, stack};

use super::draw::RPM;
use super::torque::MILLI;
use super::{Figure, FigureError, Figures, Name, Subject, Table};
use crate::operating::{self, AxisCourse};
use crate::size::candidate::Candidate;
use crate::size::report::SizeReport;

/// Speeds from standstill to the fastest, both ends included.
const SPEEDS: usize = 201;

pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    // The fastest of the source's letters asks the most: N of 5 cm. Of other machines the only job.
    let job = subject.jobs.iter().find(|job| job.stem == "N5").or_else(|| subject.jobs.first());
    let plan = job.and_then(|job| planner::plan(&subject.machine, &job.job).ok());
    let courses = plan.map(|plan| operating::courses(&subject.machine, &plan));
    for (index, actuator) in subject.machine.actuators.iter().enumerate() {
        let used = courses.as_ref().map(|courses| Use {
            course: &courses[index],
            job: job.map_or("", |job| job.title.as_str()),
        });
        let source = match (subject.chapter.map(|chapter| chapter.number), index) {
            (Some(3), 0) => "3-23",
            (Some(3), 1) => "3-24",
            _ => "",
        };
        let stem = format!("motor_{}_{}", subject.stem, actuator.name);
        let machine = &subject.machine.name;
        let title = format!("{machine}, axis {}: what the motor gives", actuator.name);
        figures.figures.push(figure(stem, source, title, &actuator.motor, used)?);
    }
    Ok(())
}

/// The motors that the machine of a sizing has, and those that it gets, with what the job asks of each.
///
/// # Errors
/// Numbers that cannot be drawn.
pub fn sized(report: &SizeReport) -> Result<Figures, FigureError> {
    let mut figures = Figures::default();
    for axis in &report.axes {
        let pairs = [("now", Some(&axis.present)), ("chosen", axis.judged.as_ref())];
        for (word, pair) in pairs {
            let Some(pair) = pair else { continue };
            let Candidate { name, gear, gear_ratio, motor, .. } = &pair.candidate;
            let gear = match gear {
                Some(gear) => format!("gear {gear}"),
                None => format!("ratio {gear_ratio}"),
            };
            let title = format!("Axis {}, {word}: {name}, {gear}", axis.axis);
            let used = Use { course: &pair.course, job: &report.job };
            let stem = format!("size_{}_{word}", axis.axis);
            figures.figures.push(figure(stem, "", title, motor, Some(used))?);
        }
    }
    Ok(figures)
}

/// What a motor does for a job.
#[derive(Debug, Clone, Copy)]
struct Use<'a> {
    course: &'a AxisCourse,
    /// The job's name.
    job: &'a str,
}

fn figure(
    stem: String,
    source: &str,
    title: String,
    motor: &Motor,
    used: Option<Use<'_>>,
) -> Result<Figure, FigureError> {
    let (table, mut torques, more) = match motor {
        Motor::Dc(motor) => {
            let table = dc(&stem, motor);
            let torques = vec![
                curve("voltage", 0, &table, "torque_voltage", MILLI),
                curve("current", 4, &table, "torque_current", MILLI),
                curve("continuous", 2, &table, "torque_continuous", MILLI),
            ];
            let power = vec![curve("power", 3, &table, "power", 1.0)];
            let efficiency = vec![curve("efficiency", 5, &table, "efficiency", 100.0)];
            (table, torques, vec![("power [W]", power), ("efficiency [%]", efficiency)])
        }
        Motor::Stepper(motor) => {
            let table = stepper(&stem, motor);
            let torques = vec![curve("pull-out", 0, &table, "torque_pull_out", MILLI)];
            let power = vec![curve("power", 3, &table, "power", 1.0)];
            (table, torques, vec![("power [W]", power)])
        }
    };
    let mut points = Table::new(format!("{stem}_points"), ["t", "speed", "torque", "lit"]);
    if let Some(Use { course, .. }) = used {
        for point in &course.points {
            let lit = f64::from(u8::from(point.is_lit));
            points.numbers([point.time, point.speed, point.torque(), lit]);
        }
        torques.push(Curve { name: "job".to_owned(), colour: colour(1), lines: passed(course) });
    }
    let axes = ["speed [rpm]", "torque [mN·m]"];
    let chart = |up, height, curves| Chart {
        title: "motor",
        across: axes[0],
        up,
        height,
        at_least: Some((0.0, 0.0)),
        curves,
    };
    let mut charts = vec![chart(axes[1], 340, torques)];
    charts.extend(more.into_iter().map(|(up, curves)| chart(up, 170, curves)));
    let job = used.map_or(String::new(), |used| format!("; in orange, {}", used.job));
    Ok(Figure {
        name: Name::Motor,
        source: source.to_owned(),
        title,
        caption: format!(
            "The torque that the supply's voltage drives in the steady state, the power stage's largest \
             current, and the current that the winding bears for ever where the file says so{job}. Below \
             zero a motor brakes; efficiency is that of the winding."
        ),
        axes: axes.map(str::to_owned),
        svg: stack("motor", &charts)?,
        table,
        more: if used.is_some() { vec![points] } else { Vec::new() },
    })
}

/// A DC motor from standstill to its speed without load, at its full voltage.
pub(super) fn dc(stem: &str, motor: &DcMotor) -> Table {
    let mut table = Table::new(
        stem,
        [
            "speed",
            "speed_rpm",
            "torque_voltage",
            "torque_current",
            "torque_continuous",
            "current",
            "power",
            "efficiency",
        ],
    );
    for index in 0..SPEEDS {
        let speed = motor.no_load_speed() * index as f64 / (SPEEDS - 1) as f64;
        let current = motor.settled_current(motor.voltage, speed);
        let torque = motor.torque_constant * current;
        let continuous =
            motor.continuous_current.map_or(f64::NAN, |most| motor.torque_constant * most);
        table.numbers([
            speed,
            speed * RPM,
            torque,
            motor.largest_torque(),
            continuous,
            current,
            torque * speed,
            // τ·ω/(V·i), of which i goes out.
            motor.torque_constant * speed / motor.voltage,
        ]);
    }
    table
}

/// A stepper from standstill to its largest pulse rate.
fn stepper(stem: &str, motor: &StepperMotor) -> Table {
    let mut table = Table::new(stem, ["speed", "speed_rpm", "torque_pull_out", "power"]);
    for index in 0..SPEEDS {
        let speed = motor.largest_speed() * index as f64 / (SPEEDS - 1) as f64;
        let torque = motor.pull_out_torque(speed);
        table.numbers([speed, speed * RPM, torque, torque * speed]);
    }
    table
}

fn curve(name: &str, index: usize, table: &Table, column: &str, scale: f64) -> Curve {
    let [x, y] = ["speed_rpm", column].map(|name| table.column(name).unwrap_or_default());
    let line: Vec<(f64, f64)> =
        x.into_iter().zip(y).filter(|(_, y)| y.is_finite()).map(|(x, y)| (x, y * scale)).collect();
    // A limit that the file does not name has no line, and no entry in the legend.
    let name = if line.is_empty() { "" } else { name };
    Curve { name: name.to_owned(), colour: colour(index), lines: vec![line] }
}

/// The way of a job through torque and speed, both turned to positive speed; broken where the motor turns
/// back.
fn passed(course: &AxisCourse) -> Vec<Vec<(f64, f64)>> {
    let same = |one: &_, other: &_| {
        let turns = |point: &operating::OperatingPoint| point.speed >= 0.0;
        turns(one) == turns(other)
    };
    course
        .points
        .chunk_by(same)
        .map(|run| {
            let line = run.iter().map(|point| {
                let side = if point.speed < 0.0 { -1.0 } else { 1.0 };
                (point.speed * side * RPM, point.torque() * side * MILLI)
            });
            line.collect::<Vec<_>>()
        })
        .filter(|line| line.len() > 1)
        .map(sparse)
        .collect()
}

/// A line without the points that lie all but on the one before.
fn sparse(line: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    /// [rpm] and [mN·m]: less than a line is wide.
    const NEAR: (f64, f64) = (4.0, 0.15);
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let last = line.last().copied();
    for point in line {
        let near = kept.last().is_some_and(|before| {
            (point.0 - before.0).abs() < NEAR.0 && (point.1 - before.1).abs() < NEAR.1
        });
        if !near {
            kept.push(point);
        }
    }
    if kept.last() != last.as_ref() {
        kept.extend(last);
    }
    kept
}
