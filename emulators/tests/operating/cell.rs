//! A machine that is operated: controller, drives and plant in one process, with switches.

#[path = "../../../tests/support/switches.rs"]
mod switches;

use controller::{Controller, Inputs, Outputs, Peers};
use drives::bridge::BridgeOptions;
use drives::port::Port;
use drives::{Bridge, Deadlines, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::time::SETPOINT_PERIOD;
use messages::{
    Command, ControllerState, Feedback, MotionEnd, Nanoseconds, OperatorReply, OperatorRequest,
    OperatorVerb, Progress, Refusal,
};
use switches::Switches;

pub const X: u32 = 1;
pub const Y: u32 = 2;
pub const ESTOP: u64 = 1 << 5;
pub const DOOR: u64 = 1 << 6;
pub const CHILLER: u64 = 1 << 7;

/// The operated machine, with switches at both ends and an index on y, and `more` in its file.
pub fn machine(more: &str) -> Machine {
    let switches = Switches {
        x_home: "-2 mm",
        y_home: "198 mm",
        y_method: "index",
        y_reference: "200 mm",
        probe: "150 mm",
        speeds: ["50 mm/s", "2 mm/s"],
    };
    Machine::parse("cell.toml", &(switches.machine() + more), &[]).unwrap()
}

pub struct Cell {
    pub controller: Controller,
    pub bridge: Bridge,
    pub outputs: Outputs,
    pub progress: Progress,
    now: Nanoseconds,
    /// What the last two commands were.
    pub before: [Command; 2],
}

impl Cell {
    pub fn new(machine: &Machine) -> Self {
        Self::of(machine, SimulatedPlant::new(machine, PlantOptions::default()).unwrap())
    }

    /// With the hardware behind `port`.
    pub fn of(machine: &Machine, port: Box<dyn Port>) -> Self {
        let options =
            BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing: machine.realtime };
        Self {
            controller: Controller::new(machine),
            bridge: Bridge::new(port, options).with_brakes(machine.operating.brakes()),
            outputs: Outputs::default(),
            progress: Progress::default(),
            now: Nanoseconds(0),
            before: [Command::default(); 2],
        }
    }

    /// Enabled, and idle.
    pub fn enabled(machine: &Machine) -> Self {
        let mut cell = Self::new(machine);
        cell.enable();
        cell
    }

    /// Enables it.
    pub fn enable(&mut self) {
        self.run(3);
        self.accept(OperatorVerb::Enable, 0, 0.0, 0.0);
        self.until(ControllerState::Idle, 3000);
    }

    /// Homed, and at home.
    pub fn homed(machine: &Machine) -> Self {
        let mut cell = Self::enabled(machine);
        cell.accept(OperatorVerb::Home, 0, 0.0, 0.0);
        cell.until(ControllerState::Idle, 60_000);
        assert_eq!(cell.progress.homed & 3, 3);
        cell
    }

    pub fn cycle(&mut self, request: Option<OperatorRequest>) -> &Command {
        self.now = self.now + SETPOINT_PERIOD;
        self.bridge.begin(self.now, self.now);
        let feedback = self.bridge.feedback();
        let inputs = Inputs {
            feedback,
            received: self.now,
            setpoints: &[],
            request,
            peers: Peers::default(),
            slow: 0,
        };
        self.before = [self.before[1], self.outputs.command];
        self.controller.step(self.now, &inputs, &mut self.outputs);
        self.progress = self.outputs.progress.unwrap_or(self.progress);
        self.bridge.latch(&self.outputs.command, self.now);
        self.bridge.finish(self.now);
        &self.outputs.command
    }

    pub fn run(&mut self, cycles: u32) {
        (0..cycles).for_each(|_| {
            self.cycle(None);
        });
    }

    pub fn until(&mut self, state: ControllerState, most: u32) {
        for _ in 0..most {
            if self.state() == state {
                self.run(6);
                return;
            }
            self.cycle(None);
        }
        panic!("{:?}, not {state:?}: {:?}", self.state(), self.outputs.command.fault);
    }

    pub fn ask(&mut self, verb: OperatorVerb, axis: u32, value: f64, second: f64) -> OperatorReply {
        let request =
            OperatorRequest { verb: verb as u32, ticket: 9, axis, value, second, reserved: 0 };
        self.cycle(Some(request));
        self.outputs.reply.unwrap()
    }

    pub fn accept(&mut self, verb: OperatorVerb, axis: u32, value: f64, second: f64) {
        let reply = self.ask(verb, axis, value, second);
        assert_eq!(reply.accepted, 1, "{verb:?}: {reply:?}");
    }

    pub fn refuse(&mut self, verb: OperatorVerb, axis: u32, value: f64, second: f64) -> Refusal {
        let reply = self.ask(verb, axis, value, second);
        assert_eq!(reply.accepted, 0, "{verb:?}");
        Refusal::from_wire(reply.refusal)
    }

    pub fn state(&self) -> ControllerState {
        self.outputs.command.state()
    }

    /// How the newest motion by hand ended.
    pub fn end(&self) -> MotionEnd {
        MotionEnd::from_wire(self.progress.motion_end)
    }

    pub fn feedback(&self) -> &Feedback {
        self.bridge.feedback()
    }

    /// Where the plan has a joint now [m].
    pub fn place(&self, axis: usize) -> f64 {
        self.outputs.command.tool[axis]
    }

    /// Where the joint really is [m].
    pub fn truth(&self, axis: usize) -> f64 {
        self.feedback().tool[axis]
    }
}
