//! Coulomb friction with true stiction: which motors stick, which slide, and when that changes.
//!
//! The law (the same that the feedforward uses, since the friction model decides accuracy): a
//! sliding motor feels `Tc` against its motion; one at rest is held exactly as long as less than
//! `Tc` acts on it, and starts the instant more does. No speed band, no creep: a stuck motor's
//! speed is 0.0 and its angle does not change in the last bit.
//!
//! Within a smooth stretch every motor keeps its contact. The two events that end one, a sliding
//! motor reaching speed 0 and a held one being overcome, are located inside the step, and the
//! rest of the step is taken with the new contacts. So the switching does not lower the order of
//! the integration, as a sign function evaluated in its stages or a split impulse would.

use machine::Mechanism;
use nalgebra::SVector;

use super::contacts::{Contact, Contacts};
use super::coupling::Unsolvable;
use super::dynamics::{Dynamics, Part};
use super::state::{Phases, State};
use super::winding::Weights;

/// Refinements of the instant of an event; the margins are smooth, so that each takes regula
/// falsi several digits on.
const REFINEMENTS: usize = 4;

/// An event this close to the end of a step, as a share of it, is at its end.
const TIME_RESOLUTION: f64 = 1e-12;

/// The contacts in which `state` goes on.
fn decide<const N: usize, const A: usize, M: Mechanism<N>>(
    dynamics: &Dynamics<N, M, A>,
    state: &State<N, A>,
) -> Contacts<A> {
    let coulomb = dynamics.motors().coulomb;
    let mut contacts = Contacts::new();
    for motor in 0..A {
        if coulomb[motor] > 0.0 {
            let speed = state.speed[motor];
            let contact =
                if speed == 0.0 { Contact::Held } else { Contact::Sliding(speed.signum()) };
            contacts.set(motor, contact, coulomb[motor]);
        }
    }
    // Behind a rigid transmission, one motor that lets go changes what the others must bear:
    // the worst lets go first, and the rest are asked again.
    while contacts.any_held() {
        let torque = dynamics.net_torque(state, &contacts, 0.0);
        let mut worst = None;
        let mut excess = 0.0;
        for motor in 0..A {
            let over = torque[motor].abs() - coulomb[motor];
            if contacts.of(motor) == Contact::Held && over > excess {
                (worst, excess) = (Some(motor), over);
            }
        }
        let Some(motor) = worst else { break };
        contacts.set(motor, Contact::Sliding(torque[motor].signum()), coulomb[motor]);
    }
    contacts
}

/// How far each motor is from the end of its contact; negative once it is past it.
fn margins<const N: usize, const A: usize, M: Mechanism<N>>(
    contacts: &Contacts<A>,
    dynamics: &Dynamics<N, M, A>,
    state: &State<N, A>,
    at: f64,
) -> [f64; A] {
    let torque = if contacts.any_held() {
        dynamics.net_torque(state, contacts, at)
    } else {
        SVector::zeros()
    };
    let coulomb = dynamics.motors().coulomb;
    core::array::from_fn(|motor| match contacts.of(motor) {
        Contact::Frictionless => f64::INFINITY,
        Contact::Held => coulomb[motor] - torque[motor].abs(),
        Contact::Sliding(sign) => sign * state.speed[motor],
    })
}

