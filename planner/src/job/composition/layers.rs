//! Which shape is on which layer.

use std::collections::BTreeMap;

use graphics::{Contour, FileMode, FillRule, Graphic, Raster, Shape};
use machine::document::{Diagnostics, Named};

use super::colours::{Palette, WHITE};
use super::tables::{LayerTable, Mode};

/// A layer; they are marked in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Layer {
    /// Of the job file, by its place there.
    Declared(usize),
    /// Of a drawing's own file, by the drawing and the layer's place in it.
    OfFile(usize, usize),
    /// What is on none.
    Rest,
}

/// What is on one layer.
#[derive(Debug, Default)]
pub(super) struct Content {
    pub(super) lines: Vec<Drawn<Contour>>,
    pub(super) areas: Vec<Drawn<Area>>,
    pub(super) images: Vec<Drawn<Raster>>,
}

/// A shape in its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawn<T> {
    pub(super) shape: T,
    /// Machine frame [m].
    pub(super) height: f64,
    /// The line that asks for it, 0 for none.
    pub(super) line: u64,
}

/// What is filled.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Area {
    pub(super) contours: Vec<Contour>,
    pub(super) rule: FillRule,
    /// Whether it is dark; a white one covers what was filled before it.
    pub(super) is_dark: bool,
}

/// One drawing in one of its places.
pub(super) struct Placed<'a> {
    pub(super) graphic: &'a Graphic,
    /// Which drawing of the job it is, from 0.
    pub(super) drawing: usize,
    /// From its coordinates to the machine's [m].
    pub(super) flat: kurbo::Affine,
    /// Machine frame [m].
    pub(super) height: f64,
    /// The line that asks for all of it; `None` where its file's own lines do.
    pub(super) line: Option<u64>,
    /// The layer that all of it is on.
    pub(super) layer: Option<usize>,
}

/// The layers of a job.
pub(super) struct Layers<'a> {
    declared: &'a [(machine::document::Spanned<String>, LayerTable)],
    palettes: Vec<Palette>,
    contents: BTreeMap<Layer, Content>,
}

/// What of a shape is on a layer.
#[derive(Debug, Clone, Copy, Default)]
struct Parts {
    line: bool,
    fill: bool,
}

impl<'a> Layers<'a> {
    pub(super) fn new(
        declared: Option<&'a Named<LayerTable>>,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let declared = declared.map_or(&[][..], |named| &named.entries);
        let palettes =
            declared.iter().map(|(name, table)| Palette::new(name, table, diagnostics)).collect();
        Self { declared, palettes, contents: BTreeMap::new() }
    }

    /// The place of the declared layer called `name`.
    pub(super) fn named(&self, name: &str) -> Option<usize> {
        self.declared.iter().position(|(declared, _)| declared.value == name)
    }

