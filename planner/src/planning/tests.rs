//! Jobs planned window by window, at rates that change on the way.

#![allow(clippy::unwrap_used)]

use machine::{Machine, Override};
use messages::Setpoint;
use messages::math::hypot;
use messages::time::SETPOINT_PERIOD;

use super::outlet::Outlet;
use super::run::plan_windows;
use super::{MOST_SETPOINTS, Window};
use crate::drawing::Action;
use crate::limits::motion_limits::Scope;
use crate::plan::PlanFacts;
use crate::{Job, PlanError};

/// Takes every window, after so many of which the rate changes.
struct Taking<'a> {
    rates: &'a dyn Fn(usize) -> f64,
    /// Setpoints that may wait.
    ahead: usize,
    windows: Vec<usize>,
    setpoints: Vec<Setpoint>,
}

impl Outlet for Taking<'_> {
    fn is_abandoned(&self) -> bool {
        false
    }

    fn take(&mut self, window: Box<Window>) -> Result<(), Box<Window>> {
        self.windows.push(window.setpoints.len());
        self.setpoints.extend(window.setpoints);
        Ok(())
    }

    fn ahead(&self) -> usize {
        self.ahead
    }

    fn rate(&self) -> f64 {
        (self.rates)(self.windows.len())
    }
}

/// The built-in machine, with the program's origin in the corner of its area.
fn machine(settings: &[&str]) -> Machine {
    let origin = "gcode.origins.g54=[\"0 mm\", \"0 mm\"]";
    let settings: Vec<Override> =
        settings.iter().chain([&origin]).map(|it| it.parse().unwrap()).collect();
    Machine::builtin_with(&settings).unwrap()
}

fn job(program: &str, settings: &[&str], machine: &Machine) -> Job {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.nc");
    std::fs::write(&path, format!("G21 G90\n{program}")).unwrap();
    let settings: Vec<Override> = settings.iter().map(|it| it.parse().unwrap()).collect();
    Job::read(&path, &settings, machine).unwrap()
}

struct Planned {
    windows: Vec<usize>,
    setpoints: Vec<Setpoint>,
    facts: PlanFacts,
}

impl Planned {
    fn lit(&self) -> impl Iterator<Item = &Setpoint> {
        self.setpoints.iter().filter(|it| it.laser.is_lit())
    }

    /// The most power in each cycle that is lit from its start to its end, and the speed in it [m/s].
    fn exposures(&self) -> impl Iterator<Item = (f64, f64)> {
        let pairs = self.setpoints.windows(2).filter(|pair| {
            pair[0].laser.gate != 0 && pair[0].laser.last().0 != 0 && pair[1].laser.gate != 0
        });
        pairs.map(|pair| {
            let way = hypot(pair[1].tool[0] - pair[0].tool[0], pair[1].tool[1] - pair[0].tool[1]);
            (pair[0].laser.last().1, way * 1e3)
        })
    }
}

fn planned_at(
    machine: &Machine,
    job: &Job,
    rates: &dyn Fn(usize) -> f64,
) -> Result<Planned, PlanError> {
    let mut taking = Taking { rates, ahead: 5_000, windows: Vec::new(), setpoints: Vec::new() };
    let facts = plan_windows(machine, job, Scope::Machine, 1, &mut taking)?;
    let Taking { windows, setpoints, .. } = taking;
    assert_eq!(facts.samples, setpoints.len() as u64);
    assert!(setpoints.iter().enumerate().all(|(index, it)| it.sequence == index as u64));
    Ok(Planned { windows, setpoints, facts })
}

