//! Surfaces, focus and path deviation against the golden vectors and against geometry.

#![allow(clippy::unwrap_used)]

mod followed;
#[path = "../support/mod.rs"]
mod support;

use followed::SurfaceCurve;
use machine::focus::{marginal_travel, paraxial_travel};
use machine::kinematics::Joints;
use machine::mechanisms::mcm::McmBranch;
use machine::path_check::{Curve, Deviation, Interpolated, Interpolation};
use machine::surface::{
    Cone, Placement, Projection, Shape, Sphere, SphereProjection, Spot, Surface, facing,
};
use machine::taylor::Taylor;
use machine::{Mcm, Mechanism};
use messages::math;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use support::{Random, array, code_of, golden, near, number, vector};

fn projection(name: &Value) -> Projection {
    Projection::ALL.into_iter().find(|mode| name == mode.name()).unwrap()
}

fn cone(value: &Value, projection: Projection) -> Cone {
    let of = |key: &str| number(&value[key]);
    Cone { bottom: of("R_bottom"), top: of("R_top"), length: of("h"), projection }
}

fn here(shape: Shape) -> Surface {
    Surface { shape, placement: Placement::HERE }
}

/// A placement with nothing special.
fn aslant() -> Placement {
    let rotation = Matrix3::from_columns(&[
        Vector3::new(0.36, 0.48, -0.8),
        Vector3::new(-0.8, 0.6, 0.0),
        Vector3::new(0.48, 0.64, 0.6),
    ]);
    Placement { rotation, translation: Vector3::new(0.1, -0.2, 0.3) }
}

#[test]
fn cones_agree_with_the_golden_vectors() {
    let file = golden("mcm");
    let cases = file["cone"].as_array().unwrap();
    assert_eq!(cases.len(), 18);
    for case in cases {
        let (input, output) = (&case["input"], &case["output"]);
        let context = input.to_string();
        let frustum = cone(input, projection(&input["mode"]));
        near(frustum.half_angle(), number(&output["half_angle"]), 1e-9, &context);
        let surface = here(Shape::Cone(frustum));
        let spot = surface.spot(number(&input["x"]), number(&input["y"])).unwrap();
        near((Vector3::from(spot.point) - vector(&output["point"])).amax(), 0.0, 1e-9, &context);
        near((Vector3::from(spot.normal) - vector(&output["normal"])).amax(), 0.0, 1e-9, &context);
        near(spot.point[1], number(&output["y_axis"]), 1e-9, &context);
        let angle = math::atan2(spot.point[0], spot.point[2]);
        near(angle, number(&output["alpha"]), 1e-9, &context);
        let radius = math::hypot(spot.point[0], spot.point[2]);
        near(radius, number(&output["r_local"]), 1e-9, &context);
    }
    let failing = file["failing"].as_array().unwrap().iter().find(|case| case["kind"] == "cone");
    let input = &failing.unwrap()["input"];
    let surface = here(Shape::Cone(cone(input, projection(&input["mode"]))));
    let error = surface.point(number(&input["x"]), number(&input["y"])).unwrap_err();
    assert_eq!((error.code, error.value), ("off_surface", 0.06));
    near(error.limit, 0.0425, 1e-15, "the radius there");
}

fn all_shapes() -> Vec<Shape> {
    let mut shapes = vec![Shape::Plane];
    for projection in Projection::ALL {
        for (bottom, top) in [(0.05, 0.035), (0.03, 0.045), (0.04, 0.04), (0.04, 0.04 - 1e-12)] {
            shapes.push(Shape::Cone(Cone { bottom, top, length: 0.1, projection }));
        }
    }
    for projection in [SphereProjection::Central, SphereProjection::Orthographic] {
        shapes.push(Shape::Sphere(Sphere { radius: 0.09, projection }));
    }
    shapes
}

fn tangent(part: [Taylor; 3]) -> Vector3<f64> {
    Vector3::new(part[0].first, part[1].first, part[2].first)
}

