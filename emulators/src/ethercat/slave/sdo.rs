//! The server of a slave's objects: SDO upload and download, at once, in one message, or in segments
//! (ETG.1000.6 5.6.2).

use crate::ethercat::frame::{double_word, put, word};

/// Why a transfer was refused (ETG.1000.6 table 41).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Abort {
    /// The toggle bit did not change.
    Toggle = 0x0503_0000,
    /// The command is unknown.
    Command = 0x0504_0001,
    /// The sub-objects cannot be read or written all at once.
    CompleteAccess = 0x0601_0000,
    /// It cannot be written.
    ReadOnly = 0x0601_0002,
    /// It can be written only while the number of entries is 0.
    NotEmpty = 0x0601_0003,
    /// There is no such object.
    NoObject = 0x0602_0000,
    /// Process data cannot carry it in this direction, or not in this size.
    NotMappable = 0x0604_0041,
    /// All of it would be more than process data can carry.
    MappingTooLong = 0x0604_0042,
    /// The value is longer than the object.
    TooLong = 0x0607_0012,
    /// The value is shorter than the object.
    TooShort = 0x0607_0013,
    /// The object has no such subindex.
    NoSubindex = 0x0609_0011,
    /// The value is out of range.
    Value = 0x0609_0030,
    /// Not in this state.
    State = 0x0800_0022,
}

/// What the server reads and writes.
pub trait Objects {
    /// The bytes of an object.
    ///
    /// # Errors
    /// If it cannot be read.
    fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, Abort>;

    /// Writes an object.
    ///
    /// # Errors
    /// If it cannot be written so.
    fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<(), Abort>;
}

/// Bytes of an SDO's command, index, subindex and four bytes of data.
const INITIATE: usize = 8;

/// Most bytes that a master may announce.
const LONGEST: usize = 4096;

/// A transfer in segments that is under way.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Transfer {
    /// To the master: what is left.
    Upload { left: Vec<u8>, toggle: bool },
    /// From the master: what has come, and how much of it there shall be.
    Download { index: u16, sub: u8, got: Vec<u8>, length: usize, toggle: bool },
}

/// The server.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Server {
    transfer: Option<Transfer>,
}

impl Server {
    /// The answer to an SDO `request`, of `room` bytes at most, none to an abort.
    pub fn answer(
        &mut self,
        request: &[u8],
        room: usize,
        objects: &mut dyn Objects,
    ) -> Option<Vec<u8>> {
        let command = request.first().copied().unwrap_or(0x80);
        let (index, sub) = (word(request, 1), request.get(3).copied().unwrap_or(0));
        let answer = match command >> 5 {
            0 => self.download_segment(command, request, objects),
            1 => self.download(command, request, objects),
            2 => self.upload(command, index, sub, room, objects),
            3 => self.upload_segment(command, room),
            4 => {
                self.transfer = None;
                return None;
            }
            _ => Err(Abort::Command),
        };
        Some(answer.unwrap_or_else(|abort| {
            self.transfer = None;
            let mut message = initiate(0x80, index, sub);
            put(&mut message, 4, &(abort as u32).to_le_bytes());
            message
        }))
    }

    fn upload(
        &mut self,
        command: u8,
        index: u16,
        sub: u8,
        room: usize,
        objects: &mut dyn Objects,
    ) -> Result<Vec<u8>, Abort> {
        if command & 0x10 != 0 {
            return Err(Abort::CompleteAccess);
        }
        self.transfer = None;
        let value = objects.read(index, sub)?;
        if (1..=4).contains(&value.len()) {
            let unused = 4 - value.len() as u8;
            let mut message = initiate(0x43 | unused << 2, index, sub);
            put(&mut message, 4, &value);
            return Ok(message);
        }
        let mut message = initiate(0x41, index, sub);
        put(&mut message, 4, &(value.len() as u32).to_le_bytes());
        let (now, later) = value.split_at(value.len().min(room.saturating_sub(INITIATE)));
        message.extend(now);
        if !later.is_empty() {
            self.transfer = Some(Transfer::Upload { left: later.to_vec(), toggle: false });
        }
        Ok(message)
    }

    fn upload_segment(&mut self, command: u8, room: usize) -> Result<Vec<u8>, Abort> {
        let Some(Transfer::Upload { left, toggle }) = &mut self.transfer else {
            return Err(Abort::Command);
        };
        if (command & 0x10 != 0) != *toggle {
            return Err(Abort::Toggle);
        }
        let mut message = vec![if *toggle { 0x10 } else { 0 }];
        *toggle = !*toggle;
        let later = left.split_off(left.len().min(room.saturating_sub(1)));
        message.extend(left.iter());
        if later.is_empty() {
            message.iter_mut().take(1).for_each(|command| *command |= 0x01);
        }
        if left.len() < 7 {
            let unused = 7 - left.len() as u8;
            message.iter_mut().take(1).for_each(|command| *command |= unused << 1);
            message.resize(INITIATE, 0);
        }
        *left = later;
        if left.is_empty() {
            self.transfer = None;
        }
        Ok(message)
    }

