//! `graver tables`: the tables of the sources, as printed, with the errata applied, and as modelled.

use crate::arguments::{TableFormat, TablesArguments};
use crate::exit::{Exit, Failure};
use crate::output::{self, printed, say};
use monitor::report::html;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use workbench::thesis::{TablesReport, tables};

/// Title of the page.
const TITLE: &str = "Tables of the sources";

/// Runs the command.
///
/// # Errors
/// A name that is no table's, or a folder that cannot be written.
pub fn run(arguments: &TablesArguments) -> Result<Exit, Failure> {
    let report = tables(&arguments.names).map_err(Failure::bad_input)?;
    if let Some(folder) = &arguments.out {
        write(folder, arguments.format, &report)?;
    }
    let print = |text: &str| printed(io::stdout().lock().write_all(text.as_bytes()));
    match arguments.format {
        _ if arguments.json => output::json(&report)?,
        _ if arguments.out.is_some() => {}
        Some(TableFormat::Json) => output::json(&report)?,
        Some(TableFormat::Csv) => print(&csv(&report))?,
        Some(TableFormat::Html) => print(&page(&report))?,
        Some(TableFormat::Text) => print(&report.text())?,
        None => say!("{}", report.text().trim_end()),
    }
    Ok(Exit::Done)
}

/// All tables in one, their names in the first column.
fn csv(report: &TablesReport) -> String {
    let mut text = String::new();
    for table in &report.tables {
        let table = table.csv();
        let rows = if text.is_empty() { Some(table.as_str()) } else { after_heading(&table) };
        text += rows.unwrap_or_default();
    }
    text
}

fn after_heading(table: &str) -> Option<&str> {
    table.split_once('\n').map(|(_, rows)| rows)
}

fn page(report: &TablesReport) -> String {
    html::document(TITLE, &format!("<h1>{TITLE}</h1>\n{}", report.html()))
}

/// Writes `format`, or all but text, into `folder`.
fn write(folder: &Path, format: Option<TableFormat>, report: &TablesReport) -> Result<(), Failure> {
    let failed = |path: &Path, error: &dyn std::fmt::Display| {
        Failure::bad_input(format!("--out: cannot write {}: {error}", path.display()))
    };
    fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    let file = |name: &str, content: &str| {
        let path = folder.join(name);
        fs::write(&path, content).map_err(|error| failed(&path, &error))
    };
    let is_wanted = |kind| format.is_none_or(|format| format == kind);
    if is_wanted(TableFormat::Csv) {
        for table in &report.tables {
            file(&format!("table_{}.csv", table.name), &table.csv())?;
        }
    }
    if is_wanted(TableFormat::Html) {
        file("tables.html", &page(report))?;
    }
    if is_wanted(TableFormat::Json) {
        let text = serde_json::to_string_pretty(report).map_err(Failure::output)?;
        file("tables.json", &(text + "\n"))?;
    }
    if format == Some(TableFormat::Text) {
        file("tables.txt", &report.text())?;
    }
    Ok(())
}