#[test]
fn spots_lie_on_their_surface_with_the_normal_across_it() {
    let mut random = Random::new(7);
    for shape in all_shapes() {
        let surface = Surface { shape, placement: aslant() };
        for _ in 0..50 {
            let (x, y) = (0.02 * random.next(), 0.04 + 0.03 * random.next());
            let context = format!("{shape:?} at {x} {y}");
            let spot: Spot<f64> = surface.spot(x, y).unwrap();
            let normal = Vector3::from(spot.normal);
            near(normal.norm(), 1.0, 1e-15, &context);
            near(surface.height(spot.point).unwrap(), 0.0, 1e-15, &context);
            // Beside the surface: the same normal, and the height.
            let above = Vector3::from(spot.point) + normal * 0.003;
            near(surface.height(<[f64; 3]>::from(above)).unwrap(), 0.003, 1e-15, &context);
            let beside = surface.normal_beside(<[f64; 3]>::from(above)).unwrap();
            near((Vector3::from(beside) - normal).amax(), 0.0, 1e-14, &context);
            // Both directions of the drawing are tangents: across the normal.
            let (still_x, still_y) = (Taylor::from(x), Taylor::from(y));
            let along_x = surface.point(Taylor::new(x, 1.0, 0.0, 0.0), still_y).unwrap();
            let along_y = surface.point(still_x, Taylor::new(y, 1.0, 0.0, 0.0)).unwrap();
            for tangent in [tangent(along_x), tangent(along_y)] {
                near(tangent.dot(&normal), 0.0, 1e-14, &context);
            }
            let isometric = matches!(shape, Shape::Plane)
                || matches!(shape, Shape::Cone(Cone { projection: Projection::Developed, .. }));
            if isometric {
                let (u, v) = (tangent(along_x), tangent(along_y));
                near(u.norm(), 1.0, 1e-12, &context);
                near(v.norm(), 1.0, 1e-12, &context);
                near(u.dot(&v), 0.0, 1e-12, &context);
                // Right-handed, seen from outside: the drawing is not mirrored.
                near((u.cross(&v) - normal).amax(), 0.0, 1e-12, &context);
            }
        }
    }
}

/// The central projection stretches by 1/(1 + (x/r)²) (0.80 at x = r/2); the arc does not.
#[test]
fn the_sources_projection_stretches() {
    let stretch = |projection| {
        let cylinder = Cone { bottom: 0.04, top: 0.04, length: 0.1, projection };
        let x = Taylor::new(0.02, 1.0, 0.0, 0.0);
        tangent(here(Shape::Cone(cylinder)).point(x, 0.05.into()).unwrap()).norm()
    };
    near(stretch(Projection::Central), 0.8, 1e-15, "central");
    near(stretch(Projection::Arc), 1.0, 1e-15, "arc");
    near(stretch(Projection::Developed), 1.0, 1e-15, "develop");
    near(stretch(Projection::Orthographic), 1.0 / 0.75_f64.sqrt(), 1e-15, "ortho");
}

#[test]
fn what_is_off_a_surface_is_refused_with_the_value_and_its_limit() {
    let frustum =
        |projection| here(Shape::Cone(Cone { bottom: 0.05, top: 0.035, length: 0.1, projection }));
    for projection in Projection::ALL {
        for (y, limit) in [(-0.001, 0.0), (0.12, 0.1), (f64::NAN, 0.0)] {
            let error = frustum(projection).point(0.0, y).unwrap_err();
            assert_eq!((error.code, error.limit), ("off_surface", limit), "{projection:?} {y}");
        }
        assert!(frustum(projection).point(0.0, 0.0).is_ok());
    }
    assert_eq!(code_of(frustum(Projection::Developed).point(0.0, 0.4)), "off_surface");
    assert_eq!(code_of(frustum(Projection::Arc).normal_beside([0.0, 0.05, 0.0])), "off_surface");
    let ball = Sphere { radius: 0.06, projection: SphereProjection::Orthographic };
    let error = here(Shape::Sphere(ball)).point(0.06, 0.08).unwrap_err();
    assert_eq!((error.code, error.value, error.limit), ("off_surface", 0.1, 0.06));
}

