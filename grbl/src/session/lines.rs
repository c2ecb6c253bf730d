//! Lines as they come in and wait, what they wait for, and what is said.

use super::{
    BLOCKS, ErrorCode, Held, MOST_OUTPUT, Procedure, Purpose, Session, Unit, WINDOW, Waiting,
    is_busy,
};

/// Bytes of lines that are kept at most; what a client sends beyond is answered with an error.
const MOST_WAITING: usize = 1 << 16;

impl Session {
    /// Forgets all lines that wait, unanswered.
    pub(super) fn forget_lines(&mut self) {
        self.waiting.clear();
        self.waiting_bytes = 0;
        self.held = None;
        self.procedure = Procedure::default();
        self.purposes.retain(|(_, purpose)| *purpose != Purpose::Line);
    }

    /// Takes bytes of the client.
    pub fn receive(&mut self, bytes: &[u8], now: f64) {
        self.now = now;
        for &byte in bytes {
            match self.splitter.take(byte) {
                Unit::None => {}
                Unit::Text => self.heard = now,
                Unit::Realtime(realtime) => self.realtime(realtime),
                Unit::Line(line) => {
                    self.heard = now;
                    self.wait(Waiting::Line(line));
                }
                Unit::TooLong => self.wait(Waiting::Dropped),
            }
        }
        self.go_on();
    }

    pub(super) fn wait(&mut self, line: Waiting) {
        let bytes = match &line {
            Waiting::Line(line) => line.len() + 1,
            Waiting::Dropped => 1,
        };
        let is_room = self.waiting_bytes + bytes <= MOST_WAITING;
        // Whoever goes on so far beyond its window counts no answers.
        if !is_room && self.waiting.len() > MOST_WAITING {
            return;
        }
        self.waiting_bytes += if is_room { bytes } else { 1 };
        self.waiting.push_back(if is_room { line } else { Waiting::Dropped });
    }

    /// Bytes of its window that the client has left.
    pub(super) fn room(&self) -> usize {
        WINDOW.saturating_sub(self.waiting_bytes + self.splitter.length())
    }

    /// Does whatever can be done now.
    pub(super) fn go_on(&mut self) {
        self.follow_motions();
        loop {
            self.release();
            if self.held.is_some() {
                break;
            }
            let Some(line) = self.waiting.pop_front() else { break };
            match line {
                Waiting::Line(line) => {
                    self.waiting_bytes = self.waiting_bytes.saturating_sub(line.len() + 1);
                    self.handle(&line);
                }
                Waiting::Dropped => {
                    self.waiting_bytes = self.waiting_bytes.saturating_sub(1);
                    self.refuse_line(ErrorCode::TooLong, "the line is too long, or one too many");
                }
            }
        }
        if self.is_program_over() {
            self.hand_over();
        }
        self.next_jog();
    }

    /// Answers the held line where what it waits for is there.
    pub(super) fn release(&mut self) {
        let now = self.now;
        match &self.held {
            Some(Held::Dwell { .. }) if !self.waiting.is_empty() => {
                self.held = None;
                self.ok();
            }
            Some(Held::Rest { dwell, since } | Held::Dwell { dwell, since }) => {
                // The program before it goes first.
                let has_work = self.spool.as_ref().is_some_and(|gathered| gathered.has_work);
                if has_work || !self.rests() {
                    self.set_since(None);
                    return;
                }
                let since = *since.as_ref().unwrap_or(&now);
                let is_over = now - since >= *dwell;
                self.set_since(Some(since));
                if is_over {
                    self.held = None;
                    self.ok();
                }
            }
            Some(Held::JogRoom) if self.jogs.len() < BLOCKS => {
                self.held = None;
                self.ok();
            }
            _ => {}
        }
    }

    fn set_since(&mut self, value: Option<f64>) {
        if let Some(Held::Rest { since, .. } | Held::Dwell { since, .. }) = &mut self.held {
            *since = value;
        }
    }

    /// Whether nothing of this session is under way, and the machine stands.
    pub(super) fn rests(&self) -> bool {
        let state = self.status.as_ref().map(|status| status.state.as_str());
        self.jobs.is_empty()
            && self.jogs.is_empty()
            && self.jogging.is_over()
            && !state.is_some_and(is_busy)
    }

    /// Handles a line.
    fn handle(&mut self, line: &[u8]) {
        let line = line.trim_ascii();
        if line.is_empty() {
            self.ok();
            return;
        }
        if self.is_asleep {
            self.refuse_line(ErrorCode::Locked, "asleep: send a reset (0x18)");
            return;
        }
        match line.strip_prefix(b"$") {
            Some(system) => {
                let text = String::from_utf8_lossy(system).trim().to_owned();
                self.system(&text);
            }
            None => self.program_line(line),
        }
    }

    pub(super) fn ok(&mut self) {
        self.line("ok");
    }

    pub(super) fn refuse_line(&mut self, code: ErrorCode, words: &str) {
        self.message(words);
        self.error(code);
    }

    pub(super) fn error(&mut self, code: ErrorCode) {
        self.line(&format!("error:{}", code as u8));
    }

    /// A push message, which no line of a client is answered with.
    pub(super) fn message(&mut self, words: &str) {
        // Brackets and line ends would end it for a client.
        let words: String = words
            .chars()
            .map(|character| match character {
                '[' => '(',
                ']' => ')',
                character if character.is_control() => ' ',
                character => character,
            })
            .collect();
        self.line(&format!("[MSG:{words}]"));
    }

    pub(super) fn line(&mut self, text: &str) {
        if !self.is_connected {
            return;
        }
        if self.output.len() < MOST_OUTPUT {
            self.output.extend_from_slice(text.as_bytes());
            self.output.extend_from_slice(b"\r\n");
        }
    }
}
