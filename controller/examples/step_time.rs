//! How long a controller step takes: plays a long stream with motors that follow exactly.
//!
//! `cargo run --release -p controller --example step_time`

#![allow(clippy::print_stdout, reason = "an example for people")]

use std::time::Instant;

use controller::{Controller, Inputs, Outputs, Peers};
use machine::Machine;
use messages::feedback::status;
use messages::time::SETPOINT_TIME as CYCLE_TIME;
use messages::{
    CommandMode, ControllerState, Cycle, Feedback, Nanoseconds, OperatorRequest, OperatorVerb,
    Setpoint, math,
};

const SETPOINTS: u64 = 200_000;

/// Steps timed together.
const BATCH: u32 = 500;

/// Setpoints in one turn; few enough to stay in a cache, as a channel's newest do.
const TURN: u64 = 500;

fn main() {
    let machine = Machine::builtin();
    let home = [machine.home[0] + machine.home[1], machine.home[0] - machine.home[1]];
    let pulsation = math::TURN / (TURN as f64 * CYCLE_TIME);
    let turn: Vec<Setpoint> = (0..TURN)
        .map(|sequence| {
            let angle = math::TURN * sequence as f64 / TURN as f64;
            let mut setpoint = Setpoint { stream: 1, sequence, ..Setpoint::default() };
            for (index, home) in home.iter().enumerate() {
                setpoint.position[index] = home + 0.005 * (1.0 - math::cos(angle));
                setpoint.velocity[index] = 0.005 * pulsation * math::sin(angle);
                setpoint.acceleration[index] = 0.005 * pulsation * pulsation * math::cos(angle);
                setpoint.effort[index] = 0.001 * math::cos(angle);
            }
            setpoint.laser.gate = 1;
            setpoint.laser.power = 0.5;
            setpoint
        })
        .collect();
    // Rates off 1 interpolate between setpoints.
    for rate in [1.0, 0.9] {
        let mut controller = Controller::new(&machine);
        let mut outputs = Outputs::default();
        let mut feedback = Feedback { status: status::POWERED, ..Feedback::default() };
        for (index, actuator) in machine.actuators.iter().enumerate() {
            feedback.position[index] = home[index] / actuator.ratio;
        }
        let (mut sent, mut steps, mut cycle) = (0, 0_u32, 0);
        let mut batch = Vec::with_capacity(2);
        let (mut since, mut batches) = (Instant::now(), Vec::new());
        while sent < SETPOINTS {
            cycle += 1;
            let request = match cycle {
                2 => Some((OperatorVerb::Enable, 0.0)),
                3 => Some((OperatorVerb::Override, rate)),
                40 => Some((OperatorVerb::Start, 1.0)),
                _ => None,
            };
            let request = request.map(|(verb, value)| OperatorRequest {
                verb: verb as u32,
                ticket: cycle,
                value,
                ..OperatorRequest::default()
            });
            feedback.cycle = Cycle(u64::from(cycle));
            if outputs.command.mode() == CommandMode::Driven {
                feedback.position = outputs.command.reference;
            }
            let end = sent + controller.room().min(2) as u64;
            batch.clear();
            batch.extend(
                (sent..end)
                    .map(|sequence| Setpoint { sequence, ..turn[(sequence % TURN) as usize] }),
            );
            let inputs = Inputs {
                feedback: &feedback,
                received: Nanoseconds(0),
                setpoints: &batch,
                request,
                peers: Peers::default(),
                slow: 0,
            };
            controller.step(Nanoseconds(0), &inputs, &mut outputs);
            sent = end;
            if outputs.command.state() == ControllerState::Running {
                steps += 1;
                if steps % BATCH == 0 {
                    batches.push(since.elapsed().as_secs_f64() / f64::from(BATCH) * 1e9);
                    since = Instant::now();
                }
            }
        }
        batches.sort_by(f64::total_cmp);
        let (least, median) = (batches[0], batches[batches.len() / 2]);
        println!("rate {rate}: {median:.0} ns a step (median of batches), {least:.0} ns at least");
    }
}
