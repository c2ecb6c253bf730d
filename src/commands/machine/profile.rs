//! Profiles of a machine for programs that draw jobs and send them as grbl.

use machine::Machine;
use serde::Serialize;
use serde_json::{Value, json};

/// What such programs have to know, in their units.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Profile {
    /// Name of the machine.
    pub name: String,
    /// Name of its mechanism.
    pub mechanism: String,
    /// Width of the area in x [m].
    pub width: f64,
    /// Depth of the area in y [m].
    pub depth: f64,
    /// Where the origin of the work coordinate system G54 is, from the lower left corner of the area [m].
    pub origin: [f64; 2],
    /// The S word that means full power, which grbl tells as `$30`.
    pub full_scale: f64,
    /// Whether it has axes that find their references.
    pub homes: bool,
    /// Whether its tool moves in z.
    pub has_z: bool,
    /// Largest speed while marking [m/s].
    pub speed: f64,
    /// Largest speed between marks [m/s].
    pub rapid: f64,
    /// Largest acceleration [m/s²].
    pub acceleration: f64,
    /// Where grbl is heard over TCP: the host.
    pub host: String,
    /// And the port.
    pub port: u16,
}

/// A length or speed in the millimetres of those programs, without what the binary fraction adds.
fn millimetres(value: f64) -> f64 {
    (value * 1e9).round() / 1e6
}

impl Profile {
    /// What is to be known of `machine`, heard at `host` and `port`.
    pub fn of(machine: &Machine, host: &str, port: u16) -> Self {
        let (lower, upper) = (machine.area.lower, machine.area.upper);
        let origin = machine.gcode.origins[0];
        Self {
            name: machine.name.clone(),
            mechanism: machine.mechanism.name().to_owned(),
            width: upper[0] - lower[0],
            depth: upper[1] - lower[1],
            origin: [origin[0] - lower[0], origin[1] - lower[1]],
            full_scale: machine.gcode.words.full_scale,
            homes: (0..machine.axes.len()).any(|axis| machine.operating.homing(axis).is_some()),
            has_z: upper[2] > lower[2],
            speed: machine.path.speed,
            rapid: machine.path.rapid,
            acceleration: machine.path.acceleration,
            host: host.to_owned(),
            port,
        }
    }

    /// Whether G54 begins in the lower left corner, from where such programs draw.
    pub fn begins_in_the_corner(&self) -> bool {
        self.origin.iter().all(|place| millimetres(*place) == 0.0)
    }

    /// A device for LightBurn, as its files `.lbdev` list them. What is left out LightBurn fills with its own values
    /// when it reads the file.
    pub fn lightburn(&self) -> Value {
        // Speeds of its preview are in mm/s.
        let (speed, rapid) = (millimetres(self.speed), millimetres(self.rapid));
        let acceleration = millimetres(self.acceleration);
        json!({ "DeviceList": [{
            "DisplayName": self.name,
            "GUID": self.identity(),
            "Name": "GRBL",
            "ProfilePath": "GRBL",
            // A network address is no part of such a file: it is entered in LightBurn.
            "Type": "Serial",
            "Width": millimetres(self.width),
            "Height": millimetres(self.depth),
            // The origin is the lower left corner, and both axes lead away from it.
            "MirrorX": false,
            "MirrorY": false,
            "HomeOnStartup": self.homes,
            "Settings": {
                "AllowComms": true,
                "BaudRate": 115_200,
                // Front left.
                "CutOrigin": 2,
                "DwellIsMilliseconds": false,
                "EnableDTR": false,
                "EnableZ": self.has_z,
                "IsTextBased": true,
                "NetworkPort": self.port,
                "S_Scale": self.full_scale,
                "Sim_MaxAccelX": acceleration,
                "Sim_MaxAccelY": acceleration,
                "Sim_MaxSpeedX": speed,
                "Sim_MaxSpeedY": speed,
                "Sim_RapidSpeed": rapid,
                // grbl's buffer has room for 128 characters, one of which stays free.
                "TargetBufferSize": 127,
                "TransferMode": 0,
                "VariableLaserPower": true,
            },
        }]})
    }

