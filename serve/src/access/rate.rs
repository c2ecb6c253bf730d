//! So many in a row, and so many more each second, from one address.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Addresses that are remembered; whoever comes beyond that waits for others to be forgotten.
const ADDRESSES: usize = 1024;

/// A bucket for each address.
#[derive(Debug)]
pub(super) struct Buckets {
    most: f64,
    per_second: f64,
    buckets: Mutex<HashMap<IpAddr, (f64, Instant)>>,
}

impl Buckets {
    pub(super) fn new(most: f64, per_second: f64) -> Self {
        Self { most, per_second, buckets: Mutex::default() }
    }

    /// Whether one more is allowed; nothing is taken.
    pub(super) fn has(&self, address: IpAddr) -> bool {
        self.left(&mut self.lock(), address, Instant::now()) >= 1.0
    }

    /// Takes one; `false` where there is none left.
    pub(super) fn take(&self, address: IpAddr) -> bool {
        self.take_at(address, Instant::now())
    }

    fn take_at(&self, address: IpAddr, now: Instant) -> bool {
        let mut buckets = self.lock();
        let left = self.left(&mut buckets, address, now);
        if left < 1.0 {
            return false;
        }
        if buckets.len() >= ADDRESSES && !buckets.contains_key(&address) {
            buckets.retain(|_, (left, then)| self.filled(*left, *then, now) < self.most);
            if buckets.len() >= ADDRESSES {
                return false;
            }
        }
        buckets.insert(address, (left - 1.0, now));
        true
    }

    fn left(
        &self,
        buckets: &mut HashMap<IpAddr, (f64, Instant)>,
        address: IpAddr,
        now: Instant,
    ) -> f64 {
        buckets.get(&address).map_or(self.most, |(left, then)| self.filled(*left, *then, now))
    }

    fn filled(&self, left: f64, then: Instant, now: Instant) -> f64 {
        let since = now.saturating_duration_since(then).as_secs_f64();
        (left + since * self.per_second).min(self.most)
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<IpAddr, (f64, Instant)>> {
        self.buckets.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;
    use std::time::Duration;

    fn address(number: u32) -> IpAddr {
        Ipv4Addr::from(number).into()
    }

    #[test]
    fn an_address_gets_so_many_in_a_row_and_more_with_time() {
        let buckets = Buckets::new(3.0, 2.0);
        let start = Instant::now();
        let taken =
            |after: f64| buckets.take_at(address(1), start + Duration::from_secs_f64(after));
        assert_eq!([taken(0.0), taken(0.0), taken(0.0), taken(0.0)], [true, true, true, false]);
        assert_eq!([taken(0.5), taken(0.5)], [true, false]);
        assert!(buckets.take_at(address(2), start), "another address has its own");
    }

    #[test]
    fn what_is_remembered_is_bounded_and_forgotten_when_it_is_full_again() {
        let buckets = Buckets::new(2.0, 1.0);
        let start = Instant::now();
        for number in 0..ADDRESSES as u32 {
            assert!(buckets.take_at(address(number), start));
        }
        assert!(!buckets.take_at(address(9999), start), "no room");
        let later = start + Duration::from_secs(10);
        assert!(buckets.take_at(address(9999), later));
        assert_eq!(buckets.lock().len(), 1);
    }
}
