//! Every way in which a person can break a machine file: each gets an error at its line, or the
//! file is still sound. Nothing panics.

#![allow(clippy::unwrap_used)]

use machine::Machine;
use machine::document::{DocumentError, Position, ProblemKind};
use messages::random::SplitMix64;

const FILES: [(&str, &str); 10] = [
    ("cartesian.toml", include_str!("../../machines/cartesian.toml")),
    ("corexy.toml", include_str!("../../machines/corexy.toml")),
    ("cartesian_steppers.toml", include_str!("../../machines/cartesian_steppers.toml")),
    ("five_bar.toml", include_str!("../../machines/five_bar.toml")),
    ("prrrp.toml", include_str!("../../machines/prrrp.toml")),
    ("polar.toml", include_str!("../../machines/polar.toml")),
    ("tri_planar.toml", include_str!("../../machines/tri_planar.toml")),
    ("mcm.toml", include_str!("../../machines/mcm.toml")),
    ("twin_actuator.toml", include_str!("../../machines/twin_actuator.toml")),
    ("serial.toml", include_str!("../../machines/serial.toml")),
];

/// Keys that may be of either sign: another place or angle, where the mechanism may not come.
const SIGNED: [&str; 10] = [
    "position",
    "home",
    "height",
    "offset",
    "offset_angle",
    "head_center",
    "length",
    "twist",
    "angle",
    "counterbalance",
];

/// Keys that name one of two sides, 1 or -1.
const SIDES: [&str; 5] = ["working_mode", "assembly_mode", "side", "elbow", "legs"];

/// Keys that may be 0.
const MAY_BE_ZERO: [&str; 18] = [
    "coulomb",
    "viscous",
    "brake",
    "brake_release",
    "inertia",
    "on_delay",
    "off_delay",
    "detent_torque",
    "damping",
    "bar_mass",
    "gap",
    "clearance",
    "arm_center",
    "head_inertia",
    "workpiece_mass",
    "workpiece_center",
    "workpiece_inertia",
    "rod_center",
];

/// One line of a machine file that sets a key.
struct Setting<'a> {
    file: &'a str,
    text: &'a str,
    /// From 1.
    line: usize,
    key: &'a str,
    value: &'a str,
}

fn settings() -> Vec<Setting<'static>> {
    let mut found = Vec::new();
    for (file, text) in FILES {
        for (index, line) in text.lines().enumerate() {
            let code = line.split('#').next().unwrap();
            if let Some((key, value)) = code.split_once('=') {
                let (key, value) = (key.trim(), value.trim());
                found.push(Setting { file, text, line: index + 1, key, value });
            }
        }
    }
    assert!(found.len() > 700, "only {} settings found", found.len());
    found
}

impl Setting<'_> {
    /// The file with this line replaced by `lines`.
    fn replaced(&self, lines: &str) -> String {
        let mut all: Vec<&str> = self.text.lines().collect();
        all[self.line - 1] = lines;
        all.join("\n")
    }

    fn parse(&self, lines: &str) -> Result<Machine, DocumentError> {
        Machine::parse(self.file, &self.replaced(lines), &[])
    }

    /// Checks that `value` is refused at this line, for one of the reasons `kinds`.
    fn refuses(&self, value: &str, kinds: &[ProblemKind]) {
        let line = format!("{} = {value}", self.key);
        let error = self.parse(&line).expect_err(&format!("{}: `{line}` passed", self.file));
        let first = error.problems().next().unwrap();
        assert!(
            kinds.contains(&first.kind) && first.line() == Some(self.line),
            "{}: line {} `{line}` gave {:?}: {error}",
            self.file,
            self.line,
            first.kind
        );
        assert_eq!(error.file(), self.file);
        assert!(!error.message().is_empty());
    }

    /// Checks that `value` is refused for another one that it does not go with, wherever that stands.
    fn contradicts(&self, value: &str) {
        let line = format!("{} = {value}", self.key);
        let error = self.parse(&line).expect_err(&format!("{}: `{line}` passed", self.file));
        let first = error.problems().next().unwrap();
        let kinds = [Contradiction, OutOfRange];
        assert!(kinds.contains(&first.kind) && first.line().is_some(), "{line}: {error}");
    }

    fn is_quantity(&self) -> bool {
        self.value.starts_with('"')
            && self.value.contains(|c: char| c.is_ascii_digit())
            && !matches!(self.key, "description" | "sample" | "name")
    }

    fn is_number(&self) -> bool {
        self.value.parse::<f64>().is_ok()
    }

    fn is_list(&self) -> bool {
        self.value.starts_with('[')
    }
}

