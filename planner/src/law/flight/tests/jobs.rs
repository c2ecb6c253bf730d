use super::*;

/// A line between two points, marked at one speed.
type Line = [Vector3<f64>; 2];

/// Whatever judges a flight beyond the tool's limits.
type Fits = fn(&Flight) -> bool;

fn point(x: f64, y: f64) -> Vector3<f64> {
    Vector3::new(x, y, 0.0) * 1e-3
}

/// A polygon through `points`.
fn chain(points: &[Vector3<f64>]) -> Vec<Line> {
    points.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// `rows` lines to and fro over `length`, `pitch` apart [mm].
fn hatch(rows: u32, length: f64, pitch: f64) -> Vec<Line> {
    let row = |index: u32| {
        let y = f64::from(index) * pitch;
        let (first, last) = (point(0.0, y), point(length, y));
        if index.is_multiple_of(2) { [first, last] } else { [last, first] }
    };
    (0..rows).map(row).collect()
}

/// Time of all lines at `speed`, from rest at the first point, to rest anywhere.
fn total(lines: &[Line], speed: f64, limits: &FlightLimits, fits: Fits) -> f64 {
    let mut time = 0.0;
    let mut state = State::rest(lines[0][0]);
    for [first, last] in lines {
        let velocity = (last - first).normalize() * speed;
        let to = moving(*first, velocity);
        let flight = Flight::new(&state, &to, limits, &mut |flight| fits(flight)).unwrap();
        check(&flight, &state, &to, limits, "job");
        time += flight.duration() + (last - first).norm() / speed;
        state = moving(*last, velocity);
    }
    time + Flight::run_out(&state, limits, &[]).unwrap().duration()
}

/// Two belts at 45°, each within 10 m/s² and 1 m/s.
fn belts(flight: &Flight) -> bool {
    let keeps = |x: f64, y: f64, limit: f64| (x.abs() + y.abs()) <= limit * (1.0 + 1e-9);
    let grid = (0..=64).map(|index| flight.duration() * f64::from(index) / 64.0);
    // The acceleration is largest at a break.
    grid.chain(flight.breaks()).all(|time| {
        let motion = flight.at(time);
        keeps(motion.velocity.x, motion.velocity.y, 1.0)
            && keeps(motion.acceleration.x, motion.acceleration.y, 10.0)
    })
}

/// Name, lines, speed, bounds of time without and with a limit of jerk, how much longer is right.
type Job = (&'static str, Vec<Line>, f64, [f64; 2], f64);

fn jobs() -> Vec<Job> {
    let square = [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0), (0.0, 0.0)];
    let square: Vec<_> = square.into_iter().map(|(x, y)| point(x, y)).collect();
    let zigzag: Vec<_> =
        (0..41).map(|index| point(f64::from(index), f64::from(index % 2) * 1.732_050_8)).collect();
    let star: Vec<_> = (0..6)
        .map(|index| {
            let (sine, cosine) = math::sin_cos(f64::from(index) * 0.4 * math::TURN);
            point(30.0 * cosine, 30.0 * sine)
        })
        .collect();
    let line = [point(0.0, 0.0), point(100.0, 0.0)];
    vec![
        ("line_100", chain(&line), 1.0, [0.441_477_796, 0.496_619_607], 1.01),
        ("square_40", chain(&square), 0.5, [0.948_493_199, 1.108_634_665], 1.01),
        ("zigzag_2mm", chain(&zigzag), 0.5, [5.259_455_038, 6.498_568_371], 1.01),
        ("star_5", chain(&star), 0.5, [1.180_769_020, 1.335_927_838], 1.01),
        ("hatch_50", hatch(51, 30.0, 0.2), 0.5, [8.230_886_512, 9.286_289_843], 1.01),
        ("raster_4x50", hatch(4, 50.0, 0.1), 0.3, [0.949_120_190, 1.065_014_302], 1.01),
    ]
}

#[test]
fn jobs_take_hardly_longer_than_their_bounds() {
    for (name, lines, speed, bounds, factor) in jobs() {
        for (jerk, bound) in [(1e6, bounds[0]), (500.0, bounds[1])] {
            let limits = FlightLimits { jerk, ..LIMITS };
            let ratio = total(&lines, speed, &limits, |_| true) / bound;
            println!("{name} jerk {jerk:e}: {ratio:.4} of the bound");
            assert!(ratio <= factor, "{name} jerk {jerk:e}: {ratio}");
        }
    }
}

#[test]
fn turns_within_the_limits_of_belts_are_near_to_their_bound() {
    let (sine, cosine) = math::sin_cos(math::TURN / 8.0);
    let turn =
        |p: Vector3<f64>| Vector3::new(cosine * p.x - sine * p.y, sine * p.x + cosine * p.y, 0.0);
    let lines: Vec<Line> = hatch(31, 30.0, 0.2).into_iter().map(|line| line.map(turn)).collect();
    for (jerk, bound) in [(1e6, 6.344_107_429), (500.0, 6.808_816_859)] {
        let limits = FlightLimits { jerk, ..LIMITS };
        let ratio = total(&lines, 0.5, &limits, belts) / bound;
        println!("corexy_hatch_45 jerk {jerk:e}: {ratio:.4} of the bound");
        assert!(ratio <= 1.08, "jerk {jerk:e}: {ratio}");
    }
}
