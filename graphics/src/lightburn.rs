//! Projects of LightBurn, `.lbrn2` and `.lbrn`: shapes on their layers, and how those are marked.
//!
//! The format is not published; what is read here was seen in files. Lengths are millimetres, y points up from the
//! machine's origin.

mod path;
mod recipes;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::rc::Rc;

use core::f64::consts::{FRAC_PI_2, TAU};

use base64::Engine as _;
use kurbo::{Affine, Point, Vec2};
use messages::math;
use roxmltree::{Document, Node};

use crate::ReadError;
use crate::read::arcs::circular;
use crate::read::images::{Images, Placed};
use crate::read::is_finite;
use crate::read::notes::Notes;
use crate::read::pen::{Budget, Pen};
use crate::read::xml::{self, Lines, number};
use crate::shape::{Arc, Contour, FileMode, Fill, FillRule, Graphic, Shape};
use path::{Primitives, Vertex};
use recipes::{Recipes, colour};

/// Corners of a polygon: more are a mistake.
const MOST_CORNERS: f64 = 10_000.0;

/// Reads a LightBurn project.
///
/// # Errors
///
/// Where it is none, with the line, or exceeds a bound of [`crate::read`].
pub fn read(bytes: &[u8]) -> Result<Graphic, ReadError> {
    let text = crate::read::text(bytes)?;
    let document = xml::parse(&text)?;
    let root = document.root_element();
    if !root.has_tag_name("LightBurnProject") {
        return Err(ReadError::new(
            format!(
                "the file's root element is <{}> and not <LightBurnProject>",
                root.tag_name().name()
            ),
            "save the drawing as a LightBurn project",
        ));
    }
    let mut project = Project {
        lines: &Lines::new(&text),
        lists: Lists::new(&document),
        recipes: Recipes::new(root),
        notes: Notes::default(),
        budget: Budget::default(),
        shapes: Vec::new(),
        images: Images::default(),
    };
    let is_mirrored =
        |name| root.attribute(name).is_some_and(|value| value == "True" || value == "1");
    let (across, along) = (is_mirrored("MirrorX"), is_mirrored("MirrorY"));
    if across || along {
        let text = "the project counts from another corner of its machine: it is mirrored back, \
                    and its place is not known";
        project.notes.add(text, 1);
    }
    let sign = |is_mirrored: bool| if is_mirrored { -1e-3 } else { 1e-3 };
    project.children(root, Affine::scale_non_uniform(sign(across), sign(along)))?;
    for recipe in project.recipes.all.iter().filter(|recipe| recipe.is_hidden) {
        project.notes.add(format!("layer \"{}\" is not for output", recipe.name), 0);
    }
    Ok(Graphic {
        shapes: project.shapes,
        images: project.images.all,
        recipes: project.recipes.all,
        notes: project.notes.finish(),
        ..Graphic::default()
    })
}

/// Vertices and primitives that several shapes share, by their numbers.
#[derive(Debug, Default)]
struct Lists {
    vertices: HashMap<String, Rc<Vec<Vertex>>>,
    primitives: HashMap<String, Rc<Primitives>>,
}

impl Lists {
    fn new(document: &Document<'_>) -> Self {
        let mut lists = Self::default();
        for node in document.descendants().filter(Node::is_element) {
            if let Some(id) = node.attribute("VertID")
                && let Some(list) = own_vertices(node)
            {
                lists.vertices.insert(id.to_owned(), Rc::new(list));
            }
            if let Some(id) = node.attribute("PrimID")
                && let Some(list) = own_primitives(node)
            {
                lists.primitives.insert(id.to_owned(), Rc::new(list));
            }
        }
        lists
    }
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// The vertices in a shape itself; `None` where there are none, or at fault.
fn own_vertices(node: Node<'_, '_>) -> Option<Vec<Vertex>> {
    match child(node, "VertList") {
        Some(list) => path::packed_vertices(list.text().unwrap_or("")),
        None => path::vertices(node).filter(|list| !list.is_empty()),
    }
}

fn own_primitives(node: Node<'_, '_>) -> Option<Primitives> {
    match child(node, "PrimList") {
        Some(list) => path::packed_primitives(list.text().unwrap_or("")),
        None => path::primitives(node)
            .filter(|list| !matches!(list, Primitives::List(list) if list.is_empty())),
    }
}

/// The transform of a shape; `None` where it has none, or one that is at fault.
fn transform(node: Node<'_, '_>) -> Option<Affine> {
    let text = child(node, "XForm")?.text()?;
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|it| it.parse().ok()).collect();
    let numbers: [f64; 6] = numbers?.try_into().ok()?;
    numbers.iter().all(|number| number.is_finite()).then_some(Affine::new(numbers))
}