use ProblemKind::{
    BareNumber, Contradiction, MissingKey, NotFinite, OutOfRange, Syntax, UnknownKey, UnknownUnit,
    UnknownWord, WrongType, WrongUnit,
};

#[test]
fn the_shipped_files_are_sound() {
    for (file, text) in FILES {
        Machine::parse(file, text, &[]).unwrap();
    }
}

#[test]
fn a_deleted_key_is_missed_or_has_a_default() {
    let mut missed = Vec::new();
    for setting in settings() {
        match setting.parse("") {
            Ok(_) => {}
            Err(error) => {
                let kind = error.problems().next().unwrap().kind;
                assert!(matches!(kind, MissingKey | Contradiction), "{error}");
                // Without a place or an angle the mechanism is another one, and rests elsewhere.
                let moves = kind == Contradiction && SIGNED.contains(&setting.key);
                assert!(moves || error.message().contains(setting.key), "{error}");
                assert!(error.line().is_some());
                if kind == MissingKey {
                    missed.push(setting.key);
                }
            }
        }
    }
    missed.sort_unstable();
    missed.dedup();
    assert_eq!(
        missed,
        [
            "arm",
            "arm_center",
            "arm_inertia",
            "arm_mass",
            "base_a",
            "base_b",
            "carriage_mass",
            "cart_mass",
            "center",
            "center_distance",
            "coulomb",
            "current",
            "distal",
            "distal_inertia",
            "distal_mass",
            "freedom",
            "half_base",
            "head_center",
            "head_inertia",
            "head_mass",
            "height",
            "holding_torque",
            "housing_inertia",
            "inductance",
            "inductor",
            "inertia",
            "joint",
            "lead",
            "leg_mass",
            "link",
            "link_inertia",
            "link_mass",
            "mass",
            "mass_x",
            "mass_y",
            "motor_mass",
            "name",
            "offset",
            "pitch",
            "platform_inertia",
            "platform_mass",
            "position",
            "proximal",
            "proximal_inertia",
            "proximal_mass",
            "pulley_radius",
            "resistance",
            "resolution",
            "rod_center",
            "rod_inertia",
            "rod_mass",
            "rotor_inertia",
            "sample",
            "side",
            "slide_mass",
            "stator_x",
            "stator_y",
            "stiffness",
            "table_inertia",
            "tool",
            "tool_mass",
            "torque_constant",
            "viscous",
            "voltage",
            "working_mode",
            "x",
            "y",
            "yoke_inertia",
        ]
    );
}

#[test]
fn a_mistyped_key_is_named_at_its_line_and_corrected() {
    for setting in settings() {
        let key = setting.key;
        for mistyped in [format!("{key}{}", &key[key.len() - 1..]), format!("q{key}")] {
            let line = format!("{mistyped} = {}", setting.value);
            let error = setting.parse(&line).expect_err(&line);
            let first = error.problems().next().unwrap();
            assert_eq!((first.kind, first.line()), (UnknownKey, Some(setting.line)), "{error}");
            assert_eq!(first.column(), Some(1), "{error}");
            // One letter in two or three is not enough to guess by.
            if key.len() > 3 {
                assert!(first.message().contains(&format!("did you mean `{key}`?")), "{error}");
            }
        }
    }
}

#[test]
fn a_doubled_key_is_refused() {
    for setting in settings() {
        let line = format!("{} = {}", setting.key, setting.value);
        let error = setting.parse(&format!("{line}\n{line}")).expect_err(&line);
        assert_eq!(error.line(), Some(setting.line + 1), "{error}");
        assert!(error.message().contains("duplicate key"), "{error}");
    }
}

#[test]
fn a_value_of_another_type_is_refused() {
    let types = [WrongType, BareNumber, UnknownWord];
    for setting in settings() {
        for value in ["1979-05-27", "{ a = 1 }", "[[]]", "[true, true]"] {
            setting.refuses(value, &types);
        }
        if setting.key != "air_assist" {
            setting.refuses("true", &types);
        }
        if !setting.is_number() {
            setting.refuses("7", &types);
        }
        if !matches!(setting.key, "name" | "description" | "sample") {
            setting.refuses("\"seven\"", &types);
        }
        setting.refuses("\"seven", &[Syntax]);
        setting.refuses("", &[Syntax]);
    }
}

