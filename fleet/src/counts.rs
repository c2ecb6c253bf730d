//! Counts what the hub hands on.

use crate::now;
use monitor::hub::{Batch, Lost};
use monitor::latency::HopLatency;
use monitor::stage::{Inputs, MonitorStage, Outputs};
use operator::fleet::{Latency, MachineMetrics, VERSION};

/// A count of drives that begin again at zero when drives do.
#[derive(Debug, Default)]
struct Restarting {
    before: Option<u64>,
    all: u64,
}

impl Restarting {
    /// Takes what is counted now; what was before the first is not ours.
    fn take(&mut self, now: u64) {
        let since = match self.before {
            Some(before) => now.checked_sub(before).unwrap_or(now),
            None => 0,
        };
        self.before = Some(now);
        self.all += since;
    }
}

/// What was counted since the start.
#[derive(Debug)]
pub(crate) struct Counts {
    machine: String,
    since: f64,
    stage: MonitorStage,
    outputs: Outputs,
    cycles: u64,
    unseen: u64,
    late: Restarting,
    overruns: Restarting,
    gate_faults: Restarting,
}

impl Counts {
    pub(crate) fn new(machine: String) -> Self {
        Self {
            machine,
            since: now(),
            stage: MonitorStage::new(),
            outputs: Outputs::default(),
            cycles: 0,
            unseen: 0,
            late: Restarting::default(),
            overruns: Restarting::default(),
            gate_faults: Restarting::default(),
        }
    }

    pub(crate) fn lose(&mut self, lost: Lost) {
        self.unseen += lost.feedbacks;
    }

    pub(crate) fn take(&mut self, batch: &Batch) {
        let inputs = Inputs { feedbacks: &batch.feedbacks, commands: &batch.commands };
        self.stage.step(&inputs, &mut self.outputs);
        self.cycles += batch.feedbacks.len() as u64;
        for feedback in &batch.feedbacks {
            self.late.take(feedback.missed);
            self.overruns.take(feedback.overruns);
        }
        for report in &batch.drives_reports {
            self.gate_faults.take(report.gate_trips);
        }
    }

    pub(crate) fn metrics(&self) -> MachineMetrics {
        let hops = self.stage.histograms().named().filter(|(_, histogram)| !histogram.is_empty());
        let hops = hops.map(|(hop, histogram)| {
            let HopLatency { count, p50, p99, p999, max, .. } = HopLatency::of(histogram);
            (hop.name().to_owned(), Latency { count, p50, p99, p999, max })
        });
        MachineMetrics {
            version: VERSION,
            machine: self.machine.clone(),
            time: now(),
            since: self.since,
            cycles: self.cycles,
            late_cycles: self.late.all,
            overruns: self.overruns.all,
            gate_faults: self.gate_faults.all,
            unseen_cycles: self.unseen,
            unsent: 0,
            latency: hops.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{Cycle, DrivesReport, Feedback};

    #[test]
    fn what_drives_count_goes_on_when_drives_begin_anew() {
        let mut counts = Counts::new("cell".to_owned());
        let cycle = |cycle: u64, missed: u64, overruns: u64| Feedback {
            cycle: Cycle(cycle),
            missed,
            overruns,
            ..Feedback::default()
        };
        let report = |gate_trips| DrivesReport { gate_trips, ..DrivesReport::default() };
        counts.take(&Batch {
            feedbacks: vec![cycle(1, 5, 7), cycle(2, 6, 7), cycle(3, 8, 9)],
            drives_reports: vec![report(4), report(5)],
            ..Batch::default()
        });
        counts.lose(Lost { feedbacks: 3, commands: 1 });
        counts.take(&Batch {
            feedbacks: vec![cycle(1, 2, 0)],
            drives_reports: vec![report(1)],
            ..Batch::default()
        });
        let metrics = counts.metrics();
        assert_eq!((metrics.cycles, metrics.unseen_cycles), (4, 3));
        // 3 and then 2 more; 2; 1 and then 1 more.
        assert_eq!((metrics.late_cycles, metrics.overruns, metrics.gate_faults), (5, 2, 2));
        assert_eq!((metrics.machine.as_str(), metrics.version), ("cell", 1));
    }
}
