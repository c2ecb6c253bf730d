//! Arguments of the workbench: machines, motors, figures and tables.

use super::MachineArguments;
use super::examples::{NEW_EXAMPLES, PROFILE_EXAMPLES};
use ::workbench::new::Kind;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Arguments of `size`.
#[derive(Debug, Clone, Args)]
pub struct SizeArguments {
    /// Job: G-code, a drawing (.svg .dxf .lbrn2 .plt …), an image or a job file (.toml);
    /// without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// Catalogue of motors and gears: a .toml file, or thesis, dc, bldc, steppers or gears, which are built in.
    /// Can be repeated; without it all that are built in.
    #[arg(long, value_name = "CATALOGUE")]
    pub motors: Vec<String>,
    /// By what every need is multiplied before it is compared with what a motor gives.
    #[arg(long, value_name = "X", default_value_t = 1.25, value_parser = margin)]
    pub margin: f64,
    /// Temperature of the air around the motors [°C].
    #[arg(long, value_name = "T", default_value_t = 25.0, allow_negative_numbers = true, value_parser = temperature)]
    pub ambient: f64,
    /// Look for a motor for this axis only. Can be repeated.
    #[arg(long, value_name = "NAME")]
    pub axis: Vec<String>,
    /// What makes one motor smaller than another.
    #[arg(long, value_enum, default_value = "mass")]
    pub by: SizeOrder,
    /// Which gears to try: without it those of the catalogues, or the machine's where they have none.
    #[arg(long, value_enum)]
    pub gears: Option<SizeGears>,
    /// Write the machine file with the motors and gears that were chosen.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Draw torque over speed of each motor, the machine's and the chosen one, with the points of the job:
    /// SVG and CSV, and a page of them.
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What makes one motor smaller than another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SizeOrder {
    /// Mass of motor and gear; power where one has none.
    Mass,
    /// Rated power.
    Power,
}

/// Which gears `size` tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SizeGears {
    /// The ratio that the machine has.
    Keep,
    /// Those of the catalogues, and none.
    Catalogue,
    /// Any ratio.
    Any,
}

/// Reads by what needs are multiplied.
fn margin(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "this must be a number, such as 1.25".to_owned())?;
    if (1.0..=100.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} is not from 1, nothing in hand, to 100"))
    }
}

/// Reads a temperature of the air [°C].
fn temperature(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "this must be a number, such as 25".to_owned())?;
    if (-100.0..=200.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} °C is not from -100 °C to 200 °C"))
    }
}

/// Arguments of `calibrate`.
#[derive(Debug, Clone, Args)]
pub struct CalibrateArguments {
    /// The measured poses: a CSV file with a header.
    pub measurements: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// What to identify: any of legs, base (where the stator stands) and tool (where the measured point is on
    /// the platform). The rest stays as the machine file has it.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "legs,base,tool")]
    pub free: Vec<CalibratePart>,
    /// Write the machine file with what was identified.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What `calibrate` identifies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CalibratePart {
    /// The lengths of the legs.
    Legs,
    /// Where the stator stands.
    Base,
    /// Where the measured point is on the platform.
    Tool,
}

