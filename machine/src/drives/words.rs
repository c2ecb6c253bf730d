//! What the fault words of drives mean, for people: a word travels as a number, its text is made where it is
//! told.

use super::DrivesKind;

/// What `word` means on drives of `kind`; `None` where it is not known.
pub fn fault_text(kind: &DrivesKind, word: u32) -> Option<&'static str> {
    match kind {
        DrivesKind::Simulated => None,
        DrivesKind::Hostmot2(_) => hostmot2(word),
        DrivesKind::Ethercat(_) => cia402(word),
    }
}

/// The words of the HostMot2 port.
fn hostmot2(word: u32) -> Option<&'static str> {
    Some(match word {
        1 => "the card's watchdog has bitten",
        2 => "the card does not answer",
        3 => "the card was reset, or is another one than before: start again, and home",
        4 => "the scan head was told a place beyond its full scale",
        _ => return None,
    })
}

/// Error codes of drives by IEC 61800-7-201 (CiA 402), object 603Fh, and of the port itself below 100h.
fn cia402(word: u32) -> Option<&'static str> {
    Some(match word {
        1 => "the bus does not answer",
        2 => "a slave has left the operational state",
        3 => "our clock and that of the bus are too far apart",
        4 => {
            "some slaves do not take part: they were cut off, without power, or plugged in anew; start again"
        }
        0x2110..=0x213F => "short circuit or earth fault at the input",
        0x2200..=0x22FF => "overcurrent in the drive",
        0x2310 => "continuous overcurrent of the motor",
        0x2300..=0x23FF => "overcurrent, short circuit or earth fault of the motor",
        0x3100..=0x31FF => "the mains voltage is wrong",
        0x3210..=0x3212 => "overvoltage of the intermediate circuit",
        0x3220..=0x3222 => "undervoltage of the intermediate circuit",
        0x3300..=0x33FF => "the output voltage is wrong",
        0x4210 => "the drive is too hot",
        0x4310 => "the motor is too hot",
        0x4000..=0x4FFF => "a temperature is beyond its limit",
        0x5440..=0x5443 => "a contactor or its supply fails",
        0x5000..=0x5FFF => "the drive's hardware is faulty",
        0x6100..=0x62FF => "the drive's firmware is faulty",
        0x6300..=0x63FF => "a parameter of the drive is wrong",
        0x7120 => "the motor is blocked or faulty",
        0x7121 => "the motor is blocked",
        0x7300..=0x73FF => "the encoder is faulty",
        0x7500..=0x75FF => "the drive's communication is disturbed",
        0x8100..=0x81FF => "the communication with the drive is disturbed",
        0x8611 => "the drive's following error is too large",
        0x8612 => "a reference limit of the drive is exceeded",
        0x8700..=0x87FF => "the drive has lost its synchronisation",
        0xF000..=0xFFFF => "a fault of the drive's maker",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::{cia402, fault_text};
    use crate::drives::DrivesKind;

    #[test]
    fn a_known_word_has_a_text_and_an_unknown_one_none() {
        assert_eq!(cia402(0x8611), Some("the drive's following error is too large"));
        assert_eq!(cia402(0x2310), Some("continuous overcurrent of the motor"));
        assert_eq!(cia402(0x9999), None);
        assert_eq!(fault_text(&DrivesKind::Simulated, 0x8611), None);
    }
}
