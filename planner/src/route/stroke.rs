//! A stroke on the route: the posture in which it is entered, the ways into it and out of it, and the
//! speed that the axes can follow along it.

use std::sync::Arc;

use machine::kinematics::KinematicsError;
use machine::{Mechanism, PathLimits};

use super::{Router, Slowed, slower};
use crate::jet::Jet;
use crate::law::SpeedLaw;
use crate::outline::Outline;
use crate::posture::{Part, Posture, Refused, candidates, walk};
use crate::reach::reach;
use crate::run_in::{RunIn, RunOut};
use crate::stroke::StrokePath;
use crate::timing::Way;

/// Postures that one stroke is timed for, each where the one before cannot be reached.
const TIMED: usize = 7;

/// Rounds in which run-in, run-out and the law of speed between them are fitted to each other. Each
/// makes the runs slower by what the axes lack.
const ROUNDS: usize = 12;

/// How much slower than it seems to need a run is made in each of these rounds, so that a last
/// thousandth takes no round of its own.
const RUN_MARGIN: f64 = 1.02;

/// Share of the path's acceleration that the stroke's bend at its end may take of a run that is made
/// slower; the rest is for its ramp.
const BEND: f64 = 0.7;

/// How often the runs are made shorter, by half their speed, where they leave the reach: at last their
/// speed is below a hundredth of what was asked, and what is out of reach is the stroke itself.
const SHORTENINGS: usize = 8;

/// A stroke timed for the posture in which it is entered.
struct Timed {
    run_in: RunIn,
    run_out: RunOut,
    /// How its speed changes; `None` where it is constant.
    law: Option<SpeedLaw>,
}

/// How fast the run-in or the run-out of a stroke is made.
#[derive(Clone, Copy)]
struct RunPace {
    /// The speed at the stroke's end of it [m/s].
    speed: f64,
    /// How many times slower it is than the path's limits let it be, so that the axes can follow.
    slower: f64,
}

