//! Pictures of a comparison.

use machine::Machine;
use machine::kinematics::KinematicsError;
use messages::artwork::Artwork;
use monitor::report::PictureError;
use monitor::report::chart::{FINE, colour, draw, frame, legend, short, styled};
use monitor::report::workspace::{Ground, Workspace};
use plotters::prelude::*;
use std::collections::BTreeSet;

use super::job::Run;
use super::ranking::CRITERIA;
use super::text::{MILLI, RPM};
use super::{Comparison, MachineReport};
use crate::reach::{self, survey};

/// Height of a chart, in page units.
const HEIGHT: u32 = 300;

/// Speeds at which the limit of a motor is drawn.
const LIMIT_POINTS: usize = 60;

/// What of a machine only pictures need.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawn {
    area: [[f64; 2]; 2],
    home: [f64; 2],
    ground: Vec<Ground>,
    /// What the first job marks.
    artwork: Option<Artwork>,
    motors: Vec<MotorDrawn>,
}

#[derive(Debug, Clone, PartialEq)]
struct MotorDrawn {
    name: String,
    /// Speed [rad/s] and torque [N·m].
    points: Vec<[f64; 2]>,
    /// The largest torque over speed.
    limit: Vec<[f64; 2]>,
}

impl Drawn {
    /// What is drawn of `machine` and its `runs`.
    ///
    /// # Errors
    /// Where its mechanism has no solution at home.
    pub(super) fn of(machine: &Machine, runs: &[Run]) -> Result<Self, KinematicsError> {
        let [lower, upper] = [machine.area.lower, machine.area.upper];
        let motor = |(index, actuator): (usize, &machine::Actuator)| {
            let points = runs.iter().filter_map(|run| run.points.get(index)).flatten();
            let fastest = actuator.motor.largest_speed();
            let limit = (0..=LIMIT_POINTS).map(|step| {
                let speed = fastest * step as f64 / LIMIT_POINTS as f64;
                [speed, actuator.motor.largest_torque(speed)]
            });
            MotorDrawn {
                name: actuator.name.clone(),
                points: points.copied().collect(),
                limit: limit.filter(|point| point.iter().all(|it| it.is_finite())).collect(),
            }
        };
        Ok(Self {
            area: [[lower[0], upper[0]], [lower[1], upper[1]]],
            home: [machine.home[0], machine.home[1]],
            ground: survey(machine)?.ground,
            artwork: runs.first().map(|run| run.artwork.clone()),
            motors: machine.actuators.iter().enumerate().map(motor).collect(),
        })
    }

    /// What is reached, and the first job on it.
    pub(super) fn area(&self) -> Result<String, PictureError> {
        let workspace = Workspace {
            area: self.area,
            columns: reach::GRID,
            ground: &self.ground,
            home: self.home,
            artwork: self.artwork.as_ref(),
        };
        workspace.picture()
    }

    /// Speed and torque of each motor over all jobs, within what it can give.
    pub(super) fn motors(&self) -> Result<String, PictureError> {
        let scaled = |[speed, torque]: [f64; 2]| (speed.abs() * RPM, torque.abs() * MILLI);
        let all = || self.motors.iter().flat_map(|it| it.points.iter().chain(&it.limit));
        let most = all()
            .map(|point| scaled(*point))
            .fold((1e-9_f64, 1e-9_f64), |most, point| (most.0.max(point.0), most.1.max(point.1)));
        draw("motors", HEIGHT, |area| {
            let mut chart =
                frame(area).build_cartesian_2d(0.0..1.05 * most.0, 0.0..1.08 * most.1)?;
            styled(
                chart
                    .configure_mesh()
                    .x_desc("speed [rpm]")
                    .y_desc("torque [mN·m]")
                    .x_label_formatter(&short)
                    .y_label_formatter(&short),
            )
            .draw()?;
            for (index, motor) in self.motors.iter().enumerate() {
                let dot = colour(index).mix(0.5).filled();
                let points = thinned(motor.points.iter().map(|point| scaled(*point)), most);
                chart.draw_series(points.into_iter().map(|at| Circle::new(at, FINE, dot)))?;
                let line = motor.limit.iter().map(|point| scaled(*point));
                chart.draw_series(LineSeries::new(line, colour(index).stroke_width(FINE + 1)))?;
            }
            let entries: Vec<_> = (self.motors.iter().enumerate())
                .map(|(index, it)| (it.name.as_str(), colour(index).stroke_width(2 * FINE)))
                .collect();
            legend(area, &entries)
        })
    }
}

