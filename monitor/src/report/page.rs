//! The report page: one HTML file with its pictures inside, no script, no reference to a network.

use super::chart::{CURVES, Chart, Curve, GRID, INK, PAPER, colour};
use super::{PictureError, Report};
use crate::latency::HopLatency;
use crate::summary::text::{latency, rows};
use crate::trace::envelope::Envelope;
use messages::hop::Hop;
use messages::{AxisArray, math};
use plotters::style::RGBColor;
use std::fmt::Write;

/// Height of a chart, in page units.
const HEIGHT: u32 = 260;

/// Points of a latency distribution per factor of ten in rarity.
const POINTS_PER_NINE: u32 = 20;

impl Report<'_> {
    /// The whole page.
    ///
    /// # Errors
    /// [`PictureError`] when a picture's numbers cannot be drawn.
    pub fn page(&self) -> Result<String, PictureError> {
        let mut body = String::new();
        let title = format!("{} on {}", self.summary.job.name, self.summary.machine.name);
        let outcome = self.summary.outcome.name();
        let mut put = |text: String| body.push_str(&text);
        put(format!("<h1>{}</h1>\n<p class=\"outcome {outcome}\">{outcome}</p>\n", escape(&title)));
        put(section("Summary", &self.summary_table()));
        put(section(
            "Path",
            &figure(self.picture()?, "Planned and truly marked path, seen from above."),
        ));
        if !self.trace.marked.paths().is_empty() {
            let (picture, gain) = self.magnified_picture()?;
            let note =
                format!("The same with every deviation from the plan drawn {gain} times as large.");
            put(section("Deviation, magnified", &figure(picture, &note)));
        }
        put(section("Tool", &self.tool_charts()?));
        put(section("Axes", &self.axis_charts()?));
        if self.histograms.named().any(|(_, histogram)| !histogram.is_empty()) {
            put(section("Latency", &self.latency_charts()?));
        }
        Ok(document(&title, &body))
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
                curve("in the dark", CURVES[7], &trace.deviation_dark, 1e6),
                curve("lit", CURVES[0], &trace.deviation_lit, 1e6),
            ],
        );
        let speed =
            over_time("speed [m/s]", (0.0, 0.0), vec![curve("", CURVES[2], &trace.speed, 1.0)]);
        let mut gate = over_time(
            "laser power [%]",
            (0.0, 100.0),
            vec![curve("", CURVES[4], &trace.power, 100.0)],
        );
        gate.height = HEIGHT * 2 / 3;
        Ok(figure(
            deviation.draw()?,
            "Distance of the tool from where the plan had it at that time.",
        ) + &figure(speed.draw()?, "Speed of the tool.")
            + &figure(gate.draw()?, "Laser: power while the gate was open, 0 in the dark."))
    }

    fn axis_charts(&self) -> Result<String, PictureError> {
        let trace = self.trace;
        let gains = |values: &[f64]| -> AxisArray {
            let mut array = [1e3; messages::MAX_AXES];
            array.iter_mut().zip(values).for_each(|(to, from)| *to = 1e3 * from);
            array
        };
        let following = self.per_axis(&trace.following_error, &gains(&[]));
        let torque = self.per_axis(&trace.current, &gains(self.torque_constants));
        let voltage = self.per_axis(&trace.voltage, &[1.0; messages::MAX_AXES]);
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

    fn per_axis(&self, envelopes: &[Envelope], scales: &AxisArray) -> Vec<Curve> {
        (self.summary.machine.axes.iter().zip(envelopes).zip(scales).enumerate())
            .map(|(index, ((name, envelope), scale))| curve(name, colour(index), envelope, *scale))
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
            hops.map(|(hop, envelope)| curve(hop.name(), colour(hop as usize), envelope, 1e6))
                .collect(),
        );
        Ok(table
            + &figure(
                distribution.draw_distribution()?,
                "How long each hop took in that share of the cycles at most.",
            )
            + &figure(over.draw()?, "The hops inside a cycle, over the run."))
    }
}

fn curve(name: &str, colour: RGBColor, envelope: &Envelope, scale: f64) -> Curve {
    Curve { name: name.to_owned(), colour, lines: envelope.lines(scale) }
}

fn over_time(up: &str, at_least: (f64, f64), curves: Vec<Curve>) -> Chart<'_> {
    Chart { title: up, across: "time [s]", up, height: HEIGHT, at_least: Some(at_least), curves }
}

fn section(name: &str, content: &str) -> String {
    format!("<section>\n<h2>{name}</h2>\n{content}</section>\n")
}

fn figure(svg: String, caption: &str) -> String {
    format!("<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>\n", escape(caption))
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The colour as plotters writes it into attributes.
fn hexadecimal(colour: RGBColor) -> String {
    format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2)
}

fn document(title: &str, body: &str) -> String {
    let (ink, grid, paper) = (hexadecimal(INK), hexadecimal(GRID), hexadecimal(PAPER));
    format!(
        r#"<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; --ink: {ink}; --grid: {grid}; --paper: {paper}; --back: #F3F4F6; }}
@media (prefers-color-scheme: dark) {{
  :root {{ --ink: #C9CFD8; --grid: #3A414C; --paper: #1E2228; --back: #15181C; }}
}}
body {{ margin: 0 auto; max-width: 62rem; padding: 1.5rem; background: var(--back); color: var(--ink);
  font: 15px/1.5 system-ui, sans-serif; }}
h1 {{ font-size: 1.5rem; margin: 0 0 .3rem; }}
h2 {{ font-size: 1.05rem; margin: 0 0 .6rem; }}
section {{ background: var(--paper); border: 1px solid var(--grid); border-radius: 8px;
  padding: 1rem 1.2rem; margin: 1rem 0; overflow-x: auto; }}
figure {{ margin: 0 0 1rem; }}
figcaption {{ font-size: .85rem; opacity: .8; }}
svg {{ display: block; width: 100%; height: auto; }}
svg [fill="{ink}"] {{ fill: var(--ink); }}
svg [stroke="{ink}"] {{ stroke: var(--ink); }}
svg [stroke="{grid}"] {{ stroke: var(--grid); }}
svg [fill="{paper}"] {{ fill: var(--paper); }}
table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; }}
th, td {{ padding: .15rem .9rem .15rem 0; vertical-align: top; text-align: left; }}
th {{ font-weight: 600; white-space: nowrap; }}
.figures td, .figures th {{ text-align: right; }}
.figures th:first-child {{ text-align: left; }}
.warning td {{ color: #C77700; }}
.outcome {{ display: inline-block; margin: 0; padding: .1rem .7rem; border-radius: 1rem; color: #FFF;
  background: #B3413C; }}
.completed {{ background: #1F8A5B; }}
.stopped {{ background: #B07A12; }}
</style>
</head>
<body>
{body}</body>
</html>
"#,
        title = escape(title),
    )
}
