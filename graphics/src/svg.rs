//! SVG drawings, by `usvg`: what it draws, in metres and with y up, in the colours and on the layers of the file.
//!
//! Circles, ellipses, rounded rectangles and the arcs of paths stay arcs; path data keeps its full precision.
//! Transforms have single precision as `usvg` gives them: 0.02 µm at 300 mm. A pixel is 1/96 inch.

mod basic;
mod path;
mod source;
#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};
use std::io::Read as _;
use std::rc::Rc;
use std::sync::{Arc as Shared, Mutex};

use kurbo::{Affine, BezPath, Point, Rect};
use roxmltree::Document;
use usvg::tiny_skia_path::PathSegment;

use crate::ReadError;
use crate::read::images::{Images, Placed};
use crate::read::notes::Notes;
use crate::read::pen::{Budget, Pen};
use crate::read::xml::{self, Lines};
use crate::read::{MOST_BYTES, bounds, is_finite};
use crate::shape::{Colour, Contour, Fill, FillRule, Graphic, Raster, Segment, Shape};
use crate::text::Installed;
use path::Drawn;
use source::Source;

/// Metres in a pixel.
const PIXEL: f64 = 0.0254 / 96.0;

/// How far beyond a clip path something may be to count as inside [m].
const CLIPPED: f64 = 1e-6;

/// Distances that single precision rounds by more than this are told [m].
const ROUNDED: f64 = 1e-6;

/// What is not honoured is switched off, so that it takes no time: it is named from the source.
const STYLE: &str = "*{mask:none!important;filter:none!important;marker-start:none!important;\
                     marker-mid:none!important;marker-end:none!important;\
                     stroke-dasharray:none!important}\
                     clipPath,clipPath *{clip-path:none!important}";

/// Reads an SVG file, compressed or not.
///
/// # Errors
///
/// Where it is no SVG file, or exceeds a bound of [`crate::read`].
pub fn read(bytes: &[u8]) -> Result<Graphic, ReadError> {
    if bytes.starts_with(&[0x1f, 0x8b]) {
        return read_text(&crate::read::text(&inflate(bytes)?)?, Installed::here);
    }
    read_text(&crate::read::text(bytes)?, Installed::here)
}

/// What a compressed file holds, up to [`MOST_BYTES`].
fn inflate(bytes: &[u8]) -> Result<Vec<u8>, ReadError> {
    let mut inflated = Vec::new();
    let mut reader = flate2::read::GzDecoder::new(bytes).take(MOST_BYTES as u64 + 1);
    reader.read_to_end(&mut inflated).map_err(|error| {
        ReadError::new(format!("the compressed file is damaged: {error}"), "save it again")
    })?;
    if inflated.len() > MOST_BYTES {
        return Err(crate::read::too_large());
    }
    Ok(inflated)
}

/// Reads an SVG document, its text in `fonts`.
fn read_text<'f>(text: &str, fonts: impl FnOnce() -> &'f Installed) -> Result<Graphic, ReadError> {
    let document = xml::parse(text)?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        return Err(ReadError::new(
            format!("the file's root element is <{}> and not <svg>", root.tag_name().name()),
            "save the drawing as SVG",
        ));
    }
    let lines = Lines::new(text);
    let mut notes = Notes::default();
    let mut source = Source::new(&document, &lines, &mut notes)?;
    let page = source.page(&mut notes);
    let stand_in = source.stand_in();
    let fonts = has_element(&document, "text").then(fonts);
    let tree = resolve(&stand_in, fonts, &mut notes)?;
    let (width, height) = (f64::from(tree.size().width()), f64::from(tree.size().height()));
    let has_clones = has_element(&document, "use");
    let mut walk = Walk {
        source: &mut source,
        notes: &mut notes,
        budget: Budget::default(),
        shapes: Vec::new(),
        images: Images::default(),
        known: has_clones.then(HashMap::new),
    };
    let to_metres = Affine::new([PIXEL, 0.0, 0.0, -PIXEL, 0.0, height * PIXEL]);
    walk.group(tree.root(), to_metres, &Place::default())?;
    let (mut shapes, mut images) = (walk.shapes, walk.images.all);
    source.name_left_out(&mut notes);
    let page = page.then(|| Rect::new(0.0, 0.0, width * PIXEL, height * PIXEL));
    if page.is_none() {
        let all = Graphic { shapes, images, ..Graphic::default() };
        (shapes, images) = from_lowest(all);
    }
    Ok(Graphic { shapes, images, page, notes: notes.finish(), ..Graphic::default() })
}

