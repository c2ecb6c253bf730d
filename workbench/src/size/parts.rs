//! What a job asks of the gear, the screw and the belt of an axis.

use super::candidate::Candidate;
use super::checks::{Use, rms};
use super::need::AxisNeed;
use super::{belt, gear, screw};
use crate::catalogue::{Belt, Screw};
use machine::transmission::gear::LoadClass;

/// Torque and forces at the gear's output.
pub(super) fn output(
    candidate: &Candidate,
    need: &AxisNeed,
    inertia_ratio: f64,
    margin: f64,
    uses: &mut Vec<Use>,
) {
    let Some(limits) = &candidate.limits else { return };
    let service = limits.service.of(LoadClass::of(inertia_ratio));
    let torques: Vec<f64> = need
        .points
        .iter()
        .map(|point| {
            let turning = need.stiff_inertia * point.acceleration / need.travel;
            need.travel * point.effort + turning
        })
        .collect();
    let (largest, at) = torques.iter().zip(&need.points).fold((0.0, None), |most, (of, point)| {
        if of.abs() > most.0 { (of.abs(), Some(point.time)) } else { most }
    });
    let mean = rms(torques.iter().copied());
    let found = (largest * service, at);
    uses.push(Use::new("gear_torque", found, limits.max_torque, "N·m", margin));
    if let Some(continuous) = limits.continuous_torque {
        let found = (mean * service, None);
        uses.push(Use::new("gear_heating", found, continuous, "N·m", margin));
    }
    let Some(diameter) = need.pulley else { return };
    let radial = gear::radial_force(largest, diameter);
    let forces = [("gear_radial", radial), ("gear_axial", gear::axial_force(radial))];
    for ((check, force), limit) in forces.into_iter().zip(limits.loads) {
        if let Some(limit) = limit {
            uses.push(Use::new(check, (force, at), limit, "N", margin));
        }
    }
}

/// The speed of a screw against that at which it whips.
pub(super) fn whip(screw: &Screw, need: &AxisNeed, margin: f64) -> Use {
    let found = need.points.iter().fold((0.0, None), |most, point| {
        let turning = (point.speed / need.travel).abs();
        if turning > most.0 { (turning, Some(point.time)) } else { most }
    });
    let limit = screw::SHARE * screw::critical_speed(screw);
    Use::new("screw_whip", found, limit, "rad/s", margin)
}

/// The strands of a belt against what breaks it and what keeps it from slipping.
pub(super) fn strands(belt: &Belt, need: &AxisNeed, margin: f64, uses: &mut Vec<Use>) {
    let (force, at) = need.points.iter().fold((0.0, None), |most, point| {
        if point.effort.abs() > most.0 { (point.effort.abs(), Some(point.time)) } else { most }
    });
    let preload = belt::preload(force);
    if let Some(limit) = belt.breaking_force {
        uses.push(Use::new("belt_strength", (preload.strands[0], at), limit, "N", margin));
    }
    if let Some([friction, wrap]) = belt.grip {
        uses.push(Use::new("belt_grip", (belt::least_grip(), at), friction * wrap, "1", 1.0));
    }
}
