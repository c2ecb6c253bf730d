//! A platform on three hinged legs, each on a planar motor: as large as its motors must be.

use super::samples;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{about, comment, inertia, kg, lengths, line, mm};
use crate::new::worst::Worst;
use crate::new::{LESS, Request, Short};
use core::f64::consts::TAU;
use machine::StepperMotor;

/// Pitch of the stator's teeth [m].
pub(in crate::new) const PITCH: f64 = 0.64e-3;

/// The shipped machine: side of its triangles [m], holding force of its motors [N], their mass [kg] and
/// the mass of its platform without a head.
const SIDE: f64 = 0.2;
const FORCE: f64 = 80.0;
const MOTOR: f64 = 0.9;
const PLATFORM: f64 = 0.3;

/// Heights of the platform that it reaches, in sides.
const HEIGHTS: [f64; 2] = [0.345, 0.695];

/// The strongest planar motor [N].
const STRONGEST: f64 = 3000.0;

/// What of its holding force a motor is asked for at most.
const SHARE: f64 = 0.6;

/// Largest pulse rate of the driver [1/s], and pulses of a pitch.
const PULSE_RATE: f64 = 1e6;
const PULSES: [f64; 4] = [1000.0, 500.0, 200.0, 100.0];

pub(super) fn draft(request: &Request, asked: &Asked) -> Draft {
    let Request { area: [width, depth], head, z, .. } = *request;
    let force = asked.planar.unwrap_or(FORCE);
    let side = (z / (HEIGHTS[1] - HEIGHTS[0])).max(SIDE * (force / FORCE).sqrt());
    let scale = side / SIDE;
    let home = (HEIGHTS[0] + HEIGHTS[1]) / 2.0 * side;
    let platform = head + PLATFORM * scale * scale;
    let turning = platform * side * side;
    let motor = MOTOR * force / FORCE;
    let [x, y] = [width / 2.0 + 2.1 * side, depth / 2.0 + 1.6 * side];
    let inertias = [0.05, 0.05, 0.092].map(|share| inertia(share * turning));
    let mut mechanism = "[mechanism.tri_planar]\n".to_owned();
    for (key, value, what) in [
        ("side", mm(side), "of platform and legs: what the height and the motors need"),
        ("stator_x", lengths(&[-x, x]), "half the area, and 2.1 sides for the feet"),
        ("stator_y", lengths(&[-y, y]), "half the area, and 1.6 sides"),
        ("inductor", mm(0.4 * side * (force / FORCE).sqrt() / scale), "of a motor of that force"),
        ("gap", mm(5e-3), ""),
        ("clearance", mm(0.02 * scale.min(1.0)), ""),
        ("type_1_margin", "0.15".to_owned(), ""),
        ("type_2_margin", "0.05".to_owned(), ""),
        ("platform_mass", kg(platform), "the head, and carbon plate"),
        ("platform_inertia", format!("[{}]", inertias.join(", ")), ""),
        ("leg_mass", kg(0.08 * scale * scale), "carbon plate"),
        ("motor_mass", kg(motor), "as much for its force as a motor of 150 mm: 0.9 kg for 80 N"),
    ] {
        mechanism += &line(key, &value, what);
    }
    let axis = |name: &str| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Length,
        output: "",
        transmission: format!(
            "[axis.{name}.transmission.planar]\n{}\n",
            line("pitch", &mm_fine(PITCH), "")
        ),
        efficiency: (1.0, ""),
        travel: Travel::OfArea,
        own: None,
    };
    let radius = (0.15 * width.min(depth)).min(0.02).min(0.3 * z);
    let speed = crate::new::text::quantity(0.8 * asked.speed.min(1.5 * radius / 0.4), "m/s");
    let sample = format!(
        "# A circle in a plane tilted by 10 degrees about x, the platform's normal along the plane's.\n\n\
         [path.circle]\nradius = {}\nroll = \"10 deg\"\n\n[attitude]\nroll = \"10 deg\"\n",
        mm(radius)
    ) + &samples::marking(&speed, "");
    Draft {
        about: "A tri-planar platform after source 001: a triangular platform on three hinged triangles, each \
                standing on a planar stepper motor of one common stator."
            .to_owned(),
        description: "Six-degree-of-freedom platform on three planar stepper motors".to_owned(),
        home: format!("home = {}\n", lengths(&[0.0, 0.0, home])),
        area_about: "",
        area: [[-width / 2.0, width / 2.0], [-depth / 2.0, depth / 2.0]],
        z: Some([home - z / 2.0, home + z / 2.0]),
        mechanism,
        axes: ["xD", "yD", "xE", "yE", "xF", "yF"].map(axis).into(),
        sample,
    }
}

fn mm_fine(value: f64) -> String {
    crate::new::text::exact(value * 1e3, "mm")
}

/// A planar motor of a holding force [N] for what `worst` asks of it, and what is said of it.
pub(in crate::new) fn motor(worst: &Worst, force: f64) -> Result<(StepperMotor, String), Short> {
    let ratio = PITCH / TAU;
    let slow = |what: String| Short::Acceleration(LESS, what);
    if worst.effort > SHARE * force {
        let needed = 1.15 * worst.effort / SHARE;
        if needed > STRONGEST {
            return Err(slow(format!("a planar motor has {STRONGEST} N at most")));
        }
        return Err(Short::Force(needed.max(1.05 * force)));
    }
    let pitches = worst.speed / PITCH;
    let Some(pulses) = PULSES.into_iter().find(|pulses| pulses * pitches * 1.2 <= PULSE_RATE)
    else {
        let speed = PULSE_RATE / 1.2 / PULSES[3] * PITCH;
        return Err(slow(format!("the driver's pulses let a motor go at {} m/s", about(speed))));
    };
    let mut motor = StepperMotor {
        full_steps: 4.0,
        microsteps: pulses / 4.0,
        holding_torque: force * ratio,
        detent_torque: 0.0025 * force * ratio,
        rotor_inertia: 1e-12,
        current: 3.0 * (force / FORCE),
        resistance: 2.5 * (FORCE / force),
        inductance: 2e-3 * (FORCE / force),
        voltage: 48.0,
        damping: 0.0,
        pulse_rate: PULSE_RATE,
    };
    motor.damping = 0.4 * (motor.stiffness() * worst.load * ratio * ratio).sqrt();
    let left = motor.pull_out_torque(worst.speed / ratio) / ratio;
    if worst.effort * 1.25 > 0.97 * left {
        return Err(slow(format!(
            "at {} m/s its inductance leaves a planar motor {} N of {} N",
            about(worst.speed),
            about(left),
            about(force)
        )));
    }
    let why = comment(&format!(
        "A planar motor, given as a stepper whose turn is one pitch: {} N of holding force are {} mN m. It \
         does {} m/s and {} N at the worst place of the area. Winding and pulses are rounded data of a \
         150 mm motor on air bearings, by the force.",
        about(force),
        about(force * ratio * 1e3),
        about(worst.speed),
        about(worst.effort)
    ));
    Ok((motor, why))
}
