//! Who takes the windows of a job.

use messages::plan::PlanFacts;

use super::Window;

/// The consumer of a job's windows.
pub(crate) trait Outlet {
    /// Whether planning shall stop.
    fn is_abandoned(&self) -> bool;

    /// Notes that a window has been planned, which will be taken after those before it.
    fn note(&mut self, _window: &Window) {}

    /// Forgets the last `count` windows that were noted: they are planned anew.
    fn forget(&mut self, _count: usize) {}

    /// Takes the next window; gives it back when there is no room for it yet.
    fn take(&mut self, window: Box<Window>) -> Result<(), Box<Window>>;

    /// How many setpoints may be planned before they can be taken.
    fn ahead(&self) -> usize {
        0
    }

    /// How much faster than it asks for the job shall be marked, 1 as it asks.
    fn rate(&self) -> f64 {
        1.0
    }

    /// Waits a little for room.
    fn wait(&mut self) {}

    /// What the plan comes to so far, asked for after each window and, as `is_last`, after the last.
    fn heed(&mut self, _facts: &dyn Fn() -> PlanFacts, _is_last: bool) {}
}