    fn download(
        &mut self,
        command: u8,
        request: &[u8],
        objects: &mut dyn Objects,
    ) -> Result<Vec<u8>, Abort> {
        let (index, sub) = (word(request, 1), request.get(3).copied().unwrap_or(0));
        if command & 0x10 != 0 {
            return Err(Abort::CompleteAccess);
        }
        self.transfer = None;
        let data = request.get(4..).unwrap_or_default();
        let written = initiate(0x60, index, sub);
        if command & 0x02 != 0 {
            let unused = if command & 0x01 == 0 { 0 } else { usize::from(command >> 2 & 0x03) };
            let value = data.get(..4 - unused).ok_or(Abort::TooShort)?;
            objects.write(index, sub, value)?;
            return Ok(written);
        }
        let length = double_word(data, 0) as usize;
        if length > LONGEST {
            return Err(Abort::TooLong);
        }
        let got = data.get(4..).unwrap_or_default();
        let got = got.get(..length.min(got.len())).unwrap_or_default();
        if got.len() == length {
            objects.write(index, sub, got)?;
        } else {
            let got = got.to_vec();
            self.transfer = Some(Transfer::Download { index, sub, got, length, toggle: false });
        }
        Ok(written)
    }

    fn download_segment(
        &mut self,
        command: u8,
        request: &[u8],
        objects: &mut dyn Objects,
    ) -> Result<Vec<u8>, Abort> {
        let Some(Transfer::Download { index, sub, got, length, toggle }) = &mut self.transfer
        else {
            return Err(Abort::Command);
        };
        if (command & 0x10 != 0) != *toggle {
            return Err(Abort::Toggle);
        }
        let data = request.get(1..).unwrap_or_default();
        let unused = if data.len() <= 7 { usize::from(command >> 1 & 0x07) } else { 0 };
        got.extend(data.iter().take(data.len().saturating_sub(unused)));
        if got.len() > *length {
            return Err(Abort::TooLong);
        }
        let mut answer = vec![0x20 | if *toggle { 0x10 } else { 0 }];
        answer.resize(INITIATE, 0);
        *toggle = !*toggle;
        if command & 0x01 != 0 {
            if got.len() < *length {
                return Err(Abort::TooShort);
            }
            objects.write(*index, *sub, got)?;
            self.transfer = None;
        }
        Ok(answer)
    }
}

fn initiate(command: u8, index: u16, sub: u8) -> Vec<u8> {
    let mut message = vec![command];
    message.extend(index.to_le_bytes());
    message.extend([sub, 0, 0, 0, 0]);
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    struct One(Vec<u8>);

    impl Objects for One {
        fn read(&mut self, index: u16, _: u8) -> Result<Vec<u8>, Abort> {
            if index == 0x2000 { Ok(self.0.clone()) } else { Err(Abort::NoObject) }
        }

        fn write(&mut self, _: u16, _: u8, value: &[u8]) -> Result<(), Abort> {
            self.0 = value.to_vec();
            Ok(())
        }
    }

    fn upload(length: u8, room: usize) -> Vec<u8> {
        let (mut server, mut one) = (Server::default(), One((0..length).collect()));
        let mut ask = |request: &[u8]| server.answer(request, room, &mut one).unwrap_or_default();
        let first = ask(&[0x40, 0, 0x20, 0, 0, 0, 0, 0]);
        if first[0] & 2 != 0 {
            return first[4..8 - usize::from(first[0] >> 2 & 3)].to_vec();
        }
        assert_eq!(first[4..8], [length, 0, 0, 0]);
        let mut got = first[8..].to_vec();
        let mut toggle = 0;
        while got.len() < usize::from(length) {
            let segment = ask(&[0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            assert_eq!(segment[0] & 0xF0, toggle);
            let unused = usize::from(segment[0] >> 1 & 7);
            got.extend(&segment[1..segment.len() - unused]);
            assert_eq!(segment[0] & 1 == 1, got.len() == usize::from(length));
            toggle ^= 0x10;
        }
        got
    }

    #[test]
    fn a_value_of_any_length_is_read_whole() {
        for length in [1, 2, 3, 4, 5, 8, 11, 12, 13, 20, 30, 31, 100] {
            for room in [10, 16, 24, 120] {
                assert_eq!(
                    upload(length, room),
                    (0..length).collect::<Vec<_>>(),
                    "{length} {room}"
                );
            }
        }
    }

    #[test]
    fn a_value_is_written_in_segments() {
        let (mut server, mut one) = (Server::default(), One(Vec::new()));
        let mut ask = |request: &[u8]| server.answer(request, 16, &mut one).unwrap_or_default();
        assert_eq!(ask(&[0x21, 0, 0x20, 0, 12, 0, 0, 0, 1, 2, 3])[0], 0x60);
        assert_eq!(ask(&[0x00, 4, 5, 6, 7, 8, 9, 10])[0], 0x20);
        assert_eq!(ask(&[0x1B, 11, 12, 0, 0, 0, 0, 0])[0], 0x30);
        assert_eq!(one.0, (1..=12).collect::<Vec<_>>());
    }

    #[test]
    fn what_cannot_be_is_aborted() {
        let (mut server, mut one) = (Server::default(), One(Vec::new()));
        let mut code = |request: &[u8]| {
            let answer = server.answer(request, 16, &mut one).unwrap_or_default();
            (answer[0], double_word(&answer, 4))
        };
        assert_eq!(code(&[0x40, 1, 0x20, 0, 0, 0, 0, 0]), (0x80, Abort::NoObject as u32));
        assert_eq!(code(&[0x50, 0, 0x20, 0, 0, 0, 0, 0]), (0x80, Abort::CompleteAccess as u32));
        assert_eq!(code(&[0x60, 0, 0, 0, 0, 0, 0, 0]), (0x80, Abort::Command as u32));
        assert_eq!(code(&[0x21, 0, 0x20, 0, 12, 0, 0, 0]).0, 0x60);
        assert_eq!(code(&[0x10, 0, 0, 0, 0, 0, 0, 0]), (0x80, Abort::Toggle as u32));
    }
}
