//! Lines of programs: read and answered one by one, gathered, and handed over as one job.

use super::{Gathered, Held, OwnJob, Purpose, SHORT_SILENCE, SILENCE, Session, WINDOW};
use crate::codes::{Alarm, ErrorCode};
use crate::machine::{Answer, Ask, JobState};

impl Session {
    /// Takes where the machine is for where the program is, while nothing else moves it.
    pub(super) fn sync(&mut self) {
        if self.spool.is_none() && self.rests() && self.status.is_some() {
            self.reader.stand_at(self.tool());
        }
    }

    /// Reads a line, answers it, and adds it to the program.
    pub(super) fn program_line(&mut self, line: &[u8]) {
        if self.is_locked() && !self.is_checking {
            return self.refuse_line(ErrorCode::Locked, "locked: $X or $H unlocks");
        }
        if !self.jogs.is_empty() || !self.jogging.is_over() {
            return self.refuse_line(ErrorCode::Locked, "the machine is being jogged");
        }
        if line == b"%" {
            self.ok();
            if self.spool.as_ref().is_some_and(|gathered| gathered.has_work) {
                self.hand_over();
            }
            return;
        }
        match probe_code(line) {
            Some(Ok(must_touch)) => return self.probe_line(line, must_touch),
            Some(Err(words)) => return self.refuse_line(ErrorCode::Unsupported, words),
            None => {}
        }
        self.sync();
        let preamble = if self.spool.is_none() { self.reader.preamble() } else { String::new() };
        let read = self.reader.read(line);
        if !self.is_checking && !self.gather(&preamble, line) {
            return;
        }
        let effect = match read {
            Ok(effect) => effect,
            Err(error) => {
                let words = format!("{}, column {}; {}", error.message, error.column, error.help);
                return self.refuse(ErrorCode::of(&error), words);
            }
        };
        if let Some(words) = effect.bounds.as_ref().and_then(|bounds| self.beyond(bounds)) {
            return self.refuse(ErrorCode::Travel, words);
        }
        for note in &effect.notes {
            let number = self.line_number();
            self.message(&format!("line {number}: {note}"));
        }
        if self.is_checking {
            return self.ok();
        }
        let works = effect.bounds.is_some() || effect.is_lit || effect.pauses;
        if let Some(gathered) = &mut self.spool {
            gathered.is_more |= effect.is_lit || effect.pauses || works && gathered.has_work;
            gathered.has_work |= works;
        }
        if effect.ends {
            self.hand_over();
            self.held = Some(Held::Rest { dwell: 0.0, since: None });
            return;
        }
        match effect.dwell.filter(|_| !effect.is_lit) {
            Some(dwell) => {
                // In a program the dwell is the job's.
                let has_work = self.spool.as_ref().is_some_and(|gathered| gathered.has_work);
                let dwell = if has_work { 0.0 } else { dwell };
                self.held = Some(Held::Dwell { dwell, since: None });
            }
            None => self.ok(),
        }
    }

    /// Adds a line to the program, which it begins after `preamble` where there is none; whether that could be done.
    fn gather(&mut self, preamble: &str, line: &[u8]) -> bool {
        let spool = match self.spool.take() {
            Some(gathered) => Ok(gathered),
            None => self.spools.begin(preamble).map(|spool| Gathered {
                spool,
                has_work: false,
                is_more: false,
                refused: 0,
                first_refused: None,
            }),
        };
        let added = spool.and_then(|mut gathered| gathered.spool.add(line).map(|()| gathered));
        match added {
            Ok(gathered) => {
                self.spool = Some(gathered);
                true
            }
            Err(error) => {
                self.refuse_line(
                    ErrorCode::TooLong,
                    &format!("the program cannot be kept: {error}"),
                );
                false
            }
        }
    }

    /// The number of the client's newest line in its program, from 1.
    fn line_number(&self) -> u64 {
        self.spool.as_ref().map_or(1, |gathered| gathered.spool.lines)
    }

    /// Refuses the newest line, and with it the whole program.
    fn refuse(&mut self, code: ErrorCode, words: String) {
        let Some(gathered) = &mut self.spool else { return self.refuse_line(code, &words) };
        let number = gathered.spool.lines;
        gathered.refused += 1;
        gathered.first_refused.get_or_insert_with(|| (number, words.clone()));
        self.refuse_line(code, &format!("line {number}: {words}"));
    }