/// Points that can be told apart in a chart up to `most`: one of those that fall together.
fn thinned(points: impl Iterator<Item = (f64, f64)>, most: (f64, f64)) -> Vec<(f64, f64)> {
    /// Places along either axis that can be told apart.
    const PLACES: [f64; 2] = [240.0, 80.0];
    let place = |(x, y): (f64, f64)| {
        ((x / most.0 * PLACES[0]).round() as i64, (y / most.1 * PLACES[1]).round() as i64)
    };
    let mut seen = BTreeSet::new();
    points.filter(|point| seen.insert(place(*point))).collect()
}

/// A group of bars for each name, a bar for each machine.
fn bars(
    title: &str,
    up: &str,
    groups: &[String],
    machines: &[&MachineReport],
    value: impl Fn(usize, &MachineReport) -> Option<f64>,
) -> Result<String, PictureError> {
    let value = &value;
    let all = || (0..groups.len()).flat_map(|group| machines.iter().map(move |it| (group, *it)));
    let most = all().filter_map(|(group, it)| value(group, it)).fold(1e-12, f64::max);
    let name = |at: &f64| {
        let is_middle = (at - at.floor() - 0.5).abs() < 0.01;
        let found = groups.get(at.floor() as usize).filter(|_| is_middle);
        found.cloned().unwrap_or_default()
    };
    draw(title, HEIGHT, |area| {
        let mut chart =
            frame(area).build_cartesian_2d(0.0..groups.len() as f64, 0.0..1.08 * most)?;
        styled(
            chart
                .configure_mesh()
                .disable_x_mesh()
                .y_desc(up)
                .x_labels(2 * groups.len() + 1)
                .x_label_formatter(&name)
                .y_label_formatter(&short),
        )
        .draw()?;
        let width = 0.8 / machines.len().max(1) as f64;
        for (index, machine) in machines.iter().enumerate() {
            for group in 0..groups.len() {
                let Some(height) = value(group, machine) else { continue };
                let left = group as f64 + 0.1 + index as f64 * width;
                let bar = [(left, 0.0), (left + 0.9 * width, height)];
                chart.draw_series([Rectangle::new(bar, colour(index).filled())])?;
            }
        }
        let entries: Vec<_> = (machines.iter().enumerate())
            .map(|(index, it)| (it.name.as_str(), colour(index).stroke_width(3 * FINE)))
            .collect();
        legend(area, &entries)
    })
}

impl Comparison {
    fn ranked(&self) -> Vec<&MachineReport> {
        self.machines.iter().filter(|machine| machine.refused.is_none()).collect()
    }

    /// What each machine has of each criterion.
    pub(super) fn shares(&self) -> Result<String, PictureError> {
        let names = CRITERIA.map(str::to_owned);
        bars("criteria", "1 for the best [1]", &names, &self.ranked(), |group, machine| {
            machine.shares.get(group).copied().flatten()
        })
    }

    /// The time of each job.
    pub(super) fn times(&self) -> Result<String, PictureError> {
        bars("times", "time [s]", &self.jobs, &self.ranked(), |group, machine| {
            machine.jobs.get(group).map(|job| job.time)
        })
    }

    /// The error of each job.
    pub(super) fn errors(&self) -> Result<String, PictureError> {
        bars("errors", "error [µm]", &self.jobs, &self.ranked(), |group, machine| {
            machine.jobs.get(group)?.error_max.map(|error| error * super::text::MICRO)
        })
    }

    /// The pictures by the names of their files.
    ///
    /// # Errors
    /// [`PictureError`] when the numbers cannot be drawn.
    pub fn pictures(&self) -> Result<Vec<(String, String)>, PictureError> {
        let mut pictures = vec![
            ("criteria.svg".to_owned(), self.shares()?),
            ("times.svg".to_owned(), self.times()?),
            ("errors.svg".to_owned(), self.errors()?),
        ];
        for (index, drawn) in (1..).zip(&self.drawn) {
            pictures.push((format!("area_{index}.svg"), drawn.area()?));
            pictures.push((format!("motors_{index}.svg"), drawn.motors()?));
        }
        Ok(pictures)
    }
}
