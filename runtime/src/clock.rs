//! The monotonic clock, sleeping until an absolute instant, and the deadlines of a cycle.

use messages::Nanoseconds;

const SECOND: i64 = 1_000_000_000;

/// How long before a deadline a real-time thread ends its sleep and spins.
///
/// Chosen from quiet rounds on a 2-core VM under FIFO 85: the 99th percentile of |period − 1 ms| is
/// 14 to 20 µs with a plain sleep and 0.1 to 0.3 µs with 100 µs of spinning. Beside compilers the
/// margins cannot be told apart: medians over 12 interleaved rounds of 3 s, overruns slipped, were
/// 32 µs asleep and 62, 6 and 272 µs with 50, 100 and 200 µs, where LinuxCNC's servo thread, which
/// does not slip, had 90 µs. It is a tenth of one core, far from the kernel's throttle.
pub const SPIN_MARGIN: Nanoseconds = Nanoseconds(100_000);

/// The monotonic clock, which every stamp in a sample is from.
pub fn now() -> Nanoseconds {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a valid timespec for the kernel to fill; CLOCK_MONOTONIC always exists.
    #[allow(unsafe_code)]
    unsafe {
        libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time)
    };
    Nanoseconds(time.tv_sec * SECOND + time.tv_nsec)
}

pub(crate) fn timespec(time: Nanoseconds) -> libc::timespec {
    libc::timespec { tv_sec: time.0 / SECOND, tv_nsec: time.0 % SECOND }
}

/// Sleeps until `deadline` on the monotonic clock; at once when it has passed. Goes on sleeping
/// after a signal.
pub fn sleep_until(deadline: Nanoseconds) {
    let until = timespec(Nanoseconds(deadline.0.max(0)));
    loop {
        // SAFETY: `until` is a normalised timespec; an absolute sleep writes no remainder.
        #[allow(unsafe_code)]
        let result = unsafe {
            libc::clock_nanosleep(
                libc::CLOCK_MONOTONIC,
                libc::TIMER_ABSTIME,
                &until,
                std::ptr::null_mut(),
            )
        };
        if result != libc::EINTR {
            return;
        }
    }
}

/// Sleeps until `margin` before `deadline` and spins through the rest, for a wake-up that does not
/// carry the timer's lateness. A margin of 0 only sleeps.
pub fn sleep_then_spin_until(deadline: Nanoseconds, margin: Nanoseconds) {
    sleep_until(deadline - margin);
    while now() < deadline {
        std::hint::spin_loop();
    }
}

/// The absolute deadlines of a cycle: `start + n × period`, without drift, unless they are moved.
#[derive(Debug, Clone)]
pub struct PeriodicClock {
    period: Nanoseconds,
    margin: Nanoseconds,
    deadline: Nanoseconds,
}

impl PeriodicClock {
    /// A clock whose first deadline is one period from now.
    ///
    /// `margin` is how long before a deadline the sleep ends and spinning begins, 0 for none.
    pub fn new(period: Nanoseconds, margin: Nanoseconds) -> Self {
        Self { period, margin, deadline: now() + period }
    }

    /// The same with `first` as its first deadline.
    #[must_use]
    pub fn starting_at(self, first: Nanoseconds) -> Self {
        Self { deadline: first, ..self }
    }

    /// The deadline that is next, or at which [`Self::wait`] returned last until
    /// [`Self::advance`].
    pub fn deadline(&self) -> Nanoseconds {
        self.deadline
    }

    /// Sleeps until the deadline; not at all when it has passed. What is to be done about a deadline
    /// that was met late, [`Self::skip`] or [`Self::slip`] decides.
    pub fn wait(&self) {
        if now() < self.deadline {
            sleep_then_spin_until(self.deadline, self.margin);
        }
    }

