//! What a Prometheus server collects at `/metrics`.

use messages::DrivesReport;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::prometheus_text;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Registry, Unit};
use serde_json::Value;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// What a body at `/metrics` is.
pub use prometheus_text::CONTENT_TYPE;

/// Bounds of the cycle time [s]: from a tenth of the shortest period to twice the longest.
const CYCLE_TIMES: [f64; 14] = [
    10e-6, 20e-6, 40e-6, 60e-6, 80e-6, 100e-6, 150e-6, 200e-6, 300e-6, 500e-6, 1e-3, 2e-3, 4e-3,
    8e-3,
];

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct StateLabel {
    state: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct CodeLabel {
    code: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OutcomeLabel {
    outcome: String,
}

/// A gauge of a number that is not whole.
type FloatGauge = Gauge<f64, AtomicU64>;

/// All of them.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    up: Gauge,
    joined: Gauge,
    cycle_time: Histogram,
    late_cycles: Counter,
    overruns: Counter,
    gate_faults: Counter,
    gate_trips: AtomicU64,
    lit: Gauge,
    rate_override: FloatGauge,
    power_override: FloatGauge,
    rapid_override: FloatGauge,
    state: Family<StateLabel, Gauge>,
    faults: Family<CodeLabel, Counter>,
    jobs: Family<OutcomeLabel, Counter>,
    waiting: Gauge,
    clients: Gauge,
    requests: Counter,
    refused: Counter,
    /// Numbers of the jobs that were counted; the queue tells those that ended again and again.
    ended: Mutex<Option<BTreeSet<u64>>>,
}

impl Default for Metrics {
    fn default() -> Self {
        Self::new()
    }
}

impl Metrics {
    /// All at zero.
    pub fn new() -> Self {
        let mut registry = Registry::with_prefix("graver");
        let registry_of = &mut registry;
        macro_rules! registered {
            ($metric:expr, $name:literal, $help:literal) => {{
                let metric = $metric;
                registry_of.register($name, $help, metric.clone());
                metric
            }};
        }
        let cycle_time = Histogram::new(CYCLE_TIMES);
        registry_of.register_with_unit(
            "cycle_time",
            "From the deadline of a cycle to the command that answers it",
            Unit::Seconds,
            cycle_time.clone(),
        );
        Self {
            up: registered!(Gauge::default(), "up", "1 while the pipeline answers"),
            joined: registered!(
                Gauge::default(),
                "observed",
                "1 while the samples of a pipeline are read"
            ),
            late_cycles: registered!(
                Counter::default(),
                "late_cycles",
                "Cycles in which no fresh command arrived in time"
            ),
            overruns: registered!(
                Counter::default(),
                "overruns",
                "Cycles whose work did not end before the next deadline"
            ),
            gate_faults: registered!(
                Counter::default(),
                "gate_faults",
                "Times that the watchdog closed an open gate"
            ),
            lit: registered!(
                Gauge::default(),
                "gate_open",
                "1 while the gate of the laser is open"
            ),
            rate_override: registered!(
                FloatGauge::default(),
                "rate_override",
                "Rate that is asked for, 1 as planned"
            ),
            power_override: registered!(
                FloatGauge::default(),
                "power_override",
                "Multiple of the power that the job asks for, until it ends"
            ),
            rapid_override: registered!(
                FloatGauge::default(),
                "rapid_override",
                "Rate of rapids that is asked for, 1 as planned"
            ),
            state: registered!(Family::default(), "state", "1 for the state of the controller"),
            faults: registered!(
                Family::default(),
                "faults",
                "Faults that were latched, by their code"
            ),
            jobs: registered!(Family::default(), "jobs", "Jobs that ended, by their outcome"),
            waiting: registered!(Gauge::default(), "jobs_waiting", "Jobs in the queue"),
            clients: registered!(Gauge::default(), "clients", "Pages that are connected"),
            requests: registered!(
                Counter::default(),
                "http_requests",
                "Requests that were answered"
            ),
            refused: registered!(
                Counter::default(),
                "http_refused",
                "Requests that were refused for want of a right, or for their number"
            ),
            cycle_time,
            gate_trips: AtomicU64::new(0),
            ended: Mutex::new(None),
            registry,
        }
    }

    /// As text, in Prometheus' own format.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = prometheus_text::encode(&mut text, &self.registry);
        text
    }

    pub(crate) fn joined(&self, is_joined: bool) {
        self.joined.set(i64::from(is_joined));
    }

    pub(crate) fn cycle(&self, seconds: f64) {
        self.cycle_time.observe(seconds);
    }

    pub(crate) fn late(&self, missed: u64, overruns: u64) {
        self.late_cycles.inc_by(missed);
        self.overruns.inc_by(overruns);
    }

    pub(crate) fn drives(&self, report: &DrivesReport) {
        self.lit.set(i64::from(report.lit));
        // Drives that started anew count from zero again.
        let before = self.gate_trips.swap(report.gate_trips, Ordering::Relaxed);
        let since = report.gate_trips.checked_sub(before).unwrap_or(report.gate_trips);
        self.gate_faults.inc_by(since);
    }

    pub(crate) fn status(&self, before: Option<&Value>, now: &Value) {
        self.up.set(1);
        for (gauge, key) in [
            (&self.rate_override, "rate_override"),
            (&self.power_override, "power_override"),
            (&self.rapid_override, "rapid_override"),
        ] {
            gauge.set(now[key].as_f64().unwrap_or(1.0));
        }
        let state = now["state"].as_str().unwrap_or("unknown");
        if before.and_then(|before| before["state"].as_str()) != Some(state) {
            self.state.clear();
            self.state.get_or_create(&StateLabel { state: state.to_owned() }).set(1);
        }
        let fault = now["fault"].as_str();
        if let (Some(code), Some(before)) = (fault, before)
            && before["fault"].as_str() != Some(code)
        {
            self.faults.get_or_create(&CodeLabel { code: code.to_owned() }).inc();
        }
    }

    pub(crate) fn silent(&self) {
        self.up.set(0);
        self.state.clear();
    }

    pub(crate) fn queue(&self, queue: &Value) {
        let waiting = queue["waiting"].as_array().map_or(0, Vec::len);
        self.waiting.set(i64::try_from(waiting).unwrap_or(i64::MAX));
        let ended = queue["ended"].as_array().into_iter().flatten();
        let ended =
            ended.filter_map(|job| Some((job["number"].as_u64()?, job["outcome"].as_str()?)));
        let ended: Vec<(u64, &str)> = ended.collect();
        let numbers = ended.iter().map(|(number, _)| *number).collect();
        let mut known = self.ended.lock().unwrap_or_else(PoisonError::into_inner);
        // Those that had ended before this process began are not its to count.
        if let Some(known) = known.as_ref() {
            for (_, outcome) in ended.iter().filter(|(number, _)| !known.contains(number)) {
                self.jobs.get_or_create(&OutcomeLabel { outcome: (*outcome).to_owned() }).inc();
            }
        }
        *known = Some(numbers);
    }

    /// Pages that are connected.
    pub fn clients(&self) -> i64 {
        self.clients.get()
    }

    pub(crate) fn connected(&self) {
        self.clients.inc();
    }

    pub(crate) fn disconnected(&self) {
        self.clients.dec();
    }

    pub(crate) fn answered(&self, is_refused: bool) {
        self.requests.inc();
        if is_refused {
            self.refused.inc();
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use serde_json::json;
    use std::io::Write;
    use std::process::{Command, Stdio};

    fn filled() -> Metrics {
        let metrics = Metrics::new();
        metrics.joined(true);
        [15e-6, 90e-6, 5e-3, 1.0].into_iter().for_each(|time| metrics.cycle(time));
        metrics.late(2, 3);
        for gate_trips in [1, 4, 2] {
            metrics.drives(&DrivesReport { gate_trips, ..DrivesReport::default() });
        }
        let status = |state: &str, fault: Option<&str>| json!({ "state": state, "fault": fault, "power_override": 0.8 });
        metrics.status(None, &status("running", None));
        metrics.status(Some(&status("running", None)), &status("faulted", Some("overload")));
        let job = |number: u64, outcome: &str| json!({ "number": number, "outcome": outcome });
        metrics.queue(&json!({ "waiting": [], "ended": [job(1, "completed")] }));
        metrics.queue(&json!({ "waiting": [job(4, "")], "ended":
            [job(1, "completed"), job(2, "completed"), job(3, "stopped")] }));
        metrics.connected();
        metrics
    }

    #[test]
    fn every_number_is_what_was_counted() {
        let text = filled().text();
        for line in [
            "graver_cycle_time_seconds_bucket{le=\"0.0001\"} 2",
            "graver_cycle_time_seconds_count 4",
            "graver_late_cycles_total 2",
            "graver_overruns_total 3",
            // 1, then 3 more, then 2 of drives that began anew.
            "graver_gate_faults_total 6",
            "graver_state{state=\"faulted\"} 1",
            "graver_faults_total{code=\"overload\"} 1",
            "graver_jobs_total{outcome=\"completed\"} 1",
            "graver_jobs_total{outcome=\"stopped\"} 1",
            "graver_jobs_waiting 1",
            "graver_clients 1",
            "graver_up 1",
            "graver_rate_override 1.0",
            "graver_power_override 0.8",
        ] {
            assert!(text.lines().any(|it| it == line), "{line} in\n{text}");
        }
        assert!(!text.contains("running"), "only one state holds");
    }

    #[test]
    fn promtool_has_nothing_to_say_where_it_is_installed() {
        let checked = Command::new("promtool")
            .args(["check", "metrics"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let Ok(mut child) = checked else { return };
        child.stdin.take().unwrap().write_all(filled().text().as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        let said =
            String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.trim().is_empty(), "{said}");
    }
}
