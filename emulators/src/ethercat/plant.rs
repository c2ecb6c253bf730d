//! The simulated plant behind the drives: the one place that knows how the plant is moved.

use drives::{Actuation, Freshness, Measurement, PlantOptions, Port, SimulatedPlant};
use machine::{ActuatorMode, Machine, Motor, Timing};
use messages::time::Period;
use messages::{CommandMode, MAX_ACTUATORS, Nanoseconds};

use super::wires::{Bundle, Phases};

/// Why a machine cannot stand behind the drives.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// The plant itself cannot be simulated.
    #[error("{0}")]
    Plant(drives::plant::PlantError),
    /// These drives are servo drives.
    #[error("the emulated drives are for servo motors, and this machine has steppers")]
    Steppers,
}

/// How often the drives' loops run: as in drives that are bought, several times in a cycle of the bus.
const LOOPS: Period = Period::SHORTEST;

/// The machine that the drives move.
pub struct Plant {
    port: Box<dyn Port + Send>,
    measurement: Measurement,
    period: Nanoseconds,
    /// What a motor gives by turning, for each count in a step [V].
    back_emf: Vec<f64>,
    /// Counts a step ago.
    before: [i64; MAX_ACTUATORS],
    /// Where the tool was a step ago [m].
    tool_before: Option<[f64; 3]>,
}

impl core::fmt::Debug for Plant {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter
            .debug_struct("Plant")
            .field("measurement", &self.measurement)
            .finish_non_exhaustive()
    }
}

impl Plant {
    /// The plant of `machine`.
    ///
    /// # Errors
    /// If it cannot be simulated, or has no servo motors.
    pub fn new(machine: &Machine, options: PlantOptions) -> Result<Self, PlantError> {
        if machine.actuators.iter().any(|actuator| matches!(actuator.motor, Motor::Stepper(_))) {
            return Err(PlantError::Steppers);
        }
        // The machine file says what the drives follow, and how late. The motors behind them follow voltages at once.
        let realtime = Timing { period: LOOPS, ..machine.realtime };
        let mut motors = Machine { realtime, ..machine.clone() };
        for actuator in &mut motors.actuators {
            (actuator.mode, actuator.latency) = (ActuatorMode::Voltage, Nanoseconds(0));
            (actuator.age, actuator.torque_delay) = (Nanoseconds(0), Nanoseconds(0));
        }
        motors.drives.gate_latency = Nanoseconds(0);
        let port = SimulatedPlant::new(&motors, options).map_err(PlantError::Plant)?;
        let period = LOOPS.time();
        let back_emf = machine.actuators.iter().map(|actuator| {
            let constant = actuator.motor.dc().map_or(0.0, |motor| motor.torque_constant);
            constant * actuator.encoder.resolution() / period.seconds()
        });
        let back_emf = back_emf.collect();
        let measurement = Measurement::default();
        let (before, tool_before) = ([0; MAX_ACTUATORS], None);
        Ok(Self { port, measurement, period, back_emf, before, tool_before })
    }

    /// From one step to the next.
    pub fn period(&self) -> Nanoseconds {
        self.period
    }

    /// Measures at the end of a step, and lets the power stages do in the next one what `wires` says.
    pub fn step(&mut self, wires: &mut Bundle) {
        let mut actuation = Actuation { freshness: Freshness::Fresh, ..Actuation::DISABLED };
        let turning = self.measurement.counts.iter().zip(&self.before).zip(&self.back_emf);
        let voltages = actuation.voltage.iter_mut().zip(turning);
        for (motor, (voltage, ((now, before), back_emf))) in wires.motors.iter().zip(voltages) {
            *voltage = match motor.phases {
                Phases::Driven(driven) => {
                    actuation.mode = CommandMode::Driven;
                    driven
                }
                // The plant's power stages are on or off together: this one lets its motor run free.
                Phases::Open => (now - before) as f64 * back_emf,
            };
        }
        (self.before, self.tool_before) = (self.measurement.counts, self.measurement.tool);
        self.port.exchange(&actuation, &mut self.measurement);
        let measured = self.measurement.counts.iter().zip(&self.measurement.current);
        for (motor, (counts, current)) in wires.motors.iter_mut().zip(measured) {
            (motor.counts, motor.current) = (*counts, *current);
        }
    }

    /// Inputs of the machine whose places are in the machine file, one bit each: 1 is active.
    pub fn inputs(&self) -> u64 {
        self.measurement.inputs
    }

    /// Tool centre point in the machine frame [m], where the plant knows it: `later` than the newest step, up to a
    /// step, as it goes on at its speed.
    pub fn tool(&self, later: Nanoseconds) -> Option<[f64; 3]> {
        let tool = self.measurement.tool?;
        let before = self.tool_before.unwrap_or(tool);
        let steps = later.seconds() / self.period.seconds();
        let moved = tool.iter().zip(before).map(|(now, before)| now + steps * (now - before));
        let mut carried = tool;
        carried.iter_mut().zip(moved).for_each(|(carried, moved)| *carried = moved);
        Some(carried)
    }

    /// Motor positions [rad].
    pub fn positions(&self) -> &[f64] {
        &self.measurement.position
    }
}
