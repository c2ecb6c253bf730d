//! What disturbs a real-time thread on the core: it wakes up every period for a second, and how late is counted.

use super::finding::Finding;
use super::host::Host;
use messages::Nanoseconds;
use runtime::clock::{now, sleep_until};
use runtime::thread::{DRIVES_PRIORITY, Placement, RealtimeOptions, enter_realtime};
use serde::Serialize;
use std::time::Duration;

/// How late a command may be for its cycle, as a part of the period: the bound on hardware.
const BOUND: f64 = 0.3;

/// Wakes that may be later than that, as a part of all.
const FEW: f64 = 0.001;

/// How late a thread woke up.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Noise {
    /// The CPU.
    pub core: usize,
    /// Whether the thread had a real-time priority.
    pub is_realtime: bool,
    /// The period that it slept for [s].
    pub period: f64,
    /// How often it woke up.
    pub wakes: usize,
    /// How late half of the wakes were at most [ns].
    pub p50: i64,
    /// How late 99 of 100 were at most [ns].
    pub p99: i64,
    /// How late 999 of 1000 were at most [ns].
    pub p999: i64,
    /// The latest [ns].
    pub max: i64,
    /// How many came later than 0.3 of the period.
    pub late: usize,
    /// Time that a hypervisor took from this CPU meanwhile, by its own count [s].
    pub stolen: f64,
}

/// Wakes up on the core every `period` for `duration`; `None` where no thread can be started.
pub(super) fn measure(
    host: &Host,
    core: usize,
    period: Nanoseconds,
    duration: Duration,
) -> Option<Noise> {
    let before = stolen(host, core);
    let count = (duration.as_nanos() / period.0.unsigned_abs().max(1) as u128) as usize;
    let thread = move || {
        let options = RealtimeOptions {
            priority: Some(DRIVES_PRIORITY),
            placement: Placement::Core(core),
            lock_memory: false,
        };
        let realtime = enter_realtime(&options);
        let mut lateness = Vec::with_capacity(count);
        let mut deadline = now() + period;
        for _ in 0..count {
            sleep_until(deadline);
            lateness.push((now() - deadline).0);
            deadline = deadline + period;
            // What was too late for the next one would count twice.
            while deadline <= now() {
                deadline = deadline + period;
            }
        }
        (lateness, realtime.facts.fifo == 1)
    };
    let (lateness, is_realtime) =
        std::thread::Builder::new().name("doctor".to_owned()).spawn(thread).ok()?.join().ok()?;
    let mut noise = of(lateness, core, period)?;
    noise.is_realtime = is_realtime;
    noise.stolen = (stolen(host, core) - before).max(0.0);
    Some(noise)
}

fn of(mut lateness: Vec<i64>, core: usize, period: Nanoseconds) -> Option<Noise> {
    lateness.sort_unstable();
    let last = lateness.len().checked_sub(1)?;
    let quantile = |share: f64| lateness[((last as f64 * share).ceil() as usize).min(last)];
    let bound = (period.0 as f64 * BOUND) as i64;
    Some(Noise {
        core,
        is_realtime: false,
        period: period.0 as f64 * 1e-9,
        wakes: lateness.len(),
        p50: quantile(0.5),
        p99: quantile(0.99),
        p999: quantile(0.999),
        max: lateness[last],
        late: lateness.len() - lateness.partition_point(|late| *late <= bound),
        stolen: 0.0,
    })
}

/// Time that a hypervisor has taken from the CPU [s]: the eighth column of proc_stat(5), in ticks of 10 ms.
fn stolen(host: &Host, core: usize) -> f64 {
    let text = host.text("/proc/stat").unwrap_or_default();
    let name = format!("cpu{core}");
    let line = text.lines().find(|line| line.split_whitespace().next() == Some(name.as_str()));
    let ticks = line.and_then(|line| line.split_whitespace().nth(8)?.parse::<f64>().ok());
    ticks.unwrap_or(0.0) * 0.01
}

/// What a measurement says.
pub(super) fn finding(noise: Option<&Noise>) -> Finding {
    const CHECK: &str = "wake-up latency";
    const WHY: &str =
        "it is what all of the above comes to: how late a thread wakes up that asked for a time";
    let Some(noise) = noise else {
        return Finding::unknown(CHECK, "not measured for another computer", WHY);
    };
    let microseconds = |time: i64| time as f64 * 1e-3;
    let found = format!(
        "CPU {}, {}: p50 {:.0}, p99 {:.0}, p99.9 {:.0}, max {:.0} µs late; {} of {} wakes later than {:.0} µs{}",
        noise.core,
        if noise.is_realtime { "SCHED_FIFO" } else { "without priority" },
        microseconds(noise.p50),
        microseconds(noise.p99),
        microseconds(noise.p999),
        microseconds(noise.max),
        noise.late,
        noise.wakes,
        noise.period * BOUND * 1e6,
        if noise.stolen > 0.0 {
            format!("; the hypervisor took {:.0} ms", noise.stolen * 1e3)
        } else {
            String::new()
        },
    );
    if noise.late == 0 {
        return Finding::ok(CHECK, found, WHY);
    }
    let remedy =
        "see the findings above; then measure for longer: graver bench latency --seconds 60";
    if noise.late as f64 > FEW * noise.wakes as f64 {
        Finding::problem(CHECK, found, WHY, remedy)
    } else {
        Finding::advice(CHECK, found, WHY, remedy)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::finding::Verdict;
    use super::*;

    const MILLISECOND: Nanoseconds = Nanoseconds(1_000_000);

    #[test]
    fn late_wakes_are_counted_against_the_bound_on_hardware() {
        let mut lateness = vec![10_000; 998];
        lateness.extend([300_000, 300_001]);
        let noise = of(lateness, 3, MILLISECOND).unwrap();
        assert_eq!((noise.p50, noise.p99, noise.max), (10_000, 10_000, 300_001));
        assert_eq!((noise.late, noise.wakes), (1, 1000));
        assert_eq!(finding(Some(&noise)).verdict, Verdict::Advice);
        let noise = of(vec![400_000; 10], 3, MILLISECOND).unwrap();
        assert_eq!(finding(Some(&noise)).verdict, Verdict::Problem);
        let noise = of(vec![0], 3, MILLISECOND).unwrap();
        assert_eq!(finding(Some(&noise)).verdict, Verdict::Ok);
        assert_eq!(of(Vec::new(), 3, MILLISECOND), None);
        assert_eq!(finding(None).verdict, Verdict::Unknown);
    }

    #[test]
    fn stolen_time_is_that_of_the_core_alone() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("proc")).unwrap();
        let text =
            "cpu  1 1 1 1 1 1 1 900 0 0\ncpu1 1 2 3 4 5 6 7 8 9 0\ncpu11 0 0 0 0 0 0 0 50 0 0\n";
        std::fs::write(folder.path().join("proc/stat"), text).unwrap();
        let host = Host::new(folder.path());
        assert_eq!(stolen(&host, 1), 0.08);
        assert_eq!(stolen(&host, 11), 0.5);
        assert_eq!(stolen(&host, 2), 0.0);
    }
}
