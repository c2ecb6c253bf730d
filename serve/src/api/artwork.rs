//! What the job under way is to mark.

use super::{ApiError, answer, ask, blocking};
use crate::context::Context;
use crate::outline::{MOST_POINTS, Outline, Strokes};
use axum::extract::State;
use axum::response::Response;
use messages::artwork::ArtworkLine;
use messages::run_folder;
use operator::Request;
use schemars::JsonSchema;
use serde::Serialize;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// The most that is read of an artwork [bytes]: what comes after is marked too, but not drawn.
const MOST: u64 = 1 << 30;

/// What the job under way is to mark.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub(crate) struct ArtworkAnswer {
    /// The job; null without one.
    pub job: Option<String>,
    /// As far as it is planned.
    #[serde(flatten)]
    pub drawing: Strokes,
}

pub(crate) async fn artwork(State(context): State<Context>) -> Result<Response, ApiError> {
    let status = ask(&context, Request::Status).await?;
    let job = status["job"].as_str().map(str::to_owned);
    let Some(folder) = status["run_folder"].as_str().map(str::to_owned) else {
        return Ok(answer(&ArtworkAnswer { job, drawing: Strokes::default() }));
    };
    let drawing = blocking(move || Ok(read(&Path::new(&folder).join(run_folder::ARTWORK)))).await?;
    Ok(answer(&ArtworkAnswer { job, drawing }))
}

/// The strokes in the file; none where there is no such file yet. It grows while the job is planned, so its last line
/// may be half there.
fn read(path: &Path) -> Strokes {
    let mut outline = Outline::new(MOST_POINTS);
    if let Ok(file) = File::open(path) {
        let lines = BufReader::new(file.take(MOST)).lines().map_while(Result::ok);
        for line in lines.map_while(|line| serde_json::from_str::<ArtworkLine>(&line).ok()) {
            outline.add(line.goes_on, &line.stroke.points);
        }
    }
    outline.finish()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_is_written_so_far_is_read_and_half_a_line_is_left_out() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(run_folder::ARTWORK);
        assert_eq!(read(&path), Strokes::default());
        let text = "{\"points\":[[0,0,0],[0.01,0,0]],\"line\":1}\n\
                    {\"goes_on\":true,\"points\":[[0.01,0,0],[0.01,0.02,0]],\"line\":1}\n\
                    {\"points\":[[0.5,0";
        std::fs::write(&path, text).unwrap();
        let shown = read(&path);
        assert_eq!(shown.strokes, [vec![[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.02, 0.0]]]);
    }
}
