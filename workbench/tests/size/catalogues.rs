//! The catalogues that are built in, and those that are wrong.

use super::by_hand::ONE;
use machine::Motor;
use workbench::catalogue::{BUILTIN, Catalogue, schema};

#[test]
fn the_built_in_catalogues_are_sound_and_plausible() {
    let mut all = Catalogue::default();
    for (name, text) in BUILTIN {
        let one = Catalogue::parse(name, text).unwrap_or_else(|error| panic!("{error}"));
        all = all.and(one);
    }
    let count =
        |is_dc: bool| all.motors.iter().filter(|it| it.motor.dc().is_some() == is_dc).count();
    println!("{} DC motors, {} steppers, {} gears", count(true), count(false), all.gears.len());
    assert!(count(true) >= 40 && count(false) >= 10 && all.gears.len() >= 40);
    for motor in &all.motors {
        assert!(motor.source.len() > 20, "{}", motor.name);
        let Motor::Dc(dc) = &motor.motor else { continue };
        // Mechanical time constants of small motors, and what they take without load.
        let time = dc.rotor_inertia * dc.resistance / (dc.torque_constant * dc.torque_constant);
        assert!((5e-4..30e-3).contains(&time), "{}: {time} s", motor.name);
        let stall = dc.voltage / dc.resistance;
        assert!(motor.no_load_current < 0.15 * stall, "{}", motor.name);
        assert!(dc.current <= 1.01 * stall, "{}", motor.name);
        if let (Some(continuous), Some(thermal)) = (dc.continuous_current, motor.thermal) {
            // What the winding bears for ever warms it by some 25 K to 100 K, its resistance cold.
            let loss = continuous * continuous * dc.resistance;
            let rise = loss * (thermal.winding_housing + thermal.housing_ambient);
            assert!((20.0..110.0).contains(&rise), "{}: {rise} K", motor.name);
        }
    }
    for gear in &all.gears {
        assert!(gear.continuous_torque.is_none_or(|torque| torque <= gear.max_torque));
        assert!((0.5..1.0).contains(&gear.efficiency), "{}", gear.name);
    }
}

/// `GRAVER_WRITE_SCHEMA=1 cargo test -p workbench --test size` writes it anew.
#[test]
fn the_committed_schema_of_catalogues_is_the_generated_one() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../catalogues/schema.json");
    if std::env::var_os("GRAVER_WRITE_SCHEMA").is_some() {
        std::fs::write(path, schema()).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    assert!(committed == schema(), "write it anew with GRAVER_WRITE_SCHEMA=1");
}

/// The first problem of a catalogue: its line, and what would be right.
fn problem(text: &str) -> (Option<usize>, String) {
    let error = Catalogue::parse("wrong.toml", text).unwrap_err();
    assert!(error.to_string().starts_with("wrong.toml:"), "{error}");
    (error.line(), error.message())
}

#[test]
fn a_wrong_catalogue_is_refused_with_line_and_remedy() {
    let wrong = |from: &str, to: &str, words: &[&str]| {
        let text = ONE.replace(from, to);
        assert_ne!(text, ONE, "{from}");
        let (line, message) = problem(&text);
        let at = text.lines().position(|it| it.contains(to)).map(|at| at + 1);
        assert_eq!(line, at, "{message}");
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    wrong("mass = \"480 g\"", "mas = \"480 g\"", &["unknown key `mas`", "did you mean `mass`?"]);
    wrong("\"0.5 ohm\"", "\"0.5 volt\"", &["volt"]);
    wrong("resistance = \"0.5 ohm\"", "resistance = 0.5", &["no unit", "0.5 ohm"]);
    wrong("\"30 mN m/A\"", "\"30 mN m\"", &["N m"]);
    wrong("\"1e-5 kg m^2\"", "\"1e5 kg m^2\"", &["rotor_inertia", "possible is"]);
    wrong("efficiency = 0.75", "efficiency = 1.2", &["1.2", "100 %"]);
    wrong("continuous_torque = \"1 N m\"", "continuous_torque = \"3 N m\"", &["3 N·m", "lower"]);
    wrong("continuous_current = \"3 A\"", "continuous_current = \"9 A\"", &["9.000 A", "lower"]);
    let hot = "max_winding = 5 ";
    wrong("max_winding = 155", hot, &["max_winding", "possible is"]);
    let (line, message) = problem(&ONE.replace("wrap = \"180 deg\"", ""));
    assert!(
        message.contains("`friction` and `wrap`") && message.contains("give both"),
        "{message}"
    );
    assert!(line.is_some());
    // Without a source the motor is named, and the line is its own.
    let (line, message) = problem(&ONE.replace("source = \"a hand\"", ""));
    assert_eq!(line, Some(4));
    assert!(message.contains("`M` names no source") && message.contains("source ="), "{message}");
    let (_, message) = problem(&ONE.replace("[motor.dc]", "[motor.cd]"));
    assert!(message.contains("unknown key `cd`") && message.contains("dc, stepper"), "{message}");
    let (line, message) = problem("source = \"it\"\n[[motor]]\nname = \"M\"\n");
    assert_eq!(line, Some(3));
    assert!(message.contains("neither") && message.contains("[motor.dc]"), "{message}");
    let twice = format!(
        "{ONE}\n[[gear]]\nname = \"G\"\nratio = 2\nefficiency = 0.9\nmax_torque = \"1 N m\"\n"
    );
    assert!(problem(&twice).1.contains("two gears are of the name `G`"));
    assert_eq!(problem("source = \"it\"\n[[motor]\n").0, Some(2));
}
