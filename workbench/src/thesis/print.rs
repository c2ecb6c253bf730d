//! Tables as text, as comma-separated values, and as HTML.

use core::fmt::Write;

use monitor::report::html::{escape, section};

use super::errata::Erratum;
use super::table::{Cell, Table};
use super::tables::TablesReport;

/// Digits of a number for people.
const DIGITS: i32 = 5;

/// A number as people read it.
fn number(value: Option<f64>) -> String {
    let Some(value) = value else { return "–".to_owned() };
    if value == 0.0 {
        return "0".to_owned();
    }
    // Digits before the point, or minus the zeros behind it.
    let scientific = format!("{value:e}");
    let exponent =
        scientific.split_once('e').and_then(|(_, exponent)| exponent.parse::<i32>().ok());
    let digits = usize::try_from(DIGITS - 1 - exponent.unwrap_or(0)).unwrap_or(0);
    let text = format!("{value:.digits$}");
    match text.split_once('.') {
        Some(_) => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

/// A cell's name in its table.
fn place(cell: &Cell) -> [String; 2] {
    let motor = cell.motor.map_or_else(String::new, |motor| format!(" {motor}"));
    [cell.row.clone(), format!("{}{motor}", cell.column)]
}

/// The columns of a printed table.
const HEADINGS: [&str; 8] =
    ["", "", "unit", "printed", "from print", "errata", "modelled", "because"];

fn line(cell: &Cell) -> [String; 8] {
    let [row, column] = place(cell);
    if cell.printed.is_none() && cell.modelled.is_none() {
        let text = cell.text.clone().unwrap_or_default();
        let mut line = [const { String::new() }; 8];
        [line[0], line[1], line[7]] = [row, column, text];
        return line;
    }
    let mut because = cell.because.join(", ");
    if let Some(text) = cell.text.as_deref().filter(|text| !text.is_empty()) {
        because = if because.is_empty() { text.to_owned() } else { format!("{text}; {because}") };
    }
    [
        row,
        column,
        cell.source_unit.clone(),
        number(cell.printed),
        number(cell.from_print),
        number(cell.errata),
        number(cell.modelled),
        because,
    ]
}

impl TablesReport {
    /// For a terminal: a line for each value, in the source's unit.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for table in &self.tables {
            text += &table.text();
            text.push('\n');
        }
        for Erratum { id, text: why } in &self.errata {
            let _ = writeln!(text, "{id:7} {why}");
        }
        text
    }

    /// As the sections of a page.
    pub fn html(&self) -> String {
        let mut body: String = self.tables.iter().map(Table::html).collect();
        let rows: String = self
            .errata
            .iter()
            .map(|Erratum { id, text }| {
                format!("<tr><th>{}</th><td>{}</td></tr>\n", escape(id), escape(text))
            })
            .collect();
        body += &section("Errata", &format!("<table>\n{rows}</table>\n"));
        body
    }
}

impl Table {
    /// For a terminal: a line for each value, in the source's unit.
    pub fn text(&self) -> String {
        let lines: Vec<[String; 8]> = self.cells.iter().map(line).collect();
        let heads = HEADINGS.map(str::to_owned);
        let width = |column: usize| {
            let all = lines.iter().chain([&heads]);
            all.map(|line| line[column].chars().count()).max().unwrap_or(0)
        };
        let widths: [usize; 8] = core::array::from_fn(width);
        let mut text = format!("Table {}  {}\n", self.name, self.title);
        for line in [&heads].into_iter().chain(&lines) {
            let mut row = String::new();
            for (column, (entry, width)) in line.iter().zip(widths).enumerate() {
                if (3..7).contains(&column) {
                    let _ = write!(row, "{entry:>width$}  ");
                } else {
                    let _ = write!(row, "{entry:width$}  ");
                }
            }
            text += row.trim_end();
            text.push('\n');
        }
        text
    }

    /// As comma-separated values, each in the source's unit and in SI units.
    pub fn csv(&self) -> String {
        let mut text =
            "table,row,column,motor,source_unit,unit,text,printed,printed_si,from_print,\
                        from_print_si,errata,errata_si,modelled,modelled_si,because\n"
                .to_owned();
        let plain = |value: Option<f64>| value.map_or_else(String::new, |it| it.to_string());
        for cell in &self.cells {
            let motor = cell.motor.map_or_else(String::new, |motor| motor.to_string());
            let fields = [
                quoted(&self.name),
                quoted(&cell.row),
                quoted(&cell.column),
                motor,
                quoted(&cell.source_unit),
                quoted(&cell.unit),
                quoted(cell.text.as_deref().unwrap_or_default()),
                plain(cell.printed),
                plain(cell.printed_si),
                plain(cell.from_print),
                plain(cell.from_print_si),
                plain(cell.errata),
                plain(cell.errata_si),
                plain(cell.modelled),
                plain(cell.modelled_si),
                quoted(&cell.because.join(" ")),
            ];
            text += &fields.join(",");
            text.push('\n');
        }
        text
    }

    /// As a section of a page.
    pub fn html(&self) -> String {
        let heads: String = HEADINGS.iter().map(|head| format!("<th>{head}</th>")).collect();
        let rows: String = self
            .cells
            .iter()
            .map(|cell| {
                let fields: String =
                    line(cell).iter().map(|field| format!("<td>{}</td>", escape(field))).collect();
                format!("<tr>{fields}</tr>\n")
            })
            .collect();
        let title = escape(&format!("Table {}: {}", self.name, self.title));
        section(&title, &format!("<table>\n<tr>{heads}</tr>\n{rows}</table>\n"))
    }
}

/// A field of comma-separated values.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
