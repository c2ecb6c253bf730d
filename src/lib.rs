//! Graver: a real-time motion controller for laser marking and engraving machines.
//!
//! This is the command line and the supervisor; what a machine is, how a job is planned, played,
//! driven and watched stands in the other crates. `ARCHITECTURE.md` follows one sample through all
//! of them.

pub mod arguments;
pub mod commands;
pub mod exit;
pub mod files;
pub mod inputs;
pub mod notify;
pub mod output;
pub mod pipeline;

use ::operator::Verb;
use arguments::{Arguments, BenchCommand, Command, MachineCommand};
use clap::Parser;
use commands::{
    bench, calibrate, check, compare, doctor, export, faults, figures, kinematics, machine, manual,
    offset, operating, operator, plan, queue, replay, run, serve, service, simulate, size, status,
    submit, tables, verify,
};
use exit::{Exit, Failure};
use runtime::domain::Role;
use std::process::ExitCode;

/// Does what the command line says.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let json = wants_json(&arguments.command);
    match carry_out(&arguments.command) {
        Ok(exit) => exit.into(),
        Err(failure) => {
            output::failure(&failure, json);
            failure.exit().into()
        }
    }
}

fn carry_out(command: &Command) -> Result<Exit, Failure> {
    match command {
        Command::Run(arguments) => run::run(arguments),
        Command::Simulate(arguments) => simulate::run(arguments),
        Command::Plan(arguments) => plan::run(arguments),
        Command::Check(arguments) => check::run(arguments),
        Command::Kinematics(arguments) => kinematics::run(arguments),
        Command::Export(arguments) => export::run(arguments),
        Command::Replay(arguments) => replay::run(arguments),
        Command::Size(arguments) => size::run(arguments),
        Command::Calibrate(arguments) => calibrate::run(arguments),
        Command::Figures(arguments) => figures::run(arguments),
        Command::Machine(MachineCommand::New(arguments)) => machine::new(arguments),
        Command::Machine(MachineCommand::Export(arguments)) => machine::export::export(arguments),
        Command::Bench(BenchCommand::Latency(arguments)) => bench::latency::run(arguments),
        Command::Bench(BenchCommand::Plan(arguments)) => bench::planning::run(arguments),
        Command::Bench(BenchCommand::Simulate(arguments)) => bench::simulate(arguments),
        Command::Doctor(arguments) => doctor::run(arguments),
        Command::Submit(arguments) => submit::run(arguments),
        Command::Queue(command) => queue::run(command),
        Command::Hold(arguments) => operator::verb(Verb::Hold, arguments),
        Command::Resume(arguments) => operator::verb(Verb::Resume, arguments),
        Command::Stop(arguments) => operator::verb(Verb::Stop, arguments),
        Command::Reset(arguments) => operator::verb(Verb::Reset, arguments),
        Command::Enable(arguments) => operator::verb(Verb::Enable, arguments),
        Command::Disable(arguments) => operator::verb(Verb::Disable, arguments),
        Command::Override(arguments) => operator::overrides(arguments),
        Command::Home(arguments) => operating::home(arguments),
        Command::Jog(arguments) => operating::jog(arguments),
        Command::TestPulse(arguments) => operating::test_pulse(arguments),
        Command::Probe(arguments) => operating::probe(arguments),
        Command::Input(arguments) => operating::input(arguments),
        Command::Output(arguments) => operating::output(arguments),
        Command::Offset(command) => offset::run(command),
        Command::Status(arguments) => status::run(arguments),
        #[cfg(feature = "watch")]
        Command::Watch(arguments) => commands::watch::run(arguments),
        Command::Faults(arguments) => faults::run(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Tables(arguments) => tables::run(arguments),
        Command::Domain(arguments) => run::domain(arguments),
        Command::Serve(arguments) => serve::run(arguments),
        Command::Fleet(command) => commands::fleet::run(command),
        Command::Planner(arguments) => service::run(Role::Planner, arguments),
        Command::Controller(arguments) => service::run(Role::Controller, arguments),
        Command::Drives(arguments) => service::run(Role::Drives, arguments),
        Command::Monitor(arguments) => service::monitor(arguments),
        Command::Modbus(arguments) => service::run(Role::Modbus, arguments),
        Command::Schema { file } => manual::schema(*file),
        Command::Completions { shell } => manual::completions(*shell),
        Command::Manual { folder } => manual::pages(folder),
        Command::VerifySummary { file } => verify::run(file),
    }
}

/// Whether a failure is also printed as JSON.
fn wants_json(command: &Command) -> bool {
    match command {
        Command::Run(arguments) => arguments.pipeline.instance.json,
        Command::Simulate(arguments) => arguments.json,
        Command::Plan(arguments) => arguments.json,
        Command::Check(arguments) => arguments.json,
        Command::Replay(arguments) => arguments.json,
        Command::Size(arguments) => arguments.json,
        Command::Calibrate(arguments) => arguments.json,
        Command::Figures(arguments) => arguments.json,
        Command::Machine(MachineCommand::New(arguments)) => arguments.json,
        Command::Machine(MachineCommand::Export(arguments)) => arguments.json,
        Command::Doctor(arguments) => arguments.json,
        Command::Submit(arguments) => arguments.instance.json,
        Command::Compare(arguments) => arguments.json,
        Command::Tables(arguments) => arguments.json,
        _ => false,
    }
}
