//! Who answers on the bus, held to who the machine file has there.

use machine::drives::EthercatIdentity;

use crate::port::PortError;

/// What a slave's EEPROM says of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its name.
    pub name: String,
    /// The number of its maker.
    pub vendor: u32,
    /// The maker's number of it.
    pub product: u32,
    /// Its revision.
    pub revision: u32,
    /// Its serial number.
    pub serial: u32,
}

impl Found {
    fn is(&self, wanted: &EthercatIdentity) -> bool {
        let Self { vendor, product, revision, serial, .. } = *self;
        [vendor, product] == [wanted.vendor, wanted.product]
            && wanted.revision.is_none_or(|wanted| wanted == revision)
            && wanted.serial.is_none_or(|wanted| wanted == serial)
    }
}

/// Holds the slaves that were `found`, in the order of the bus, to those that are `wanted`.
///
/// # Errors
/// The first one that is another, with what stands there instead, and where the wanted one is if it is on the bus.
pub fn check(found: &[Found], wanted: &[EthercatIdentity]) -> Result<(), PortError> {
    let at = |slave: u16| found.get(usize::from(slave));
    let is_there = |wanted: &EthercatIdentity| at(wanted.slave).is_some_and(|own| own.is(wanted));
    let Some(missed) = wanted.iter().find(|wanted| !is_there(wanted)) else { return Ok(()) };
    let Some(answers) = at(missed.slave) else { return Ok(()) };
    let place = missed.slave;
    // Where nobody else is wanted, or somebody else is than answers there.
    let is_free = |slave: usize| {
        !wanted.iter().any(|wanted| usize::from(wanted.slave) == slave && is_there(wanted))
    };
    let mut slaves = found.iter().enumerate();
    let elsewhere = slaves.position(|(slave, own)| own.is(missed) && is_free(slave));
    let help = match elsewhere {
        Some(other) => {
            let of_other = wanted.iter().find(|wanted| usize::from(wanted.slave) == other);
            if of_other.is_some_and(|wanted| answers.is(wanted)) {
                format!(
                    "slaves {place} and {other} have changed places: put the cables back, or change the positions in \
                     the machine file"
                )
            } else {
                format!(
                    "that one is slave {other}: the order on the bus has changed; put the cables back, or change the \
                     positions in the machine file"
                )
            }
        }
        None => format!(
            "put the right one there, or write who it is in [drives.ethercat.slaves.{place}]"
        ),
    };
    let Found { name, vendor, product, revision, serial } = answers;
    let optional = |name: &str, number: Option<u32>| {
        number.map_or(String::new(), |number| format!(", {name} {number:#x}"))
    };
    Err(PortError::Mismatch {
        found: format!(
            "slave {place} is \"{name}\", vendor {vendor:#x}, product {product:#x}, revision {revision:#x}, serial \
             number {serial:#x}"
        ),
        expected: format!(
            "the machine file has vendor {:#x}, product {:#x}{}{} there: {help}",
            missed.vendor,
            missed.product,
            optional("revision", missed.revision),
            optional("serial number", missed.serial),
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(products: &[u32]) -> Vec<Found> {
        let of = |(serial, product): (u32, &u32)| Found {
            name: format!("N{product}"),
            vendor: 2,
            product: *product,
            revision: 1,
            serial,
        };
        (10..).zip(products).map(of).collect()
    }

    fn wanted(slave: u16, product: u32) -> EthercatIdentity {
        EthercatIdentity { slave, vendor: 2, product, revision: None, serial: None }
    }

    fn told(products: &[u32], wanted: &[EthercatIdentity]) -> String {
        check(&found(products), wanted).err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn who_is_wanted_passes_and_who_is_not_mentioned_too() {
        assert_eq!(told(&[7, 8, 9], &[wanted(0, 7), wanted(2, 9)]), "");
        assert_eq!(told(&[7, 8, 9], &[]), "");
    }

    #[test]
    fn another_one_is_named_with_what_is_wanted_there() {
        let other = told(&[7, 8], &[wanted(1, 9)]);
        assert!(
            other.starts_with("slave 1 is \"N8\", vendor 0x2, product 0x8, revision 0x1"),
            "{other}"
        );
        assert!(
            other.contains("the machine file has vendor 0x2, product 0x9 there: put the right"),
            "{other}"
        );
        let serial = EthercatIdentity { serial: Some(12), ..wanted(1, 8) };
        let serial = told(&[7, 8], &[serial]);
        assert!(serial.contains("serial number 0xb;"), "{serial}");
        assert!(serial.contains("product 0x8, serial number 0xc there"), "{serial}");
    }

    #[test]
    fn slaves_in_another_order_are_told_where_they_are() {
        let swapped = told(&[8, 7, 9], &[wanted(0, 7), wanted(1, 8), wanted(2, 9)]);
        assert!(swapped.contains("slaves 0 and 1 have changed places"), "{swapped}");
        let moved = told(&[6, 7, 8], &[wanted(0, 7), wanted(1, 8)]);
        assert!(moved.contains("that one is slave 1: the order on the bus has changed"), "{moved}");
        // A second one of the same kind that is in its own place is not the one that is missing.
        let missing = told(&[8, 7], &[wanted(0, 7), wanted(1, 7)]);
        assert!(missing.contains("put the right one there"), "{missing}");
    }
}
