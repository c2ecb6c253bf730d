//! Mechanisms whose machine frame is not that of their axes, and what turns instead of sliding.

use std::sync::Arc;

use machine::frame::{Alignment, Frame, Mesh};
use machine::kinematics::Joints;
use machine::mechanisms::galvo::{Galvo, Optics};
use machine::transmission::Elasticity;
use machine::{Cartesian, CoreXy, Mechanism, Pose};
use messages::math;
use nalgebra::Vector3;

use super::SCREW;
use super::suite::conforms;

const ASKEW: Alignment = Alignment {
    mirrored: [true, false, true],
    swapped: true,
    origin: [0.31, -0.02, 0.05],
    rotation: 3e-3,
    skew: -1.5e-3,
    scale: [1.0002, 0.9991, 1.003],
};

/// Deviations of some tens of micrometres over a square of half a metre about the origin.
fn mesh() -> Mesh {
    let at = |row: usize, column: usize| {
        let (r, c) = (row as f64, column as f64);
        [60e-6 * math::sin(0.9 * c - 0.4 * r), 45e-6 * math::cos(0.7 * r + 0.2 * c)]
    };
    let rows: Vec<Vec<[f64; 2]>> =
        (0..6).map(|row| (0..7).map(|column| at(row, column)).collect()).collect();
    Mesh::new([-0.3, 0.3], [-0.25, 0.25], &rows).unwrap()
}

/// Frames over axes that lift the tool or not.
fn frames(lifts: bool) -> Vec<Option<Arc<Frame>>> {
    let [x, y, z] = ASKEW.origin;
    let askew = Alignment { origin: [x, y, if lifts { z } else { 0.0 }], ..ASKEW };
    let frame = |alignment, mesh| Some(Arc::new(Frame::new(&alignment, mesh).unwrap()));
    vec![frame(askew, None), frame(Alignment::NONE, Some(mesh())), frame(askew, Some(mesh()))]
}

#[test]
fn the_cartesian_conforms_in_any_frame() {
    for frame in frames(false) {
        let flat = Cartesian { frame, ..Cartesian::rigid([1.93, 0.33]) };
        conforms(&flat, &[()], |random| random.joints([[-0.2, 0.2]; 2]));
    }
    for frame in frames(true) {
        let lift = Cartesian {
            elasticity: Some([SCREW; 3]),
            frame,
            ..Cartesian::rigid([1.93, 0.33, 0.2])
        };
        conforms(&lift, &[()], |random| random.joints([[-0.2, 0.2], [-0.2, 0.2], [-0.1, 0.1]]));
    }
}

#[test]
fn the_cartesian_with_a_chuck_conforms() {
    for frame in [vec![None], frames(false)].concat() {
        let mechanism = Cartesian { travel: [1.0, 0.03], frame, ..Cartesian::rigid([1.93, 2e-4]) };
        conforms(&mechanism, &[()], |random| random.joints([[-0.2, 0.2], [-6.0, 6.0]]));
    }
}

#[test]
fn the_corexy_conforms_with_a_lift_and_in_any_frame() {
    let springs = [0.33, 1.06, 0.2].map(|mass| Elasticity::damped(6e4, mass, 0.9));
    for frame in frames(false) {
        let flat = CoreXy { frame, ..CoreXy::rigid([0.33, 1.06]) };
        conforms(&flat, &[()], |random| random.joints([[-0.2, 0.2]; 2]));
    }
    for frame in [vec![None], frames(true)].concat() {
        let lift = CoreXy { elasticity: Some(springs), frame, ..CoreXy::rigid([0.33, 1.06, 0.2]) };
        conforms(&lift, &[()], |random| random.joints([[-0.2, 0.2], [-0.2, 0.2], [-0.1, 0.1]]));
    }
    let lift = CoreXy::rigid([0.33, 1.06, 0.2]);
    assert_eq!(lift.gravity(&Joints::zeros()), Joints::from([0.0, 0.0, 0.2 * 9.806_65]));
}