struct Project<'l> {
    lines: &'l Lines,
    lists: Lists,
    recipes: Recipes,
    notes: Notes,
    budget: Budget,
    shapes: Vec<Shape>,
    images: Images,
}

impl Project<'_> {
    fn children(&mut self, node: Node<'_, '_>, by: Affine) -> Result<(), ReadError> {
        for node in node.children().filter(|node| node.has_tag_name("Shape")) {
            self.shape(node, by)?;
        }
        Ok(())
    }

    fn shape(&mut self, node: Node<'_, '_>, above: Affine) -> Result<(), ReadError> {
        let line = self.lines.of(node.range().start);
        let own = transform(node);
        if own.is_none() && child(node, "XForm").is_some() {
            self.notes.add("a transform at fault is left out", line);
        }
        let by = above * own.unwrap_or_default();
        if node.attribute("PowerScale").is_some_and(|scale| scale.parse() != Ok(100.0)) {
            self.notes.add("the power scale of a single shape is left out", line);
        }
        let contours = match node.attribute("Type").unwrap_or("") {
            "Group" => {
                let inside = child(node, "Children").unwrap_or(node);
                return self.children(inside, by);
            }
            "Text" => match child(node, "BackupPath") {
                Some(outline) => {
                    // The outline has the text's place in its own transform, in newer files the text has it.
                    let inner = transform(outline).filter(|&inner| inner != Affine::IDENTITY);
                    let by = above * inner.or(own).unwrap_or_default();
                    self.path(outline, line).map(|contours| (contours, by))
                }
                None => {
                    self.notes
                        .add("text without an outline is left out: convert it to a path", line);
                    return Ok(());
                }
            },
            "Path" => self.path(node, line).map(|contours| (contours, by)),
            "Rect" => rectangle(node).map(|contours| (contours, by)),
            "Ellipse" => ellipse(node).map(|contours| (contours, by)),
            "Polygon" => {
                self.notes
                    .add("a polygon has its first corner to the right: check its direction", line);
                polygon(node).map(|contours| (contours, by))
            }
            "Bitmap" => {
                self.image(node, by, line);
                return Ok(());
            }
            kind => {
                let kind: String = kind.chars().take(30).collect();
                self.notes.add(format!("a shape of the type \"{kind}\" is left out"), line);
                return Ok(());
            }
        };
        let Some((contours, by)) = contours else {
            self.notes.add("a shape with numbers that do not fit is left out", line);
            return Ok(());
        };
        let layer = node.attribute("CutIndex").and_then(|index| index.trim().parse().ok());
        self.add(contours, by, layer.unwrap_or(0), line)
    }

    /// An image about its middle.
    fn image(&mut self, node: Node<'_, '_>, by: Affine, line: u64) {
        let size = number(node, "W").zip(number(node, "H"));
        let data = node.attribute("Data").unwrap_or("");
        let data: String = data.split_ascii_whitespace().collect();
        let file = base64::engine::general_purpose::STANDARD.decode(data).ok();
        let (Some((width, height)), Some(file)) = (size, file) else {
            self.notes.add("an image whose size or data is at fault is left out", line);
            return;
        };
        let square = Affine::new([width, 0.0, 0.0, height, -width / 2.0, -height / 2.0]);
        let layer = node.attribute("CutIndex").and_then(|index| index.trim().parse().ok());
        let layer = layer.unwrap_or(0);
        let placed = Placed {
            layer: Some(self.recipes.name(layer).into()),
            recipe: self.recipes.of(layer, true).first().copied(),
            line,
        };
        self.images.add(&file, by * square, placed, &mut self.notes);
    }

    /// One shape for each recipe of its layer.
    fn add(
        &mut self,
        contours: Vec<Contour>,
        by: Affine,
        index: usize,
        line: u64,
    ) -> Result<(), ReadError> {
        let recipes = self.recipes.of(index, false);
        let choices: Vec<Option<usize>> = match recipes.is_empty() {
            true => vec![None],
            false => recipes.into_iter().map(Some).collect(),
        };
        let contours: Vec<Contour> = contours.iter().map(|it| it.transformed(by)).collect();
        if contours.is_empty() || !contours.iter().all(is_finite) {
            return Ok(());
        }
        for recipe in choices {
            self.budget.spend(&contours)?;
            let mode = recipe.map_or(FileMode::Line, |place| self.recipes.all[place].mode);
            let colour = colour(index);
            let is_filled = matches!(mode, FileMode::Fill | FileMode::FillAndLine);
            self.shapes.push(Shape {
                contours: contours.clone(),
                stroke: (mode != FileMode::Fill).then_some(colour),
                fill: is_filled.then_some(Fill { colour, rule: FillRule::EvenOdd }),
                layer: Some(self.recipes.name(index).into()),
                recipe,
                line,
            });
        }
        Ok(())
    }

    fn path(&mut self, node: Node<'_, '_>, line: u64) -> Option<Vec<Contour>> {
        let shared = |id: &str| node.attribute(id).unwrap_or("");
        let vertices = match own_vertices(node) {
            Some(list) => Rc::new(list),
            None => self.lists.vertices.get(shared("VertID")).cloned()?,
        };
        let primitives = match own_primitives(node) {
            Some(list) => Rc::new(list),
            None => match self.lists.primitives.get(shared("PrimID")) {
                Some(list) => Rc::clone(list),
                None if child(node, "PrimList").is_some() => return None,
                None => {
                    self.notes
                        .add("a path that does not say how its corners join is drawn open", line);
                    Rc::new(Primitives::Open)
                }
            },
        };
        path::contours(&vertices, &primitives)
    }
}

