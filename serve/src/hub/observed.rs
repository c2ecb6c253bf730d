//! What the samples of one pipeline tell.

use crate::machine_facts::MachineFacts;
use crate::metrics::Metrics;
use crate::path::ToolPath;
use crate::ring::Ring;
use crate::scope::{LONGEST, Scope, ScopeRequest};
use crate::signals::{CycleSamples, Signal, SignalName, signals};
use machine::Machine;
use messages::{LaserCycle, Nanoseconds, Progress};
use monitor::hub::Batch;
use monitor::latency::HopLatency;
use monitor::recording::CycleRecord;
use monitor::stage::{Inputs, MonitorStage, Outputs};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The first step of a histogram that is shown [ns], and by what each is longer than the one before.
const FIRST_STEP: u64 = 1_000;
const STEP: f64 = 1.25;

/// The latency of a hop.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct HopReport {
    /// Its figures [ns].
    #[serde(flatten)]
    pub figures: HopLatency,
    /// The upper bound of each step [ns], and how many were in it.
    pub histogram: Vec<(u64, u64)>,
}

/// The latencies since the pipeline was joined.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct LatencyReport {
    /// Every hop that happened, by its name.
    pub hops: BTreeMap<String, HopReport>,
}

/// The pipeline of one machine.
pub(super) struct Observed {
    facts: Arc<MachineFacts>,
    signals: Vec<Signal>,
    names: Arc<Vec<SignalName>>,
    pub(super) ring: Ring,
    pub(super) path: ToolPath,
    stage: MonitorStage,
    period: Nanoseconds,
    progress: Progress,
    epoch: u64,
    counted: Option<(u64, u64)>,
}

impl Observed {
    pub(super) fn new(machine: &Machine) -> Self {
        let signals = signals(machine);
        let period = machine.realtime.period;
        let capacity = (LONGEST / period.seconds()).ceil() as usize + 1;
        Self {
            facts: Arc::new(MachineFacts::of(machine)),
            names: Arc::new(signals.iter().map(|signal| signal.name.clone()).collect()),
            ring: Ring::new(signals.len(), capacity),
            path: ToolPath::default(),
            stage: MonitorStage::new(),
            period: period.time(),
            progress: Progress::default(),
            epoch: 0,
            counted: None,
            signals,
        }
    }

    pub(super) fn facts(&self) -> Arc<MachineFacts> {
        self.facts.clone()
    }

    pub(super) fn names(&self) -> Arc<Vec<SignalName>> {
        self.names.clone()
    }

    pub(super) fn scope(&self, request: ScopeRequest) -> Result<Scope, String> {
        let names: Vec<String> = self.names.iter().map(|signal| signal.name.clone()).collect();
        Scope::new(request, &names, self.period.seconds())
    }

    pub(super) fn take(&mut self, batch: &Batch, metrics: &Metrics) {
        self.progress = batch.progress.last().copied().unwrap_or(self.progress);
        let inputs = Inputs { feedbacks: &batch.feedbacks, commands: &batch.commands };
        let mut outputs = Outputs::default();
        self.stage.step(&inputs, &mut outputs);
        for record in &outputs.records {
            self.record(record, metrics);
        }
    }

    fn record(&mut self, CycleRecord { feedback, command }: &CycleRecord, metrics: &Metrics) {
        let is_answered = command.cycle == feedback.cycle && command.published.0 != 0;
        let command = is_answered.then_some(command);
        let time = Nanoseconds(self.period.0 * feedback.elapsed() as i64);
        let lit = lit_share(&feedback.laser, time);
        if feedback.epoch != self.epoch {
            // Drives have started anew: what their cycles were before is another count.
            (self.epoch, self.counted) = (feedback.epoch, None);
        }
        let cycle = CycleSamples { feedback, command, progress: &self.progress, lit };
        self.ring.push(feedback.cycle.0, self.signals.iter().map(|signal| signal.value(&cycle)));
        self.path.push(feedback, command, lit);
        if let Some(command) = command {
            metrics.cycle((command.published - feedback.deadline).seconds());
        }
        let (missed, overruns) = self.counted.unwrap_or((feedback.missed, feedback.overruns));
        metrics.late(
            feedback.missed.saturating_sub(missed),
            feedback.overruns.saturating_sub(overruns),
        );
        self.counted = Some((feedback.missed, feedback.overruns));
    }

    pub(super) fn latency(&self) -> LatencyReport {
        let hops = self.stage.histograms().named().filter(|(_, histogram)| !histogram.is_empty());
        let hops = hops.map(|(hop, histogram)| {
            let steps = histogram.iter_log(FIRST_STEP, STEP);
            let steps =
                steps.map(|step| (step.value_iterated_to(), step.count_since_last_iteration()));
            let report = HopReport {
                figures: HopLatency::of(histogram),
                histogram: steps.filter(|(_, count)| *count > 0).collect(),
            };
            (hop.name().to_owned(), report)
        });
        LatencyReport { hops: hops.collect() }
    }
}

/// The share of `time` in which the gate was open.
fn lit_share(laser: &LaserCycle, time: Nanoseconds) -> f64 {
    let (mut gate, mut from, mut lit) = (laser.gate, 0, 0);
    for edge in laser.edges() {
        let at = i64::from(edge.offset).min(time.0);
        lit += if gate != 0 { at - from } else { 0 };
        (gate, from) = (edge.gate, at);
    }
    lit += if gate != 0 { time.0 - from } else { 0 };
    lit.max(0) as f64 / time.0.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::GateEdge;

    #[test]
    fn the_lit_share_is_the_time_between_the_edges() {
        let time = Nanoseconds(1_000_000);
        let mut laser = LaserCycle::OFF;
        assert_eq!(lit_share(&laser, time), 0.0);
        for (offset, gate) in [(250_000, 3), (500_000, 0), (900_000, 4)] {
            assert!(laser.push(GateEdge { offset, gate, power: 0.5 }));
        }
        assert!((lit_share(&laser, time) - 0.35).abs() < 1e-12);
        laser = LaserCycle { gate: 1, ..LaserCycle::OFF };
        assert_eq!(lit_share(&laser, time), 1.0);
    }
}
