//! From the tables of a job, and the files that they name, to a composition.

use std::path::{Path, PathBuf};

use graphics::order::{Stroke, arrange};
use graphics::{Contour, FileRecipe};
use kurbo::Point;
use machine::Machine;
use machine::document::{Diagnostics, Named, Spanned};
use nalgebra::Vector3;

use super::layers::{Content, Drawn, Layer, Layers, Placed};
use super::recipe::{Defaults, Way, recipe};
use super::rows::Rows;
use super::serial::Serial;
use super::source::Source;
use super::tables::{DrawingTable, FrameTable, LayerTable, OrderTable, OrderWord};
use super::{Composition, Mark, MarkShape, Recipe, Section, frame, middle, placement};
use crate::drawing::{Note, Power};
use crate::job::JobError;
use crate::job::files::JobFiles;
use crate::job::room::Room;
use crate::job::whole::whole;

/// The most repetitions of a job.
const MOST_REPEATS: u64 = 100_000;

/// What a job composes.
pub(in crate::job) struct Parts<'a> {
    pub(in crate::job) drawings: Vec<Part<'a>>,
    pub(in crate::job) layers: Option<&'a Named<LayerTable>>,
    pub(in crate::job) order: Option<&'a OrderTable>,
    pub(in crate::job) frame: Option<&'a FrameTable>,
    pub(in crate::job) defaults: Defaults,
    /// Whether it lies on the machine as it is drawn, with a level tool: not on a surface, nor turned.
    pub(in crate::job) is_level: bool,
}

/// One drawing.
pub(in crate::job) struct Part<'a> {
    pub(in crate::job) table: &'a DrawingTable,
    /// The name of its file where that is the job itself, whose lines are told then.
    pub(in crate::job) file: Option<&'a Path>,
}

/// What came of it.
pub(in crate::job) struct Composed {
    pub(in crate::job) composition: Composition,
    /// Where it has room, where it says no place of its own.
    pub(in crate::job) room: Room,
    pub(in crate::job) notes: Vec<Note>,
    /// The files that were read.
    pub(in crate::job) files: Vec<PathBuf>,
}

