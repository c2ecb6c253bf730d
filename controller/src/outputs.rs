//! The digital outputs: who switches which, and when.
//!
//! | function | on |
//! |---|---|
//! | `air`, `general` | as the job says, while it is played or held with closed doors; by hand while there is none |
//! | `extraction` | while a job is under way, and for its time afterwards |
//! | `brake` | while the motors are powered; drives sees to it too, whatever becomes of the controller |
//! | `signal` | in its states |
//!
//! A fault puts out what a job or a person has switched on.

use machine::Machine;
use machine::operating::OutputFunction;
use messages::{CommandMode, ControllerState, Nanoseconds};

/// The bit of the air assist among a job's outputs; that of its digital output P is the one P + 1 after it.
const AIR: u64 = 1;

/// An extraction, and for how many cycles it goes on without a job.
#[derive(Debug, Clone, Copy)]
struct Extraction {
    bit: u64,
    after: u64,
    left: u64,
}

/// The outputs of one machine. A bit is the place of an output in its file.
#[derive(Debug, Clone)]
pub struct Switching {
    air: u64,
    /// Those of digital outputs 0, 1 and so on.
    general: Vec<u64>,
    extractions: Vec<Extraction>,
    signals: Vec<(u64, u32)>,
    brakes: u64,
    /// Those that a person has switched on.
    by_hand: u64,
    on: u64,
}

/// What a job has of the outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobOutputs {
    /// There is no job.
    None,
    /// It is under way, and what it has switched on is to be off: bits of nobody.
    Held,
    /// It is under way with these, bit 0 for the air assist, P + 1 for digital output P.
    On(u64),
}

impl Switching {
    /// Of this machine, all off.
    pub fn new(machine: &Machine) -> Self {
        let mut switching = Self {
            air: 0,
            general: Vec::new(),
            extractions: Vec::new(),
            signals: Vec::new(),
            brakes: machine.operating.brakes(),
            by_hand: 0,
            on: 0,
        };
        let period = machine.realtime.period;
        for (bit, output) in machine.operating.output_bits() {
            match output.function {
                OutputFunction::Air => switching.air |= bit,
                OutputFunction::General => switching.general.push(bit),
                OutputFunction::Extraction { after } => {
                    let after = period.cycles_in(Nanoseconds::from_seconds(after));
                    switching.extractions.push(Extraction { bit, after, left: 0 });
                }
                OutputFunction::Signal { states } => switching.signals.push((bit, states)),
                OutputFunction::Brake => {}
            }
        }
        switching
    }

    /// The outputs that are on, one bit each.
    pub fn on(&self) -> u64 {
        self.on
    }

    /// Switches the output with this index by hand, of those that a job could switch; whether it is one.
    pub fn switch(&mut self, index: usize, is_on: bool) -> bool {
        let bit = u32::try_from(index).ok().and_then(|index| 1_u64.checked_shl(index));
        let bit = bit.filter(|bit| self.by_job() & bit != 0);
        match bit {
            Some(bit) if is_on => self.by_hand |= bit,
            Some(bit) => self.by_hand &= !bit,
            None => return false,
        }
        true
    }

    /// Those that a job can switch.
    fn by_job(&self) -> u64 {
        self.general.iter().fold(self.air, |bits, bit| bits | bit)
    }