#[test]
fn lens_travel_agrees_with_the_golden_vectors() {
    for case in golden("polar")["focus"].as_array().unwrap() {
        let [depth, index, angle] = ["depth", "n", "u"].map(|key| number(&case[key]));
        let context = case.to_string();
        near(paraxial_travel(depth, index), number(&case["lens_paraxial"]), 1e-12, &context);
        let marginal = marginal_travel(depth, index, angle);
        near(marginal, number(&case["lens_marginal"]), 1e-12, &context);
        // The way of the ray itself: it meets the axis at the depth.
        let radius = marginal * math::tan(angle);
        let inside = math::asin(math::sin(angle) / index);
        near(radius / math::tan(inside), depth, 1e-12, &context);
        assert_eq!(marginal_travel(depth, index, 0.0), paraxial_travel(depth, index));
    }
}

fn mcm() -> Mcm {
    let file = golden("mcm");
    let of = |key: &str| number(&file["params"][key]);
    Mcm {
        tool: of("l"),
        offset: of("x0"),
        height: of("z0"),
        reach: array(&file["params"]["limits"]["X"]),
        singular_distance: of("v_sing"),
        branch: McmBranch::default(),
        load: support::loads::MCM,
        elasticity: None,
    }
}

fn curve(name: &str) -> fn(f64) -> [f64; 2] {
    match name {
        "line" => |u| [-0.03 + 0.06 * u, 0.02 + 0.06 * u],
        "circle" => |u| {
            let (s, c) = math::sin_cos(math::TURN * u);
            [0.02 * c, 0.05 + 0.02 * s]
        },
        "sine" => |u| [-0.03 + 0.06 * u, 0.05 + 0.008 * math::sin(3.0 * math::TURN * u)],
        _ => panic!("no curve {name}"),
    }
}

fn surface_of(input: &Value) -> Surface {
    let description = &input["cone"];
    let rows: Vec<[f64; 3]> = (0..3).map(|row| array(&description["Rot"][row])).collect();
    Surface {
        shape: Shape::Cone(cone(description, projection(&input["mode"]))),
        placement: Placement {
            rotation: Matrix3::from_fn(|row, column| rows[row][column]),
            translation: vector(&description["tr"]),
        },
    }
}

#[test]
fn a_tool_faces_every_normal() {
    let mut random = Random::new(11);
    let fixed = [Vector3::x(), -Vector3::x(), Vector3::y(), Vector3::z(), -Vector3::z()];
    for normal in fixed.into_iter().chain((0..50).map(|_| random.vector(1.0).normalize())) {
        let rotation = facing(&normal);
        near((rotation.column(2) - normal).amax(), 0.0, 1e-15, "z is the normal");
        let off = rotation * rotation.transpose() - Matrix3::identity();
        near(off.amax(), 0.0, 1e-15, "orthogonal");
        near(rotation.determinant(), 1.0, 1e-15, "right-handed");
    }
    assert_eq!(facing(&Vector3::z()), Matrix3::identity());
}

/// The drawing moves; the joints' derivatives come out of one pass over series, and agree with
/// differences of joints that were solved one by one.
#[test]
fn a_moving_drawing_gives_the_rates_of_the_joints() {
    let file = golden("mcm");
    let machine = mcm();
    for path in file["paths"].as_array().unwrap() {
        let surface = surface_of(&path["input"]);
        let near_by = Joints::from(array::<5>(&path["knots_q"][0]));
        let moving = |time: f64| {
            let at = |value: f64, first: f64, second: f64, third: f64| {
                Taylor::new(
                    value + time * (first + time * (second / 2.0 + time * third / 6.0)),
                    first + time * (second + time * third / 2.0),
                    second + time * third,
                    third,
                )
            };
            [at(-0.012, 0.05, 0.4, -3.0), at(0.045, 0.03, -0.2, 5.0)]
        };
        let joints = |time: f64| {
            let [x, y] = moving(time);
            let tool = surface.spot(x, y).unwrap().tool();
            machine.joint_motion(&tool, machine.branch, &near_by).unwrap()
        };
        let drawing = |time: f64| moving(time).map(|series| series.value);
        let followed = SurfaceCurve {
            mechanism: &machine,
            branch: machine.branch,
            surface: &surface,
            drawing,
        };
        let here = joints(0.0);
        let solved = |time: f64| followed.joints(time, &near_by).unwrap();
        near((solved(0.0) - here.position).amax(), 0.0, 1e-12, "position");
        let h = 1e-5;
        let (ahead, behind) = (joints(h), joints(-h));
        let scale = 1.0 + here.jerk.amax();
        for (found, low, high) in [
            (here.velocity, solved(-h), solved(h)),
            (here.acceleration, behind.velocity, ahead.velocity),
            (here.jerk, behind.acceleration, ahead.acceleration),
        ] {
            let difference = (high - low) / (2.0 * h);
            near((found - difference).amax(), 0.0, 1e-7 * scale, &path["input"].to_string());
        }
    }
}

