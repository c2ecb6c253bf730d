//! Measurements in an instrument's own frame, and such that do not fit.

use super::*;
use core::f64::consts::{FRAC_PI_2, PI};

/// The frame `inner` of `outer` in that of `outer`.
fn chained(outer: &Pose, inner: &Pose) -> Pose {
    Pose {
        position: outer.position + outer.rotation * inner.position,
        rotation: outer.rotation * inner.rotation,
    }
}

/// The frame that undoes `frame`.
fn inverse(frame: &Pose) -> Pose {
    let rotation = frame.rotation.transpose();
    Pose { position: -(rotation * frame.position), rotation }
}

/// The same poses from an instrument in whose frame the machine's is at `seen`, of a point that is at
/// `point` in the tool's frame.
fn seen_from(seen: &Pose, measurements: &[Measurement], point: &Pose) -> Vec<Measurement> {
    let again = |measurement: &Measurement| Measurement {
        pose: chained(&chained(seen, &measurement.pose), point),
        ..*measurement
    };
    measurements.iter().map(again).collect()
}

/// The machine of the file, with this platform.
fn with(platform: TriPlanar) -> Machine {
    Machine { mechanism: MechanismKind::TriPlanar(Box::new(platform)), ..machine() }
}

fn by_name(report: &CalibrationReport, name: &str) -> Identified {
    report.numbers.iter().find(|number| number.name == name).unwrap().clone()
}

/// That the report has the legs as built, and this mounting.
fn assert_found(report: &CalibrationReport, free: &[Part], mounting: &Mounting) {
    let found = TriPlanar { mounting: Some(*mounting), ..built() };
    let wanted = free.iter().flat_map(|part| model::numbers(&found, *part));
    for (number, wanted) in report.numbers.iter().zip(wanted) {
        assert!((number.value - wanted).abs() < 1e-9, "{number:?} {wanted}");
    }
}

const NOWHERE: ([f64; 3], [f64; 3]) = ([0.0; 3], [0.0; 3]);

#[test]
fn an_instrument_may_stand_and_be_turned_in_any_way() {
    let measurements = measured(20, 0.0, [0.25, 0.025], 1);
    let Mounting { base, tool } = built().mounting.unwrap();
    let mounted = |base: Pose, tool: Pose| Some(Mounting { base, tool });
    let still = frame(NOWHERE.0, NOWHERE.1);
    for (position, turns) in [
        ([0.05, 0.0, 0.0], [0.0; 3]),
        ([0.5, -0.3, 0.2], [0.0; 3]),
        ([0.0; 3], [0.0, 0.0, FRAC_PI_2]),
        ([0.0, 0.0, -0.1], [PI, 0.0, 0.0]),
        ([-2.0, 5.0, 1.0], [1.2, -0.7, 2.5]),
    ] {
        let seen = frame(position, turns);
        let poses = seen_from(&seen, &measurements, &still);
        let wanted = Mounting { base: chained(&seen, &base), tool };
        let drawn = platform(&machine());
        for (file, free) in [
            (drawn, &ALL[..]),
            (TriPlanar { mounting: mounted(still, tool), ..drawn }, &[Part::Legs, Part::Base]),
            (TriPlanar { mounting: None, ..built() }, &[Part::Base, Part::Tool]),
            (TriPlanar { mounting: mounted(still, tool), ..built() }, &[Part::Base]),
        ] {
            let report = calibrate(&with(file), "poses.csv", &poses, free).unwrap();
            assert!(report.open.is_empty() && report.after.max < 1e-11, "{report:?}");
            assert_found(&report, free, &wanted);
        }
        // The same of a point far beside the tool.
        let poses = seen_from(&still, &measurements, &seen);
        let wanted = Mounting { base, tool: chained(&tool, &seen) };
        for (legs, free) in [(built(), &[Part::Tool][..]), (drawn, &[Part::Legs, Part::Tool])] {
            let file = TriPlanar { mounting: mounted(base, still), ..legs };
            let report = calibrate(&with(file), "poses.csv", &poses, free).unwrap();
            assert_found(&report, free, &wanted);
        }
    }
    // Nothing is put elsewhere that is not free.
    let poses = seen_from(&frame([0.05, 0.0, 0.0], [0.0; 3]), &measurements, &still);
    let error = calibrate(&machine(), "poses.csv", &poses, &[Part::Legs]).unwrap_err();
    assert!(error.to_string().contains("poses.csv:2: a leg would be"), "{error}");
}

#[test]
fn with_base_and_tool_free_the_files_tool_may_be_half_a_side_and_half_a_radian_off() {
    let measurements = measured(20, 0.0, [0.25, 0.025], 1);
    let Mounting { base, tool } = built().mounting.unwrap();
    let seen = frame([0.5, -0.3, 0.2], [1.2, -0.7, 2.5]);
    for (place, turns) in [
        ([0.0, 0.0, 0.1], [0.0; 3]),
        ([0.07, -0.07, 0.0], [0.0; 3]),
        ([0.1, 0.0, 0.0], [0.5, 0.0, 0.0]),
        ([0.0, 0.0, -0.1], [0.2, -0.3, 0.3]),
    ] {
        let point = frame(place, turns);
        let poses = seen_from(&seen, &measurements, &point);
        let report = calibrate(&machine(), "poses.csv", &poses, &ALL).unwrap();
        let wanted = Mounting { base: chained(&seen, &base), tool: chained(&tool, &point) };
        assert_found(&report, &ALL, &wanted);
    }
}

