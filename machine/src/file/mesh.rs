//! The mesh of a frame: what the tool was measured to be off by, in the machine file or in a file beside it.

use super::mesh_file;
use crate::document::{Diagnostics, ProblemKind, Quantity, Span, Spanned};
use crate::frame::Mesh;
use crate::frame::mesh::MeshError;
use crate::limits::WorkArea;
use crate::quantity as unit;
use crate::table;

/// What two ways of writing one place may differ by [m].
const ROUNDING: f64 = 1e-9;

type Signed<K> = Quantity<K>;
type Rows = Vec<Vec<Signed<unit::Length>>>;

table! {
    /// Where the tool really was, less where it should have been, over a grid of even distances that
    /// covers the area. A smooth surface goes through all values. Given here, or in a file.
    pub struct MeshTable {
        /// A file of comma-separated values beside the machine file, with a line for each point, in place of
        /// all other keys. Its first line names the columns: `x [mm],y [mm],dx [um],dy [um]`.
        pub file: Option<Spanned<String>>,
        /// First and last column of the grid.
        pub x: Option<[Signed<unit::Length>; 2]>,
        /// First and last row of the grid.
        pub y: Option<[Signed<unit::Length>; 2]>,
        /// Deviations in x: a list for each row, the first one at the first y, with a value for each
        /// column. 0 when left out.
        pub dx: Option<Vec<Vec<Signed<unit::Length>>>>,
        /// Deviations in y.
        pub dy: Option<Vec<Vec<Signed<unit::Length>>>>,
    }
}

/// Deviations over a grid.
pub(super) struct Grid {
    /// First and last column, first and last row [m], and where they are said.
    pub(super) ranges: [([f64; 2], Span); 2],
    /// In x and y, row by row [m].
    pub(super) deviations: Vec<Vec<[f64; 2]>>,
    /// Where the deviations stand.
    pub(super) place: Span,
}

/// The surface of `table` over an `area`; refuses one that is none, or does not cover the area.
pub(super) fn surface(
    table: &MeshTable,
    area: &WorkArea,
    diagnostics: &mut Diagnostics,
) -> Option<Mesh> {
    let grid = match &table.file {
        Some(file) => of_file(table, file, diagnostics)?,
        None => of_table(table, diagnostics)?,
    };
    let mut is_sound = true;
    for (row, (name, (range, span))) in ["x", "y"].into_iter().zip(grid.ranges).enumerate() {
        let [from, to] = range;
        let (lower, upper) = (area.lower[row], area.upper[row]);
        let covers = from < to && from <= lower + ROUNDING && to >= upper - ROUNDING;
        if !covers {
            is_sound = false;
            diagnostics.contradict(
                span,
                format!(
                    "the mesh reaches from {name} = {from} m to {to} m, and the area from {lower} m to \
                     {upper} m"
                ),
                "measure all of the area, and write [first, last]",
            );
        }
    }
    if !is_sound {
        return None;
    }
    let [x, y] = grid.ranges.map(|(range, _)| range);
    Mesh::new(x, y, &grid.deviations).map_err(|error| refuse(error, grid.place, diagnostics)).ok()
}

fn of_file(
    table: &MeshTable,
    file: &Spanned<String>,
    diagnostics: &mut Diagnostics,
) -> Option<Grid> {
    let ends = [table.x, table.y].into_iter().flatten().map(|range| range[0].span);
    let lists = [&table.dx, &table.dy].into_iter().flatten();
    let values = lists.map(|rows| rows.iter().flatten().next().map_or(table.span, |at| at.span));
    let others: Vec<Span> = ends.chain(values).collect();
    for span in &others {
        diagnostics.contradict(
            *span,
            "a mesh has its values here or in a file, and this one names a `file`".to_owned(),
            "leave out `x`, `y`, `dx` and `dy`, or `file`",
        );
    }
    let grid = mesh_file::grid(file, diagnostics)?;
    others.is_empty().then_some(grid)
}

fn of_table(table: &MeshTable, diagnostics: &mut Diagnostics) -> Option<Grid> {
    let mut range = |key: &str, given: Option<[Signed<unit::Length>; 2]>| {
        if given.is_none() {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                table.span,
                format!("`{key}` is missing in the table `mesh`"),
                Some(format!("add `{key} = [\"0 mm\", \"300 mm\"]`, or `file`")),
            );
        }
        given.map(|[from, to]| ([from.value, to.value], from.span))
    };
    let (x, y) = (range("x", table.x), range("y", table.y));
    let ranges = [x?, y?];
    let size = |rows: &Rows| (rows.len(), rows.first().map_or(0, Vec::len));
    let lists = [&table.dx, &table.dy].map(Option::as_ref);
    let Some(given) = lists.into_iter().flatten().next() else {
        diagnostics.contradict(
            table.span,
            "a mesh without deviations has no effect".to_owned(),
            "add `dx` or `dy`, a list of values for each row, or `file`",
        );
        return None;
    };
    let (rows, columns) = size(given);
    let even = |list: &Rows| list.len() == rows && list.iter().all(|row| row.len() == columns);
    let place = given.iter().flatten().next().map_or(table.span, |value| value.span);
    if !lists.into_iter().flatten().all(even) {
        diagnostics.contradict(
            place,
            "the rows of the mesh are not all of one length".to_owned(),
            "give `dx` and `dy` as many rows as each other, and every row as many values",
        );
        return None;
    }
    let value = |list: Option<&Rows>, row: usize, column: usize| {
        list.map_or(0.0, |list| list[row][column].value)
    };
    let deviations = (0..rows)
        .map(|row| (0..columns).map(|column| lists.map(|list| value(list, row, column))).collect())
        .collect();
    Some(Grid { ranges, deviations, place })
}

fn refuse(error: MeshError, span: Span, diagnostics: &mut Diagnostics) {
    match error {
        MeshError::Lines(count) => diagnostics.contradict(
            span,
            format!("a mesh of {count} lines in one direction is none"),
            &format!("give {} to {} rows, and as many values in each", Mesh::FEWEST, Mesh::MOST),
        ),
        MeshError::Steep(slope) => diagnostics.contradict(
            span,
            format!(
                "the deviations of the mesh change by {:.0} µm in a millimetre, and a correction by \
                 {:.0} µm at most",
                slope * 1e3,
                Mesh::STEEPEST * 1e3
            ),
            "look for a wrong value or unit; what is turned or scaled is no mesh",
        ),
    }
}