/// Shapes and images without a page, their lowest point at 0.
fn from_lowest(all: Graphic) -> (Vec<Shape>, Vec<Raster>) {
    let Some(lowest) = all.bounds().map(|all| all.y0).filter(|lowest| lowest.is_finite()) else {
        return (all.shapes, all.images);
    };
    let by = Affine::translate((0.0, -lowest));
    let shape = |shape: Shape| Shape {
        contours: shape.contours.iter().map(|contour| contour.transformed(by)).collect(),
        ..shape
    };
    let image = |image: Raster| Raster { placement: by * image.placement, ..image };
    (all.shapes.into_iter().map(shape).collect(), all.images.into_iter().map(image).collect())
}

fn has_element(document: &Document<'_>, name: &str) -> bool {
    document.descendants().any(|node| node.tag_name().name() == name)
}

/// The tree that `usvg` makes: no file is followed, and fonts that are not there are named.
fn resolve(
    text: &str,
    fonts: Option<&Installed>,
    notes: &mut Notes,
) -> Result<usvg::Tree, ReadError> {
    let replaced = Mutex::new(BTreeSet::new());
    let select = usvg::FontResolver::default_font_selector();
    let mut options = usvg::Options {
        style_sheet: Some(STYLE.to_owned()),
        image_href_resolver: usvg::ImageHrefResolver {
            resolve_data: Box::new(|kind, data, _| match kind {
                "image/png" => Some(usvg::ImageKind::PNG(data)),
                "image/jpeg" | "image/jpg" => Some(usvg::ImageKind::JPEG(data)),
                "image/gif" => Some(usvg::ImageKind::GIF(data)),
                "image/webp" => Some(usvg::ImageKind::WEBP(data)),
                _ => None,
            }),
            resolve_string: Box::new(|_, _| None),
        },
        ..usvg::Options::default()
    };
    if let Some(fonts) = fonts {
        options.fontdb = Shared::clone(&fonts.faces);
        let built_in = fonts.built_in;
        let replaced = &replaced;
        options.font_resolver.select_font = Box::new(move |font, database| {
            let found = select(font, database).or(built_in);
            let named = found.and_then(|id| database.face(id)).map(|face| &face.families);
            let is_left = found.is_some() && found == built_in;
            let wanted = font.families().iter().find_map(|family| match family {
                usvg::FontFamily::Named(name) => Some(name.clone()),
                // A kind of font that is not there either.
                kind => is_left.then(|| kind.to_string()),
            });
            if let (Some(wanted), Ok(mut replaced)) = (wanted, replaced.lock()) {
                let found = named.and_then(|names| names.first()).map(|name| name.0.as_str());
                let is_one_of = font.families().iter().any(|family| {
                    matches!(family, usvg::FontFamily::Named(name)
                        if named.is_some_and(|names| names.iter().any(|known| known.0 == *name)))
                });
                if !is_one_of {
                    replaced.insert((wanted, found.map(str::to_owned)));
                }
            }
            found
        });
    }
    let tree = usvg::Tree::from_str(text, &options).map_err(|error| match error {
        usvg::Error::InvalidSize => ReadError::new(
            "the drawing's width, height or viewBox is not above zero",
            "set the size of its page",
        ),
        usvg::Error::ElementsLimitReached
        | usvg::Error::ParsingFailed(roxmltree::Error::NodesLimitReached) => xml::too_many(),
        error => ReadError::new(format!("the drawing cannot be read: {error}"), "save it again"),
    });
    drop(options);
    for (wanted, found) in replaced.into_inner().unwrap_or_default() {
        let instead = match found {
            Some(found) => format!("text is set in \"{found}\""),
            None => "its text is left out".to_owned(),
        };
        notes.add(format!("the font \"{wanted}\" is not installed: {instead}"), 0);
    }
    tree
}

