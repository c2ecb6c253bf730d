//! A HostMot2 board in software: `hostmot2-emulator --udp 127.0.0.1:27181 --machine machines/gantry.toml`.
//!
//! It serves until it is interrupted or its time is over, and then prints what happened, as JSON with
//! `--report -` or into a file.

use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use emulators::hostmot2::record::Record;
use emulators::hostmot2::report::Report;
use emulators::hostmot2::rig::Rig;
use emulators::hostmot2::service::Service;
use emulators::hostmot2::spaces::Identity;
use emulators::hostmot2::wiring::Wiring;
use emulators::hostmot2::{Board, Emulator, Faults};
use machine::Machine;
use messages::Nanoseconds;

/// A HostMot2 board in software, with a machine's motors behind it.
#[derive(Debug, Parser)]
#[command(name = "hostmot2-emulator")]
struct Options {
    /// Where it listens.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:27181")]
    udp: SocketAddrV4,
    /// The machine behind it; without one nothing is connected.
    #[arg(long, value_name = "FILE")]
    machine: Option<PathBuf>,
    /// Angle of a scan head's motors at full scale [degrees]; without it there is no scan head.
    #[arg(long, value_name = "DEGREES")]
    scan_head: Option<f64>,
    /// The hardware address that its EEPROM tells.
    #[arg(long, value_name = "MAC", value_parser = mac)]
    mac: Option<[u8; 6]>,
    /// Share of the frames that are lost, each way.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    loss: f64,
    /// Share of the frames that are late.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    late: f64,
    /// How late they are [ms].
    #[arg(long, value_name = "MS", default_value_t = 3.0)]
    delay: f64,
    /// Share of the frames that come twice.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    duplicate: f64,
    /// Share of the frames that are damaged.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    corrupt: f64,
    /// From when on the board neither hears nor answers [s].
    #[arg(long, value_name = "S")]
    silent_from: Option<f64>,
    /// From when to when the cable is cut [s].
    #[arg(long, value_name = "S", num_args = 2)]
    cut: Option<Vec<f64>>,
    /// Chooses the frames.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How long it serves [s]; without it until it is interrupted.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Where the report goes, `-` for standard output.
    #[arg(long, value_name = "FILE", default_value = "-")]
    report: PathBuf,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = std::io::Write::write_fmt(
                &mut std::io::stderr(),
                format_args!("hostmot2-emulator: {error}\n"),
            );
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<(), Box<dyn std::error::Error>> {
    let identity = Identity {
        address: options.udp.ip().octets(),
        mac: options.mac.unwrap_or(Identity::default().mac),
    };
    let mut board = Board::new(identity);
    if let Some(path) = &options.machine {
        let machine = Machine::load(path, &[])?;
        let mut wiring = Wiring::of(&machine);
        if let Some(degrees) = options.scan_head {
            wiring = wiring.with_scan_head(degrees.to_radians());
        }
        board = board.with_machine(Rig::new(&machine, &wiring)?, &wiring, Record::default());
    }
    let seconds = Nanoseconds::from_seconds;
    let faults = Faults {
        loss: options.loss,
        late: options.late,
        delay: seconds(options.delay * 1e-3),
        duplicate: options.duplicate,
        corrupt: options.corrupt,
        silent_from: options.silent_from.map(seconds),
        cut: match options.cut.as_deref() {
            Some([from, to]) => Some([seconds(*from), seconds(*to)]),
            _ => None,
        },
        seed: options.seed,
        ..Faults::default()
    };
    let emulator = Emulator::new(board, &faults, Nanoseconds(0));
    let socket = UdpSocket::bind(SocketAddr::V4(options.udp))?;
    let mut service = Service::new(emulator, socket)?;
    let end = options.duration.map(|duration| Instant::now() + Duration::from_secs_f64(duration));
    runtime::signal::install()?;
    service.run(|| {
        runtime::signal::termination().is_some() || end.is_some_and(|end| Instant::now() >= end)
    })?;
    let report = Report::of(service.emulator());
    Ok(report.write(&options.report)?)
}

/// Six bytes in hexadecimal, parted by colons.
fn mac(text: &str) -> Result<[u8; 6], String> {
    let bytes = text.split(':').map(|part| u8::from_str_radix(part, 16));
    let bytes: Vec<u8> = bytes.collect::<Result<_, _>>().map_err(|error| error.to_string())?;
    bytes.try_into().map_err(|_| "six bytes, as in 00:60:1b:16:00:01".to_owned())
}