    /// Whether the program that was gathered is to begin now: nothing more comes before it is answered, or nothing has come
    /// for a while.
    pub(super) fn is_program_over(&self) -> bool {
        let Some(gathered) = &self.spool else { return false };
        if self.is_paused && gathered.has_work {
            return false;
        }
        let silence = self.now - self.heard;
        let is_full = self.held.is_some() && self.waiting_bytes + self.splitter.length() >= WINDOW;
        let single =
            gathered.has_work && !gathered.is_more && self.held.is_none() && gathered.refused == 0;
        is_full || silence >= if single { SHORT_SILENCE } else { SILENCE }
    }

    /// Hands the program over as a job; one with a line that was refused is thrown away, and so is one that does nothing.
    pub(super) fn hand_over(&mut self) {
        let Some(gathered) = self.spool.take() else { return };
        let Gathered { spool, has_work, refused, first_refused, .. } = gathered;
        if let Some((number, words)) = first_refused {
            spool.discard();
            if has_work {
                let lines =
                    if refused == 1 { "a line is" } else { &format!("{refused} lines are") };
                self.message(&format!(
                    "the job is not begun: {lines} wrong, the first is line {number}: {words}"
                ));
            }
            return;
        }
        if !has_work {
            spool.discard();
            return self.settle_air();
        }
        let before = spool.before;
        match spool.finish() {
            Ok(file) => {
                let full_scale = self.settings.full_scale;
                let set =
                    vec!["gcode.dialect=grbl".to_owned(), format!("gcode.full_scale={full_scale}")];
                let ticket = self.ask(Ask::Submit { file, set }, Purpose::Submit);
                self.jobs.push_back(OwnJob { number: None, ticket, before });
            }
            Err(error) => {
                self.message(&format!("the job is not begun: {error}"));
                self.raise(Alarm::Travel);
            }
        }
    }

    /// Switches the air assist where a line has done so without a program.
    fn settle_air(&mut self) {
        let Some(name) = self.air_output() else { return };
        let is_on = self.reader.modals().air;
        let was_on = self.status.as_ref().and_then(|status| status.outputs.get(&name).copied());
        if was_on.is_some_and(|was_on| was_on != is_on) && self.rests() {
            self.ask(Ask::Output { name, is_on }, Purpose::Free);
        }
    }

    /// The machine has taken a job, or not.
    pub(super) fn submitted(&mut self, ticket: u64, answer: Answer) {
        let place = self.jobs.iter().position(|job| job.ticket == ticket);
        match (answer, place) {
            (Answer::Submitted(number), Some(place)) => self.jobs[place].number = Some(number),
            // It was given up meanwhile.
            (Answer::Submitted(job), None) => {
                self.ask(Ask::Withdraw { job }, Purpose::Free);
            }
            (Answer::Refused(words), Some(place)) => {
                self.jobs.remove(place);
                self.job_failed(&words);
            }
            (Answer::Done(_), Some(place)) => {
                self.jobs.remove(place);
            }
            (_, None) => {}
        }
    }

    /// Follows a job of this session.
    pub(super) fn job_goes(&mut self, number: u64, state: JobState) {
        let JobState::Ended { outcome, message } = state else { return };
        let Some(place) = self.jobs.iter().position(|job| job.number == Some(number)) else {
            return;
        };
        let before = self.jobs[place].before;
        self.jobs.remove(place);
        match outcome.as_str() {
            "completed" => {}
            "stopped" => {
                self.drop_work();
                self.message("the job was stopped");
                self.sync();
            }
            "refused" => {
                let words = message.unwrap_or_default();
                let note = if before > 0 {
                    format!(" (its lines count on after {before} that say where it begins)")
                } else {
                    String::new()
                };
                self.job_failed(&format!("{words}{note}"));
            }
            _ => {
                // A fault is told by itself, with its alarm.
                self.drop_work();
                if let Some(words) = message {
                    self.message(&format!("the job has ended: {words}"));
                }
                self.fail_held();
                self.sync();
            }
        }
    }

    /// A job that was not begun: nothing that follows it is.
    fn job_failed(&mut self, words: &str) {
        self.drop_work();
        self.message(&format!("the job is not begun: {words}"));
        self.raise(Alarm::Travel);
        self.fail_held();
        self.sync();
    }
}

/// Whether a line probes and must touch, or why it cannot; `None` of another line.
fn probe_code(line: &[u8]) -> Option<Result<bool, &'static str>> {
    let text: String = line
        .iter()
        .take_while(|byte| !b"(;".contains(byte))
        .filter(|byte| !byte.is_ascii_whitespace())
        .map(|byte| char::from(byte.to_ascii_uppercase()))
        .collect();
    let place = text.find("G38.")?;
    match text.as_bytes().get(place + 4) {
        Some(b'2') => Some(Ok(true)),
        Some(b'3') => Some(Ok(false)),
        _ => Some(Err("G38.4 and G38.5 are not supported: a probe moves until it touches, G38.2")),
    }
}
