//! What the driver of a network card is set to, asked as ethtool(8) does.

use std::io::{self, Error};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};

/// The request of ioctl(2) for all of it; linux/sockios.h.
const SIOCETHTOOL: libc::c_ulong = 0x8946;

/// The command for when it interrupts; linux/ethtool.h.
const GET_COALESCING: u32 = 0x0e;

/// The numbers that it gives back.
const COALESCING_NUMBERS: usize = 23;

/// The place of the delay after a received packet [µs] among them, the command included.
const RECEIVE_DELAY: usize = 1;

/// What a card or the kernel does with packets to have fewer of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offload {
    /// The kernel joins received packets.
    GenericReceive,
    /// The kernel splits packets late.
    GenericSegmentation,
    /// The card splits packets.
    Segmentation,
}

impl Offload {
    /// All of them.
    pub const ALL: [Self; 3] =
        [Self::GenericReceive, Self::GenericSegmentation, Self::Segmentation];

    /// Its name in ethtool(8).
    pub fn name(self) -> &'static str {
        match self {
            Self::GenericReceive => "gro",
            Self::GenericSegmentation => "gso",
            Self::Segmentation => "tso",
        }
    }

    /// The command for it; linux/ethtool.h.
    fn command(self) -> u32 {
        match self {
            Self::GenericReceive => 0x2b,
            Self::GenericSegmentation => 0x23,
            Self::Segmentation => 0x1e,
        }
    }
}

/// How long the card keeps a received packet before it interrupts, in µs.
///
/// # Errors
/// A card that does not exist or does not tell.
pub fn receive_delay(card: &str) -> io::Result<u32> {
    let mut numbers = [0; COALESCING_NUMBERS];
    numbers[0] = GET_COALESCING;
    ask(card, &mut numbers)?;
    Ok(numbers[RECEIVE_DELAY])
}

/// Whether this is on.
///
/// # Errors
/// A card that does not exist or does not tell.
pub fn is_on(card: &str, offload: Offload) -> io::Result<bool> {
    let mut numbers = [offload.command(), 0];
    ask(card, &mut numbers)?;
    Ok(numbers[1] != 0)
}

/// Asks the driver of `card`, whose answer takes the place of the question: a structure of 32-bit numbers that begins
/// with the command.
fn ask(card: &str, numbers: &mut [u32]) -> io::Result<()> {
    // SAFETY: all zeros is a valid request without a name.
    #[allow(unsafe_code)]
    let mut request: libc::ifreq = unsafe { std::mem::zeroed() };
    // The name keeps a zero at its end.
    if card.len() >= request.ifr_name.len() {
        return Err(Error::from_raw_os_error(libc::ENODEV));
    }
    for (to, from) in request.ifr_name.iter_mut().zip(card.bytes()) {
        *to = from as libc::c_char;
    }
    request.ifr_ifru.ifru_data = numbers.as_mut_ptr().cast();
    // SAFETY: no pointers; what is returned is ours if it is not negative.
    #[allow(unsafe_code)]
    let descriptor =
        unsafe { libc::socket(libc::AF_INET, libc::SOCK_DGRAM | libc::SOCK_CLOEXEC, 0) };
    if descriptor < 0 {
        return Err(Error::last_os_error());
    }
    // SAFETY: the descriptor is open, and nobody else has it.
    #[allow(unsafe_code)]
    let socket = unsafe { OwnedFd::from_raw_fd(descriptor) };
    // SAFETY: `request` has a name that ends in zero and points to as many numbers as the command's structure has, which
    // outlive the call.
    #[allow(unsafe_code)]
    match unsafe { libc::ioctl(socket.as_raw_fd(), SIOCETHTOOL as _, &mut request) } {
        0 => Ok(()),
        _ => Err(Error::last_os_error()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_card_that_does_not_exist_is_an_error() {
        for name in ["none-such", "a-name-that-is-much-too-long", ""] {
            assert_eq!(
                receive_delay(name).unwrap_err().raw_os_error(),
                Some(libc::ENODEV),
                "{name}"
            );
            assert!(is_on(name, Offload::GenericReceive).is_err());
        }
    }
}
