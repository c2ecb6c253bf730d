//! What was found out about one property of a computer.

use serde::Serialize;

/// How a property bears on real time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As it should be.
    Ok,
    /// It cannot be told.
    Unknown,
    /// The machine runs; it would run better with the remedy.
    Advice,
    /// The machine does not run, or not in real time.
    Problem,
}

impl Verdict {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Unknown => "unknown",
            Self::Advice => "advice",
            Self::Problem => "problem",
        }
    }
}

/// What was found out about one property.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub struct Finding {
    /// The property.
    pub check: String,
    /// How it bears on real time.
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// Why it matters.
    pub why: String,
    /// What to do about it, a command where there is one; null where nothing is to be done.
    pub remedy: Option<String>,
}

impl Finding {
    /// A property that is as it should be.
    pub fn ok(check: &str, found: impl Into<String>, why: &str) -> Self {
        Self::new(check, Verdict::Ok, found.into(), why, None)
    }

    /// A property that cannot be told.
    pub fn unknown(check: &str, found: impl Into<String>, why: &str) -> Self {
        Self::new(check, Verdict::Unknown, found.into(), why, None)
    }

    /// A property that could be better.
    pub fn advice(
        check: &str,
        found: impl Into<String>,
        why: &str,
        remedy: impl Into<String>,
    ) -> Self {
        Self::new(check, Verdict::Advice, found.into(), why, Some(remedy.into()))
    }

    /// A property that has to be changed.
    pub fn problem(
        check: &str,
        found: impl Into<String>,
        why: &str,
        remedy: impl Into<String>,
    ) -> Self {
        Self::new(check, Verdict::Problem, found.into(), why, Some(remedy.into()))
    }

    fn new(
        check: &str,
        verdict: Verdict,
        found: String,
        why: &str,
        remedy: Option<String>,
    ) -> Self {
        Self { check: check.to_owned(), verdict, found, why: why.to_owned(), remedy }
    }
}