    /// Goes on by one cycle: the outputs in the one to come.
    pub fn cycle(&mut self, job: JobOutputs, state: ControllerState, mode: CommandMode) -> u64 {
        let is_faulted = matches!(state, ControllerState::Faulted | ControllerState::Halted);
        if job != JobOutputs::None || is_faulted || mode == CommandMode::QuickStop {
            self.by_hand = 0;
        }
        let mut on = self.by_hand;
        if let JobOutputs::On(bits) = job {
            on |= if bits & AIR != 0 { self.air } else { 0 };
            let general = self.general.iter().zip(1_u32..);
            on |= general
                .filter(|(_, place)| bits >> place & 1 == 1)
                .fold(0, |on, (bit, _)| on | bit);
        }
        for extraction in &mut self.extractions {
            extraction.left = match job {
                JobOutputs::None => extraction.left.saturating_sub(1),
                _ => extraction.after.saturating_add(1),
            };
            on |= if extraction.left > 0 { extraction.bit } else { 0 };
        }
        let signals = self.signals.iter().filter(|(_, states)| states >> state as u32 & 1 == 1);
        on = signals.fold(on, |on, (bit, _)| on | bit);
        self.on = on | if mode == CommandMode::Disabled { 0 } else { self.brakes };
        self.on
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use ControllerState as State;

    const OUTPUTS: &str = r#"
[outputs.valve]
function = "general"
[outputs.air]
function = "air"
[outputs.fan]
function = "extraction"
after = "3 ms"
[outputs.red]
function = "signal"
states = ["faulted", "halted"]
[outputs.green]
function = "signal"
states = ["running"]
[outputs.brake]
function = "brake"
[outputs.clamp]
function = "general"
"#;

    const VALVE: u64 = 1;
    const AIR_JET: u64 = 2;
    const FAN: u64 = 4;
    const RED: u64 = 8;
    const GREEN: u64 = 16;
    const BRAKE: u64 = 32;
    const CLAMP: u64 = 64;

    fn switching() -> Switching {
        let text = format!("{}{OUTPUTS}", machine::machine::BUILTIN);
        Switching::new(&Machine::parse("outputs.toml", &text, &[]).unwrap())
    }

    #[test]
    fn each_output_follows_who_switches_it() {
        let mut switching = switching();
        let mut cycle = |job, state, mode| switching.cycle(job, state, mode);
        let (off, driven) = (CommandMode::Disabled, CommandMode::Driven);
        assert_eq!(cycle(JobOutputs::None, State::Disabled, off), 0);
        assert_eq!(cycle(JobOutputs::None, State::Idle, driven), BRAKE);
        // Air, and digital output 1, which is the second general one.
        let job = JobOutputs::On(0b101);
        assert_eq!(cycle(job, State::Running, driven), AIR_JET | CLAMP | FAN | GREEN | BRAKE);
        assert_eq!(cycle(JobOutputs::On(0b10), State::Holding, driven), VALVE | FAN | BRAKE);
        assert_eq!(cycle(JobOutputs::Held, State::Holding, driven), FAN | BRAKE);
        // The extraction goes on for its time, here of three cycles.
        for _ in 0..3 {
            assert_eq!(cycle(JobOutputs::None, State::Idle, driven), FAN | BRAKE);
        }
        assert_eq!(cycle(JobOutputs::None, State::Idle, driven), BRAKE);
        assert_eq!(cycle(JobOutputs::None, State::Stopping, CommandMode::QuickStop), BRAKE);
        assert_eq!(cycle(JobOutputs::None, State::Faulted, off), RED);
    }

    #[test]
    fn what_a_person_has_switched_on_goes_off_with_a_fault_and_with_a_job() {
        let (driven, off) = (CommandMode::Driven, CommandMode::Disabled);
        for (job, state, mode) in [
            (JobOutputs::On(0), State::Running, driven),
            (JobOutputs::None, State::Faulted, off),
            (JobOutputs::None, State::Halted, driven),
            (JobOutputs::None, State::Stopping, CommandMode::QuickStop),
        ] {
            let mut switching = switching();
            assert!(switching.switch(0, true) && switching.switch(1, true));
            let on = switching.cycle(JobOutputs::None, State::Disabled, off);
            assert_eq!(on, VALVE | AIR_JET);
            assert!(switching.switch(1, false));
            assert_eq!(switching.cycle(JobOutputs::None, State::Idle, driven), VALVE | BRAKE);
            assert_eq!(switching.cycle(job, state, mode) & VALVE, 0, "{state:?}");
            assert_eq!(switching.cycle(JobOutputs::None, State::Idle, driven) & VALVE, 0);
        }
        // Extraction, lamps, brakes and what there is not.
        for index in [2, 3, 5, 7, 64, usize::MAX] {
            assert!(!switching().switch(index, true), "{index}");
        }
    }
}
