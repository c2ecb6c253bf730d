//! The report page: one HTML file without a reference to a network. It tells everything in text and still pictures;
//! where scripts run, views to explore the run take the place of the pictures.

use super::chart::{CURVES, Chart, Curve, colour};
use super::html::{document_with, escape, figure, section};
use super::{PictureError, Report};
use crate::latency::HopLatency;
use crate::summary::text::{latency, rows};
use crate::trace::envelope::Envelope;
use messages::hop::Hop;
use messages::{ActuatorArray, math};
use plotters::style::RGBColor;
use std::fmt::Write;

/// Height of a chart, in page units.
const HEIGHT: u32 = 260;

/// The most that the page takes [bytes], whatever the run.
const MOST_BYTES: usize = 19_500_000;

/// The rows of the summary that stand at the head of the page.
const FACTS: [&str; 8] =
    ["fault", "error", "ended in", "time", "marked", "contour error", "missing", "left"];

/// Nothing is fetched from anywhere.
const POLICY: &str = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
    script-src 'unsafe-inline'; style-src 'unsafe-inline'\">\n";

/// The sheet of the views, beside that of all pages.
const STYLE: &str = include_str!("assets/report.css");

/// The scripts of the views, in one module: what they declare they all see.
const SCRIPTS: [&str; 14] = [
    include_str!("assets/words.js"),
    include_str!("assets/bytes.js"),
    include_str!("assets/curve.js"),
    include_str!("assets/track.js"),
    include_str!("assets/clock.js"),
    include_str!("assets/camera.js"),
    include_str!("assets/ruler.js"),
    include_str!("assets/painter.js"),
    include_str!("assets/gestures.js"),
    include_str!("assets/path_view.js"),
    include_str!("assets/chart.js"),
    include_str!("assets/transport.js"),
    include_str!("assets/places.js"),
    include_str!("assets/main.js"),
];

/// Points of a latency distribution per factor of ten in rarity.
const POINTS_PER_NINE: u32 = 20;