    /// A device for Rayforge: the content of its `device.yaml`. JSON is YAML.
    pub fn rayforge(&self) -> Value {
        // Its speeds are whole millimetres a minute.
        let a_minute = |speed: f64| (millimetres(speed) * 60.0).floor();
        json!({
            "api_version": 1,
            "device": {
                "name": self.name,
                "vendor": "Graver",
                "model": self.mechanism,
                "description": "Graver, by grbl over TCP",
            },
            "machine": {
                "driver": "GrblTelnetDriver",
                "driver_args": { "host": self.host, "port": self.port },
                "gcode_precision": 3,
                "supports_arcs": true,
                "supports_curves": false,
                "axis_extents": [millimetres(self.width), millimetres(self.depth)],
                "origin": "bottom_left",
                "has_z": self.has_z,
                "max_cut_speed": a_minute(self.speed) as i64,
                "max_travel_speed": a_minute(self.rapid) as i64,
                "acceleration": millimetres(self.acceleration).floor() as i64,
                "home_on_start": self.homes,
                "single_axis_homing_enabled": self.homes,
                "heads": [{ "max_power": self.full_scale }],
            },
        })
    }

    /// How Rayforge writes G-code for it: the content of its `dialect.yaml`.
    pub fn rayforge_dialect() -> Value {
        json!({
            // M4: power in proportion to the speed, so that corners are not burnt.
            "laser_on": "M4 S{power:.0f}",
            "laser_off": "M5",
            "focus_laser_on": "M3 S{power:.0f}",
            "tool_change": "",
            "set_speed": "",
            "travel_move": "G0{x_cmd}{y_cmd}{z_cmd}{extra_cmd}{s_command}",
            "linear_move": "G1{x_cmd}{y_cmd}{z_cmd}{extra_cmd}{f_command}{s_command}",
            "arc_cw": "G2{x_cmd}{y_cmd}{z_cmd}{extra_cmd} I{i} J{j}{f_command}{s_command}",
            "arc_ccw": "G3{x_cmd}{y_cmd}{z_cmd}{extra_cmd} I{i} J{j}{f_command}{s_command}",
            "bezier_cubic": "",
            "air_assist_on": "M8",
            "air_assist_off": "M9",
            "home_all": "$H",
            "home_axis": "$H{axis_letter}",
            "move_to": "$J=G90 G21 F{speed} X{x} Y{y}{z_cmd}",
            "jog": "$J=G91 G21 F{speed}",
            "clear_alarm": "$X",
            "set_wcs_offset": "G10 L2 P{p_num} X{x} Y{y} Z{z}",
            "probe_cycle": "G38.2 {axis_letter}{max_travel} F{feed_rate}",
            "dwell": "G4 P{seconds:.3f}",
            "preamble": ["G21", "G90"],
            "postscript": ["M5", "M9"],
            "inject_wcs_after_preamble": true,
            "omit_unchanged_coords": true,
        })
    }

    /// What tells the machine from others, the same for every export of it: a word of eleven characters, as LightBurn
    /// has.
    fn identity(&self) -> String {
        let hash = messages::sample::fnv1a(format!("{}\0{}", self.mechanism, self.name).as_bytes());
        format!("Gr{:09x}", hash & 0xf_ffff_ffff)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_is_told_in_the_units_of_each_program() {
        let profile = Profile::of(&Machine::builtin(), "laser.local", 7123);
        assert!(!profile.begins_in_the_corner());
        assert_eq!(profile.origin, [0.1, 0.1]);
        let device = &profile.lightburn()["DeviceList"][0];
        assert_eq!((&device["Width"], &device["Height"]), (&json!(200.0), &json!(200.0)));
        assert_eq!(device["Settings"]["Sim_RapidSpeed"], 250.0);
        assert_eq!(device["Settings"]["S_Scale"], 1000.0);
        assert_eq!(device["GUID"].as_str().map(str::len), Some(11));
        let device = profile.rayforge();
        assert_eq!(device["machine"]["axis_extents"], json!([200.0, 200.0]));
        assert_eq!(device["machine"]["max_cut_speed"], 15_000);
        assert_eq!(device["machine"]["acceleration"], 10_000);
        assert_eq!(device["machine"]["driver_args"], json!({"host": "laser.local", "port": 7123}));
        assert_eq!(device["machine"]["home_on_start"], false);
    }
}
