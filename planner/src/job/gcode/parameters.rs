//! The parameters that a program sets: numbered ones, and named ones that belong to a subroutine, or to
//! all of the program where their names begin with `_`.

use std::collections::HashMap;

use super::expression::Target;

/// Parameters 1 to this one belong to a subroutine.
const LOCAL: usize = 30;

/// The last parameter that a program may set.
const LAST: u32 = 5000;

/// How many parameters a program may have.
const MOST: usize = 100_000;

/// Predefined parameters, which a program cannot set.
pub(super) const PREDEFINED: [&str; 24] = [
    "_x",
    "_y",
    "_z",
    "_metric",
    "_imperial",
    "_absolute",
    "_incremental",
    "_inverse_time",
    "_units_per_minute",
    "_units_per_rev",
    "_coord_system",
    "_motion_mode",
    "_plane",
    "_feed",
    "_rpm",
    "_spindle_on",
    "_flood",
    "_mist",
    "_current_tool",
    "_line",
    "_call_level",
    "_value",
    "_value_returned",
    "_task",
];

/// What a program has set.
#[derive(Debug)]
pub(super) struct Store {
    numbered: HashMap<u32, f64>,
    global: HashMap<String, f64>,
    /// Those of the main program, and of each subroutine that is being run.
    local: Vec<Local>,
    /// What the last subroutine gave back, and whether it gave anything.
    pub(super) returned: Option<f64>,
}

/// What belongs to one run of a subroutine.
#[derive(Debug, Clone, Default)]
struct Local {
    numbered: [f64; LOCAL],
    named: HashMap<String, f64>,
}

impl Store {
    pub(super) fn new() -> Self {
        Self {
            numbered: HashMap::new(),
            global: HashMap::new(),
            local: vec![Local::default()],
            returned: None,
        }
    }

    /// Begins a subroutine with `arguments` in its first parameters.
    pub(super) fn enter(&mut self, arguments: &[f64]) {
        let mut local = Local::default();
        for (place, argument) in local.numbered.iter_mut().zip(arguments) {
            *place = *argument;
        }
        self.local.push(local);
    }

    /// Begins a program that M98 calls: it shares the numbered parameters of its caller.
    pub(super) fn enter_program(&mut self) {
        let numbered = self.local.last().map_or([0.0; LOCAL], |local| local.numbered);
        self.local.push(Local { numbered, named: HashMap::new() });
    }

    /// Ends what was begun last, a program or a subroutine.
    pub(super) fn leave(&mut self, is_program: bool) {
        if self.local.len() < 2 {
            return;
        }
        if let (Some(left), Some(caller)) = (self.local.pop(), self.local.last_mut())
            && is_program
        {
            caller.numbered = left.numbered;
        }
    }

    /// How many subroutines are being run.
    pub(super) fn level(&self) -> usize {
        self.local.len() - 1
    }

    /// One that the program may set; 0 before it does. `None` of those that it may not.
    pub(super) fn numbered(&self, index: u32) -> Option<f64> {
        let own =
            (index as usize).checked_sub(1).and_then(|at| self.local.last()?.numbered.get(at));
        if let Some(value) = own {
            return Some(*value);
        }
        (index <= LAST).then(|| self.numbered.get(&index).copied().unwrap_or(0.0))
    }

    /// `None` before it is set.
    pub(super) fn named(&self, name: &str) -> Option<f64> {
        let names = if name.starts_with('_') { &self.global } else { &self.local.last()?.named };
        names.get(name).copied()
    }

    /// Sets one. Gives back whether there was room for it.
    pub(super) fn set(&mut self, target: Target, value: f64) -> bool {
        let Some(local) = self.local.last_mut() else { return false };
        let room = self.numbered.len() + self.global.len() + local.named.len() < MOST;
        match target {
            Target::Numbered(index) => {
                match (index as usize).checked_sub(1).and_then(|at| local.numbered.get_mut(at)) {
                    Some(place) => *place = value,
                    None if room => {
                        self.numbered.insert(index, value);
                    }
                    None => return false,
                }
            }
            Target::Named(_) if !room => return false,
            Target::Named(name) if name.starts_with('_') => {
                self.global.insert(name, value);
            }
            Target::Named(name) => {
                local.named.insert(name, value);
            }
        }
        true
    }
}

/// Why a program cannot set a parameter, `None` where it can.
pub(super) fn refusal(target: &Target) -> Option<String> {
    match target {
        Target::Numbered(5161..=5163 | 5181..=5183) => None,
        Target::Numbered(index) if *index > LAST => {
            Some(format!("#{index} is not set by a program: those are #1 to #{LAST}"))
        }
        Target::Named(name) if PREDEFINED.contains(&name.as_str()) => {
            Some(format!("#<{name}> is predefined and cannot be set"))
        }
        _ => None,
    }
}
