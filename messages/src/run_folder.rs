//! The files of a run folder by name: what supervisor, planner and monitor leave there for each
//! other and for people.

/// The job as asked for; the supervisor's.
pub const REQUEST: &str = "request.json";
/// Why the job was refused, if it was; the planner's.
pub const REFUSAL: &str = "refused.json";
/// What is to be marked, an [`ArtworkLine`](crate::artwork::ArtworkLine) a line; the planner's.
pub const ARTWORK: &str = "artwork.jsonl";
/// What the plan comes to, [`PlanFacts`](crate::plan::PlanFacts); the planner's.
pub const PLAN: &str = "plan.json";
/// The recording: every cycle's feedback and command; the monitor's. A long one has further parts, `samples.1.mcap` and
/// so on.
pub const SAMPLES: &str = "samples.mcap";
/// The recording as earlier versions wrote it.
pub const OLD_SAMPLES: &str = "samples.bin";
/// Latencies as HdrHistogram interval log; the monitor's.
pub const LATENCY: &str = "latency.hlog";
/// What the monitor recorded and lost, written when the recording is complete; the monitor's.
pub const WATCH: &str = "monitor.json";
/// The summary; `docs/schema/summary.json` is its schema.
pub const SUMMARY: &str = "summary.json";
/// The report as one self-contained page.
pub const REPORT: &str = "report.html";
/// The picture of planned and marked path.
pub const PICTURE: &str = "path.svg";

/// All of them: whoever begins a run in a folder removes what an earlier one left.
pub const ALL: [&str; 11] = [
    REQUEST,
    REFUSAL,
    ARTWORK,
    PLAN,
    SAMPLES,
    OLD_SAMPLES,
    LATENCY,
    WATCH,
    SUMMARY,
    REPORT,
    PICTURE,
];
