//! A mesh in a file of its own: comma-separated values, a line for each point of the grid, in any order.

use super::mesh::Grid;
use crate::document::{Attached, Diagnostics, Measured, ProblemKind, Span, Spanned};
use crate::frame::Mesh;
use crate::quantity::{Dimension, Kind, Length, read, read_any};

/// The columns that there can be.
const COLUMNS: [&str; 4] = ["x", "y", "dx", "dy"];

/// What the first line says, as an example.
const HEADER: &str = "x [mm],y [mm],dx [um],dy [um]";

/// Places that differ by less are the same [m].
const SAME: f64 = 1e-9;

/// How far a place may be from its line of the grid, as a share of the distance of two lines.
const UNEVEN: f64 = 1e-3;

/// One line of the file.
struct Point {
    /// x, y, dx, dy [m].
    values: [f64; 4],
    span: Span,
}

/// Where the columns stand in a line, and in what unit each is [m].
struct Header {
    separator: char,
    /// Of each of [`COLUMNS`]: its index in a line, and its unit.
    columns: [Option<(usize, f64)>; 4],
    /// How many columns a line has.
    count: usize,
}

/// The grid of the file that the machine file calls `name`; what is wrong with it is noted at its line.
pub(super) fn grid(name: &Spanned<String>, diagnostics: &mut Diagnostics) -> Option<Grid> {
    let file = diagnostics.attached(name)?;
    // A mark that some programs put before all text is no part of it.
    let text = file.text().trim_start_matches('\u{feff}');
    let lines =
        text.lines().filter(|line| !line.trim().is_empty() && !line.trim().starts_with('#'));
    let mut lines = lines.peekable();
    let Some(first) = lines.next() else {
        let message = "the file of the mesh is empty".to_owned();
        refuse(file.span(text), message, &format!("begin it with `{HEADER}`"), diagnostics);
        return None;
    };
    let header = Header::read(first, &file, diagnostics)?;
    let mut points = Vec::new();
    let mut is_sound = true;
    for line in lines {
        if points.len() == Mesh::MOST * Mesh::MOST {
            let message = format!("a mesh has at most {} points", points.len());
            refuse(file.span(line), message, "measure fewer", diagnostics);
            return None;
        }
        let point = header.point(line, &file, diagnostics);
        is_sound &= point.is_some();
        points.extend(point);
    }
    let end = file.span(&text[text.trim_end().len()..]);
    if !is_sound {
        return None;
    }
    arranged(&points, name.span, file.span(first), end, diagnostics)
}

impl Header {
    fn read(line: &str, file: &Attached, diagnostics: &mut Diagnostics) -> Option<Self> {
        let help = || format!("write such as `{HEADER}`");
        let separator = [';', '\t', ','].into_iter().find(|separator| line.contains(*separator));
        let separator = separator.unwrap_or(',');
        let mut columns = [None; 4];
        let mut count = 0;
        for (index, cell) in line.split(separator).enumerate() {
            count = index + 1;
            let cell = cell.trim();
            let span = file.span(cell);
            let (name, unit) = cell.split_once('[').unwrap_or((cell, ""));
            let (name, unit) = (name.trim().trim_matches('"'), unit.trim_end_matches([']', '"']));
            let Some(column) = COLUMNS.iter().position(|known| name.eq_ignore_ascii_case(known))
            else {
                let message = format!("a mesh has no column `{cell}`");
                refuse(span, message, &help(), diagnostics);
                return None;
            };
            let Ok(unit) = read::<Length>(&format!("1 {unit}")) else {
                let message = format!("the column `{name}` has no unit of length");
                refuse(span, message, &help(), diagnostics);
                return None;
            };
            if columns[column].replace((index, unit)).is_some() {
                let message = format!("the column `{name}` stands twice");
                refuse(span, message, &help(), diagnostics);
                return None;
            }
        }
        let [x, y, dx, dy] = columns;
        if x.is_none() || y.is_none() || (dx.is_none() && dy.is_none()) {
            let message = "a mesh needs the columns x and y, and dx or dy or both".to_owned();
            refuse(file.span(line), message, &help(), diagnostics);
            return None;
        }
        Some(Self { separator, columns, count })
    }

