//! Machines compared on one small job.

#![allow(clippy::unwrap_used)]

use machine::Machine;
use planner::request::JobRequest;
use workbench::compare::{Comparison, Contender, Settings, Weights, compare};

/// The machine in `machines/`, on a letter of 5 mm.
fn contender(file: &str, height: &str) -> Contender {
    let path = format!("{}/../machines/{file}.toml", env!("CARGO_MANIFEST_DIR"));
    let machine = Machine::load(path.as_ref(), &[]).unwrap();
    let set = ["letters.text=N".to_owned(), format!("letters.height={height}")];
    let jobs = vec![JobRequest { job: None, set: set.into(), offsets: None, confined: false }];
    Contender { file: Some(file.to_owned()), plant: machine.clone(), machine, jobs }
}

fn compared(contenders: &[Contender], weights: Weights) -> Comparison {
    compare(contenders, &Settings { seeds: 2, weights }).unwrap()
}

#[test]
fn two_comparisons_are_the_same_and_weights_choose_the_first() {
    let contenders = [contender("cartesian", "5 mm"), contender("corexy", "5 mm")];
    let all = compared(&contenders, Weights::default());
    let text = |comparison: &Comparison| serde_json::to_string(comparison).unwrap();
    assert_eq!(text(&all), text(&compared(&contenders, Weights::default())));
    let [cartesian, corexy] = &all.machines[..] else { panic!() };
    assert!(cartesian.mechanics.moving_mass > corexy.mechanics.moving_mass);
    let stiffness = [cartesian, corexy].map(|it| it.mechanics.stiffness.as_ref().unwrap().least);
    assert!(stiffness[0] > 100.0 * stiffness[1]);
    // One figure alone: its best machine has all of it.
    for (name, first) in [("mass", 1), ("stiffness", 0)] {
        let mut weights = Weights::default();
        for criterion in workbench::compare::CRITERIA {
            weights.set(&format!("{criterion}={}", u8::from(criterion == name))).unwrap();
        }
        let ranked = compared(&contenders, weights);
        assert_eq!(ranked.machines[first].rank, Some(1), "{name}");
        assert_eq!(ranked.machines[first].score, Some(1.0), "{name}");
        assert_eq!(ranked.machines[1 - first].rank, Some(2), "{name}");
    }
    for machine in &all.machines {
        assert_eq!(machine.jobs[0].outcome, "completed");
        assert!(machine.error_max.unwrap() < 2e-5, "{:?}", machine.error_max);
        let mismatch = machine.mismatch.as_ref().unwrap();
        assert!(mismatch.error_max.unwrap() > machine.error_max.unwrap());
        assert_eq!((mismatch.seeds, mismatch.faults), (2, 0));
        let bound: f64 = machine.binding.iter().map(|it| it.share).sum();
        assert!((bound - 1.0).abs() < 1e-6, "{bound}");
        assert!(machine.utilisation.is_some_and(|it| (0.05..=1.0).contains(&it)));
    }
    let pictures = all.pictures().unwrap();
    assert_eq!(pictures.len(), 3 + 2 * 2);
    for (name, svg) in &pictures {
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
    }
    let page = all.page().unwrap();
    assert!(page.contains("torque [mN·m]") && page.contains("CoreXY") && !page.contains("NaN"));
}

#[test]
fn a_machine_that_refuses_the_job_is_listed_without_a_rank() {
    // 300 mm is more than the CoreXY's area.
    let contenders = [contender("corexy", "300 mm"), contender("corexy", "5 mm")];
    let all = compared(&contenders, Weights::default());
    let refused = &all.machines[0];
    assert!(refused.refused.is_some() && refused.rank.is_none() && refused.score.is_none());
    assert_eq!((all.machines[1].rank, all.machines[1].score), (Some(1), Some(1.0)));
    assert!(all.text().contains("is refused"));
}

#[test]
fn an_unknown_weight_is_refused_with_the_list() {
    let mut weights = Weights::default();
    for (text, told) in [("speed=3", "utilisation"), ("time", "NAME=NUMBER"), ("time=-1", "-1")] {
        let error = weights.set(text).unwrap_err();
        assert!(error.contains(told), "{error}");
    }
    assert_eq!(weights, Weights::default());
}
