//! The mailbox: messages of other protocols in a sync manager's buffer (ETG.1000.4 5.6).

use std::collections::VecDeque;

use super::sdo::{Objects, Server};
use crate::ethercat::frame::{put, word};

/// Bytes of a mailbox's header.
const HEADER: usize = 6;

/// Bytes of CoE's header.
const COE_HEADER: usize = 2;

/// CAN application protocol over EtherCAT.
const COE: u8 = 3;

/// CoE's service of an emergency, of an SDO request, and of an SDO response.
const EMERGENCY: u16 = 1;
const REQUEST: u16 = 2;
const RESPONSE: u16 = 3;

/// Command of an aborted transfer.
const ABORT: u8 = 0x80;

/// Most messages that wait for the master.
const MOST_WAITING: usize = 8;

/// The slave's end of the mailbox.
#[derive(Debug, Clone, Default)]
pub struct Mailbox {
    server: Server,
    waiting: VecDeque<Vec<u8>>,
    counter: u8,
}

impl Mailbox {
    /// Takes a `message`, and makes its answer of `room` bytes at most ready.
    pub fn take(&mut self, message: &[u8], room: usize, objects: &mut dyn Objects) {
        let length = usize::from(word(message, 0));
        let kind = message.get(5).map_or(0, |kind| kind & 0x0F);
        let Some(body) = message.get(HEADER..HEADER + length) else {
            return self.refuse(0x08);
        };
        if kind != COE {
            return self.refuse(0x02);
        }
        if length < COE_HEADER + 8 {
            return self.refuse(0x06);
        }
        if word(body, 0) >> 12 != REQUEST {
            return self.refuse(0x03);
        }
        let room = room.saturating_sub(HEADER + COE_HEADER);
        let request = body.get(COE_HEADER..).unwrap_or_default();
        if let Some(answer) = self.server.answer(request, room, objects) {
            // ETG.1000.6 5.6.2.7: an abort goes as a request, whoever sends it.
            let aborts = answer.first() == Some(&ABORT);
            self.coe(if aborts { REQUEST } else { RESPONSE }, &answer);
        }
    }

    /// Tells the master of a fault: its `code`, the error `register`, and what else there is to say.
    pub fn emergency(&mut self, code: u16, register: u8) {
        let mut body = code.to_le_bytes().to_vec();
        body.extend([register, 0, 0, 0, 0, 0]);
        self.coe(EMERGENCY, &body);
    }

    /// The next message for the master, if there is one.
    pub fn pop(&mut self) -> Option<Vec<u8>> {
        self.waiting.pop_front()
    }

    fn coe(&mut self, service: u16, body: &[u8]) {
        let message = [&(service << 12).to_le_bytes(), body].concat();
        self.send(COE, &message);
    }

    /// Answers that a message cannot be taken: the detail of ETG.1000.4 table 30.
    fn refuse(&mut self, detail: u16) {
        let mut body = 1_u16.to_le_bytes().to_vec();
        body.extend(detail.to_le_bytes());
        self.send(0, &body);
    }

    fn send(&mut self, kind: u8, body: &[u8]) {
        if self.waiting.len() >= MOST_WAITING {
            return;
        }
        self.counter = self.counter % 7 + 1;
        let mut message = vec![0; HEADER];
        put(&mut message, 0, &(body.len() as u16).to_le_bytes());
        put(&mut message, 5, &[kind | self.counter << 4]);
        message.extend(body);
        self.waiting.push_back(message);
    }
}
