//! `graver plan --pulses` and `--pulse-path`: every step pulse of a plan with the instant at which it
//! is due, and the path that the counted pulses make.

mod path;
mod train;

use crate::exit::Failure;
use machine::{Machine, Mechanism, MechanismVisitor};
use messages::Setpoint;
use messages::time::{SETPOINT_PERIOD, SETPOINT_TIME};
use path::PulsePath;
use planner::Plan;
use planner::trajectory::{Cursor, Reference};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use train::{Due, Train};

/// What the pulses of a plan come to. What bends, and how far a rotor lags, is taken to be as planned:
/// the deviation is that of counting alone.
#[derive(Debug, Clone, Default, Serialize, schemars::JsonSchema)]
pub struct PulseFacts {
    /// The count at the end, 0 at the start, per axis; 0 for an axis without a stepper.
    pub counts: Vec<i64>,
    /// The largest rate of pulses [1/s], per axis; 0 for an axis without a stepper.
    pub largest_rate: Vec<f64>,
    /// The largest distance of the tool from where the plan has it at that time [m].
    pub deviation_max: f64,
    /// The same while the laser is on [m].
    pub deviation_lit_max: f64,
    /// Its root mean square over time [m].
    pub deviation_rms: f64,
    /// How far rounding to whole pulses may put the tool off where it matters most, to first order [m].
    pub bound: f64,
}

/// The files to write, those of them that are asked for.
#[derive(Debug, Default)]
pub struct PulseFiles {
    /// For the pulses.
    pub list: Option<(File, PathBuf)>,
    /// For the path that they make.
    pub path: Option<(File, PathBuf)>,
}

/// Whether any actuator of `machine` is a stepper.
pub fn has_steppers(machine: &Machine) -> bool {
    machine.actuators.iter().any(|actuator| actuator.motor.stepper().is_some())
}

/// A motion in setpoints, and between them.
pub struct Motion<'a> {
    /// One a millisecond.
    pub setpoints: Box<dyn Iterator<Item = Setpoint> + 'a>,
    /// What is planned at a stream time [s]; asked in order of time.
    pub planned: Box<dyn FnMut(f64) -> Reference + 'a>,
}

impl<'a> Motion<'a> {
    /// That of `plan`.
    pub fn of(plan: &'a Plan) -> Self {
        let mut cursor = Cursor::default();
        let planned = move |time| plan.trajectory.at(time, &mut cursor);
        Self { setpoints: plan.setpoints(1), planned: Box::new(planned) }
    }
}

/// Follows the pulses of `motion`. The list has one row a pulse in order of time: `t` [s], the axis or of several on one the actuator, and
/// the count from then on, 0 at the start. The path has one row a pulse too: `t` [s], where the tool is
/// from then on [m], how far that is from the plan [m], and whether the laser is on.
///
/// The course between two setpoints is the cubic that the drives follow at the planned rate.
///
/// # Errors
/// Whatever the file system reports; a place where the mechanism does not close with counted joints.
pub fn follow(
    machine: &Machine,
    motion: Motion<'_>,
    files: PulseFiles,
) -> Result<PulseFacts, Failure> {
    let table = |file: Option<(File, PathBuf)>| {
        file.map(|(file, path)| Table { file: BufWriter::new(file), path })
    };
    let follower = Follower { machine, motion, list: table(files.list), path: table(files.path) };
    machine.mechanism.visit(follower)
}

/// A file that is written line by line.
struct Table {
    file: BufWriter<File>,
    path: PathBuf,
}

impl Table {
    /// Lets `write` put a line into it.
    fn put(
        &mut self,
        write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<(), Failure> {
        write(&mut self.file)
            .map_err(|error| Failure::output(format!("{}: {error}", self.path.display())))
    }
}

struct Follower<'a> {
    machine: &'a Machine,
    motion: Motion<'a>,
    list: Option<Table>,
    path: Option<Table>,
}

impl MechanismVisitor for Follower<'_> {
    type Output = Result<PulseFacts, Failure>;

    fn visit<const N: usize, M: Mechanism<N>>(mut self, mechanism: M) -> Self::Output {
        if let Some(table) = &mut self.list {
            table.put(|file| writeln!(file, "t,axis,count"))?;
        }
        if let Some(table) = &mut self.path {
            table.put(|file| writeln!(file, "t,x,y,z,deviation,laser"))?;
        }
        let mut facts = PulseFacts::default();
        if let Some(first) = self.motion.setpoints.next() {
            facts = self.walk(mechanism, first)?;
        }
        for table in [&mut self.list, &mut self.path].into_iter().flatten() {
            table.put(Write::flush)?;
        }
        Ok(facts)
    }
}

impl Follower<'_> {
    fn walk<const N: usize, M: Mechanism<N>>(
        &mut self,
        mechanism: M,
        first: Setpoint,
    ) -> Result<PulseFacts, Failure> {
        let actuators = self.machine.actuators.iter().enumerate();
        let mut trains: Vec<Train> =
            actuators.filter_map(|(index, actuator)| Train::new(index, actuator, &first)).collect();
        let mut path = PulsePath::new(mechanism, &mut self.motion.planned, &trains, &first)
            .map_err(|error| path::unclosed(first.sequence as f64 * SETPOINT_TIME, &error))?;
        let mut due: Vec<Due> = Vec::new();
        // The rate of the lead is the difference across both neighbours, as in the controller.
        let mut before = first;
        let mut next = self.motion.setpoints.next();
        while let Some(now) = next {
            next = self.motion.setpoints.next();
            let after = next.as_ref().unwrap_or(&now);
            let start = now.sequence.saturating_sub(1) as f64 * SETPOINT_TIME;
            due.clear();
            for (index, train) in trains.iter_mut().enumerate() {
                train.follow(index, &before, &now, after, &mut due);
            }
            due.sort_by_key(|pulse| pulse.offset);
            path.begin(&before, &now);
            for pulse in &due {
                let time = start + pulse.offset as f64 * 1e-9;
                if let Some(list) = &mut self.list {
                    let (name, count) = (&trains[pulse.train].name, pulse.count);
                    list.put(|file| writeln!(file, "{time:.9},{name},{count}"))?;
                }
                let share = pulse.offset as f64 / SETPOINT_PERIOD.0 as f64;
                let unclosed = |error| path::unclosed(time, &error);
                // Just before it, and from it on.
                path.look(share, &trains).map_err(unclosed)?;
                path.count(pulse);
                let now = path.look(share, &trains).map_err(unclosed)?;
                if let Some(table) = &mut self.path {
                    let [x, y, z] = now.tool;
                    let (off, lit) = (now.deviation, u32::from(now.is_lit));
                    table.put(|file| writeln!(file, "{time:.9},{x},{y},{z},{off},{lit}"))?;
                }
            }
            let unclosed = |error| path::unclosed(start + SETPOINT_TIME, &error);
            path.look(1.0, &trains).map_err(unclosed)?;
            path.end().map_err(unclosed)?;
            before = now;
        }
        Ok(path.facts(&trains))
    }
}
