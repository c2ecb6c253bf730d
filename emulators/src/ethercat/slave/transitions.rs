//! What a slave asks of its settings before it goes from one state to the next.

use messages::Nanoseconds;

use super::super::device::Loss;
use super::sii::Use;
use super::state::{Code, State};
use super::sync_manager::{Direction, SyncManager};
use super::{Slave, register};

impl Slave {
    /// A master has written `request` to the control register: a state, and bit 4 to acknowledge a fault.
    pub(super) fn request(&mut self, request: u8, now: Nanoseconds) {
        let faulty = self.code() != 0;
        let acknowledged = request & 0x10 != 0;
        let wanted = match State::of(request) {
            Ok(wanted) => wanted,
            Err(code) => return self.tell_state(self.state, Some(code)),
        };
        if faulty && !acknowledged && wanted > State::Init {
            return;
        }
        if wanted == self.state {
            return self.tell_state(wanted, None);
        }
        let ready = if self.state.leads_to(wanted) {
            self.ready_for(wanted, now)
        } else {
            Err(Code::InvalidChange)
        };
        match ready {
            Ok(()) => self.enter(wanted, now),
            Err(code) => self.tell_state(self.state, Some(code)),
        }
    }

    fn ready_for(&self, wanted: State, now: Nanoseconds) -> Result<(), Code> {
        if wanted <= self.state {
            return Ok(());
        }
        match wanted {
            State::Init => Ok(()),
            State::PreOp => self.mailboxes_are_set(),
            State::SafeOp => self.buffers_are_set(),
            State::Op => {
                self.buffers_are_set()?;
                let coming = self.asked_sync().is_none() || self.clock.next(now).is_some();
                if coming { Ok(()) } else { Err(Code::NoSync) }
            }
        }
    }

    fn mailboxes_are_set(&self) -> Result<(), Code> {
        let set = |(purpose, direction)| {
            self.description.manager(purpose).is_none_or(|(index, it)| {
                SyncManager::of(&self.memory, index).is(it.start, it.length, true, direction)
            })
        };
        let both = [(Use::MailboxOut, Direction::Write), (Use::MailboxIn, Direction::Read)];
        if both.into_iter().all(set) { Ok(()) } else { Err(Code::Mailbox) }
    }

    fn buffers_are_set(&self) -> Result<(), Code> {
        self.mailboxes_are_set()?;
        let [outputs, inputs] = self.device.sizes(self.asked_sync())?;
        for (purpose, direction, bytes, code) in [
            (Use::Outputs, Direction::Write, outputs, Code::Outputs),
            (Use::Inputs, Direction::Read, inputs, Code::Inputs),
        ] {
            let Some((index, expected)) = self.description.manager(purpose) else { continue };
            let manager = SyncManager::of(&self.memory, index);
            let length = u16::try_from(bytes).unwrap_or(u16::MAX);
            if !manager.is(expected.start, length, false, direction) {
                return Err(code);
            }
        }
        Ok(())
    }

    fn enter(&mut self, state: State, now: Nanoseconds) {
        let left = core::mem::replace(&mut self.state, state);
        if left == State::Op {
            self.device.stop(now, Loss::Asked);
            self.watchdog = None;
        }
        if state <= State::PreOp {
            self.watchdog = None;
        }
        if state == State::Init {
            self.clock.arm(now, None, 0);
            self.mailbox = Default::default();
            // The application closes the mailboxes and the buffers.
            for index in 0..register::MANAGERS {
                self.set(register::SYNC_MANAGERS + 8 * index as u16 + 5, &[0]);
            }
        }
        if state == State::Op {
            self.fresh = false;
            let guarded = self
                .description
                .manager(Use::Outputs)
                .is_some_and(|(index, _)| SyncManager::of(&self.memory, index).watchdog);
            self.watchdog = None;
            if guarded {
                self.feed(now);
            }
            self.device.start(now);
        }
        self.tell_state(state, None);
    }
}
