//! Names in a fleet: of machines, groups and jobs. They are parts of subjects, so a dot, a star or a space would make another
//! subject of one.

use std::fs::File;
use std::io::{self, Read};

/// The longest name.
const LONGEST: usize = 64;

/// Digits of a job's number.
const ID_DIGITS: usize = 16;

/// Whether `name` can be that of a machine or a group.
///
/// # Errors
/// Why it cannot, with what would be right.
pub fn check(name: &str) -> Result<(), String> {
    let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-');
    if !name.is_empty() && name.len() <= LONGEST && name.bytes().all(is_allowed) {
        return Ok(());
    }
    let shown: String = name.chars().take(LONGEST).collect();
    Err(format!("{shown:?} is no name of a fleet: 1 to {LONGEST} of a-z, A-Z, 0-9, '_' and '-'"))
}

/// Whether `id` is a job's number.
pub fn is_id(id: &str) -> bool {
    id.len() == ID_DIGITS
        && id.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
}

/// A number for a job, which no other has.
///
/// # Errors
/// The kernel's random numbers cannot be read.
pub fn new_id() -> io::Result<String> {
    let mut bytes = [0; ID_DIGITS / 2];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The name of a pipeline whose user gave none: this computer's, and the instance's where it is not the only one.
pub fn of(host: &str, instance: &str) -> String {
    let host = host.split('.').next().unwrap_or_default();
    let whole = if instance == "default" { host.to_owned() } else { format!("{host}-{instance}") };
    let allowed =
        |it: char| if it.is_ascii_alphanumeric() || it == '_' || it == '-' { it } else { '-' };
    let name: String = whole.trim().chars().map(allowed).take(LONGEST).collect();
    if name.is_empty() { "machine".to_owned() } else { name }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_name_is_one_part_of_a_subject() {
        for name in ["a", "cell-1", "Laser_2", &"x".repeat(64)] {
            assert_eq!(check(name), Ok(()), "{name}");
        }
        for name in ["", "a.b", "*", ">", "a b", "ä", "a\n", &"x".repeat(65)] {
            assert!(check(name).unwrap_err().contains("a-z"), "{name}");
        }
    }

    #[test]
    fn a_name_is_made_of_the_computers_and_the_instances() {
        assert_eq!(of("shop.example.org\n", "default"), "shop");
        assert_eq!(of("shop", "cell1"), "shop-cell1");
        assert_eq!(of("", "default"), "machine");
        for host in ["", "ü ö", &"long".repeat(40)] {
            assert_eq!(check(&of(host, "cell1")), Ok(()), "{host}");
        }
    }

    #[test]
    fn numbers_of_jobs_differ() {
        let ids: std::collections::BTreeSet<String> = (0..100).map(|_| new_id().unwrap()).collect();
        assert!(ids.len() == 100 && ids.iter().all(|id| is_id(id)), "{ids:?}");
        for id in ["", "..", "0123456789abcde", "0123456789abcdeF", "0123456789abcde/"] {
            assert!(!is_id(id), "{id}");
        }
    }
}
