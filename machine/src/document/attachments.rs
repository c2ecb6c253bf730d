//! Files that a document names beside itself: found in its folder, or read before together with it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::Source;
use super::node::Span;

/// The largest file that a document may name [bytes].
const LARGEST: u64 = 16 << 20;

/// Where the files that a document names are found.
#[derive(Debug, Clone, Default)]
pub enum Attachments {
    /// Nowhere.
    #[default]
    None,
    /// In this folder, as they are now.
    Folder(PathBuf),
    /// Read before, by the names that the document gives them.
    Read(BTreeMap<String, Attachment>),
}

/// A file that a document names, as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attachment {
    /// Its path.
    pub path: PathBuf,
    /// Its text, or why it cannot be read.
    pub text: Result<String, String>,
}

impl Attachment {
    /// Reads the file at `path`: UTF-8 text of at most 16 MB.
    pub fn read(path: PathBuf) -> Self {
        let text = text(&path);
        Self { path, text }
    }
}

fn text(path: &Path) -> Result<String, String> {
    let unreadable = |error: std::io::Error| format!("cannot be read: {error}");
    // Opening a pipe would wait for somebody to write to it.
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err("is no file".to_owned());
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unreadable)?;
    file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST {
        return Err(format!("is larger than {} MB", LARGEST >> 20));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..valid].iter().filter(|byte| **byte == b'\n').count() + 1;
        format!("is not UTF-8 text in line {line}")
    })
}

impl Attachments {
    /// In the folder of the document at `path`.
    pub fn beside(path: &Path) -> Self {
        Self::Folder(path.parent().unwrap_or_else(|| Path::new("")).to_owned())
    }

    /// Path and text of the file called `name`, or why there is none.
    pub(super) fn read(&self, name: &str) -> Result<(String, String), String> {
        let found = match self {
            Self::None => None,
            Self::Folder(folder) => Some(Attachment::read(folder.join(name))),
            Self::Read(files) => files.get(name).cloned(),
        };
        let Attachment { path, text } =
            found.ok_or_else(|| format!("there is no file `{name}`"))?;
        let path = path.display().to_string();
        match text {
            Ok(text) => Ok((path, text)),
            Err(cause) => Err(format!("{path} {cause}")),
        }
    }
}

/// A file that a document names, as one of the texts that its values come from.
#[derive(Debug)]
pub(crate) struct Attached {
    source: Arc<Source>,
    index: usize,
}

impl Attached {
    pub(super) fn new(source: Arc<Source>, index: usize) -> Self {
        Self { source, index }
    }

    /// Its text.
    pub(crate) fn text(&self) -> &str {
        &self.source.text
    }

    /// The place of `part`, which must be a part of its text.
    pub(crate) fn span(&self, part: &str) -> Span {
        let text = self.source.text.as_bytes().as_ptr_range();
        let start = (part.as_ptr() as usize).saturating_sub(text.start as usize);
        let start = start.min(self.source.text.len());
        let end = (start + part.len()).min(self.source.text.len());
        Span { source: self.index, start, end }
    }
}
