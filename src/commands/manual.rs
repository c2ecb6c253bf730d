//! What is generated from the code: shell completions, man pages, and the schemas of files.

use crate::arguments::{Arguments, SchemaFile};
use crate::exit::{Exit, Failure};
use crate::output;
use clap::CommandFactory;
use std::io::Write;
use std::path::Path;

/// Prints the completion script of a shell.
///
/// # Errors
/// When standard output cannot be written.
pub fn completions(shell: clap_complete::Shell) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    // Into memory: it panics where it cannot write.
    clap_complete::generate(shell, &mut Arguments::command(), "graver", &mut script);
    output::printed(std::io::stdout().lock().write_all(&script))?;
    Ok(Exit::Done)
}

/// Prints the JSON schema of a file that people write.
///
/// # Errors
/// When standard output cannot be written.
pub fn schema(file: SchemaFile) -> Result<Exit, Failure> {
    let schema = match file {
        SchemaFile::Machine => machine::file::schema(),
        SchemaFile::Job => planner::job::file::schema(),
        SchemaFile::Catalogue => workbench::catalogue::schema(),
    };
    output::printed(std::io::stdout().lock().write_all(schema.as_bytes()))?;
    Ok(Exit::Done)
}

/// Writes a man page for graver and one for each command into `folder`.
///
/// # Errors
/// A folder that cannot be written.
pub fn pages(folder: &Path) -> Result<Exit, Failure> {
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Arguments::command(), folder))
        .map_err(|error| Failure::bad_input(format!("{}: {error}", folder.display())))?;
    Ok(Exit::Done)
}