    /// Leaves out the deadlines after which another has passed, and goes on with the newest: for
    /// drives that cannot wait, because the machine did not. Returns how many were left out, 0 when
    /// less than a period has passed.
    pub fn skip(&mut self) -> u64 {
        let skipped = (now() - self.deadline).0.max(0) / self.period.0;
        self.deadline = self.deadline + Nanoseconds(skipped * self.period.0);
        skipped.unsigned_abs()
    }

    /// Goes on to the next cycle; returns its deadline.
    pub fn advance(&mut self) -> Nanoseconds {
        self.deadline = self.deadline + self.period;
        self.deadline
    }

    /// Moves this and all later deadlines by `time`, earlier where it is negative: for drives that follow
    /// another clock.
    pub fn shift(&mut self, time: Nanoseconds) {
        self.deadline = self.deadline + time;
    }

    /// Moves this and all later deadlines so that this one is not before now: for drives that can
    /// wait. Returns by how much, 0 when nothing had passed.
    pub fn slip(&mut self) -> Nanoseconds {
        let late = Nanoseconds((now() - self.deadline).0.max(0));
        self.deadline = self.deadline + late;
        late
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLISECOND: Nanoseconds = Nanoseconds(1_000_000);

    #[test]
    fn a_sleep_never_ends_before_its_deadline() {
        for margin in [0, 50_000, 2_000_000] {
            let deadline = now() + MILLISECOND;
            sleep_then_spin_until(deadline, Nanoseconds(margin));
            assert!(now() >= deadline, "margin {margin}");
        }
        sleep_until(Nanoseconds(-5));
        sleep_until(Nanoseconds(0));
    }

    #[test]
    fn deadlines_do_not_drift() {
        let mut clock = PeriodicClock::new(MILLISECOND, Nanoseconds(0));
        let start = clock.deadline();
        for cycle in 0..20 {
            assert_eq!(clock.deadline(), start + Nanoseconds(cycle as i64 * MILLISECOND.0));
            clock.wait();
            assert!(now() >= clock.deadline());
            clock.advance();
        }
    }

    #[test]
    fn after_a_stall_the_clock_goes_on_with_the_newest_deadline_that_has_passed() {
        let mut clock = PeriodicClock::new(MILLISECOND, Nanoseconds(0));
        let start = clock.deadline();
        clock.wait();
        // At least five deadlines pass during the work of the first cycle.
        sleep_until(start + Nanoseconds(5 * MILLISECOND.0));
        clock.advance();
        clock.wait();
        let before = now();
        let skipped = clock.skip();
        let after = now();
        assert!(skipped >= 4, "{skipped}");
        let passed = Nanoseconds(MILLISECOND.0 * (1 + skipped as i64));
        assert_eq!(clock.deadline(), start + passed);
        assert!(clock.deadline() <= after && before < clock.deadline() + MILLISECOND);
    }

    #[test]
    fn a_deadline_met_less_than_a_period_late_is_not_left_out() {
        let hour = Nanoseconds(3_600_000_000_000);
        let mut clock = PeriodicClock::new(hour, Nanoseconds(0));
        let deadline = clock.deadline();
        assert_eq!(clock.skip(), 0, "it has not come yet");
        clock.deadline = now() - Nanoseconds(5);
        let late = clock.deadline();
        assert_eq!((clock.skip(), clock.deadline()), (0, late));
        clock.deadline = deadline - hour - hour - hour;
        assert_eq!((clock.skip(), clock.deadline()), (2, deadline - hour));
    }

    #[test]
    fn a_slip_moves_all_later_deadlines() {
        let mut clock = PeriodicClock::new(MILLISECOND, Nanoseconds(0));
        let start = clock.deadline();
        sleep_until(start + Nanoseconds(3 * MILLISECOND.0));
        let late = clock.slip();
        assert!(late.0 >= 3 * MILLISECOND.0);
        assert_eq!(clock.deadline(), start + late);
        assert_eq!(clock.advance(), start + late + MILLISECOND);

        let mut early = PeriodicClock::new(Nanoseconds(1_000_000_000_000), Nanoseconds(0));
        assert_eq!(early.slip(), Nanoseconds(0));
    }
}
