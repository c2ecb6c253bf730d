//! Why a thread stood still, asked of the kernel by a thread beside it that is not real-time.
//!
//! The kernel counts what holds a thread up: time that the hypervisor stole, page faults, time spent
//! ready but without a CPU, periods of a control group without time, a CPU that grew too hot. The
//! [`StallWatch`] reads the counters ten times a second and, when told of a stall, once more shortly
//! after; those that grew in between are its causes. They are known some 20 ms after the stall. A
//! counter that grew for another reason in the same tenth of a second is taken for a cause too, and
//! what the kernel does not count stays unexplained.
//!
//! The cycle itself reads nothing: it hands the stall over through a queue without a lock.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crossbeam::queue::ArrayQueue;
use messages::{Nanoseconds, StallCause};

use crate::{clock, signal};

/// Time between two readings while nothing happens.
const PERIOD: Duration = Duration::from_millis(100);

/// Time after a stall in which the kernel adds it to its counters: stolen time at the next tick of the
/// CPU, 10 ms at the slowest.
const SETTLED: Duration = Duration::from_millis(12);

/// Stalls that may wait for their explanation; those beyond stay unexplained.
const WAITING: usize = 16;

/// A stall to be explained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StallNote {
    /// Its number, chosen by whoever tells of it.
    pub number: u64,
    /// When it began.
    pub from: Nanoseconds,
    /// When it had ended.
    pub to: Nanoseconds,
    /// What explains it where no counter grew: bits of [`StallCause`].
    pub otherwise: u32,
}

/// A stall explained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Explanation {
    /// The number of its [`StallNote`].
    pub number: u64,
    /// Bits of [`StallCause`]; none where nothing is known.
    pub causes: u32,
}

/// Explains the stalls of one thread.
#[derive(Debug)]
pub struct StallWatch {
    told: Arc<ArrayQueue<StallNote>>,
    explained: Arc<ArrayQueue<Explanation>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl StallWatch {
    /// Starts watching the calling thread. Call it before the thread becomes real-time.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn start() -> io::Result<Self> {
        let told = Arc::new(ArrayQueue::new(WAITING));
        let explained = Arc::new(ArrayQueue::new(WAITING));
        let stop = Arc::new(AtomicBool::new(false));
        let mut reader = Reader { sources: Sources::of_this_thread(), newest: None, before: None };
        let (notes, answers, stopped) = (told.clone(), explained.clone(), stop.clone());
        let read = move || {
            while !stopped.load(Ordering::Relaxed) {
                reader.read();
                while let Some(note) = notes.pop() {
                    // Dropped where nobody takes them: the stall stays unexplained.
                    let _ = answers.push(reader.explain(&note));
                }
                thread::park_timeout(PERIOD);
            }
        };
        let thread = thread::Builder::new().name("stalls".into()).spawn(read)?;
        Ok(Self { told, explained, stop, thread: Some(thread) })
    }

    /// Hands a stall over to be explained: one system call, no allocation.
    pub fn tell(&self, note: StallNote) {
        if self.told.push(note).is_ok()
            && let Some(thread) = &self.thread
        {
            thread.thread().unpark();
        }
    }

    /// The next explanation, if there is one. No system call, no allocation.
    pub fn explained(&self) -> Option<Explanation> {
        self.explained.pop()
    }
}

impl Drop for StallWatch {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

/// What the kernel has counted; what it does not tell stays 0.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Counters {
    /// Stolen time of each CPU [ticks].
    stolen: Vec<u64>,
    /// The CPU that the thread ran on last.
    cpu: usize,
    /// Page faults of the thread.
    faults: u64,
    /// Time for which the thread was ready and had no CPU [ns].
    waited: u64,
    /// Periods in which the control group had used its time up.
    throttled: u64,
    /// Times that the CPU was slowed down by its heat.
    heat: u64,
}

impl Counters {
    /// What grew from `self` to `after`, during a stall as long as `length`: bits of [`StallCause`].
    fn causes(&self, after: &Self, length: Nanoseconds) -> u32 {
        let stolen = |counters: &Self| counters.stolen.get(after.cpu).copied().unwrap_or(0);
        // To wait a little is usual: only what makes up half of the stall explains it.
        let waited = after.waited.saturating_sub(self.waited) >= length.0.unsigned_abs() / 2;
        let grew = [
            (StallCause::Steal, stolen(after) > stolen(self)),
            (StallCause::PageFault, after.faults > self.faults),
            (StallCause::Preempted, waited),
            (StallCause::Throttled, after.throttled > self.throttled),
            (StallCause::Heat, after.heat > self.heat),
        ];
        grew.iter().filter(|(_, grew)| *grew).fold(0, |bits, (cause, _)| bits | cause.bit())
    }
}