impl Report<'_> {
    /// The whole page.
    ///
    /// # Errors
    /// [`PictureError`] when a picture's numbers cannot be drawn.
    pub fn page(&self) -> Result<String, PictureError> {
        let title = format!("{} on {}", self.summary.job.name, self.summary.machine.name);
        let outcome = self.summary.outcome.name();
        let script = SCRIPTS.concat();
        let still = self.still()?;
        let data = self.data(MOST_BYTES.saturating_sub(still.len() + script.len()))?;
        let body = format!(
            "<header>\n<h1>{title}</h1>\n<p class=\"outcome {outcome}\">{outcome}</p>\n</header>\n\
             {facts}<main>\n<div id=\"explorer\"></div>\n<div class=\"still\">\n{still}</div>\n</main>\n{data}\
             <script type=\"module\">\n{script}</script>\n",
            title = escape(&title),
            facts = self.facts(),
        );
        Ok(document_with(&title, &format!("{POLICY}<style>\n{STYLE}</style>\n"), &body))
    }

    /// The run in text and still pictures.
    fn still(&self) -> Result<String, PictureError> {
        let mut body = section("Summary", &self.summary_table());
        let mut put = |text: String| body.push_str(&text);
        put(pictures(
            "Path",
            &figure(self.picture()?, "Planned and truly marked path, seen from above."),
        ));
        if self.anything_marked() {
            let (picture, gain) = self.magnified_picture()?;
            let note =
                format!("The same with every deviation from the plan drawn {gain} times as large.");
            put(pictures("Deviation, magnified", &figure(picture, &note)));
        }
        put(pictures("Tool", &self.tool_charts()?));
        put(pictures("Axes", &self.motor_charts()?));
        if self.histograms.named().any(|(_, histogram)| !histogram.is_empty()) {
            put(section("Latency", &self.latency_charts()?));
        }
        Ok(body)
    }

    /// What everybody asks first.
    fn facts(&self) -> String {
        let mut list = String::from("<dl class=\"facts\">\n");
        for (name, value) in rows(self.summary) {
            if FACTS.contains(&name.as_str()) {
                let (name, value) = (escape(&name), escape(&value));
                // Writing to a string cannot fail.
                let _ = writeln!(list, "<div><dt>{name}</dt><dd>{value}</dd></div>");
            }
        }
        list + "</dl>\n"
    }

    fn summary_table(&self) -> String {
        let mut table = String::from("<table class=\"facts\">\n");
        for (name, value) in rows(self.summary) {
            // The latencies have a table of their own.
            if !name.starts_with("latency ") {
                let class = if name == "warning" { " class=\"warning\"" } else { "" };
                let (name, value) = (escape(&name), escape(&value));
                // Writing to a string cannot fail.
                let _ = writeln!(table, "<tr{class}><th>{name}</th><td>{value}</td></tr>");
            }
        }
        table + "</table>\n"
    }

    fn tool_charts(&self) -> Result<String, PictureError> {
        let trace = self.trace;
        let deviation = over_time(
            "tool deviation [µm]",
            (0.0, 0.0),
            vec![
                self.curve("in the dark", CURVES[7], &trace.deviation_dark, 1e6),
                self.curve("lit", CURVES[0], &trace.deviation_lit, 1e6),
            ],
        );
        let speed = over_time(
            "speed [m/s]",
            (0.0, 0.0),
            vec![self.curve("", CURVES[2], &trace.speed, 1.0)],
        );
        let mut gate = over_time(
            "laser power [%]",
            (0.0, 100.0),
            vec![self.curve("", CURVES[4], &trace.power, 100.0)],
        );
        gate.height = HEIGHT * 2 / 3;
        Ok(figure(
            deviation.draw()?,
            "Distance of the tool from where the plan had it at that time.",
        ) + &figure(speed.draw()?, "Speed of the tool.")
            + &figure(gate.draw()?, "Laser: power while the gate was open, 0 in the dark."))
    }

    fn motor_charts(&self) -> Result<String, PictureError> {
        let trace = self.trace;
        let gains = |values: &[f64]| -> ActuatorArray {
            let mut array = [1e3; messages::MAX_ACTUATORS];
            array.iter_mut().zip(values).for_each(|(to, from)| *to = 1e3 * from);
            array
        };
        let following = self.per_actuator(&trace.following_error, &gains(&[]));
        let torque = self.per_actuator(&trace.current, &gains(self.torque_constants));
        let voltage = self.per_actuator(&trace.voltage, &[1.0; messages::MAX_ACTUATORS]);
        Ok([
            ("following error [mrad]", following, "Reference minus feedback, at the motor."),
            (
                "motor torque [mN·m]",
                torque,
                "Torque of each motor: its measured current times its torque constant.",
            ),
            ("motor voltage [V]", voltage, "Voltage commanded to each motor."),
        ]
        .into_iter()
        .map(|(up, curves, note)| Ok(figure(over_time(up, (0.0, 0.0), curves).draw()?, note)))
        .collect::<Result<Vec<_>, _>>()?
        .concat())
    }

    fn curve(&self, name: &str, colour: RGBColor, envelope: &Envelope, scale: f64) -> Curve {
        let lines = envelope.lines(scale, self.trace.period);
        Curve { name: name.to_owned(), colour, lines }
    }

    fn per_actuator(&self, envelopes: &[Envelope], scales: &ActuatorArray) -> Vec<Curve> {
        (self.summary.machine.actuators.iter().zip(envelopes).zip(scales).enumerate())
            .map(|(index, ((name, envelope), scale))| {
                self.curve(name, colour(index), envelope, *scale)
            })
            .collect()
    }

    fn latency_charts(&self) -> Result<String, PictureError> {
        let mut table = String::from(
            "<table class=\"figures\">\n<tr><th>hop</th><th>count</th><th>min</th><th>p50</th>\
             <th>p99</th><th>p99.9</th><th>max</th></tr>\n",
        );
        let mut curves = Vec::new();
        for (hop, histogram) in self.histograms.named().filter(|(_, h)| !h.is_empty()) {
            let HopLatency { count, min, p50, p99, p999, max } = HopLatency::of(histogram);
            let cells =
                [min, p50, p99, p999, max].map(|value| format!("<td>{}</td>", latency(value)));
            // Writing to a string cannot fail.
            let _ = writeln!(
                table,
                "<tr><th>{}</th><td>{count}</td>{}</tr>",
                hop.name(),
                cells.concat()
            );
            let most = math::ln(count as f64) / core::f64::consts::LN_10;
            let steps = (most * f64::from(POINTS_PER_NINE)).ceil().max(1.0) as u32;
            let line = (0..=steps).map(|step| {
                let nines = most * f64::from(step) / f64::from(steps);
                let share = 1.0 - math::pow(10.0, -nines);
                // A logarithmic axis has no 0; 1 ns is the stamps' resolution.
                (nines, histogram.value_at_quantile(share).max(1) as f64 * 1e-3)
            });
            curves.push(Curve {
                name: hop.name().to_owned(),
                colour: colour(hop as usize),
                lines: vec![line.collect()],
            });
        }
        table.push_str("</table>\n");
        let distribution = Chart {
            title: "latency distribution",
            across: "share of all cycles",
            up: "latency [µs]",
            height: HEIGHT + 80,
            at_least: None,
            curves,
        };
        // The setpoints' age is that of the look-ahead, thousands of times the rest.
        let hops = Hop::ALL
            .into_iter()
            .zip(&self.trace.latency)
            .filter(|(hop, _)| !matches!(hop, Hop::Setpoint | Hop::Loop));
        let over = over_time(
            "latency [µs]",
            (0.0, 0.0),
            hops.map(|(hop, envelope)| self.curve(hop.name(), colour(hop as usize), envelope, 1e6))
                .collect(),
        );
        let over = figure(over.draw()?, "The hops inside a cycle, over the run.");
        Ok(table
            + &figure(
                distribution.draw_distribution()?,
                "How long each hop took in that share of the cycles at most.",
            )
            + &format!("<div class=\"picture\">\n{over}</div>\n"))
    }
}

/// A section of still pictures, which the views take the place of.
fn pictures(name: &str, content: &str) -> String {
    format!("<div class=\"picture\">\n{}</div>\n", section(name, content))
}

fn over_time(up: &str, at_least: (f64, f64), curves: Vec<Curve>) -> Chart<'_> {
    Chart { title: up, across: "time [s]", up, height: HEIGHT, at_least: Some(at_least), curves }
}