#[test]
fn path_deviations_agree_with_the_golden_vectors() {
    let file = golden("mcm");
    let machine = mcm();
    let tolerance = number(&file["path_tolerance_rel"]);
    let paths = file["paths"].as_array().unwrap();
    assert_eq!(paths.len(), 6);
    for path in paths {
        let input = &path["input"];
        let surface = surface_of(input);
        let drawing = curve(input["curve"].as_str().unwrap());
        let followed = SurfaceCurve {
            mechanism: &machine,
            branch: machine.branch,
            surface: &surface,
            drawing,
        };
        let given = path["knots_q"].as_array().unwrap();
        let last = given.len() - 1;
        let parameters = (0..=last).map(|knot| knot as f64 / last as f64);
        let first = Joints::from(array::<5>(&given[0]));
        let knots = followed.knots(parameters, &first).unwrap();
        for ((parameter, q), expected) in knots.iter().zip(given) {
            let off = (q - Joints::from(array::<5>(expected))).amax();
            near(off, 0.0, 1e-9, &format!("{input} at {parameter}"));
        }
        for (name, interpolation) in
            [("linear", Interpolation::Linear), ("natural_cubic", Interpolation::NaturalCubic)]
        {
            let result = &path["result"][name];
            let joined = Interpolated::new(knots.clone(), interpolation);
            let (parameter, middle) = joined.at(0, 0.5);
            near(parameter, number(&result["mid_u_first"]), 1e-15, name);
            let expected = Joints::from(array::<5>(&result["q_mid_first"]));
            near((middle - expected).amax(), 0.0, 1e-9, name);
            let found = followed.largest_deviation(&joined).unwrap();
            for (found, key) in [
                (found.matched, "max_matched"),
                (found.geometric, "max_geometric"),
                (found.surface, "max_surface"),
                (found.axis, "max_axis_angle"),
            ] {
                let expected = number(&result[key]);
                near(found, expected, tolerance * expected, &format!("{name} {key} {input}"));
            }
        }
    }
}

/// The circle of the source's page once more: the natural cubic is off by what its ends do, which do not
/// bend. With ends that go on as the cubic beside them a fortieth of that is left, and halving the
/// segments divides it by about sixteen.
#[test]
fn cubics_whose_ends_go_on_stray_the_least() {
    let file = golden("mcm");
    let machine = mcm();
    let path = &file["paths"][2];
    assert_eq!((&path["input"]["curve"], &path["input"]["knots"]), (&"circle".into(), &33.into()));
    let surface = surface_of(&path["input"]);
    let followed = SurfaceCurve {
        mechanism: &machine,
        branch: machine.branch,
        surface: &surface,
        drawing: curve("circle"),
    };
    let first = Joints::from(array::<5>(&path["knots_q"][0]));
    let strays = |segments: u32| {
        let parameters = (0..=segments).map(|knot| f64::from(knot) / f64::from(segments));
        let knots = followed.knots(parameters, &first).unwrap();
        let joined = Interpolated::new(knots, Interpolation::NotAKnot);
        followed.largest_deviation(&joined).unwrap()
    };
    let found = strays(32);
    near(found.geometric, 0.83e-6, 0.005e-6, "as a check of the source computed it");
    assert!(found.matched < 1e-6, "{found:?}");
    let ratio = found.geometric / strays(64).geometric;
    assert!((12.0..20.0).contains(&ratio), "{ratio}");
}