    fn point(&self, line: &str, file: &Attached, diagnostics: &mut Diagnostics) -> Option<Point> {
        let span = file.span(line);
        let cells: Vec<&str> = line.split(self.separator).map(str::trim).collect();
        if cells.len() != self.count {
            let message =
                format!("the line has {} values, and the first line {}", cells.len(), self.count);
            refuse(span, message, "give each column a value in every line", diagnostics);
            return None;
        }
        let mut values = [0.0; 4];
        let mut is_sound = true;
        for (value, (column, name)) in values.iter_mut().zip(self.columns.iter().zip(COLUMNS)) {
            let Some((index, unit)) = *column else { continue };
            let cell = cells[index];
            match read_any(cell) {
                Ok((number, Dimension::NONE)) if number.is_finite() => *value = number * unit,
                _ => {
                    let message = format!("`{cell}` is no number");
                    let help = "write a plain number: the first line has the units";
                    refuse(file.span(cell), message, help, diagnostics);
                    is_sound = false;
                    continue;
                }
            }
            let dimension = Length::DIMENSIONS[0];
            let number = Measured { value: *value, dimension, span: file.span(cell) };
            is_sound &= diagnostics.hold("MeshTable", name, &number);
        }
        is_sound.then_some(Point { values, span })
    }
}

/// The points row by row. `file` is where the machine file names theirs, `first` its first line, `end` its
/// end.
fn arranged(
    points: &[Point],
    file: Span,
    first: Span,
    end: Span,
    diagnostics: &mut Diagnostics,
) -> Option<Grid> {
    let lines = [0, 1].map(|part| distinct(points, part));
    for (name, lines) in ["x", "y"].into_iter().zip(&lines) {
        if !(Mesh::FEWEST..=Mesh::MOST).contains(&lines.len()) {
            let message =
                format!("the points of the mesh stand at {} values of {name}", lines.len());
            let help = format!(
                "give {} to {} of them, at even distances, each with every value of the other",
                Mesh::FEWEST,
                Mesh::MOST
            );
            refuse(first, message, &help, diagnostics);
            return None;
        }
    }
    let ranges = lines.each_ref().map(|lines| [lines[0], lines[lines.len() - 1]]);
    let [columns, rows] = lines.each_ref().map(Vec::len);
    let mut deviations: Vec<Vec<Option<[f64; 2]>>> = vec![vec![None; columns]; rows];
    for point in points {
        let mut place = [0; 2];
        for (part, name) in ["x", "y"].into_iter().enumerate() {
            let [from, to] = ranges[part];
            let step = (to - from) / (lines[part].len() - 1) as f64;
            let value = point.values[part];
            let at = ((value - from) / step).round();
            if (value - from - at * step).abs() > UNEVEN * step {
                let message = format!(
                    "{name} = {value} m is on no line of the grid, whose {} lines from {from} m to {to} m \
                     are {step} m apart",
                    lines[part].len()
                );
                let help = "measure at even distances; a place is written alike in all its lines";
                refuse(point.span, message, help, diagnostics);
                return None;
            }
            place[part] = at as usize;
        }
        let [column, row] = place;
        if deviations[row][column].replace([point.values[2], point.values[3]]).is_some() {
            let [x, y, ..] = point.values;
            let message = format!("the point x = {x} m, y = {y} m stands twice");
            refuse(point.span, message, "keep one of them", diagnostics);
            return None;
        }
    }
    let at = |range: [f64; 2], line: usize, count: usize| {
        range[0] + (range[1] - range[0]) * line as f64 / (count - 1) as f64
    };
    let mut whole = Vec::with_capacity(rows);
    for (row, line) in deviations.into_iter().enumerate() {
        let mut values = Vec::with_capacity(columns);
        for (column, value) in line.into_iter().enumerate() {
            let Some(value) = value else {
                let (x, y) = (at(ranges[0], column, columns), at(ranges[1], row, rows));
                let message = format!("the point x = {x} m, y = {y} m of the grid is missing");
                refuse(end, message, "give every point of the grid a line", diagnostics);
                return None;
            };
            values.push(value);
        }
        whole.push(values);
    }
    Some(Grid { ranges: ranges.map(|range| (range, file)), deviations: whole, place: file })
}

/// The different values of x or y, in order [m].
fn distinct(points: &[Point], part: usize) -> Vec<f64> {
    let mut values: Vec<f64> = points.iter().map(|point| point.values[part]).collect();
    values.sort_by(f64::total_cmp);
    values.dedup_by(|next, last| *next - *last <= SAME);
    values
}

fn refuse(span: Span, message: String, help: &str, diagnostics: &mut Diagnostics) {
    diagnostics.refuse(ProblemKind::Contradiction, span, message, Some(help.to_owned()));
}