/// A rectangle about its middle, with round corners where it has them.
fn rectangle(node: Node<'_, '_>) -> Option<Vec<Contour>> {
    let (width, height) = (number(node, "W")?, number(node, "H")?);
    if !(width > 0.0 && height > 0.0) {
        return None;
    }
    let (x, y) = (width / 2.0, height / 2.0);
    let radius = number(node, "Cr").unwrap_or(0.0).clamp(0.0, x.min(y));
    let mut pen = Pen::default();
    if radius <= 0.0 {
        pen.move_to(Point::new(-x, -y));
        for (x, y) in [(x, -y), (x, y), (-x, y)] {
            pen.line_to(Point::new(x, y));
        }
        pen.close();
        return Some(pen.take());
    }
    let (inner_x, inner_y) = (x - radius, y - radius);
    pen.move_to(Point::new(-inner_x, -y));
    let corners =
        [(inner_x, -inner_y), (inner_x, inner_y), (-inner_x, inner_y), (-inner_x, -inner_y)];
    for (number, (x, y)) in corners.into_iter().enumerate() {
        let arc = circular(Point::new(x, y), radius, (number as f64 - 1.0) * FRAC_PI_2, FRAC_PI_2);
        pen.line_to(arc.point(arc.start));
        pen.arc_to(arc, arc.point(arc.start + arc.sweep));
    }
    pen.close_here();
    Some(pen.take())
}

fn ellipse(node: Node<'_, '_>) -> Option<Vec<Contour>> {
    let (rx, ry) = (number(node, "Rx")?, number(node, "Ry")?);
    if !(rx > 0.0 && ry > 0.0) {
        return None;
    }
    let arc = Arc {
        centre: Point::ORIGIN,
        major: Vec2::new(rx, 0.0),
        minor: Vec2::new(0.0, ry),
        start: 0.0,
        sweep: TAU,
    };
    let mut pen = Pen::default();
    pen.move_to(Point::new(rx, 0.0));
    pen.arc_to(arc, Point::new(rx, 0.0));
    pen.close_here();
    Some(pen.take())
}

fn polygon(node: Node<'_, '_>) -> Option<Vec<Contour>> {
    let (rx, ry) = (number(node, "Rx")?, number(node, "Ry")?);
    let count = number(node, "N").filter(|count| (3.0..=MOST_CORNERS).contains(count))?.floor();
    if !(rx > 0.0 && ry > 0.0) {
        return None;
    }
    let mut pen = Pen::default();
    for corner in 0..count as u32 {
        let (sine, cosine) = math::sin_cos(TAU * f64::from(corner) / count);
        let at = Point::new(rx * cosine, ry * sine);
        match corner {
            0 => pen.move_to(at),
            _ => pen.line_to(at),
        }
    }
    pen.close();
    Some(pen.take())
}
