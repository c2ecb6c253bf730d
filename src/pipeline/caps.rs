//! What keeps a job from being marked as much faster as an override asks for.

use messages::plan::{Binding, PlanFacts};
use messages::run_folder;
use std::path::Path;

/// The least share of the time that is told of a limit.
const LEAST: f64 = 0.02;

/// What caps an override to `rate` of the job in the run folder `folder`, in words; `None` where nothing
/// does, or nothing is known.
pub(super) fn caps(folder: &Path, rate: f64) -> Option<String> {
    if rate <= 1.0 {
        return None;
    }
    let text = std::fs::read(folder.join(run_folder::PLAN)).ok()?;
    told(&serde_json::from_slice(&text).ok()?, rate)
}

fn told(plan: &PlanFacts, rate: f64) -> Option<String> {
    let mut told = Vec::new();
    let most = plan.speed_limit / plan.speed_asked;
    if most < rate {
        told.push(format!(
            "marks go up to {:.0} %: the largest marking speed is {:.4} m/s",
            most * 100.0,
            plan.speed_limit
        ));
    }
    let is_speed = |limit: &&Binding| {
        [Binding::SPEED_ASKED_FOR, Binding::MARKING_SPEED].contains(&limit.limit.as_str())
    };
    if let Some(limit) = plan.binding.iter().find(|limit| !is_speed(limit) && limit.share >= LEAST)
    {
        let axis = limit.axis.as_ref().map(|axis| format!(" of {axis}")).unwrap_or_default();
        told.push(format!(
            "{:.0} % of the time is bound by the {}{axis}, whatever the rate",
            limit.share * 100.0,
            limit.limit
        ));
    }
    (!told.is_empty()).then(|| told.join("; "))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn plan(limit: &str, share: f64) -> PlanFacts {
        let binding =
            |limit: &str, share| Binding { limit: limit.to_owned(), share, ..Binding::default() };
        PlanFacts {
            speed_asked: 0.5,
            speed_limit: 0.6,
            binding: vec![binding(Binding::SPEED_ASKED_FOR, 1.0 - share), binding(limit, share)],
            ..PlanFacts::default()
        }
    }

    #[test]
    fn the_largest_speed_and_what_binds_already_are_told() {
        let plan = plan("jerk of the tool", 0.25);
        let both = told(&plan, 1.5).unwrap();
        assert!(
            both.starts_with("marks go up to 120 %: the largest marking speed is 0.6000 m/s; 25 %")
        );
        assert!(both.contains("jerk of the tool"));
        assert!(told(&plan, 1.1).unwrap().starts_with("25 % of the time"));
    }

    #[test]
    fn nothing_is_told_where_nothing_caps() {
        assert_eq!(told(&plan("jerk of the tool", 0.0), 1.2), None);
        assert_eq!(caps(Path::new("/nowhere"), 1.5), None);
    }
}