/// Takes `state` one step on, through all events inside it.
///
/// # Errors
/// If the mechanism cannot go where this step leads.
pub fn advance<const N: usize, const A: usize, M: Mechanism<N>>(
    dynamics: &mut Dynamics<N, M, A>,
    state: &State<N, A>,
    phases: &Phases<A>,
    weights: &Weights<A>,
) -> Result<State<N, A>, Unsolvable> {
    let whole = weights.step;
    dynamics.begin(state, whole)?;
    let mut state = *state;
    let mut part = Part::WHOLE;
    let mut weights = *weights;
    let mut contacts = decide(dynamics, &state);
    // Every motor may stop and start again within a step; more than that is chatter.
    for _ in 0..2 * A + 2 {
        let end = dynamics.step(&state, &contacts, phases, &weights, part);
        let after = margins(&contacts, dynamics, &end.state, part.end());
        if after.iter().all(|margin| *margin >= 0.0) {
            dynamics.end(&end);
            return Ok(end.state);
        }
        let before = margins(&contacts, dynamics, &state, part.from);
        let first = earliest(&before, &after);
        let (motor, _) = first;
        let margins = (before[motor], after[motor]);
        let share = locate(dynamics, &state, &contacts, phases, (&weights, part), first, margins);
        let rest = weights.step * (1.0 - share);
        if share > 0.0 {
            weights = dynamics.motors().windings.weights(weights.step * share);
            part.length = weights.step / whole;
            state = dynamics.step(&state, &contacts, phases, &weights, part).state;
            part.from = part.end();
        }
        let coulomb = dynamics.motors().coulomb[motor];
        match contacts.of(motor) {
            Contact::Held => {
                let sign = dynamics.net_torque(&state, &contacts, part.from)[motor].signum();
                contacts.set(motor, Contact::Sliding(sign), coulomb);
            }
            Contact::Sliding(_) | Contact::Frictionless => {
                state.speed[motor] = 0.0;
                dynamics.couple(&mut state);
                contacts.set(motor, Contact::Held, coulomb);
                let torque = dynamics.net_torque(&state, &contacts, part.from)[motor];
                if torque.abs() > coulomb {
                    contacts.set(motor, Contact::Sliding(torque.signum()), coulomb);
                }
            }
        }
        if rest <= weights.step * TIME_RESOLUTION {
            dynamics.end(&dynamics.turn(&state, &contacts));
            return Ok(state);
        }
        weights = dynamics.motors().windings.weights(rest);
        part.length = rest / whole;
    }
    // Chatter: what changes its mind again and again within a step is at rest in it.
    for motor in 0..A {
        if contacts.of(motor) != Contact::Frictionless && state.speed[motor].abs() == 0.0 {
            contacts.set(motor, Contact::Held, 0.0);
        }
    }
    let end = dynamics.step(&state, &contacts, phases, &weights, part);
    dynamics.end(&end);
    Ok(end.state)
}

/// The motor whose contact ends first, with the share of the step at which it does, by the chord.
fn earliest<const A: usize>(before: &[f64; A], after: &[f64; A]) -> (usize, f64) {
    let mut first = (0, f64::INFINITY);
    for motor in 0..A {
        if after[motor] < 0.0 {
            let share = chord(before[motor].max(0.0), after[motor]);
            if share < first.1 {
                first = (motor, share);
            }
        }
    }
    first
}

/// Where the line from `before ≥ 0` at 0 to `after < 0` at 1 crosses zero.
fn chord(before: f64, after: f64) -> f64 {
    before / (before - after)
}

/// The share of the step at which the margin of `motor` vanishes, from the guess `share` on.
fn locate<const N: usize, const A: usize, M: Mechanism<N>>(
    dynamics: &Dynamics<N, M, A>,
    state: &State<N, A>,
    contacts: &Contacts<A>,
    phases: &Phases<A>,
    (weights, whole): (&Weights<A>, Part),
    (motor, guess): (usize, f64),
    (before, after): (f64, f64),
) -> f64 {
    let (mut low, mut high) = ((0.0, before.max(0.0)), (1.0, after));
    let mut share = guess;
    for _ in 0..REFINEMENTS {
        if share <= low.0 || share >= high.0 {
            break;
        }
        let part = dynamics.motors().windings.weights(weights.step * share);
        let reached = Part { length: whole.length * share, ..whole };
        let there = dynamics.step(state, contacts, phases, &part, reached).state;
        let margin = margins(contacts, dynamics, &there, reached.end())[motor];
        if margin >= 0.0 {
            low = (share, margin);
        } else {
            high = (share, margin);
        }
        let next = low.0 + (high.0 - low.0) * chord(low.1, high.1);
        if (next - share).abs() <= TIME_RESOLUTION {
            return next;
        }
        share = next;
    }
    share
}