#[test]
fn the_scan_head_conforms_with_and_without_a_lens_and_in_any_frame() {
    let lens = |distortion| Optics::FTheta { focal_length: 0.16, distortion };
    for optics in
        [lens([0.0; 2]), lens([-0.03, 0.02]), Optics::Open { distance: 0.2, mirrors: 0.012 }]
    {
        for frame in [vec![None], frames(false)].concat() {
            let elasticity = Some([Elasticity { stiffness: 40.0, damping: 1e-4 }; 2]);
            let head = Galvo { inertia: [4e-8, 9e-8], optics, elasticity, frame };
            conforms(&head, &[()], |random| random.joints([[-0.17, 0.17]; 2]));
        }
    }
}

/// Straight through the middle of the field, where the beam has no direction off the axis.
#[test]
fn a_path_through_the_middle_of_a_lens_is_smooth() {
    let optics = Optics::FTheta { focal_length: 0.16, distortion: [-0.03, 0.02] };
    let head = Galvo { inertia: [4e-8; 2], optics, elasticity: None, frame: None };
    let at = |x: f64| {
        let pose = Pose::at(Vector3::new(x, 0.3 * x, 0.0));
        let mut tool = machine::kinematics::ToolMotion::rest(&pose);
        tool.velocity = Vector3::new(2.0, 0.6, 0.0);
        head.joint_motion(&tool, (), &Joints::zeros()).unwrap()
    };
    let (before, middle, after) = (at(-1e-9), at(0.0), at(1e-9));
    assert_eq!(middle.position, Joints::<2>::zeros());
    // ω = v/2f for each mirror.
    assert!((middle.velocity - Joints::from([6.25, 1.875])).amax() < 1e-13);
    assert!(middle.acceleration.amax() < 1e-12);
    for other in [before, after] {
        assert!((other.jerk - middle.jerk).amax() < 1e-3 * (1.0 + middle.jerk.amax()));
    }
}

/// What a person means by mirrored, swapped, turned, skew and scaled.
#[test]
fn a_frame_lies_over_the_axes_as_it_says() {
    let tool = |alignment: Alignment, axes: [f64; 3]| {
        let frame = Frame::new(&alignment, None).unwrap();
        assert!(frame.is_linear());
        frame.tool(&Vector3::from(axes))
    };
    let close = |found: Vector3<f64>, expected: [f64; 3]| {
        assert!((found - Vector3::from(expected)).amax() < 1e-12, "{found} {expected:?}");
    };
    let none = Alignment::NONE;
    close(tool(none, [0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    // Homed in the corner at the right and behind: the axes run towards the other corner.
    let corner = Alignment { mirrored: [true, true, false], origin: [0.6, 0.4, 0.0], ..none };
    close(tool(corner, [0.0, 0.0, 0.0]), [0.6, 0.4, 0.0]);
    close(tool(corner, [0.1, 0.2, 0.3]), [0.5, 0.2, 0.3]);
    close(tool(Alignment { swapped: true, ..none }, [0.1, 0.2, 0.0]), [0.2, 0.1, 0.0]);
    // 1 m along x with 1 mrad of turn is 1 mm up; along y with 1 mrad of skew 1 mm to the left.
    let turned = Alignment { rotation: 1e-3, ..none };
    close(tool(turned, [1.0, 0.0, 0.0]), [math::cos(1e-3), math::sin(1e-3), 0.0]);
    let leaning = Alignment { skew: 1e-3, ..none };
    close(tool(leaning, [1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
    close(tool(leaning, [0.0, 1.0, 0.0]), [-(math::sin(1e-3)), math::cos(1e-3), 0.0]);
    let longer = Alignment { scale: [1.0002, 1.0, 1.0], ..none };
    close(tool(longer, [0.5, 0.5, 0.0]), [0.5001, 0.5, 0.0]);
    // A deviation of the mesh is where the tool is, less where it should be.
    let frame = Frame::new(&none, Some(mesh())).unwrap();
    assert!(!frame.is_linear());
    close(frame.tool(&Vector3::new(-0.3, -0.25, 0.0)), [-0.3, -0.25 + 45e-6, 0.0]);
}

#[test]
fn a_lift_that_runs_down_is_drawn_by_its_weight() {
    let down = Alignment { mirrored: [false, false, true], ..Alignment::NONE };
    let frame = Frame::new(&down, None).map(Arc::new);
    let lift = Cartesian { frame, ..Cartesian::rigid([1.0, 1.0, 0.5]) };
    let efforts = lift.gravity(&Joints::zeros());
    assert_eq!(efforts, Joints::from([0.0, 0.0, -0.5 * 9.806_65]));
}
