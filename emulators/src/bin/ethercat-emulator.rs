//! An emulated EtherCAT segment in real time: on a network interface, or behind a UDP port.

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use drives::PlantOptions;
use emulators::ethercat::bus::Bus;
use emulators::ethercat::faults::Rates;
use emulators::ethercat::service::serve;
use emulators::ethercat::{Layout, Link, Segment};
use machine::Machine;
use messages::Nanoseconds;

/// Emulates a line of EtherCAT drives and terminals that move the simulated plant of a machine file.
#[derive(Debug, Parser)]
struct Arguments {
    /// Machine file; the built-in CoreXY without one.
    #[arg(long, value_name = "FILE")]
    machine: Option<PathBuf>,
    /// Answer EtherCAT in UDP datagrams at this address.
    #[arg(long, value_name = "ADDRESS:PORT", conflicts_with = "interface")]
    udp: Option<SocketAddr>,
    /// Answer EtherCAT frames on this network interface; needs the right to open raw sockets.
    #[arg(long, value_name = "NAME", required_unless_present = "udp")]
    interface: Option<String>,
    /// Part of the frames that get lost.
    #[arg(long, default_value_t = 0.0)]
    loss: f64,
    /// Part of the frames that come back late, and by how many milliseconds: 0.01:3.
    #[arg(long, value_parser = late, default_value = "0:0")]
    late: (f64, f64),
    /// Part of the frames that come back twice.
    #[arg(long, default_value_t = 0.0)]
    duplicate: f64,
    /// Part of the frames whose bits are changed.
    #[arg(long, default_value_t = 0.0)]
    corrupt: f64,
    /// Chooses which frames these are.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// End after this many seconds.
    #[arg(long)]
    seconds: Option<f64>,
}

fn late(text: &str) -> Result<(f64, f64), String> {
    let (part, delay) = text.split_once(':').ok_or("PART:MILLISECONDS, such as 0.01:3")?;
    let number = |text: &str| {
        text.trim_end_matches("ms").parse::<f64>().map_err(|error| format!("{text}: {error}"))
    };
    Ok((number(part)?, number(delay)?))
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            say(&format!("ethercat-emulator: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn say(text: &str) {
    // With standard error gone there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "{text}");
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let machine = match &arguments.machine {
        Some(file) => Machine::load(file, &[])?,
        None => Machine::builtin(),
    };
    let segment = Segment::new(&machine, &Layout::default(), PlantOptions::default())?;
    let (late, delay) = arguments.late;
    let rates = Rates {
        lost: arguments.loss,
        late,
        delay: Nanoseconds::from_seconds(delay * 1e-3),
        duplicated: arguments.duplicate,
        corrupted: arguments.corrupt,
    };
    let mut link = Link::new(segment, rates, arguments.seed);
    let mut bus = match (&arguments.interface, arguments.udp) {
        (Some(name), _) => Bus::interface(name)?,
        (None, Some(address)) => Bus::udp(address)?,
        (None, None) => return Err("neither an interface nor an address".into()),
    };
    say(&format!("{} slaves on {bus}", link.segment.slaves().len()));
    let start = Instant::now();
    let time = arguments.seconds.map(Duration::from_secs_f64);
    serve(&mut link, &mut bus, || time.is_some_and(|time| start.elapsed() >= time))?;
    say(&format!("{:?}", link.counts()));
    for (position, slave) in link.segment.slaves().iter().enumerate() {
        let (state, code, bites) = (slave.state(), slave.code(), slave.watchdog_count());
        say(&format!(
            "slave {}: {state:?}, code {code:#06x}, watchdog expired {bites} times",
            position + 1
        ));
    }
    Ok(())
}