/// What holds for the elements of a group.
#[derive(Debug, Clone, Default)]
struct Place {
    layer: Option<Shared<str>>,
    line: u64,
    is_invisible: bool,
    /// Text, whose curves are no basic shapes.
    is_text: bool,
}

struct Walk<'s, 'a, 'input> {
    source: &'s mut Source<'a, 'input>,
    notes: &'s mut Notes,
    budget: Budget,
    shapes: Vec<Shape>,
    images: Images,
    /// Path data by number, where it may be drawn several times.
    known: Option<HashMap<usize, Rc<Drawn>>>,
}

impl Walk<'_, '_, '_> {
    fn group(
        &mut self,
        group: &usvg::Group,
        before: Affine,
        place: &Place,
    ) -> Result<(), ReadError> {
        let by = before * affine(group.transform());
        let place = self.place(group, place);
        let first = self.shapes.len();
        for node in group.children() {
            match node {
                usvg::Node::Group(group) => self.group(group, by, &place)?,
                usvg::Node::Path(path) => self.path(path, by, &place)?,
                usvg::Node::Text(text) => {
                    let line = self.line_of(text.id()).unwrap_or(place.line);
                    let place = Place { line, is_text: true, ..place.clone() };
                    self.group(text.flattened(), by, &place)?;
                }
                usvg::Node::Image(image) => self.image(image, by, &place),
            }
        }
        if let Some(clip) = group.clip_path() {
            self.clip(clip, by, first)?;
        }
        Ok(())
    }

    fn image(&mut self, image: &usvg::Image, by: Affine, place: &Place) {
        let (usvg::ImageKind::PNG(file)
        | usvg::ImageKind::JPEG(file)
        | usvg::ImageKind::GIF(file)
        | usvg::ImageKind::WEBP(file)) = image.kind()
        else {
            return;
        };
        if place.is_invisible || !image.is_visible() {
            self.notes.add("what is hidden (visibility or opacity) is left out", place.line);
            return;
        }
        let (width, height) = (f64::from(image.size().width()), f64::from(image.size().height()));
        let square = Affine::new([width, 0.0, 0.0, -height, 0.0, height]);
        let placed = Placed { layer: place.layer.clone(), recipe: None, line: place.line };
        self.images.add(file, by * square, placed, self.notes);
    }

    fn place(&mut self, group: &usvg::Group, place: &Place) -> Place {
        let mut place = place.clone();
        if let Some(number) = self.source.number_of(group.id())
            && let Some(node) = self.source.take(number)
        {
            place.line = self.source.line(node);
            if let Some(layer) = source::layer(node) {
                place.layer = Some(layer.into());
            }
        }
        let opacity = group.opacity().get();
        place.is_invisible |= opacity == 0.0;
        if opacity > 0.0 && opacity < 1.0 {
            self.notes.add("transparency is left out: colours are as if opaque", place.line);
        }
        place
    }

    fn line_of(&mut self, id: &str) -> Option<u64> {
        let number = self.source.number_of(id)?;
        self.source.take(number).map(|node| self.source.line(node))
    }

    fn path(&mut self, path: &usvg::Path, by: Affine, place: &Place) -> Result<(), ReadError> {
        let (contours, line) = self.contours(path, by, place)?;
        let line = line.unwrap_or(place.line);
        if contours.is_empty() {
            return Ok(());
        }
        let stroke = path.stroke().and_then(|it| self.colour(it.paint(), it.opacity().get(), line));
        let fill = path.fill().and_then(|fill| {
            let colour = self.colour(fill.paint(), fill.opacity().get(), line)?;
            let rule = match fill.rule() {
                usvg::FillRule::NonZero => FillRule::NonZero,
                usvg::FillRule::EvenOdd => FillRule::EvenOdd,
            };
            Some(Fill { colour, rule })
        });
        let has_paint = stroke.is_some() || fill.is_some();
        if !has_paint {
            self.notes.add("a shape with neither line nor fill is left out", line);
        } else if place.is_invisible || !path.is_visible() {
            self.notes.add("what is hidden (visibility or opacity) is left out", line);
        } else {
            let layer = place.layer.clone();
            self.shapes.push(Shape { contours, stroke, fill, layer, recipe: None, line });
        }
        Ok(())
    }

    /// The contours of a path, and its line where it is known.
    fn contours(
        &mut self,
        path: &usvg::Path,
        by: Affine,
        place: &Place,
    ) -> Result<(Vec<Contour>, Option<u64>), ReadError> {
        let number = match stand_in(path.data()) {
            Some(number) if !place.is_text => Some(number),
            _ => self.source.number_of(path.id()),
        };
        let node = number.and_then(|number| self.source.take(number));
        let line = node.map(|node| self.source.line(node));
        let data = node.and_then(|node| {
            let name = if node.tag_name().name() == "path" { "d" } else { "points" };
            Some((node.attribute(name)?, node.tag_name().name()))
        });
        let (contours, by) = match (number, data) {
            (Some(number), Some((text, name))) => {
                let drawn = self.draw(number, text, name);
                self.budget.spend(&drawn.contours)?;
                if drawn.is_faulty {
                    let text = "path data is at fault: it is drawn up to its fault";
                    self.notes.add(text, line.unwrap_or(place.line));
                }
                if drawn.points > 0 {
                    let text = "a path without a length is left out";
                    self.notes.add(text, line.unwrap_or(place.line));
                }
                let contours = drawn.contours.iter().map(|contour| contour.transformed(by));
                (contours.collect(), by)
            }
            _ => {
                let outline = outline(path.data());
                let basic = if place.is_text { None } else { basic::arcs(&outline) };
                let contours = basic.unwrap_or_else(|| from_outline(&outline));
                self.budget.spend(&contours)?;
                (contours.iter().map(|contour| contour.transformed(by)).collect::<Vec<_>>(), by)
            }
        };
        let kept: Vec<Contour> = contours.into_iter().filter(is_finite).collect();
        self.tell_rounding(by, line.unwrap_or(place.line));
        Ok((kept, line))
    }

    fn draw(&mut self, number: usize, text: &str, name: &str) -> Rc<Drawn> {
        let draw = || match name {
            "path" => Rc::new(path::data(text)),
            _ => Rc::new(path::points(text, name == "polygon")),
        };
        match &mut self.known {
            Some(known) => Rc::clone(known.entry(number).or_insert_with(draw)),
            None => draw(),
        }
    }

    /// Tells of coordinates so large that single precision is too coarse.
    fn tell_rounding(&mut self, by: Affine, line: u64) {
        let [.., x, y] = by.as_coeffs();
        if x.abs().max(y.abs()) * f64::from(f32::EPSILON) / 2.0 > ROUNDED {
            let text =
                "a place is more than 16 m from the page's corner, and is rounded by some µm";
            self.notes.add(text, line);
        }
    }

    fn colour(&mut self, paint: &usvg::Paint, opacity: f32, line: u64) -> Option<Colour> {
        let (colour, alpha) = match paint {
            usvg::Paint::Color(colour) => (*colour, 1.0),
            usvg::Paint::LinearGradient(gradient) => {
                self.notes.add("a gradient is taken as its first colour", line);
                gradient.stops().first().map(|stop| (stop.color(), stop.opacity().get()))?
            }
            usvg::Paint::RadialGradient(gradient) => {
                self.notes.add("a gradient is taken as its first colour", line);
                gradient.stops().first().map(|stop| (stop.color(), stop.opacity().get()))?
            }
            usvg::Paint::Pattern(_) => (usvg::Color::black(), 1.0),
        };
        let opacity = opacity * alpha;
        if opacity > 0.0 && opacity < 1.0 {
            self.notes.add("transparency is left out: colours are as if opaque", line);
        }
        let colour = Colour { red: colour.red, green: colour.green, blue: colour.blue };
        (opacity > 0.0).then_some(colour)
    }

    /// Honours a clip path that is an upright rectangle where nothing crosses it, and names it elsewhere.
    fn clip(&mut self, clip: &usvg::ClipPath, by: Affine, first: usize) -> Result<(), ReadError> {
        let inside = self.shapes.split_off(first);
        let by = by * affine(clip.transform());
        self.group(clip.root(), by, &Place::default())?;
        let clips = self.shapes.split_off(first);
        let rectangle = match clips.as_slice() {
            [clip] => upright(&clip.contours),
            _ => None,
        };
        let grown = rectangle.map(|rectangle| rectangle.inflate(CLIPPED, CLIPPED));
        for shape in inside {
            let Some(all) = bounds(&shape.contours) else { continue };
            match grown {
                Some(grown) if !touches(grown, all) => {
                    self.notes.add("what lies outside of its clip path is left out", shape.line);
                    continue;
                }
                Some(grown) if grown.union(all) == grown => {}
                _ => {
                    let text = "a clip path is not applied: what it hides is drawn";
                    self.notes.add(text, shape.line);
                }
            }
            self.shapes.push(shape);
        }
        Ok(())
    }
}