/// Composes `parts` with the files of the job; what is wrong with the tables goes to `diagnostics`.
///
/// # Errors
/// Where a file cannot be read.
pub(in crate::job) fn compose(
    parts: &Parts<'_>,
    job_files: &JobFiles,
    machine: &Machine,
    diagnostics: &mut Diagnostics,
) -> Result<Composed, JobError> {
    let mut notes = Vec::new();
    let mut files = Vec::new();
    let mut layers = Layers::new(parts.layers, diagnostics);
    let mut recipes: Vec<Vec<FileRecipe>> = Vec::new();
    for (number, part) in parts.drawings.iter().enumerate() {
        let table = part.table;
        let line = diagnostics.position(table.span).map_or(0, |(line, _)| line as u64);
        let layer = layer_of(table, &layers, diagnostics);
        let count = placement::count(table, diagnostics);
        let Some(serial) = serial(table, job_files, count, diagnostics) else { continue };
        let csv = table.serial.as_ref().and_then(|serial| serial.csv.as_ref());
        files.extend(csv.map(|file| job_files.path(&file.value)));
        let Some(source) = Source::of(part, job_files, diagnostics) else { continue };
        files.extend(source.file().map(|name| job_files.path(name)));
        let first = source.graphic(&serial, 0, job_files, diagnostics)?;
        notes.extend(first.notes.iter().map(|note| Note {
            line: if part.file.is_some() { note.line } else { line },
            text: source.note(&note.text),
        }));
        let home = Vector3::from(machine.home);
        let Some(places) = placement::places(table, &first, home, diagnostics) else {
            notes.push(Note { line, text: source.note("it draws nothing") });
            recipes.push(Vec::new());
            continue;
        };
        recipes.push(first.recipes.clone());
        let mut graphic = first;
        for (place, flat) in places.flat.iter().enumerate() {
            if place > 0 && source.changes() {
                graphic = source.graphic(&serial, place, job_files, diagnostics)?;
            }
            layers.add(&Placed {
                graphic: &graphic,
                drawing: number,
                flat: *flat,
                height: places.height,
                line: part.file.is_none().then_some(line),
                layer,
            });
        }
    }
    notes.extend(
        layers
            .empty()
            .map(|name| Note { line: 0, text: format!("nothing is on the layer `{name}`") }),
    );
    let mut contents = layers.take();
    let repeat = parts
        .order
        .and_then(|order| whole(&order.repeat, 1..=MOST_REPEATS, "repeat", diagnostics))
        .unwrap_or(1);
    let mut maker = Maker {
        order: parts.order.map_or(OrderWord::Shortest, |order| order.by.value),
        at: Point::new(machine.home[0], machine.home[1]),
        saved: [0.0; 2],
        notes,
    };
    let declared: Vec<Way> = layers
        .tables()
        .map(|table| {
            recipe(Some(table), None, &parts.defaults, machine, diagnostics, &mut maker.notes)
        })
        .collect();
    let outward = |layer: Layer| match layer {
        Layer::Declared(index) => declared[index].kerf.max(0.0) / 2.0,
        Layer::OfFile(drawing, index) => {
            let recipe = recipes.get(drawing).and_then(|all| all.get(index));
            recipe.and_then(|recipe| recipe.kerf).map_or(0.0, |offset| offset.max(0.0))
        }
        Layer::Rest => 0.0,
    };
    let is_placed = parts.drawings.iter().any(|part| part.table.at.is_some());
    let room = match (parts.is_level, is_placed) {
        (false, _) => Room::AtHome,
        (true, true) => middle::too_large(&contents, outward, machine),
        (true, false) => middle::find_room(&mut contents, outward, machine, &mut maker.notes),
    };
    let mut sections = Vec::new();
    if let Some(table) = parts.frame {
        sections.extend(maker.frame(table, contents.values(), &parts.defaults));
    } else {
        for (layer, content) in contents {
            let of_file = match layer {
                Layer::Declared(index) => {
                    let name = layers.names().nth(index).map(str::to_owned);
                    sections.extend(maker.section(name, content, &declared[index]));
                    continue;
                }
                Layer::OfFile(drawing, index) => {
                    let recipe = recipes.get(drawing).and_then(|all| all.get(index));
                    recipe.zip(parts.drawings.get(drawing).map(|part| part.table.span))
                }
                Layer::Rest => None,
            };
            let way =
                recipe(None, of_file, &parts.defaults, machine, diagnostics, &mut maker.notes);
            let name = of_file.map(|(file, _)| file.name.clone());
            sections.extend(maker.section(name, content, &way));
        }
    }
    maker.note_saved();
    let composition = Composition {
        is_frame: parts.frame.is_some(),
        sections: sections.into(),
        frequency: parts.defaults.frequency,
        repeat: repeat as u32,
    };
    Ok(Composed { composition, room, notes: maker.notes, files })
}