/// A cubic is its own cubic through four knots or more, however they lie, and a parabola through three.
#[test]
fn cubics_whose_ends_go_on_reproduce_cubics() {
    let mut random = Random::new(5);
    for count in 2..9 {
        let order = (count - 1).min(3);
        let factors: Vec<f64> = (0..=order).map(|_| random.next()).collect();
        let cubic = |u: f64| factors.iter().rev().fold(0.0, |sum, factor| sum * u + factor);
        let mut parameter = -1.0;
        let knots: Vec<(f64, Joints<1>)> = (0..count)
            .map(|_| {
                parameter += 0.2 + 0.1 * (1.0 + random.next());
                (parameter, Joints::from([cubic(parameter)]))
            })
            .collect();
        let joined = Interpolated::new(knots, Interpolation::NotAKnot);
        for segment in 0..joined.segments() {
            for share in [0.0, 0.3, 0.8, 1.0] {
                let (parameter, q) = joined.at(segment, share);
                near(q[0], cubic(parameter), 1e-12, &format!("{count} knots"));
            }
        }
    }
}

#[test]
fn segments_are_halved_until_the_path_is_within_tolerance() {
    let file = golden("mcm");
    let machine = mcm();
    let tolerance = Deviation { matched: 2e-5, geometric: 1e-5, surface: 2e-6, axis: 1e-3 };
    for (path, most) in [(&file["paths"][2], 140), (&file["paths"][5], 400)] {
        let input = &path["input"];
        let surface = surface_of(input);
        let drawing = curve(input["curve"].as_str().unwrap());
        let followed = SurfaceCurve {
            mechanism: &machine,
            branch: machine.branch,
            surface: &surface,
            drawing,
        };
        let near_by = Joints::from(array::<5>(&path["knots_q"][0]));
        let halved = |interpolation, most| {
            followed.subdivided([0.0, 1.0], interpolation, &tolerance, most, &near_by)
        };
        let straight = halved(Interpolation::Linear, most).unwrap();
        let cubic = halved(Interpolation::NaturalCubic, most).unwrap();
        let open = halved(Interpolation::NotAKnot, most).unwrap();
        for (joined, left) in [&straight, &cubic, &open] {
            // Looked at elsewhere than where it was subdivided.
            for segment in 0..joined.segments() {
                let (parameter, q) = joined.at(segment, 0.377);
                let reached = machine.forward(&q, machine.branch).unwrap().position;
                let [x, y] = drawing(parameter);
                let wanted = Vector3::from(surface.point(x, y).unwrap());
                assert!((reached - wanted).norm() <= tolerance.matched * 1.01);
            }
            let found = followed.largest_deviation(joined).unwrap();
            assert!(found.matched <= tolerance.matched && found.axis <= tolerance.axis);
            assert_eq!(found, *left);
        }
        let segments = [&straight, &cubic, &open].map(|(joined, _)| joined.segments());
        assert!(segments.is_sorted_by(|more, fewer| more > fewer), "{segments:?}");
        assert_eq!(code_of(halved(Interpolation::Linear, 9)), "too_many_knots");
    }
}

#[test]
fn natural_cubics_are_smooth_and_straight_at_their_ends() {
    let mut random = Random::new(3);
    let mut parameter = 0.0;
    let knots: Vec<(f64, Joints<2>)> = (0..7)
        .map(|_| {
            parameter += 1.5 + random.next();
            (parameter, Joints::from([random.next(), random.next()]))
        })
        .collect();
    let path = Interpolated::new(knots.clone(), Interpolation::NaturalCubic);
    let h = 1e-4;
    let slope = |segment: usize, share: f64| {
        let length = knots[segment + 1].0 - knots[segment].0;
        (path.at(segment, share + h).1 - path.at(segment, share - h).1) / (2.0 * h * length)
    };
    let bend = |segment: usize, share: f64| {
        let length = knots[segment + 1].0 - knots[segment].0;
        (slope(segment, share + h) - slope(segment, share - h)) / (2.0 * h * length)
    };
    for segment in 0..6 {
        near((path.at(segment, 0.0).1 - knots[segment].1).amax(), 0.0, 1e-15, "start");
        near((path.at(segment, 1.0).1 - knots[segment + 1].1).amax(), 0.0, 1e-15, "end");
        if segment > 0 {
            near((slope(segment, 0.0) - slope(segment - 1, 1.0)).amax(), 0.0, 1e-6, "slope");
            near((bend(segment, 0.0) - bend(segment - 1, 1.0)).amax(), 0.0, 1e-5, "bend");
        }
    }
    near(bend(0, 0.0).amax(), 0.0, 1e-5, "first end");
    near(bend(5, 1.0).amax(), 0.0, 1e-5, "last end");
}