#[test]
fn a_quantity_with_a_wrong_unit_is_refused() {
    for setting in settings().iter().filter(|setting| setting.is_quantity()) {
        let number = setting.value.trim_matches('"').split(' ').next().unwrap();
        setting.refuses(number, &[BareNumber]);
        setting.refuses(&format!("\"{number}\""), &[BareNumber]);
        setting.refuses(&format!("\"{number} furlong\""), &[UnknownUnit]);
        setting.refuses(&format!("\"{number} m^\""), &[UnknownUnit]);
        setting.refuses(&format!("\"{number} /\""), &[UnknownUnit]);
        setting.refuses(&format!("\"{number} kg m^7\""), &[WrongUnit]);
        setting.refuses("\"mm\"", &[WrongType]);
    }
}

#[test]
fn a_quantity_that_no_machine_has_is_refused() {
    for setting in settings().iter().filter(|setting| setting.is_quantity()) {
        let unit = setting.value.trim_matches('"').split_once(' ').unwrap().1;
        for number in ["nan", "inf", "-inf", "1e400", "1e99"] {
            setting.refuses(&format!("\"{number} {unit}\""), &[NotFinite]);
        }
        setting.refuses("nan", &[NotFinite]);
        setting.refuses("-inf", &[NotFinite]);
        let zero = format!("\"0 {unit}\"");
        if SIGNED.contains(&setting.key) {
            for value in [&format!("\"-1 {unit}\""), &zero] {
                if setting.parse(&format!("{} = {value}", setting.key)).is_err() {
                    setting.contradicts(value);
                }
            }
            continue;
        }
        setting.refuses(&format!("\"-1 {unit}\""), &[OutOfRange]);
        if matches!(setting.key, "on_delay" | "off_delay") {
            for delay in ["1e15 s", "1.01 s"] {
                setting.refuses(&format!("\"{delay}\""), &[OutOfRange]);
            }
            setting.parse(&format!("{} = \"1 s\"", setting.key)).unwrap();
        }
        if MAY_BE_ZERO.contains(&setting.key) {
            setting.parse(&format!("{} = {zero}", setting.key)).unwrap();
        } else {
            setting.refuses(&zero, &[OutOfRange]);
        }
    }
}

#[test]
fn a_number_out_of_range_is_refused() {
    for setting in settings().iter().filter(|setting| setting.is_number()) {
        for value in ["nan", "inf", "-inf", "1e400", "99999999999999999999999999999999999999999"] {
            setting.refuses(value, &[NotFinite, Syntax]);
        }
        if !SIDES.contains(&setting.key) {
            setting.refuses("-1", &[OutOfRange]);
        }
        setting.refuses("0", &[OutOfRange]);
    }
}

#[test]
fn a_point_or_range_that_cannot_be_is_refused() {
    for setting in settings().iter().filter(|setting| setting.is_list()) {
        // A side that is none, and a list of numbers that may be one of sides.
        let kinds = [WrongType, BareNumber, UnknownUnit, NotFinite, Contradiction, OutOfRange];
        let length = "\"100 mm\"";
        for value in ["[]", "[\"1 mm\"]", "[1, 2]", "[\"1 mm\", 2]", "[\"nan mm\", \"1 mm\"]"] {
            // Of too few or too many axes the first is named, where there is one.
            if (setting.key, value) == ("home_axes", "[]") {
                setting.contradicts(value);
                continue;
            }
            setting.refuses(value, &kinds);
        }
        setting.refuses(&format!("[{length}, {length}, {length}, {length}]"), &kinds);
        if setting.key == "home" {
            setting.refuses("[\"100 mm\", \"901 mm\"]", &[Contradiction]);
            setting.refuses("[\"100 mm\", \"100 mm\", \"901 mm\"]", &[Contradiction]);
        }
        if matches!(setting.key, "x" | "y") {
            setting.refuses("[\"200 mm\", \"0 mm\"]", &[Contradiction]);
            setting.refuses("[\"200 mm\", \"200 mm\"]", &[Contradiction]);
        }
    }
}