fn planned(machine: &Machine, job: &Job) -> Planned {
    planned_at(machine, job, &|_| 1.0).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn no_window_is_longer_than_a_few_seconds_whatever_lasts_long() {
    let machine = machine(&["path.rapid=5 mm/s", "path.speed=0.25 m/s"]);
    let at_home = "G0 X100 Y100\n";
    for (program, least) in [
        ("G4 P30\n", 30.0),
        ("M3 S500 G4 P20\n", 20.0),
        ("M4 S500\nG1 X150 F300\n", 10.0),
        ("M3 S500\nG1 X150 F300\n", 10.0),
        ("G1 X150 F300\n", 10.0),
        ("M4 S500\nG2 X160 I30 F300\n", 18.0),
        // In the dark, as fast as is allowed.
        ("G0 X150\nG0 Y150\n", 20.0),
    ] {
        let planned = planned(&machine, &job(&format!("{at_home}{program}"), &[], &machine));
        let most = planned.windows.iter().max().unwrap();
        assert!(*most <= MOST_SETPOINTS, "{program}: {most}");
        let time = planned.setpoints.len() as f64 * 1e-3;
        assert!((least..1.3 * least + 1.0).contains(&time), "{program}: {time} s");
    }
}

#[test]
fn light_at_rest_lasts_as_long_as_it_is_asked_for() {
    let machine = machine(&[]);
    let planned = planned(&machine, &job("M3 S500 G4 P7\nS200 G4 P6\nM5\n", &[], &machine));
    let lit = planned.lit().count() as f64 * 1e-3;
    assert!((lit - 13.0).abs() < 3e-3, "{lit} s");
    let bright = planned.lit().filter(|it| it.laser.last().1 == 0.5).count() as f64 * 1e-3;
    assert!((bright - 7.0).abs() < 3e-3, "{bright} s");
    assert_eq!(planned.facts.strokes, 1);
}

#[test]
fn a_rest_of_more_than_a_week_is_refused_at_once() {
    let machine = machine(&[]);
    let mut job = job("G4 P1\n", &[], &machine);
    job.drawing.steps[0].action = Action::Dwell { time: 700_000.0, lit: None };
    let planned = planned_at(&machine, &job, &|_| 1.0);
    assert!(matches!(planned, Err(PlanError::TooLong { .. })));
}

#[test]
fn a_long_straight_line_is_faster_soon_after_the_override() {
    let machine = machine(&[]);
    let job = job("G0 X20 Y100\nM4 S400\nG1 X180 F600\n", &[], &machine);
    let planned = planned_at(&machine, &job, &|taken| if taken > 2 { 2.0 } else { 1.0 }).unwrap();
    let time = planned.lit().count() as f64 * 1e-3;
    assert!(time < 12.0, "{time} s");
    assert!(planned.lit().any(|it| it.path_velocity > 0.0199));
}

/// The last window of a path may be of any length, and the rate may change when it is the next.
#[test]
fn the_rate_may_change_before_any_window_of_a_path_at_one_speed() {
    let machine = machine(&[]);
    for (feed, rest) in [(3000.0, 0.01), (3000.0, 0.03), (3000.0, 0.3), (6000.0, 0.02)] {
        let length = feed / 60.0 * (3.0 * super::timing::WINDOW + rest);
        let job = job(
            &format!("G0 X20 Y20\nM3 S400\nG1 X{:.4} F{feed}\nG1 Y120\n", 20.0 + length.min(170.0)),
            &[],
            &machine,
        );
        for change in 0..8 {
            for [before, after] in [[1.0, 2.0], [2.0, 1.0], [1.0, 1.1], [1.7, 1.2]] {
                let rates = |taken| if taken >= change { after } else { before };
                let planned = planned_at(&machine, &job, &rates);
                planned.unwrap_or_else(|error| {
                    panic!("F{feed}, {rest} s, {before} to {after} after {change}: {error}")
                });
            }
        }
    }
}

/// Power for each length of line is what the job asks for wherever it is marked faster, on the way from one
/// speed to the other too; and never more than it asks for where the limits leave it no faster.
#[test]
fn an_override_keeps_the_exposure_all_along() {
    let machine = machine(&[]);
    let (power, asked) = (0.4, 0.05);
    for (mode, is_constant) in [("M3", true), ("M4", false)] {
        let job = job(
            &format!("G0 X20 Y20\n{mode} S400 F3000\nG1 X180\nG3 X180.4 Y20.4 J0.4\nG1 Y180\n"),
            &[],
            &machine,
        );
        for [before, after] in [[1.0, 2.0], [2.0, 1.0], [1.0, 1.0], [1.3, 2.4]] {
            let planned =
                planned_at(&machine, &job, &|taken| if taken > 1 { after } else { before });
            let planned = planned.unwrap();
            let mut changes = 0;
            for (now, speed) in planned.exposures() {
                let right = power * speed / asked;
                let right = if is_constant { right.max(power) } else { right };
                changes += usize::from((right - power).abs() > 0.1 * power);
                let error = (now - right).abs();
                assert!(error < 0.02 * power, "{mode}, {before} to {after}: {now} at {speed} m/s");
            }
            assert!(!is_constant || (changes > 0) == (before > 1.0 || after > 1.0));
        }
    }
}

#[test]
fn no_speed_power_and_override_ask_for_more_power_than_there_is() {
    let machine = machine(&[]);
    let mut random = messages::random::SplitMix64::new(3);
    for case in 0..60 {
        let (mode, level, feed, rate) = match case {
            // Three roundings, the last of which would be above 1.
            0 => ("M3", 0.6, 2580.0, 2.0),
            _ => (
                ["M3", "M4"][case % 2],
                random.between(0.3, 1.0),
                random.between(1000.0, 9000.0),
                random.between(1.0, 3.0),
            ),
        };
        let program =
            format!("G0 X90 Y100\n{mode} S{:.3} F{feed:.3}\nG1 X95\nG1 Y105\n", 1e3 * level);
        let planned = planned_at(&machine, &job(&program, &[], &machine), &|_| rate).unwrap();
        assert!(
            planned.setpoints.iter().all(|it| it.laser.is_valid(SETPOINT_PERIOD)),
            "{program} at {rate}"
        );
    }
}

/// Fine pixels, whose light changes as often as a cycle can say.
#[test]
fn light_that_changes_often_is_slowed_at_any_override_and_keeps_its_exposure() {
    let machine = machine(&["path.speed=0.5 m/s", "path.rapid=0.5 m/s"]);
    let mut program = "G0 X60 Y100\nM4 F24000\n".to_owned();
    for pixel in 0..2000 {
        let power = if pixel % 2 == 0 { 500 } else { 0 };
        program.push_str(&format!("G1 X{:.3} S{power}\n", 60.0 + 0.02 * f64::from(pixel + 1)));
    }
    for settings in [&[][..], &["marking.speed=0.4 m/s"]] {
        let job = job(&program, settings, &machine);
        for rate in [1.0, 2.0] {
            let planned = planned_at(&machine, &job, &|_| rate).unwrap();
            let most = planned.setpoints.iter().map(|it| it.laser.edges().len()).max().unwrap();
            assert!((13..=16).contains(&most), "{most} edges");
            // 14 pixels of 0.02 mm in a millisecond.
            let speed = planned.lit().map(|it| it.path_velocity).fold(0.0, f64::max);
            assert!((0.25..0.2801).contains(&speed), "{speed} m/s");
            let edges = planned.setpoints.iter().flat_map(|it| it.laser.edges());
            let power = edges.map(|edge| edge.power).fold(0.0, f64::max);
            assert!(power <= 0.5 * 0.281 / 0.4, "{power}");
            let notes = &planned.facts.notes;
            assert!(notes.iter().any(|note| note.text.contains("changes more often")));
        }
    }
}

/// At one speed a motor that gets too warm on a long line is found so only in a later window.
#[test]
fn a_later_window_at_one_speed_is_slowed_where_it_must_be() {
    let program = "G0 X120 Y100\nM3 S500 F12000\nG2 I-20\nG2 I-20\nG2 I-20\n";
    // Friction warms a motor at any speed.
    let with = |current: f64| {
        let limit = format!("axis.a.motor.dc.continuous_current=\"{current} A\"");
        machine(&["axis.a.friction.coulomb=\"0 N m\"", &limit])
    };
    let free = with(5.0);
    let planned_free = planned(&free, &job(program, &[], &free));
    let machine = with(5.0 * 0.95 * planned_free.facts.uses.heat[0]);
    let planned = planned(&machine, &job(program, &[], &machine));
    assert!(planned.facts.uses.heat[0] <= 1.0);
    assert!(planned.facts.duration > planned_free.facts.duration);
}

/// A sharp arc near the end leaves no room to come to the speed asked for behind it.
#[test]
fn a_line_at_one_speed_is_not_stopped_on_for_an_end_that_is_out_of_reach() {
    let machine = machine(&["path.speed=0.2 m/s"]);
    let program =
        "G0 X10 Y100\nM3 S500 F9000\nG1 X180\nG1 X190\nG3 X190.4 Y100.4 J0.4\nG1 Y100.6\n";
    let planned = planned(&machine, &job(program, &[], &machine));
    let least = planned.lit().map(|it| it.path_velocity).fold(f64::INFINITY, f64::min);
    assert!(least > 0.005, "{least} m/s");
}
