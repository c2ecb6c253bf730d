//! Counting allocations of a thread, to prove that a cycle makes none.
//!
//! A test or bench binary installs it:
//! ```
//! use runtime::allocation::{Allocations, CountingAllocator};
//!
//! #[global_allocator]
//! static ALLOCATOR: CountingAllocator = CountingAllocator;
//!
//! let before = Allocations::of_this_thread();
//! let block = Box::new(1);
//! assert_eq!(Allocations::of_this_thread().since(before).allocations, 1);
//! drop(block);
//! ```

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    // Constant initialisers and no destructor: reading them never allocates, so the allocator may.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static RELEASES: Cell<u64> = const { Cell::new(0) };
    static BYTES: Cell<u64> = const { Cell::new(0) };
}

/// What a thread has asked of the heap so far; all zero unless [`CountingAllocator`] is installed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Allocations {
    /// Blocks taken, or moved to another size.
    pub allocations: u64,
    /// Blocks given back.
    pub releases: u64,
    /// Bytes asked for.
    pub bytes: u64,
}

impl Allocations {
    /// The calling thread's counts.
    pub fn of_this_thread() -> Self {
        Self { allocations: ALLOCATIONS.get(), releases: RELEASES.get(), bytes: BYTES.get() }
    }

    /// What was added since `earlier`, on the same thread.
    pub fn since(self, earlier: Self) -> Self {
        Self {
            allocations: self.allocations - earlier.allocations,
            releases: self.releases - earlier.releases,
            bytes: self.bytes - earlier.bytes,
        }
    }

    /// What `work` asks of the heap on this thread.
    pub fn during<R>(work: impl FnOnce() -> R) -> (R, Self) {
        let before = Self::of_this_thread();
        let result = work();
        (result, Self::of_this_thread().since(before))
    }
}

/// The system allocator with a count for each thread.
#[derive(Debug, Clone, Copy, Default)]
pub struct CountingAllocator;

fn count(bytes: usize) {
    // During a thread's last moments its counters may be gone; those blocks interest nobody.
    let _ = ALLOCATIONS.try_with(|allocations| allocations.set(allocations.get() + 1));
    let _ = BYTES.try_with(|total| total.set(total.get() + bytes as u64));
}

// SAFETY: every method hands its arguments on to `System` unchanged and returns its answer; the
// counting beside it neither allocates nor panics.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        let _ = RELEASES.try_with(|releases| releases.set(releases.get() + 1));
        unsafe { System.dealloc(block, layout) }
    }
}
