//! Questions to a board before the clock starts, each asked until it is answered.

use messages::Nanoseconds;

use super::idrom::BoardError;
use super::lbp16::{LONGEST, MOST_ITEMS, Request, Space};
use crate::link::Link;

/// How long a board may take for one answer.
const PATIENCE: Nanoseconds = Nanoseconds(200_000_000);
/// How often it is asked.
const ATTEMPTS: u32 = 5;

/// Asking one thing after the other, each until it is answered. What is asked may be done more than once.
pub struct Asking<'a> {
    link: &'a mut dyn Link,
    number: u32,
}

impl<'a> Asking<'a> {
    /// Asks the board behind `link`.
    pub fn new(link: &'a mut dyn Link) -> Self {
        Self { link, number: 0 }
    }

    /// The time by the clock of the link.
    pub fn now(&self) -> Nanoseconds {
        self.link.now()
    }

    /// Its name.
    ///
    /// # Errors
    /// Nobody there, or nobody with a name.
    pub fn name(&mut self) -> Result<String, BoardError> {
        let reply = self.ask(|request| request.read_words(Space::Board, 0, 8))?;
        let name: String =
            reply.iter().take_while(|byte| **byte != 0).map(|byte| char::from(*byte)).collect();
        if name.chars().all(|letter| letter.is_ascii_graphic()) && !name.is_empty() {
            Ok(name)
        } else {
            Err(BoardError::Foreign("it has no name".to_owned()))
        }
    }

    /// `count` words of the modules from the address `from` on.
    ///
    /// # Errors
    /// Nobody there.
    pub fn words(&mut self, from: u16, count: u16) -> Result<Vec<u32>, BoardError> {
        let mut words = Vec::with_capacity(usize::from(count));
        let mut done = 0;
        while done < count {
            let part = (count - done).min(MOST_ITEMS);
            let reply = self.settled(|request| request.read(from.wrapping_add(4 * done), part))?;
            words.extend(reply.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)));
            done += part;
        }
        Ok(words)
    }

    /// What `what` reads, once it reads the same twice: what stands still, and is not damaged on the way.
    ///
    /// # Errors
    /// Nobody there, or nothing that stands still.
    pub fn settled(&mut self, what: impl Fn(&mut Request)) -> Result<Vec<u8>, BoardError> {
        let mut before = self.ask(&what)?;
        for _ in 0..ATTEMPTS {
            let now = self.ask(&what)?;
            if now == before {
                return Ok(now);
            }
            before = now;
        }
        Err(BoardError::Silent)
    }

    /// Has the board do `what`, until it has answered; the bytes that `what` reads.
    ///
    /// # Errors
    /// Nobody there.
    pub fn ask(&mut self, what: impl Fn(&mut Request)) -> Result<Vec<u8>, BoardError> {
        let mut request = Request::default();
        let mut buffer = [0; LONGEST];
        for _ in 0..ATTEMPTS {
            self.number = self.number.wrapping_add(1);
            request.clear();
            request.write_number(!self.number);
            what(&mut request);
            request.read_number();
            let Some(datagram) = request.datagram() else { return Err(BoardError::Silent) };
            self.link.send(datagram);
            let until = self.link.now() + PATIENCE;
            while let Some(length) = self.link.receive(&mut buffer, until) {
                let Some(reply) = buffer.get(..length) else { continue };
                let Some((data, number)) = reply.split_last_chunk::<4>() else { continue };
                if length == request.reply_length() && u32::from_le_bytes(*number) == !self.number {
                    return Ok(data.to_vec());
                }
            }
        }
        Err(BoardError::Silent)
    }
}