impl<'a, const N: usize, M: Mechanism<N>> Router<'a, '_, N, M> {
    /// Marks a stroke with the ways into it and out of it.
    pub(super) fn mark(&mut self, outline: &'a Outline) -> Result<(), Refused> {
        let (top, share) = self.speeds.strokes[self.stroke];
        self.stroke += 1;
        let path = outline.trace(top, &self.demands.path);
        let length = path.length();
        let ends = [outline.start(), outline.end()];
        let middle = |share: f64| path.at(length * share).motion(1.0, 0.0, 0.0);

        // A posture for the whole; with shorter ways in and out where long ones leave the reach.
        let mut runs = [top, top].map(|speed| RunPace { speed, slower: 1.0 });
        let mut wanted = self.posture_for(&ends, &middle, &mut runs)?;
        for _ in 0..TIMED {
            let timed = self.time(&ends, (&path, &middle), &wanted, runs, [top, share])?;
            let Timed { run_in, run_out, .. } = &timed;
            let into = |share: f64| run_in.at(run_in.duration() * share);
            let out = |share: f64| run_out.at(run_out.duration() * share);
            let approach = self.choose(&run_in.at(0.0), &[&into, &middle, &out], Some(&wanted))?;
            if approach.start.is_like(&wanted) {
                self.take(approach);
                self.add_stroke(outline, &path, timed, top);
                return Ok(());
            }
            // What was timed cannot be reached: what can be has times of its own.
            wanted = approach.start;
        }
        Err(Refused::NoPosture { tried: TIMED })
    }

    /// Times a stroke of at most `top` [m/s], at a share of what the axes seem to allow, that is
    /// entered in a posture like `wanted`.
    fn time(
        &self,
        ends: &[Jet; 2],
        (path, middle): (&StrokePath, &Part<'_>),
        wanted: &Posture<N>,
        mut runs: [RunPace; 2],
        [top, share]: [f64; 2],
    ) -> Result<Timed, Refused> {
        let limits = self.demands.path;
        for _ in 0..ROUNDS {
            let (run_in, run_out) = ways(ends, &runs, &limits);
            let into = |share: f64| run_in.at(run_in.duration() * share);
            let entered = walk(self.demands, wanted_start(self, &run_in, wanted)?, &[&into])?.end;
            let reach = reach(self.demands, path, &entered, top)?;
            let law = if share >= 1.0 && reach.steady >= top && runs.iter().all(|l| l.speed >= top)
            {
                None
            } else {
                let mut cells = reach.cells;
                for cell in &mut cells {
                    cell.speed *= share;
                    cell.steady *= share;
                    cell.ramp = cell.ramp.map(|limit| limit * share);
                }
                let most = cells.iter().map(|cell| cell.speed).fold(0.0, f64::max).min(top);
                Some(SpeedLaw::below(&cells, most, [runs[0].speed, runs[1].speed]))
            };
            let (first, last) = law.as_ref().map_or((top, top), |law| (law.first(), law.last()));
            runs[0].speed = first;
            runs[1].speed = last;
            let (run_in, run_out) =
                if law.is_some() { ways(ends, &runs, &limits) } else { (run_in, run_out) };
            let start = wanted_start(self, &run_in, wanted)?;
            let left = walk(self.demands, entered, &[middle])?.end;
            let paces = [
                self.pace(start, run_in.duration(), &|time| run_in.at(time))?,
                self.pace(left, run_out.duration(), &|time| run_out.at(time))?,
            ];
            let mut fits = true;
            for (index, pace) in paces.into_iter().enumerate() {
                // On the way in and out nothing is retried by itself: a little is left for the springs.
                let pace = pace / share.min(1.0);
                if pace > 1.0 {
                    fits = false;
                    let run = &mut runs[index];
                    run.slower *= pace * RUN_MARGIN;
                    let bend = ends[index].second.norm();
                    let most = BEND * limits.acceleration / (run.slower * run.slower * bend);
                    run.speed = run.speed.min(most.sqrt());
                }
            }
            if fits {
                return Ok(Timed { run_in, run_out, law });
            }
        }
        Err(Refused::Kinematics(KinematicsError {
            code: "singular",
            axis: None,
            value: runs[0].slower.max(runs[1].slower),
            limit: 1.0,
            detail: "the axes cannot follow the way into the stroke or out of it",
        }))
    }

    /// The nearest posture from which a stroke can be gone.
    fn posture_for(
        &self,
        ends: &[Jet; 2],
        middle: &Part<'_>,
        runs: &mut [RunPace; 2],
    ) -> Result<Posture<N>, Refused> {
        let mut refused = None;
        for _ in 0..SHORTENINGS {
            let (run_in, run_out) = ways(ends, runs, &self.demands.path);
            let into = |share: f64| run_in.at(run_in.duration() * share);
            let out = |share: f64| run_out.at(run_out.duration() * share);
            let found =
                candidates(self.demands, &self.now, &run_in.at(0.0), &[&into, middle, &out]);
            match found {
                Ok(found) => {
                    if let Some((start, _)) = found.first() {
                        return Ok(*start);
                    }
                }
                Err(cause) => {
                    refused.get_or_insert(cause);
                }
            }
            for run in runs.iter_mut() {
                run.speed /= 2.0;
            }
        }
        Err(refused.unwrap_or(Refused::NoPosture { tried: SHORTENINGS }))
    }

    fn add_stroke(&mut self, outline: &'a Outline, path: &StrokePath, timed: Timed, top: f64) {
        let Timed { run_in, run_out, law } = timed;
        let duration = law.as_ref().map_or(outline.length() / top, SpeedLaw::duration);
        if let Some(law) = &law {
            let (speed, at) = law.slowest();
            let place = path.at(at).point;
            self.route.slowed.push(Slowed { line: outline.line, asked: top, speed, place });
            let most = law.instants(top).into_iter().map(|time| law.at(time).velocity);
            self.route.speed = most.fold(self.route.speed, f64::max);
        } else {
            self.route.speed = self.route.speed.max(top);
        }
        self.push(run_in.duration(), Way::RunIn(run_in));
        self.push(duration, Way::Stroke { outline, speed: top, law: law.map(Arc::new) });
        self.push(run_out.duration(), Way::RunOut(run_out));
    }
}

/// The posture at the start of `run_in` that goes on into the one that is `wanted` a little farther
/// away or nearer.
fn wanted_start<const N: usize, M: Mechanism<N>>(
    router: &Router<'_, '_, N, M>,
    run_in: &RunIn,
    wanted: &Posture<N>,
) -> Result<Posture<N>, KinematicsError> {
    let demands = router.demands;
    let tool = run_in.at(0.0);
    let mut branch = wanted.branch;
    let motion = demands.follow(&tool, &mut branch, &wanted.joints)?;
    Ok(Posture { joints: motion.position, branch })
}

/// The ways into a stroke and out of it.
fn ways(ends: &[Jet; 2], runs: &[RunPace; 2], limits: &PathLimits) -> (RunIn, RunOut) {
    let [into, out] = runs;
    (
        RunIn::new(&ends[0], into.speed, &slower(limits, into.slower)),
        RunOut::new(&ends[1], out.speed, &slower(limits, out.slower)),
    )
}
