//! The tokens of a server: a file of its user's alone.

use super::Right;
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use subtle::ConstantTimeEq;

/// Random bytes of a token that is made.
const BYTES: usize = 24;

/// The fewest characters of a token that people write.
const SHORTEST: usize = 16;

/// Why there are no tokens.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The file.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// Its path.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// Others can read it.
    #[error("{path} can be read by others (mode {mode:o}): chmod 600 {path}", path = path.display())]
    Open {
        /// Its path.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// A line that is none.
    #[error(
        "{path}, line {line}: {what}; a line is `operate TOKEN` or `watch TOKEN`, with {SHORTEST} or more of \
         A-Z a-z 0-9 - . _ ~",
        path = path.display()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// The line from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
}

/// Tokens and what they are good for.
#[derive(Default)]
pub struct Tokens {
    tokens: Vec<(Right, String)>,
}

impl std::fmt::Debug for Tokens {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} tokens", self.tokens.len())
    }
}

impl Tokens {
    /// The tokens in the file at `path`, which is made where there is none; whether it was made.
    ///
    /// # Errors
    /// A file that others can read, one with something else in it, or none that can be made.
    pub fn open(path: &Path) -> Result<(Self, bool), TokenError> {
        let failed = |source| TokenError::Io { path: path.to_owned(), source };
        let is_new = match fs::metadata(path) {
            Ok(found) if found.mode() & 0o077 != 0 => {
                return Err(TokenError::Open { path: path.to_owned(), mode: found.mode() & 0o777 });
            }
            Ok(_) => false,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                make(path).map_err(failed)?;
                true
            }
            Err(error) => return Err(failed(error)),
        };
        let text = fs::read_to_string(path).map_err(failed)?;
        Ok((Self::parse(path, &text)?, is_new))
    }

    fn parse(path: &Path, text: &str) -> Result<Self, TokenError> {
        let mut tokens = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let wrong =
                |what: String| TokenError::Line { path: path.to_owned(), line: index + 1, what };
            let (right, token) = match line.split_once(char::is_whitespace) {
                Some(("operate", token)) => (Right::Operate, token.trim()),
                Some(("watch", token)) => (Right::Watch, token.trim()),
                _ => return Err(wrong("neither `operate` nor `watch` and a token".to_owned())),
            };
            let is_allowed = |it: char| it.is_ascii_alphanumeric() || "-._~".contains(it);
            if token.len() < SHORTEST || !token.chars().all(is_allowed) {
                return Err(wrong(format!("a token of {} characters", token.chars().count())));
            }
            tokens.push((right, token.to_owned()));
        }
        Ok(Self { tokens })
    }

    /// Whether there is any.
    pub fn is_empty(&self) -> bool {
        self.tokens.is_empty()
    }

    /// What a token is good for. How long that takes does not tell how much of it is right.
    pub fn right(&self, presented: &str) -> Option<Right> {
        let mut found = None;
        for (right, token) in &self.tokens {
            if bool::from(token.as_bytes().ct_eq(presented.as_bytes())) {
                found = found.max(Some(*right));
            }
        }
        found
    }
}

/// Makes a file with a token to operate and one to watch, in a folder of its user's alone.
fn make(path: &Path) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    }
    let mut file = File::options();
    let mut file = file.write(true).create_new(true).mode(0o600).open(path)?;
    let text = format!(
        "# Tokens of `graver serve`: `operate` moves the machine, `watch` looks. Change them as you like.\n\
         operate {}\nwatch {}\n",
        random()?,
        random()?
    );
    file.write_all(text.as_bytes())
}

/// Random hexadecimal digits.
pub(crate) fn random() -> io::Result<String> {
    let mut bytes = [0; BYTES];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_file_is_made_once_for_its_user_alone_and_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state/graver/tokens");
        let (made, is_new) = Tokens::open(&path).unwrap();
        assert!(is_new && !made.is_empty());
        assert_eq!(fs::metadata(&path).unwrap().mode() & 0o777, 0o600);
        let text = fs::read_to_string(&path).unwrap();
        let token = |role: &str| {
            let line = text.lines().find(|line| line.starts_with(role)).unwrap();
            line.split_once(' ').unwrap().1.to_owned()
        };
        let (read, is_new) = Tokens::open(&path).unwrap();
        assert!(!is_new);
        assert_eq!(read.right(&token("operate")), Some(Right::Operate));
        assert_eq!(read.right(&token("watch")), Some(Right::Watch));
        for wrong in ["", "0", &token("watch")[1..], &(token("watch") + "0")] {
            assert_eq!(read.right(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_file_that_others_can_read_or_that_is_no_list_of_tokens_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens");
        for (text, word) in [
            ("operate short\n", "line 1"),
            ("# fine\n\nrule 0123456789abcdef\n", "line 3"),
            ("operate 0123456789 abcdef\n", "line 1"),
        ] {
            fs::write(&path, text).unwrap();
            fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).unwrap();
            let error = Tokens::open(&path).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("operate TOKEN"), "{error}");
        }
        fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).unwrap();
        let error = Tokens::open(&path).unwrap_err().to_string();
        assert!(error.contains("640") && error.contains("chmod 600"), "{error}");
    }
}
