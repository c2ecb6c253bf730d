//! The clock that libraries made for `embassy` ask: ours. Who waits by it is asked again by who runs it, so
//! nobody is woken.

use core::task::Waker;

use embassy_time_driver::Driver;

use crate::clock;

/// The monotonic clock in microseconds.
struct Monotonic;

impl Driver for Monotonic {
    fn now(&self) -> u64 {
        clock::now().0.unsigned_abs() / 1000
    }

    fn schedule_wake(&self, _at: u64, _waker: &Waker) {}
}

// The macro gives two functions the names that the library links to.
#[allow(unsafe_code)]
mod driver {
    use super::Monotonic;

    embassy_time_driver::time_driver_impl!(static DRIVER: Monotonic = Monotonic);
}