/// Whether two rectangles, which may have no width or no height, have a point in common.
fn touches(one: Rect, other: Rect) -> bool {
    one.x0 <= other.x1 && other.x0 <= one.x1 && one.y0 <= other.y1 && other.y0 <= one.y1
}

/// The rectangle that a contour is, where its sides are along x and y.
fn upright(contours: &[Contour]) -> Option<Rect> {
    let [contour] = contours else { return None };
    let all = bounds(contours)?;
    let mut at = contour.start;
    for segment in &contour.segments {
        let Segment::Line(end) = *segment else { return None };
        let is_side = [all.x0, all.x1].iter().any(|&x| same(at.x, x) && same(end.x, x))
            || [all.y0, all.y1].iter().any(|&y| same(at.y, y) && same(end.y, y));
        if !is_side {
            return None;
        }
        at = end;
    }
    (contour.segments.len() >= 4).then_some(all)
}

fn same(one: f64, other: f64) -> bool {
    (one - other).abs() <= CLIPPED
}

fn affine(by: usvg::Transform) -> Affine {
    Affine::new([by.sx, by.ky, by.kx, by.sy, by.tx, by.ty].map(f64::from))
}

/// The number of the element that a stand-in is for.
fn stand_in(path: &usvg::tiny_skia_path::Path) -> Option<usize> {
    let [origin, first, second] = path.points() else { return None };
    let is_one = *origin == usvg::tiny_skia_path::Point::from_xy(0.0, 0.0)
        && first.y == 1.0
        && second.y == 2.0
        && first.x == second.x
        && first.x >= 1.0;
    // Exact: the bound on elements is below 2²⁴.
    is_one.then_some(first.x as usize)
}