/// Arguments of `figures`.
#[derive(Debug, Clone, Args)]
pub struct FiguresArguments {
    /// Names of figures (torque, motor, acceleration, stiffness, ellipses, singular, speed, chords,
    /// modes; without any all of them), and a job that the machines mark instead of the source's
    /// letters or their own sample jobs.
    #[arg(value_name = "NAME|JOB")]
    pub what: Vec<String>,
    /// Machine file (.toml), can be repeated; without it the four machines of source 003.
    #[arg(long, value_name = "FILE")]
    pub machine: Vec<PathBuf>,
    /// Change a value of all machines (machine.path.jerk="5000 m/s^3") or of the job, as in `plan`. Can
    /// be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Folder that the files go to.
    #[arg(long, value_name = "DIR", default_value = "figures")]
    pub out: PathBuf,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What can be done with machine files.
#[derive(Debug, Clone, Subcommand)]
pub enum MachineCommand {
    /// Write a commented machine file to start from, with motors from catalogues, and a sample job.
    #[command(after_help = NEW_EXAMPLES)]
    New(NewArguments),
    /// Write a profile of a machine for LightBurn or Rayforge, which then send it jobs as to a grbl controller.
    #[command(after_help = PROFILE_EXAMPLES)]
    Export(ProfileArguments),
}

/// Arguments of `machine export`.
#[derive(Debug, Clone, Args)]
pub struct ProfileArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// For LightBurn: a file .lbdev.
    #[arg(long, required_unless_present = "rayforge", conflicts_with = "rayforge")]
    pub lbdev: bool,
    /// For Rayforge: a folder with device.yaml and dialect.yaml.
    #[arg(long)]
    pub rayforge: bool,
    /// The file, or the folder; without it named for the machine.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Where graver serve --grbl listens: the host, as that program reaches it.
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    pub host: String,
    /// And the port.
    #[arg(long, value_name = "PORT", default_value_t = 7123)]
    pub port: u16,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `machine new`. What is left out is asked for on a terminal.
#[derive(Debug, Clone, Args)]
pub struct NewArguments {
    /// Kind of the machine.
    #[arg(value_parser = kinds())]
    pub kind: Kind,
    /// Name of the machine; without it that of its kind.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Width and depth of the area, 20 mm to 2000 mm each: "300 x 200 mm".
    #[arg(long, value_name = "WIDTHxDEPTH")]
    pub area: Option<String>,
    /// Travel in z, 10 mm to 300 mm; of kinds that move in z.
    #[arg(long, value_name = "LENGTH")]
    pub z: Option<String>,
    /// Mass of the head, 0.01 kg to 20 kg.
    #[arg(long, value_name = "MASS")]
    pub head: Option<String>,
    /// Speed of the tool, 0.01 m/s to 2 m/s.
    #[arg(long, value_name = "SPEED")]
    pub speed: Option<String>,
    /// Acceleration of the tool, 0.1 m/s^2 to 50 m/s^2.
    #[arg(long, value_name = "ACCELERATION")]
    pub acceleration: Option<String>,
    /// Steppers in place of DC motors.
    #[arg(long)]
    pub steppers: bool,
    /// Catalogue of motors and gears: a .toml file, or thesis, dc, bldc, steppers or gears, which are built in.
    /// Can be repeated; without it all that are built in.
    #[arg(long, value_name = "CATALOGUE")]
    pub motors: Vec<String>,
    /// The machine file; without it KIND.toml. The sample job is written beside it, as FILE-sample.toml.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write over files that are there.
    #[arg(long)]
    pub force: bool,
    /// Ask nothing: what is left out takes its default.
    #[arg(long)]
    pub yes: bool,
    /// Print one JSON object on stdout; nothing is asked.
    #[arg(long)]
    pub json: bool,
}

/// Reads the kind of a machine.
fn kinds() -> impl TypedValueParser<Value = Kind> {
    PossibleValuesParser::new(Kind::ALL.map(Kind::name)).try_map(|name| {
        Kind::ALL.into_iter().find(|kind| kind.name() == name).ok_or("there is no such kind")
    })
}

/// Arguments of `compare`.
#[derive(Debug, Clone, Args)]
pub struct CompareArguments {
    /// Job: G-code, a drawing (.svg .dxf .lbrn2 .plt …), an image or a job file (.toml);
    /// without it the first machine's sample job.
    pub job: Option<PathBuf>,
    /// Machine file (.toml). Can be repeated; without any and without a job, the machines of source
    /// 003 are compared on its letters.
    #[arg(long, value_name = "FILE")]
    pub machine: Vec<PathBuf>,
    /// Change a value of the job, of all machines or of all plants, as for `simulate`. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// How much a figure counts: time, error, mismatch, power, mass, footprint, stiffness or
    /// utilisation. Can be repeated.
    #[arg(long, value_name = "NAME=NUMBER")]
    pub weight: Vec<String>,
    /// Plants that are other than the machine file says, of each machine.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(0..=1000))]
    pub seeds: u64,
    /// Write a page, the figures and the pictures into this folder.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// How tables are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TableFormat {
    /// For people, in the source's units.
    Text,
    /// Comma-separated values, in the source's units and in SI units.
    Csv,
    /// One JSON object.
    Json,
    /// A page that opens offline.
    Html,
}

/// Arguments of `tables`.
#[derive(Debug, Clone, Args)]
pub struct TablesArguments {
    /// Numbers of tables: 3-1, 3-2, 4-1, 5-1, 5-2, 5-3, 6-1, 6-2, 6-3, 7-1; without one all.
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// Write a page, tables.json and a CSV file for each table into this folder; with `--format` that
    /// alone.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How to print or write them.
    #[arg(long, value_enum)]
    pub format: Option<TableFormat>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}
