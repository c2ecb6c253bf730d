//! The report of a run: one page to explore offline, and the picture of the path by itself.

pub mod chart;
mod column;
mod data;
pub mod html;
pub mod page;
pub mod path;
pub mod workspace;

use crate::latency::HopHistograms;
use crate::run_folder::{FileError, RunFolder};
use crate::summary::Summary;
use crate::trace::Trace;
use messages::artwork::Artwork;
use messages::run_folder;

/// What a report is made from.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// The figures; its machine's actuators give the charts their names and number.
    pub summary: &'a Summary,
    /// What was to be marked.
    pub artwork: &'a Artwork,
    /// The curves and paths.
    pub trace: &'a Trace,
    /// Torque constant of each actuator [N·m/A], in their order.
    pub torque_constants: &'a [f64],
    /// The latencies; empty in virtual time.
    pub histograms: &'a HopHistograms,
}

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A picture could not be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A file could not be written.
    #[error("cannot write {0}")]
    File(#[from] FileError),
}

impl Report<'_> {
    /// Writes page and picture into the run folder.
    ///
    /// # Errors
    /// [`ReportError`]: a picture that cannot be drawn, or a file that cannot be written.
    pub fn write(&self, folder: &RunFolder) -> Result<(), ReportError> {
        for (name, content) in
            [(run_folder::PICTURE, self.picture()?), (run_folder::REPORT, self.page()?)]
        {
            folder.write(name, content)?;
        }
        Ok(())
    }
}

/// A picture could not be drawn; the data it was given are at fault.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot draw the picture \"{title}\": {reason}")]
pub struct PictureError {
    /// Which picture.
    pub title: String,
    /// What the drawing library says.
    pub reason: String,
}

#[cfg(test)]
mod tests;