#[test]
fn poses_that_do_not_fit_are_refused_with_the_worst_line_and_what_to_look_at() {
    let measurements = measured(40, 1e-6, [0.25, 0.025], 7);
    let mut conjugated = measurements.clone();
    for found in &mut conjugated {
        found.pose.rotation = found.pose.rotation.transpose();
    }
    let mut millimeters = measurements.clone();
    for found in &mut millimeters {
        found.pose.position *= 1e3;
    }
    // The feet of the pose before.
    let mut late = measurements.clone();
    for (found, before) in late.iter_mut().skip(1).zip(&measurements) {
        found.feet = before.feet;
    }
    for poses in [conjugated, millimeters, late] {
        for free in [&ALL[..], &[Part::Base], &[Part::Legs, Part::Tool]] {
            let error = calibrate(&machine(), "poses.csv", &poses, free).unwrap_err();
            let CalibrationError::Misfit { rms, max, line, .. } = error else { panic!("{error}") };
            assert!(max >= rms && rms > 0.2 && (2..42).contains(&line), "{error}");
            for due in ["quaternion", "metres", "same moment", &format!("line {line}")] {
                assert!(error.to_string().contains(due), "{error}");
            }
        }
    }
    // One pose among many is named, although the mean hardly shows it.
    let mut one = measured(4000, 1e-6, [0.25, 0.025], 7);
    one[1234].pose.position.z += 0.03;
    let error = calibrate(&machine(), "poses.csv", &one, &ALL).unwrap_err();
    assert!(matches!(error, CalibrationError::Misfit { line: 1236, .. }), "{error}");
}

#[test]
fn steps_that_do_not_settle_are_no_fit() {
    let measurements = measured(40, 1e-6, [0.25, 0.025], 7);
    let settled = |steps| {
        let platform = platform(&machine());
        solve::within(steps, 1e-4, &platform, &measurements, &ALL).unwrap().is_settled
    };
    assert!(!settled(1) && settled(10));
    let fit = Fit { rms: 1e-6, max: 3e-6, line: 7 };
    assert_eq!(misfit("poses.csv", 0.2, &fit, true), None);
    let error = misfit("poses.csv", 0.2, &fit, false).unwrap().to_string();
    assert!(error.contains("no numbers were found that agree best"), "{error}");
    assert!(error.contains("0.0010 mm rms, and 0.0030 mm at most, in line 7"), "{error}");
}

#[test]
fn deviations_and_open_directions_are_those_of_the_printed_numbers() {
    // An instrument whose y is the stator's -z, and whose z is the stator's y.
    let seen = frame([0.0; 3], [FRAC_PI_2, 0.0, 0.0]);
    let still = frame(NOWHERE.0, NOWHERE.1);
    let measurements = measured(40, 1e-6, [0.1, 0.005], 7);
    let here = calibrate(&machine(), "poses.csv", &measurements, &ALL).unwrap();
    let poses = seen_from(&seen, &measurements, &still);
    let turned = calibrate(&machine(), "poses.csv", &poses, &ALL).unwrap();
    let deviation =
        |report: &CalibrationReport, name: &str| by_name(report, name).deviation.unwrap();
    for (name, own) in [
        ("base x", "base x"),
        ("base y", "base z"),
        ("base z", "base y"),
        ("base about z", "base about y"),
        ("tool z", "tool z"),
    ] {
        let ratio = deviation(&turned, name) / deviation(&here, own);
        assert!((ratio - 1.0).abs() < 0.02, "{name}: {ratio}");
    }
    let ratio = deviation(&here, "base z") / deviation(&here, "base y");
    assert!((ratio - 1.0).abs() > 0.1, "the poses do not tell y and z apart: {ratio}");

    // Level poses at one height: the stator's height is not known.
    let level = seen_from(&seen, &measured(30, 0.0, [0.0, 0.0], 3), &still);
    let report = calibrate(&machine(), "poses.csv", &level, &ALL).unwrap();
    let is_open = |name: &str| by_name(&report, name).deviation.is_none();
    assert!(is_open("base y") && is_open("tool z"), "{report:?}");
    let named = |name: &str| report.open.iter().flatten().any(|share| share.name == name);
    assert!(named("base y") && named("tool z"), "{report:?}");
    for direction in &report.open {
        let square: f64 = direction.iter().map(|share| share.part * share.part).sum();
        assert!((0.5..=1.0 + 1e-9).contains(&square), "{direction:?}");
    }
}

#[test]
fn a_change_across_half_a_turn_is_a_small_one() {
    let Mounting { base, tool } = built().mounting.unwrap();
    let file = Mounting { base: frame([0.0; 3], [0.0, 0.0, PI]), tool };
    let seen = chained(&frame([0.0; 3], [0.0, 0.0, PI + 1e-3]), &inverse(&base));
    let still = frame(NOWHERE.0, NOWHERE.1);
    let poses = seen_from(&seen, &measured(20, 0.0, [0.25, 0.025], 1), &still);
    let file = with(TriPlanar { mounting: Some(file), ..built() });
    let report = calibrate(&file, "poses.csv", &poses, &[Part::Base]).unwrap();
    let yaw = by_name(&report, "base about z");
    assert!((yaw.value + PI - 1e-3).abs() < 1e-9, "{yaw:?}");
    assert!((yaw.change() - 1e-3).abs() < 1e-9, "{yaw:?}");
    for number in &report.numbers {
        assert!(number.change().abs() < 1.1e-3 && number.deviation.unwrap() < 1e-9, "{number:?}");
    }
}