fn outline(path: &usvg::tiny_skia_path::Path) -> BezPath {
    let point = |at: usvg::tiny_skia_path::Point| Point::new(f64::from(at.x), f64::from(at.y));
    let mut outline = BezPath::new();
    for segment in path.segments() {
        match segment {
            PathSegment::MoveTo(to) => outline.move_to(point(to)),
            PathSegment::LineTo(to) => outline.line_to(point(to)),
            PathSegment::QuadTo(control, to) => outline.quad_to(point(control), point(to)),
            PathSegment::CubicTo(first, second, to) => {
                outline.curve_to(point(first), point(second), point(to));
            }
            PathSegment::Close => outline.close_path(),
        }
    }
    outline
}

fn from_outline(outline: &BezPath) -> Vec<Contour> {
    let mut pen = Pen::default();
    for element in outline.elements() {
        match *element {
            kurbo::PathEl::MoveTo(to) => pen.move_to(to),
            kurbo::PathEl::LineTo(to) => pen.line_to(to),
            kurbo::PathEl::QuadTo(control, to) => pen.quadratic_to(control, to),
            kurbo::PathEl::CurveTo(first, second, to) => pen.cubic_to(first, second, to),
            kurbo::PathEl::ClosePath => pen.close(),
        }
    }
    pen.take()
}