/// The layer that the drawing of `table` says it is on.
fn layer_of(
    table: &DrawingTable,
    layers: &Layers<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<usize> {
    let Spanned { value: name, span, .. } = table.layer.as_ref()?;
    let found = layers.named(name);
    if found.is_none() {
        let known: Vec<&str> = layers.names().collect();
        let help = match machine::document::nearest(name, layers.names()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if known.is_empty() => format!("add a table [layers.{name}]"),
            None => format!("layers of this job are {}", known.join(", ")),
        };
        diagnostics.contradict(*span, format!("there is no layer `{name}`"), &help);
    }
    found
}

fn serial(
    table: &DrawingTable,
    job_files: &JobFiles,
    places: usize,
    diagnostics: &mut Diagnostics,
) -> Option<Serial> {
    match &table.serial {
        Some(serial) => Serial::new(serial, job_files, places, diagnostics),
        None => Some(Serial::plain()),
    }
}

/// Makes sections, one after the other.
pub(super) struct Maker {
    order: OrderWord,
    /// Where the tool is [m].
    at: Point,
    /// The way in the dark as drawn, and as arranged [m].
    saved: [f64; 2],
    pub(super) notes: Vec<Note>,
}

impl Maker {
    /// What is on a layer: images, then fills, then lines.
    fn section(&mut self, layer: Option<String>, content: Content, way: &Way) -> Option<Section> {
        let mut marks = Vec::new();
        for Drawn { shape, height, line } in content.images {
            match Rows::new(shape, &way.image) {
                Ok(rows) => marks.push(Mark { shape: MarkShape::Rows(rows), height, line }),
                Err(error) => {
                    let text = format!("the image is left out: {error}");
                    self.notes.push(Note { line, text });
                }
            }
        }
        for areas in content.areas.chunk_by(|one, other| one.height == other.height) {
            marks.extend(self.fill(areas, way));
        }
        let lines = self.cut(content.lines, way);
        marks.extend(self.arranged(&lines));
        if let Some(last) = marks.last() {
            self.at = last.shape.ends()[1];
        }
        (!marks.is_empty()).then_some(Section { layer, recipe: way.recipe, marks })
    }

    /// Contours in the order of marking.
    pub(super) fn arranged(&mut self, lines: &[Drawn<Contour>]) -> Vec<Mark> {
        let mark = |drawn: &Drawn<Contour>, contour: Contour| Mark {
            shape: MarkShape::Contour(contour),
            height: drawn.height,
            line: drawn.line,
        };
        let as_drawn = || lines.iter().map(|drawn| mark(drawn, drawn.shape.clone())).collect();
        if self.order == OrderWord::File {
            return as_drawn();
        }
        let strokes: Vec<Stroke> =
            lines.iter().map(|drawn| Stroke::of_contour(&drawn.shape, 0)).collect();
        // What has no place is refused when it is planned.
        let Ok(arrangement) = arrange(&strokes, self.at) else { return as_drawn() };
        self.saved[0] += arrangement.travel_before;
        self.saved[1] += arrangement.travel_after;
        let visits = arrangement.visits.iter();
        visits
            .map(|visit| {
                let drawn = &lines[visit.stroke];
                mark(drawn, visit.entry.apply(&drawn.shape))
            })
            .collect()
    }

    /// Shows where everything lies.
    fn frame<'a>(
        &mut self,
        table: &FrameTable,
        contents: impl Iterator<Item = &'a Content> + Clone,
        defaults: &Defaults,
    ) -> Option<Section> {
        let lines = contents.clone().flat_map(|content| &content.lines).map(|drawn| &drawn.shape);
        let areas = contents.clone().flat_map(|content| &content.areas);
        let areas = areas.flat_map(|drawn| &drawn.shape.contours);
        let images = contents.clone().flat_map(|content| &content.images);
        let heights = contents.flat_map(|content| {
            let lines = content.lines.iter().map(|drawn| drawn.height);
            let areas = content.areas.iter().map(|drawn| drawn.height);
            lines.chain(areas).chain(content.images.iter().map(|drawn| drawn.height))
        });
        let height = heights.reduce(f64::max)?;
        let images = images.map(|drawn| drawn.shape.bounds());
        let corners = frame::around(table.shape.value, lines.chain(areas), images);
        let (first, others) = corners.split_first()?;
        let recipe = Recipe {
            speed: Some(table.speed.value),
            power: Power {
                level: table.power.as_ref().map_or(0.0, |power| power.value),
                ..defaults.power
            },
            passes: 1,
            focus: 0.0,
            focus_step: 0.0,
            air: false,
            frequency: defaults.frequency,
        };
        let shape = match &table.power {
            None => MarkShape::Frame(corners),
            Some(_) => MarkShape::Contour(Contour {
                start: *first,
                segments: others.iter().map(|corner| graphics::Segment::Line(*corner)).collect(),
                is_closed: true,
            }),
        };
        self.notes.push(Note {
            line: 0,
            text: "only the frame is shown, nothing else marked".to_owned(),
        });
        Some(Section { layer: None, recipe, marks: vec![Mark { shape, height, line: 0 }] })
    }

    /// Tells how much way in the dark the order saves.
    fn note_saved(&mut self) {
        let [drawn, arranged] = self.saved;
        if arranged < drawn {
            let text = format!(
                "ordered: {:.0} mm of way in the dark instead of {:.0} mm, {:.0} % less",
                arranged * 1e3,
                drawn * 1e3,
                (1.0 - arranged / drawn) * 100.0
            );
            self.notes.push(Note { line: 0, text });
        }
    }
}
