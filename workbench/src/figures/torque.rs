//! Torque and speed of the motors over a job (source 003 fig. 3-11 to 3-22, 4-7 to 4-18, 5-11 to 5-22, 6-8
//! to 6-19).

use monitor::report::chart::{Chart, Curve, colour, stack};

use super::draw::{RPM, thinned};
use super::{Figure, FigureError, Figures, Name, Subject, SubjectJob, Table};
use crate::operating::{self, AxisCourse, OperatingPoint};

/// Newton metres to millinewton metres.
pub(super) const MILLI: f64 = 1e3;

pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    if subject.jobs.is_empty() {
        figures.skip(Name::Torque, &subject.stem, "the machine names no sample job");
    }
    for job in &subject.jobs {
        match planner::plan(&subject.machine, &job.job) {
            Ok(plan) => {
                let courses = operating::courses(&subject.machine, &plan);
                figures.figures.push(figure(subject, job, &courses)?);
            }
            Err(error) => {
                let of = format!("{} {}", subject.stem, job.stem);
                figures.skip(Name::Torque, &of, error.to_string());
            }
        }
    }
    Ok(())
}

/// The figure of one job; its table has a row a cycle.
pub(super) fn figure(
    subject: &Subject,
    job: &SubjectJob,
    courses: &[AxisCourse],
) -> Result<Figure, FigureError> {
    let kinds = ["speed", "speed_rpm", "torque", "load", "rotor", "friction", "power"];
    let columns =
        courses.iter().flat_map(|course| kinds.map(|kind| format!("{}_{kind}", course.name)));
    let columns = ["t".to_owned()].into_iter().chain(columns).chain(["lit".to_owned()]);
    let stem = match job.source.as_str() {
        "" => format!("torque_{}_{}", subject.stem, job.stem),
        number => format!("torque_{number}_{}", job.stem),
    };
    let mut table = Table::new(stem, columns);
    let cycles = courses.first().map_or(0, |course| course.points.len());
    for cycle in 0..cycles {
        let Some(first) = courses.first().map(|course| course.points[cycle]) else { break };
        let axes = courses.iter().flat_map(|course| {
            let point = course.points[cycle];
            [
                point.speed,
                point.speed * RPM,
                point.torque(),
                point.load,
                point.rotor,
                point.friction,
                point.power(),
            ]
        });
        let lit = f64::from(u8::from(first.is_lit));
        table.numbers([first.time].into_iter().chain(axes).chain([lit]));
    }
    let curves = |of: fn(&OperatingPoint) -> f64| -> Vec<Curve> {
        let curve = |(index, course): (usize, &AxisCourse)| {
            let line = course.points.iter().map(|point| (point.time, of(point))).collect();
            Curve { name: course.name.clone(), colour: colour(index), lines: vec![thinned(line)] }
        };
        courses.iter().enumerate().map(curve).collect()
    };
    let torques = curves(|point| point.torque() * MILLI);
    let loads = curves(|point| point.load * MILLI);
    let speeds = curves(|point| point.speed * RPM);
    let axes = ["time [s]", "torque [mN·m]"];
    let chart = |up, height, curves| Chart {
        title: "torque",
        across: axes[0],
        up,
        height,
        at_least: None,
        curves,
    };
    let charts = [
        chart(axes[1], 280, torques),
        chart("of the load [mN·m]", 220, loads),
        chart("speed [rpm]", 220, speeds),
    ];
    let svg = stack("torque", &charts)?;
    Ok(Figure {
        name: Name::Torque,
        source: job.source.clone(),
        title: format!("{}: torque and speed of the motors, {}", subject.machine.name, job.title),
        caption: "At the motors' shafts: load, rotor and friction together, and below the load by itself, which \
                  is all that the source draws. Speeds are those of the cycle that ends at the instant."
            .to_owned(),
        axes: axes.map(str::to_owned),
        svg,
        table,
        more: Vec::new(),
    })
}