/// The counters with when they were read.
struct Reader {
    sources: Sources,
    newest: Option<(Nanoseconds, Counters)>,
    before: Option<(Nanoseconds, Counters)>,
}

impl Reader {
    fn read(&mut self) {
        self.before = self.newest.replace((clock::now(), self.sources.read()));
    }

    /// Compares the counters from before the stall with those of when it has settled.
    fn explain(&mut self, note: &StallNote) -> Explanation {
        let began = |reading: &&(Nanoseconds, Counters)| reading.0 <= note.from;
        let earlier = self.newest.as_ref().filter(began).or(self.before.as_ref()).cloned();
        thread::sleep(SETTLED);
        self.read();
        let length = note.to - note.from;
        let mut causes = match (earlier, &self.newest) {
            (Some((_, earlier)), Some((_, newest))) => earlier.causes(newest, length),
            _ => 0,
        };
        if signal::continued().is_some_and(|at| at >= note.from && at <= note.to) {
            causes |= StallCause::Stopped.bit();
        }
        Explanation {
            number: note.number,
            causes: if causes == 0 { note.otherwise } else { causes },
        }
    }
}

/// Where the kernel tells what it counts.
struct Sources {
    thread: PathBuf,
    group: Option<PathBuf>,
}

impl Sources {
    fn of_this_thread() -> Self {
        // SAFETY: gettid takes nothing and cannot fail.
        #[allow(unsafe_code)]
        let thread = unsafe { libc::gettid() };
        let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
        Self {
            thread: PathBuf::from(format!("/proc/self/task/{thread}")),
            group: group_files(&groups).into_iter().find(|file| file.exists()),
        }
    }

    fn read(&self) -> Counters {
        let text = |path: &Path| fs::read_to_string(path).unwrap_or_default();
        let (faults, cpu) = faults_and_cpu(&text(&self.thread.join("stat"))).unwrap_or_default();
        let heat = |kind: &str| {
            let folder = format!("/sys/devices/system/cpu/cpu{cpu}/thermal_throttle");
            text(&Path::new(&folder).join(kind)).trim().parse().unwrap_or(0)
        };
        Counters {
            stolen: stolen(&text(Path::new("/proc/stat"))),
            cpu,
            faults,
            waited: waited(&text(&self.thread.join("schedstat"))),
            throttled: self.group.as_deref().map_or(0, |file| throttled(&text(file))),
            heat: heat("core_throttle_count") + heat("package_throttle_count"),
        }
    }
}

/// Where `cpu.stat` of the control groups named in /proc/self/cgroup may be: of version 2, and of the
/// controller `cpu` of version 1; cgroups(7).
fn group_files(groups: &str) -> Vec<PathBuf> {
    let fields = groups.lines().map(|line| line.splitn(3, ':').collect::<Vec<_>>());
    let file = |fields: Vec<&str>| match fields[..] {
        ["0", "", group] => Some(format!("/sys/fs/cgroup{group}/cpu.stat")),
        [_, controllers, group] if controllers.split(',').any(|one| one == "cpu") => {
            Some(format!("/sys/fs/cgroup/{controllers}{group}/cpu.stat"))
        }
        _ => None,
    };
    fields.filter_map(file).map(PathBuf::from).collect()
}

/// Stolen ticks of each CPU from /proc/stat; proc_stat(5).
fn stolen(text: &str) -> Vec<u64> {
    let of_a_cpu = |line: &&str| {
        line.strip_prefix("cpu").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
    };
    let steal = |line: &str| line.split_whitespace().nth(8)?.parse().ok();
    text.lines().filter(of_a_cpu).map(|line| steal(line).unwrap_or(0)).collect()
}

/// Page faults, minor and major, and the CPU it ran on last, from a thread's stat; proc_pid_stat(5).
fn faults_and_cpu(text: &str) -> Option<(u64, usize)> {
    // The name in brackets may hold spaces and brackets: count from the last one.
    let (_, rest) = text.rsplit_once(") ")?;
    let fields: Vec<&str> = rest.split(' ').collect();
    let number = |field: usize| fields.get(field)?.parse::<u64>().ok();
    // The first field after the name is number 3.
    Some((number(10 - 3)? + number(12 - 3)?, usize::try_from(number(39 - 3)?).ok()?))
}