    /// The names of the declared layers.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.declared.iter().map(|(name, _)| name.value.as_str())
    }

    /// Takes all of a drawing in.
    pub(super) fn add(&mut self, placed: &Placed<'_>) {
        for shape in &placed.graphic.shapes {
            self.add_shape(shape, placed);
        }
        for image in &placed.graphic.images {
            let layer = self.of(image.layer.as_deref(), None, image.recipe, placed);
            if self.mode(layer, placed) == Mode::Skip {
                continue;
            }
            let shape = Raster { placement: placed.flat * image.placement, ..image.clone() };
            let drawn = placed.drawn(shape, image.line);
            self.contents.entry(layer).or_default().images.push(drawn);
        }
    }

    fn add_shape(&mut self, shape: &Shape, placed: &Placed<'_>) {
        let name = shape.layer.as_deref();
        let mut found: BTreeMap<Layer, Parts> = BTreeMap::new();
        // A shape with neither line nor fill is a line of no colour.
        if shape.stroke.is_some() || shape.fill.is_none() {
            let layer = self.of(name, shape.stroke, shape.recipe, placed);
            found.entry(layer).or_default().line = true;
        }
        if let Some(fill) = shape.fill
            && fill.colour == WHITE
        {
            self.cover(shape, fill.rule, placed);
        } else if let Some(fill) = shape.fill {
            let layer = self.of(name, Some(fill.colour), shape.recipe, placed);
            found.entry(layer).or_default().fill = true;
        }
        for (layer, parts) in found {
            let made = match self.mode(layer, placed) {
                Mode::AsDrawn => parts,
                Mode::Line => Parts { line: true, fill: false },
                Mode::Fill => Parts { line: false, fill: true },
                Mode::FillAndLine => Parts { line: true, fill: true },
                Mode::Skip => continue,
            };
            let contours = shape.contours.iter().map(|contour| contour.transformed(placed.flat));
            let content = self.contents.entry(layer).or_default();
            if made.fill {
                let area = Area {
                    contours: contours.clone().collect(),
                    rule: shape.fill.map_or(FillRule::EvenOdd, |fill| fill.rule),
                    is_dark: true,
                };
                content.areas.push(placed.drawn(area, shape.line));
            }
            if made.line {
                content.lines.extend(contours.map(|contour| placed.drawn(contour, shape.line)));
            }
        }
    }

    /// Covers what was filled before, on all layers, with a white shape.
    fn cover(&mut self, shape: &Shape, rule: FillRule, placed: &Placed<'_>) {
        let contours: Vec<Contour> =
            shape.contours.iter().map(|contour| contour.transformed(placed.flat)).collect();
        for content in self.contents.values_mut().filter(|content| !content.areas.is_empty()) {
            let area = Area { contours: contours.clone(), rule, is_dark: false };
            content.areas.push(placed.drawn(area, shape.line));
        }
    }

    /// The layer of something with this `name` of a layer and this colour in its file.
    fn of(
        &self,
        name: Option<&str>,
        colour: Option<graphics::Colour>,
        recipe: Option<usize>,
        placed: &Placed<'_>,
    ) -> Layer {
        let declared = || self.palettes.iter().position(|palette| palette.holds(name, colour));
        match (placed.layer.or_else(declared), recipe) {
            (Some(index), _) => Layer::Declared(index),
            (None, Some(recipe)) => Layer::OfFile(placed.drawing, recipe),
            (None, None) => Layer::Rest,
        }
    }

    /// What is made of shapes on `layer`.
    fn mode(&self, layer: Layer, placed: &Placed<'_>) -> Mode {
        match layer {
            Layer::Declared(index) => self.declared[index].1.mode.value,
            Layer::Rest => Mode::AsDrawn,
            Layer::OfFile(_, index) => match placed.graphic.recipes.get(index) {
                Some(recipe) if recipe.is_hidden => Mode::Skip,
                Some(recipe) => match recipe.mode {
                    FileMode::Line => Mode::Line,
                    FileMode::Fill => Mode::Fill,
                    FileMode::FillAndLine => Mode::FillAndLine,
                    FileMode::Image => Mode::AsDrawn,
                },
                None => Mode::AsDrawn,
            },
        }
    }

    /// The tables of the declared layers.
    pub(super) fn tables(&self) -> impl Iterator<Item = &'a LayerTable> + use<'a> {
        self.declared.iter().map(|(_, table)| table)
    }

    /// Whether a declared layer has nothing on it, by name.
    pub(super) fn empty(&self) -> impl Iterator<Item = &str> {
        let names = self.declared.iter().enumerate();
        names
            .filter(|(index, (_, table))| {
                table.mode.value != Mode::Skip
                    && !self.contents.contains_key(&Layer::Declared(*index))
            })
            .map(|(_, (name, _))| name.value.as_str())
    }

    /// What is on each layer, in the order of marking.
    pub(super) fn take(&mut self) -> BTreeMap<Layer, Content> {
        core::mem::take(&mut self.contents)
    }
}

impl Placed<'_> {
    fn drawn<T>(&self, shape: T, line: u64) -> Drawn<T> {
        Drawn { shape, height: self.height, line: self.line.unwrap_or(line) }
    }
}
