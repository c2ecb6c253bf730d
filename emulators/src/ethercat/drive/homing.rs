//! How a drive finds its home position by itself (CiA 402-2, homing mode).

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
    Index(Way),
}

/// What a homing wants next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// To move: towards smaller or larger positions, quickly (`true`) or slowly.
    Move(f64, bool),
    /// It has found home, at this position [counts of the encoder].
    Found(i64),
}

/// A homing that is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Homing {
    stage: Option<Stage>,
    index_after: bool,
    revolution: i64,
    before: i64,
}

impl Homing {
    /// Begins at `counts`, the encoder having an index pulse every `revolution` counts.
    pub fn new(method: Method, counts: i64, revolution: i64) -> Self {
        let stage = match method {
            Method::Here => None,
            Method::Index(way) => Some(Stage::Index(way)),
            Method::Limit(way) | Method::LimitIndex(way) => Some(Stage::Approach(way)),
        };
        let index_after = matches!(method, Method::LimitIndex(_));
        Self { stage, index_after, revolution: revolution.max(1), before: counts }
    }

    /// Goes on at `counts` with the limit switches `below` and `above` closed or not.
    pub fn step(&mut self, counts: i64, [below, above]: [bool; 2]) -> Step {
        let closed = |way| if way == Way::Down { below } else { above };
        let other = |way| if way == Way::Down { Way::Up } else { Way::Down };
        let before = core::mem::replace(&mut self.before, counts);
        let Some(stage) = self.stage else { return Step::Found(counts) };
        match stage {
            Stage::Approach(way) if closed(way) => self.stage = Some(Stage::Leave(way)),
            Stage::Leave(way) if !closed(way) => {
                if !self.index_after {
                    return Step::Found(counts);
                }
                self.stage = Some(Stage::Index(other(way)));
            }
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
            Some(Stage::Index(way)) => Step::Move(way.sign(), false),
            None => Step::Found(counts),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn home(number: i8, switch: i64) -> Option<i64> {
        let mut homing = Homing::new(Method::of(number)?, 0, 1000);
        let mut counts = 0;
        for _ in 0..10_000 {
            match homing.step(counts, [counts <= -switch, counts >= switch]) {
                Step::Move(way, quick) => counts += way as i64 * if quick { 8 } else { 2 },
                Step::Found(at) => return Some(at),
            }
        }
        None
    }

    #[test]
    fn each_method_finds_its_home() {
        assert_eq!(home(35, 100), Some(0));
        assert_eq!(home(17, 1500), Some(-1498));
        assert_eq!(home(18, 1500), Some(1498));
        assert_eq!(home(1, 1500), Some(-1000));
        assert_eq!(home(2, 1500), Some(1000));
        assert_eq!(home(34, 5000), Some(1000));
        assert_eq!(home(33, 5000), Some(0));
        assert_eq!(home(3, 100), None);
    }
}