/// Time ready without a CPU [ns], from a thread's schedstat: the second number.
fn waited(text: &str) -> u64 {
    text.split_whitespace().nth(1).and_then(|number| number.parse().ok()).unwrap_or(0)
}

/// Periods without time, from a control group's cpu.stat.
fn throttled(text: &str) -> u64 {
    let line = text.lines().find_map(|line| line.strip_prefix("nr_throttled "));
    line.and_then(|number| number.trim().parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const LATE: u32 = StallCause::LateAnswer.bit();

    const STAT: &str = "cpu  213899 0 28457 105572 966 0 141 339 0 0\n\
                        cpu0 106325 0 13897 53819 385 0 5 179 0 0\n\
                        cpu1 107573 0 14560 51753 581 0 136 159 0 0\n\
                        intr 12345 6 7\nctxt 99\n";

    #[test]
    fn the_counters_are_read_as_the_kernel_writes_them() {
        assert_eq!(stolen(STAT), [179, 159]);
        let thread = "4711 (a (b) c) S 1 2 3 0 -1 64 17 0 4 0 5 6 0 0 20 0 1 0 1 2 3 4 5 6 7 8 9 10 11 \
                      12 13 14 0 0 17 1 85 1 0 0 0";
        assert_eq!(faults_and_cpu(thread), Some((21, 1)));
        assert_eq!(waited("0 3783390 1\n"), 3_783_390);
        assert_eq!(throttled("nr_periods 8\nnr_throttled 5\nthrottled_usec 9\n"), 5);
        let groups = "9:name=systemd:/\n2:cpuacct,cpu:/a\n0::/user.slice/b\n";
        let files =
            ["/sys/fs/cgroup/cpuacct,cpu/a/cpu.stat", "/sys/fs/cgroup/user.slice/b/cpu.stat"];
        assert_eq!(group_files(groups), files.map(PathBuf::from));
        // What is not there, or is written otherwise, counts nothing.
        assert_eq!((stolen(""), faults_and_cpu("1 (x) S 1"), waited("")), (vec![], None, 0));
        assert_eq!((throttled("nr_throttled x"), group_files("\n:")), (0, vec![]));
    }

    #[test]
    fn this_kernel_tells_of_this_thread() {
        let sources = Sources::of_this_thread();
        let before = sources.read();
        assert!(before.stolen.len() > before.cpu, "{before:?}");
        std::hint::black_box(vec![1_u8; 64 << 20]);
        let after = sources.read();
        assert!(after.faults > before.faults, "{before:?} {after:?}");
    }

    #[test]
    fn what_grew_is_a_cause() {
        let before = Counters { stolen: vec![5, 7], cpu: 1, ..Counters::default() };
        let length = Nanoseconds(4_000_000);
        let check = |change: fn(&mut Counters), expect: &[StallCause]| {
            let mut after = before.clone();
            change(&mut after);
            let causes = before.causes(&after, length);
            assert_eq!(StallCause::of(causes).collect::<Vec<_>>(), expect);
        };
        check(|_| {}, &[]);
        check(|after| after.stolen[1] += 1, &[StallCause::Steal]);
        check(|after| after.stolen[0] += 9, &[]);
        check(|after| after.faults += 1, &[StallCause::PageFault]);
        check(|after| after.waited += 1_999_999, &[]);
        check(|after| after.waited += 2_000_000, &[StallCause::Preempted]);
        check(|after| after.throttled += 1, &[StallCause::Throttled]);
        check(|after| after.heat += 1, &[StallCause::Heat]);
        check(
            |after| (after.stolen[1], after.heat) = (9, 1),
            &[StallCause::Steal, StallCause::Heat],
        );
    }

    #[test]
    fn every_stall_that_is_told_of_is_explained() {
        let watch = StallWatch::start().unwrap();
        let now = clock::now();
        for number in 0..3 {
            watch.tell(StallNote { number, from: now, to: now + Nanoseconds(1), otherwise: LATE });
        }
        for expected in 0..3 {
            let explanation = loop {
                match watch.explained() {
                    Some(explanation) => break explanation,
                    None => thread::yield_now(),
                }
            };
            assert_eq!(explanation.number, expected);
            assert_ne!(explanation.causes, 0);
            assert_eq!(explanation.causes & StallCause::Stopped.bit(), 0);
        }
    }
}
