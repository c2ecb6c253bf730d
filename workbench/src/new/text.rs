//! Numbers as a person writes them into a machine file.

/// `value` to so many digits, without zeros behind.
fn digits(value: f64, count: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", count - 1).parse().unwrap_or(value);
    if rounded == 0.0 || (1e-3..1e7).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// A quantity to four digits, as TOML text.
pub(super) fn quantity(value: f64, unit: &str) -> String {
    format!("\"{} {unit}\"", digits(value, 4))
}

/// A quantity to as many digits as its source may have, as TOML text.
pub(super) fn exact(value: f64, unit: &str) -> String {
    format!("\"{} {unit}\"", digits(value, 9))
}

/// A plain number to as many digits as its source may have.
pub(super) fn number(value: f64) -> String {
    digits(value, 9)
}

/// A number to three digits, for comments.
pub(super) fn about(value: f64) -> String {
    digits(value, 3)
}

/// A length of a part [m], to a tenth of a millimetre, as TOML text.
pub(super) fn mm(value: f64) -> String {
    format!("\"{} mm\"", tenths(value))
}

/// A length [m] in millimetres, to a tenth.
pub(super) fn tenths(value: f64) -> f64 {
    (value * 1e4).round() / 10.0
}

/// A mass [kg], as TOML text.
pub(super) fn kg(value: f64) -> String {
    quantity(value, "kg")
}

/// A moment of inertia [kg·m²], as TOML text.
pub(super) fn inertia(value: f64) -> String {
    quantity(value, "kg m^2")
}

/// A point or a range of lengths [m], as TOML text.
pub(super) fn lengths(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|value| mm(*value)).collect();
    format!("[{}]", values.join(", "))
}

/// `key = value`, with `comment` behind where there is one, beside those of the other lines.
pub(super) fn line(key: &str, value: &str, comment: &str) -> String {
    let text = format!("{key} = {value}");
    if comment.is_empty() { format!("{text}\n") } else { format!("{text:<35} # {comment}\n") }
}

/// `text` as lines of comment of a hundred characters at most.
pub(super) fn comment(text: &str) -> String {
    const WIDTH: usize = 100;
    let mut lines = String::new();
    let mut line = "#".to_owned();
    for word in text.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines += &line;
            lines.push('\n');
            line = "#".to_owned();
        }
        line.push(' ');
        line += word;
    }
    lines + &line + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        assert_eq!(quantity(0.25, "m/s"), "\"0.25 m/s\"");
        assert_eq!(quantity(1.234_56e-7, "kg m^2"), "\"1.235e-7 kg m^2\"");
        assert_eq!(exact(0.000_228, "kg"), "\"2.28e-4 kg\"");
        assert_eq!(lengths(&[-0.1, 0.200_04]), "[\"-100 mm\", \"200 mm\"]");
        assert_eq!(line("gear", "3", ""), "gear = 3\n");
        assert!(comment(&"word ".repeat(40)).lines().all(|line| line.len() <= 100));
    }
}