/// Values of two lines exchanged: sound if both are of one kind, else refused at one of the two.
#[test]
fn swapped_values_never_pass_unnoticed_when_they_differ_in_kind() {
    let all = settings();
    for pair in all.windows(2).filter(|pair| pair[0].file == pair[1].file) {
        let [first, second] = pair else { unreachable!() };
        let mut lines: Vec<String> = first.text.lines().map(str::to_owned).collect();
        lines[first.line - 1] = format!("{} = {}", first.key, second.value);
        lines[second.line - 1] = format!("{} = {}", second.key, first.value);
        match Machine::parse(first.file, &lines.join("\n"), &[]) {
            Ok(_) => {
                // A text passes as any text, a unit as the same unit, a number as a number.
                let unit = |value: &str| {
                    let last = value.rsplit('"').nth(1).unwrap_or_default();
                    let letters = last.split_once(' ');
                    letters.map_or(String::new(), |(_, unit)| unit.to_owned())
                };
                let texts = ["name", "description", "sample"];
                let same = unit(first.value) == unit(second.value)
                    || texts.contains(&first.key)
                    || matches!((first.key, second.key), ("position", "velocity"));
                assert!(same, "{} and {} were exchanged", first.key, second.key);
            }
            Err(error) => {
                let line = error.line().unwrap();
                let near = [first.line, second.line].contains(&line)
                    || error.problems().next().unwrap().kind == Contradiction;
                assert!(near, "{} and {}: {error}", first.key, second.key);
            }
        }
    }
}

#[test]
fn a_broken_header_is_refused_near_its_line() {
    for (file, text) in FILES {
        for (index, line) in text.lines().enumerate() {
            if !line.starts_with('[') {
                continue;
            }
            let name = line.trim_matches(['[', ']']);
            for broken in [
                format!("[{name}x]"),
                format!("[x{name}]"),
                format!("[{name}"),
                format!("{name}]"),
                format!("[[{name}]]"),
                "[]".to_owned(),
                "[.]".to_owned(),
                format!("{line}\n{line}"),
            ] {
                // The list of links is written that way.
                if broken == line {
                    continue;
                }
                let mut lines: Vec<&str> = text.lines().collect();
                lines[index] = &broken;
                let error = Machine::parse(file, &lines.join("\n"), &[])
                    .expect_err(&format!("{file}: `{broken}` passed"));
                let found = error.line().unwrap();
                // A table that is taken for part of the one before is noticed at its keys.
                assert!(
                    (index..=index + 12).contains(&found),
                    "{file}:{}: `{broken}` gave {error}",
                    index + 1
                );
            }
        }
    }
}

/// Bytes deleted, doubled, exchanged and replaced at random: an error with a line, or a machine.
#[test]
fn random_damage_never_panics() {
    let mut sequence = SplitMix64::new(1);
    let mut random = |below: usize| sequence.below(below as u64) as usize;
    let alphabet: Vec<char> = "0129.-+eE[]{}=\"'#\n\r\t ,ambµ²^/%\u{0}\u{feff}".chars().collect();
    for case in 0..4000 {
        let (file, text) = FILES[case % FILES.len()];
        let mut letters: Vec<char> = text.chars().collect();
        for _ in 0..1 + random(4) {
            let at = random(letters.len());
            match random(4) {
                0 => drop(letters.drain(at..(at + 1 + random(40)).min(letters.len()))),
                1 => letters.insert(at, alphabet[random(alphabet.len())]),
                2 => letters[at] = alphabet[random(alphabet.len())],
                _ => {
                    let other = random(letters.len());
                    letters.swap(at, other);
                }
            }
        }
        let damaged: String = letters.into_iter().collect();
        if let Err(error) = Machine::parse(file, &damaged, &[]) {
            assert!(error.line().is_some(), "case {case}: {error}\n{damaged}");
            // An independent count of line and column; a carriage return alone is a line break for
            // one and not for the other.
            if !damaged.contains('\r') {
                let place = Position::of(&error);
                let own = (error.line(), error.column());
                let counted = (place.line.map(|l| l as usize), place.column.map(|c| c as usize));
                assert_eq!(counted, own, "case {case}: {error}\n{damaged}");
                assert_eq!(place.file.as_deref(), Some(file));
            }
            // Rendering must survive every place, too.
            assert!(!format!("{:?}", miette::Report::new(error)).is_empty());
        }
    }
}
