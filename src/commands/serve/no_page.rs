//! What stands in the place of the page in a build without the feature `serve`.

use crate::arguments::AccessArguments;
use crate::exit::{Exit, Failure};
use runtime::Instance;

/// There is none.
pub(super) enum Page {}

impl Page {
    /// None.
    ///
    /// # Errors
    /// An address for one.
    pub(super) fn start(access: &AccessArguments, _: &Instance) -> Result<Option<Self>, Failure> {
        match access.listen {
            None => Ok(None),
            Some(address) => Err(Failure::bad_input(format!(
                "--listen {address}: this graver was built without the feature `serve`, and has no page"
            ))),
        }
    }

    /// Never called.
    pub(super) fn end(self) -> Result<Exit, Failure> {
        match self {}
    }
}
