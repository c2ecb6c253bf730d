//! What is made slower where the check of a job planned by its joints finds a limit broken.

use signals::time::CYCLE_TIME;

use crate::check::Breach;
use crate::itinerary::{Item, Stop};
use crate::plan::Place;
use crate::route::Speeds;
use crate::trajectory::{Course, Trajectory};

/// How much slower a stroke or a move that breaks a limit is tried again.
const SLOWER: f64 = 0.85;

/// How often in a job what breaks a limit is slowed alone, and how often after that everything is.
const TRIALS: [u32; 2] = [24, 24];

/// The retries of one job.
#[derive(Debug, Default)]
pub(crate) struct Retry {
    trials: u32,
}

impl Retry {
    /// Slows in `speeds` what breaks a limit at `place`: the stroke or move there, and the one before
    /// where that has only just ended, since springs and inductances remember it. `owners` are the
    /// numbers of the stops that the pieces of `trajectory` after the first belong to.
    ///
    /// Says whether there is anything to slow that would mend it.
    pub(crate) fn slow(
        &mut self,
        speeds: &mut Speeds,
        stops: &[Stop],
        (trajectory, owners): (&Trajectory, &[usize]),
        (place, breach): (&Place, &Breach),
    ) -> bool {
        self.trials += 1;
        if self.trials > TRIALS[0] + TRIALS[1] || breach.quantity.is_place() {
            return false;
        }
        let all = self.trials > TRIALS[0] || breach.quantity.sums_up();
        if all {
            speeds.strokes.iter_mut().for_each(|(_, share)| *share *= SLOWER);
            speeds.moves.iter_mut().for_each(|share| *share *= SLOWER);
            return true;
        }
        let blamed = [place.time, place.time - CYCLE_TIME]
            .map(|time| last_motion(trajectory, time))
            .map(|piece| piece.filter(|piece| *piece > 0));
        let mut slowed = false;
        for piece in blamed.into_iter().flatten().collect::<std::collections::BTreeSet<_>>() {
            let Some(&owner) = owners.get(piece - 1) else { continue };
            let marks = matches!(
                trajectory.pieces[piece].course,
                Course::RunIn(_) | Course::Stroke { .. } | Course::RunOut(_)
            );
            let share = match number(stops, owner).filter(|_| marks) {
                Some(stroke) => speeds.strokes.get_mut(stroke).map(|(_, share)| share),
                None => speeds.moves.get_mut(owner),
            };
            if let Some(share) = share {
                *share *= SLOWER;
                slowed = true;
            }
        }
        slowed
    }
}

/// The number of the piece that moves at `time` [s], or of the last one that did before.
fn last_motion(trajectory: &Trajectory, time: f64) -> Option<usize> {
    let after = trajectory.pieces.partition_point(|piece| piece.start <= time);
    let moves = |course: &Course| match course {
        Course::Rest(_) => false,
        Course::Joints(joints) => !joints.stands(),
        _ => true,
    };
    (0..after).rev().find(|index| moves(&trajectory.pieces[*index].course))
}

/// The number among the strokes of the stop `index`; `None` where it is no stroke.
fn number(stops: &[Stop], index: usize) -> Option<usize> {
    let is_stroke = |stop: &Stop| matches!(stop.item, Item::Stroke(_));
    let stop = stops.get(index)?;
    is_stroke(stop).then(|| stops[..index].iter().filter(|stop| is_stroke(stop)).count())
}
