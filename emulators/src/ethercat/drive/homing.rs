//! How a drive finds its home position by itself (CiA 402-2, homing mode).

use super::switches::Closed;

/// How the home position is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Where the motor is.
    Here,
    /// At the next index pulse in this direction.
    Index(Way),
    /// Where the limit switch on this side opens.
    Limit(Way),
    /// At the first index pulse after the limit switch on this side has opened.
    LimitIndex(Way),
    /// Where the home switch opens that is closed from its edge on in this direction.
    Switch(Way),
    /// Where the same closes.
    SwitchEdge(Way),
}

/// How a homing has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Homed {
    /// It has not, or was broken off.
    Not,
    /// The home position is known.
    Attained,
    /// It was not found.
    Failed,
}

/// A direction of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Towards smaller positions.
    Down,
    /// Towards larger ones.
    Up,
}

impl Way {
    fn sign(self) -> f64 {
        if self == Self::Up { 1.0 } else { -1.0 }
    }
}

impl Method {
    /// The method of CiA 402's `number`, of those that this drive has.
    pub fn of(number: i8) -> Option<Self> {
        match number {
            1 => Some(Self::LimitIndex(Way::Down)),
            2 => Some(Self::LimitIndex(Way::Up)),
            17 => Some(Self::Limit(Way::Down)),
            18 => Some(Self::Limit(Way::Up)),
            19 => Some(Self::Switch(Way::Up)),
            20 => Some(Self::SwitchEdge(Way::Up)),
            21 => Some(Self::Switch(Way::Down)),
            22 => Some(Self::SwitchEdge(Way::Down)),
            33 => Some(Self::Index(Way::Down)),
            34 => Some(Self::Index(Way::Up)),
            35 | 37 => Some(Self::Here),
            _ => None,
        }
    }
}

/// How far a homing has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Approach(Way),
    Leave(Way),
    Return(Way),
    Index(Way),
}

/// What a homing wants next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// To move: towards smaller or larger positions, quickly (`true`) or slowly.
    Move(f64, bool),
    /// It has found home, at this position [counts of the encoder].
    Found(i64),
    /// It has come to the end of its way without finding it.
    Failed,
}

/// What a homing does where its switch has opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum After {
    /// That is home.
    Nothing,
    /// It goes back until the switch closes.
    Return,
    /// It goes on to the next index pulse.
    Index,
}

/// A homing that is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Homing {
    stage: Option<Stage>,
    after: After,
    /// Whether it is the home switch that is looked for, not a limit switch.
    by_switch: bool,
    revolution: i64,
    before: i64,
}

impl Homing {
    /// Begins at `counts`, the encoder having an index pulse every `revolution` counts.
    pub fn new(method: Method, counts: i64, revolution: i64) -> Self {
        let stage = match method {
            Method::Here => None,
            Method::Index(way) => Some(Stage::Index(way)),
            Method::Limit(way)
            | Method::LimitIndex(way)
            | Method::Switch(way)
            | Method::SwitchEdge(way) => Some(Stage::Approach(way)),
        };
        let by_switch = matches!(method, Method::Switch(_) | Method::SwitchEdge(_));
        let after = match method {
            Method::LimitIndex(_) => After::Index,
            Method::SwitchEdge(_) => After::Return,
            _ => After::Nothing,
        };
        Self { stage, after, by_switch, revolution: revolution.max(1), before: counts }
    }

    /// Goes on at `counts` with these switches `closed`.
    pub fn step(&mut self, counts: i64, switches: Closed) -> Step {
        let closed = |way| if self.by_switch { switches.home } else { switches.limit(way) };
        let other = |way| if way == Way::Down { Way::Up } else { Way::Down };
        let before = core::mem::replace(&mut self.before, counts);
        let Some(stage) = self.stage else { return Step::Found(counts) };
        match stage {
            Stage::Approach(way) if closed(way) => self.stage = Some(Stage::Leave(way)),
            // The end of the axis, and the switch was not there; or the axis does not leave it.
            Stage::Approach(way) if switches.limit(way) => return Step::Failed,
            Stage::Leave(way) if switches.limit(other(way)) => return Step::Failed,
            Stage::Index(way) if switches.limit(way) => return Step::Failed,
            Stage::Leave(way) if !closed(way) => match self.after {
                After::Nothing => return Step::Found(counts),
                After::Return => self.stage = Some(Stage::Return(way)),
                After::Index => self.stage = Some(Stage::Index(other(way))),
            },
            Stage::Return(way) if closed(way) => return Step::Found(counts),
            Stage::Return(way) if switches.limit(way) => return Step::Failed,
            Stage::Index(_) => {
                let turns = [before, counts].map(|it| it.div_euclid(self.revolution));
                if let [from, to] = turns
                    && from != to
                {
                    return Step::Found(from.max(to) * self.revolution);
                }
            }
            _ => {}
        }
        match self.stage {
            Some(Stage::Approach(way)) => Step::Move(way.sign(), true),
            Some(Stage::Leave(way)) => Step::Move(other(way).sign(), false),
            Some(Stage::Return(way) | Stage::Index(way)) => Step::Move(way.sign(), false),
            None => Step::Found(counts),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::switches::Switches;
    use super::*;

    /// Where it is found from 0 on, with limit switches so far away on either side, and a home switch.
    fn home(number: i8, limit: i64, home: Option<(i64, Way)>) -> Option<i64> {
        let switches = Switches { limits: [-limit, limit], home };
        let mut homing = Homing::new(Method::of(number)?, 0, 1000);
        let mut counts = 0;
        for _ in 0..10_000 {
            match homing.step(counts, switches.closed(counts)) {
                Step::Move(way, quick) => counts += way as i64 * if quick { 8 } else { 2 },
                Step::Found(at) => return Some(at),
                Step::Failed => return None,
            }
        }
        None
    }

    #[test]
    fn each_method_finds_its_home() {
        assert_eq!(home(35, 100, None), Some(0));
        assert_eq!(home(17, 1500, None), Some(-1498));
        assert_eq!(home(18, 1500, None), Some(1498));
        assert_eq!(home(19, 1500, Some((700, Way::Up))), Some(698));
        assert_eq!(home(21, 1500, Some((-700, Way::Down))), Some(-698));
        assert_eq!(home(21, 1500, Some((700, Way::Down))), Some(702), "it stands on its switch");
        assert_eq!(home(20, 1500, Some((700, Way::Up))), Some(700));
        assert_eq!(home(22, 1500, Some((-700, Way::Down))), Some(-700));
        assert_eq!(home(22, 1500, Some((700, Way::Down))), Some(700), "it stands on its switch");
        assert_eq!(home(1, 1500, None), Some(-1000));
        assert_eq!(home(2, 1500, None), Some(1000));
        assert_eq!(home(34, 5000, None), Some(1000));
        assert_eq!(home(33, 5000, None), Some(0));
        assert_eq!(home(3, 100, None), None);
    }

    #[test]
    fn what_is_not_there_is_not_looked_for_without_end() {
        assert_eq!(home(19, 1500, None), None);
        assert_eq!(home(21, 1500, Some((700, Way::Up))), None);
        assert_eq!(home(34, 500, None), None);
    }
}
