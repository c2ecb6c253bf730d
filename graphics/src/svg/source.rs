//! The file as it is written, beside what `usvg` makes of it: lines, layers, path data in full precision, and
//! what it would leave out without a word.
//!
//! `usvg` resolves styles, transforms, symbols and text, but rounds path data to single precision, makes
//! curves of arcs, and takes its time to find the outlines of strokes. So it gets each path as a stand-in of
//! two lines which says the number of its element, and each other element with an id.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use roxmltree::{Document, Node, NodeId};

use crate::ReadError;
use crate::read::notes::Notes;
use crate::read::xml::{Lines, too_many};
use crate::read::{MOST_DEPTH, MOST_ELEMENTS};

const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";
const INKSCAPE: &str = "http://www.inkscape.org/namespaces/inkscape";

/// Characters of text: setting more would take long.
const MOST_TEXT: usize = 50_000;

/// Style rules times elements: each rule is tried at each element.
const MOST_MATCHES: usize = 50_000_000;

/// Elements whose children are drawn only where something refers to them.
const NOT_DRAWN: [&str; 8] =
    ["defs", "symbol", "clipPath", "mask", "pattern", "marker", "filter", "linearGradient"];

/// The elements of a file by number and by id.
#[derive(Debug)]
pub(super) struct Source<'a, 'input> {
    document: &'a Document<'input>,
    lines: &'a Lines,
    elements: Vec<Element>,
    by_id: HashMap<String, usize>,
    edits: Vec<Edit>,
}

#[derive(Debug, Clone)]
struct Element {
    node: NodeId,
    is_drawn: bool,
    /// Whether it stands where it would be drawn, and not in a definition.
    is_expected: bool,
}

#[derive(Debug)]
struct Edit {
    from: usize,
    to: usize,
    text: String,
}

impl<'a, 'input> Source<'a, 'input> {
    /// Numbers the elements, and prepares what `usvg` gets.
    ///
    /// # Errors
    ///
    /// Where elements refer to each other in a circle, or a bound is exceeded.
    pub(super) fn new(
        document: &'a Document<'input>,
        lines: &'a Lines,
        notes: &mut Notes,
    ) -> Result<Self, ReadError> {
        let mut source = Self {
            document,
            lines,
            elements: Vec::new(),
            by_id: HashMap::new(),
            edits: Vec::new(),
        };
        check_expansion(document, lines)?;
        source.number();
        source.remark(notes);
        Ok(source)
    }

    fn number(&mut self) {
        let document = self.document;
        let root = document.root_element();
        let with_text: HashSet<&str> = elements(document)
            .filter(|node| node.tag_name().name() == "textPath")
            .filter_map(|node| href(node)?.strip_prefix('#'))
            .collect();
        let mut seen = HashSet::new();
        let mut hidden = vec![false; document.descendants().count() + 1];
        for node in elements(document) {
            let place = node.id().get_usize();
            let above = node.parent().is_some_and(|parent| hidden[parent.id().get_usize()]);
            let name = node.tag_name().name();
            hidden[place] = above || NOT_DRAWN.contains(&name) || name == "radialGradient";
            // What an entity holds is at the place of its declaration, where nothing may change.
            if !is_element(node) || node.range().start < root.range().start {
                continue;
            }
            let number = self.elements.len() + 1;
            let known = node.attribute("id");
            let is_new = known.is_some_and(|id| seen.insert(id));
            match name {
                "path" | "polyline" | "polygon" => {
                    let attribute = if name == "path" { "d" } else { "points" };
                    if !known.is_some_and(|id| with_text.contains(id))
                        && let Some(data) = node.attribute_node(attribute)
                    {
                        let text = match name {
                            "path" => format!("M0 0L{number} 1L{number} 2"),
                            _ => format!("0 0 {number} 1 {number} 2"),
                        };
                        self.replace(data.range(), format!("{attribute}=\"{text}\""));
                    }
                }
                "rect" | "circle" | "ellipse" | "line" | "g" | "a" | "use" | "text" | "image" => {}
                "pattern" => self.stand_in_for_pattern(node),
                "clipPath" if node.attribute("clipPathUnits") == Some("objectBoundingBox") => {
                    self.rename(node, "defs", "<defs>".to_owned());
                    continue;
                }
                _ => continue,
            }
            let id = match (known, is_new) {
                (Some(id), true) => id.to_owned(),
                _ if name == "pattern" => continue,
                _ => {
                    let id = format!("\u{b7}{number}");
                    match node.attribute_node("id") {
                        Some(attribute) => self.replace(attribute.range(), format!("id=\"{id}\"")),
                        None => self.insert_id(node, &id),
                    }
                    id
                }
            };
            self.by_id.insert(id, number - 1);
            let is_expected = !hidden[place] && !matches!(name, "g" | "a" | "use" | "pattern");
            self.elements.push(Element { node: node.id(), is_drawn: false, is_expected });
        }
    }

    /// A fill with a pattern is a fill with a colour: the pattern would be drawn in each shape.
    fn stand_in_for_pattern(&mut self, node: Node<'_, '_>) {
        let Some(id) = node.attribute_node("id") else { return };
        let (name, _) = self.tag(node);
        let prefix =
            name.rsplit_once(':').map_or(String::new(), |(prefix, _)| format!("{prefix}:"));
        let id = &self.document.input_text()[id.range()];
        let gradient = format!(
            "<{prefix}linearGradient {id}><{prefix}stop stop-color=\"#000\"/></{prefix}linearGradient>"
        );
        self.rename(node, "defs", format!("{gradient}<{prefix}defs>"));
    }

    /// Gives an element another name, and its start tag another text.
    fn rename(&mut self, node: Node<'_, '_>, to: &str, start: String) {
        let (name, end) = self.tag(node);
        let prefix =
            name.rsplit_once(':').map_or(String::new(), |(prefix, _)| format!("{prefix}:"));
        let text = self.document.input_text();
        let range = node.range();
        let close = format!("</{prefix}{to}>");
        if text[..end].ends_with("/>") {
            self.replace(range.start..end, format!("{start}{close}"));
            return;
        }
        let Some(last) = text[range.clone()].rfind("</") else { return };
        self.replace(range.start..end, start);
        self.replace(range.start + last..range.end, close);
    }

    /// The name of an element with its prefix, and where its start tag ends.
    fn tag(&self, node: Node<'_, '_>) -> (&'input str, usize) {
        let text = self.document.input_text();
        let range = node.range();
        let inside = &text[range.start + 1..range.end];
        let name = inside.find(|sign: char| sign.is_whitespace() || "/>".contains(sign));
        let after = node.attributes().map(|attribute| attribute.range().end).max();
        // Namespaces are no attributes, so quotes are passed over.
        let mut quote = None;
        let from = after.unwrap_or(range.start + 1);
        let end = text[from..range.end].char_indices().find_map(|(place, sign)| match quote {
            Some(open) if open == sign => {
                quote = None;
                None
            }
            None if sign == '"' || sign == '\'' => {
                quote = Some(sign);
                None
            }
            None if sign == '>' => Some(from + place + 1),
            _ => None,
        });
        (&inside[..name.unwrap_or(inside.len())], end.unwrap_or(range.end))
    }

    fn insert_id(&mut self, node: Node<'_, '_>, id: &str) {
        let after = node.range().start + 1 + self.tag(node).0.len();
        self.replace(after..after, format!(" id=\"{id}\""));
    }

    fn replace(&mut self, range: core::ops::Range<usize>, text: String) {
        self.edits.push(Edit { from: range.start, to: range.end, text });
    }

    /// Whether the file gives the size of its page. Where it does not, `usvg` would measure the stand-ins.
    pub(super) fn page(&mut self, notes: &mut Notes) -> bool {
        let root = self.document.root_element();
        let line = self.line(root);
        let is_given = |name| {
            let value = root.attribute(name).map(str::trim);
            value.is_some_and(|value| !value.is_empty() && !value.ends_with('%') && value != "auto")
        };
        let (width, height) = (is_given("width"), is_given("height"));
        let has_view = root.attribute("viewBox").is_some_and(|value| {
            let mut numbers = value.split([' ', ',', '\t', '\n', '\r']).filter(|it| !it.is_empty());
            numbers.all(|number| number.parse::<f64>().is_ok_and(f64::is_finite))
                && value.split([' ', ',', '\t', '\n', '\r']).filter(|it| !it.is_empty()).count()
                    == 4
        });
        if has_view && !width && !height {
            notes.add("the file gives no size: a unit of its viewBox is taken as 1/96 inch", line);
        }
        if width && height || has_view {
            self.remark_illustrator(notes);
            return true;
        }
        notes.add("the file gives no size of its page: a unit is taken as 1/96 inch", line);
        for (name, is_given) in [("width", width), ("height", height)] {
            let text = format!("{name}=\"100\"");
            match root.attribute_node(name) {
                Some(attribute) if !is_given => self.replace(attribute.range(), text),
                None => {
                    let after = root.range().start + 1 + self.tag(root).0.len();
                    self.replace(after..after, format!(" {text}"));
                }
                _ => {}
            }
        }
        false
    }

    /// Adobe Illustrator writes points, 72 in an inch, as if they were pixels.
    fn remark_illustrator(&self, notes: &mut Notes) {
        let width = self.document.root_element().attribute("width").map_or("", str::trim);
        let is_in_pixels =
            width.ends_with("px") || width.ends_with(|sign: char| sign.is_ascii_digit());
        let mut comments = self.document.root().children().filter(Node::is_comment);
        let is_illustrator =
            comments.any(|node| node.text().is_some_and(|text| text.contains("Adobe Illustrator")));
        if is_in_pixels && is_illustrator {
            let text = "Adobe Illustrator counts 72 px in an inch and not 96: check the size, or scale by 4/3";
            notes.add(text, 0);
        }
    }

    /// The file as `usvg` gets it.
    pub(super) fn stand_in(&mut self) -> String {
        let text = self.document.input_text();
        let mut edits = core::mem::take(&mut self.edits);
        edits.sort_by_key(|edit| (edit.from, edit.to));
        let mut result = String::with_capacity(text.len().min(1 << 20));
        let mut at = 0;
        for edit in edits {
            if edit.from >= at {
                result.push_str(&text[at..edit.from]);
                result.push_str(&edit.text);
                at = edit.to;
            }
        }
        result.push_str(&text[at..]);
        result
    }

    /// The element of a number, from 1, and marks it as drawn.
    pub(super) fn take(&mut self, number: usize) -> Option<Node<'a, 'input>> {
        let element = self.elements.get_mut(number.checked_sub(1)?)?;
        element.is_drawn = true;
        self.document.get_node(element.node)
    }

    /// The number of the element of an id, from 1.
    pub(super) fn number_of(&self, id: &str) -> Option<usize> {
        self.by_id.get(id).map(|&place| place + 1)
    }

    /// The line of an element.
    pub(super) fn line(&self, node: Node<'_, '_>) -> u64 {
        self.lines.of(node.range().start)
    }

    /// Names the elements that should have been drawn and were not.
    pub(super) fn name_left_out(&self, notes: &mut Notes) {
        for element in
            self.elements.iter().filter(|element| element.is_expected && !element.is_drawn)
        {
            let Some(node) = self.document.get_node(element.node) else { continue };
            let is_off = node.ancestors().any(|node| {
                node.attribute("display") == Some("none") || declares(node, "display", "none")
            });
            let text = match node.tag_name().name() {
                _ if is_off => "what is hidden (display: none) is left out".to_owned(),
                "image" => match href(node) {
                    Some(to) if to.trim_start().starts_with("data:") => {
                        "an embedded image is left out".to_owned()
                    }
                    _ => "an image in another file is not followed".to_owned(),
                },
                name => format!("<{name}> that draws nothing is left out"),
            };
            notes.add(text, self.line(node));
        }
    }

    /// Names what is not honoured.
    fn remark(&self, notes: &mut Notes) {
        for node in elements(self.document) {
            let line = || self.line(node);
            for (name, text) in [
                ("mask", "a mask is not applied: what it hides is drawn"),
                ("filter", "a filter is not applied: the shape is drawn without its effect"),
                ("stroke-dasharray", "a dashed line is drawn without gaps"),
                ("marker-start", "a marker (an arrow head) is left out"),
                ("marker-mid", "a marker (an arrow head) is left out"),
                ("marker-end", "a marker (an arrow head) is left out"),
            ] {
                let given =
                    node.attribute(name).map(Cow::Borrowed).or_else(|| declared(node, name));
                if given.is_some_and(|value| value.trim() != "none") {
                    notes.add(text, line());
                }
            }
            match node.tag_name().name() {
                "pattern" if is_element(node) => {
                    notes.add("a fill with a pattern is taken as a black fill", line());
                }
                "clipPath" if node.attribute("clipPathUnits") == Some("objectBoundingBox") => {
                    notes.add("a clip path is not applied: what it hides is drawn", line());
                }
                "foreignObject" if is_element(node) => {
                    notes.add("a foreign object (text of a browser) is left out", line());
                }
                "script" => notes.add("a script is not run", line()),
                "animate" | "animateTransform" | "animateMotion" | "set" if is_element(node) => {
                    notes.add("an animation is left out: the drawing is as at its start", line());
                }
                "style" => {
                    let text = node.text().unwrap_or("");
                    if text.contains("@import") || text.contains("@font-face") {
                        notes.add("an external style sheet or font is not followed", line());
                    }
                    if text.contains("@media") {
                        notes.add("a style for a certain medium is left out", line());
                    }
                    if ["mask:", "filter:", "marker", "dasharray"]
                        .iter()
                        .any(|it| text.contains(it))
                    {
                        notes.add(
                            "masks, filters, markers and dashes of styles are left out",
                            line(),
                        );
                    }
                }
                "use" if href(node).is_some_and(|to| !to.trim().starts_with('#')) => {
                    notes.add("a reference to another file is not followed", line());
                }
                _ => {}
            }
        }
    }
}

/// The name of a layer; `None` where an element is none.
pub(super) fn layer<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    let inkscape = node.attribute((INKSCAPE, "groupmode")) == Some("layer");
    let illustrator = node.attributes().any(|attribute| {
        let namespace = attribute.namespace().unwrap_or("");
        attribute.name() == "layer" && namespace.contains("adobe") && attribute.value() == "yes"
    });
    if !inkscape && !illustrator {
        return None;
    }
    node.attribute((INKSCAPE, "label")).or_else(|| node.attribute("id"))
}

/// Where an element points to; the newer attribute has precedence.
pub(super) fn href<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    let mut attributes = node.attributes().filter(|attribute| attribute.name() == "href");
    let plain = attributes.clone().find(|attribute| attribute.namespace().is_none());
    plain
        .or_else(|| attributes.find(|attribute| attribute.namespace() == Some(XLINK)))
        .map(|attribute| attribute.value())
}

/// What the attribute `style` says of a property.
fn declared<'a>(node: Node<'a, '_>, name: &str) -> Option<Cow<'a, str>> {
    let style = node.attribute("style")?;
    style.split(';').find_map(|declaration| {
        let (found, value) = declaration.split_once(':')?;
        (found.trim() == name).then_some(Cow::Borrowed(value.trim()))
    })
}

fn declares(node: Node<'_, '_>, name: &str, value: &str) -> bool {
    declared(node, name).is_some_and(|found| found == value)
}

fn is_element(node: Node<'_, '_>) -> bool {
    matches!(node.tag_name().namespace(), None | Some(SVG))
}

fn elements<'a, 'input>(document: &'a Document<'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    document.descendants().filter(Node::is_element)
}

/// What an element is with all that it refers to: elements, and how deep they are.
#[derive(Debug, Clone, Copy, Default)]
struct Expansion {
    elements: usize,
    depth: usize,
}

/// Refuses a file whose `use` elements would make more than the bounds of it, or go in a circle. `usvg` itself
/// stops at a million elements, some gigabytes.
fn check_expansion(document: &Document<'_>, lines: &Lines) -> Result<(), ReadError> {
    let mut ids: HashMap<&str, Node<'_, '_>> = HashMap::new();
    let (mut count, mut rules, mut characters) = (0_usize, 0_usize, 0_usize);
    for node in elements(document) {
        count += 1;
        match node.tag_name().name() {
            "style" => rules += node.text().unwrap_or("").matches(['{', ',']).count(),
            "text" => {
                let texts = node.descendants().filter(Node::is_text);
                characters += texts.filter_map(|node| node.text()).map(str::len).sum::<usize>();
            }
            _ => {}
        }
        if let Some(id) = node.attribute("id") {
            ids.entry(id).or_insert(node);
        }
    }
    if characters > MOST_TEXT {
        return Err(ReadError::new(
            format!("the drawing has more than {MOST_TEXT} bytes of text"),
            "convert its text to paths, or divide it",
        ));
    }
    let mut known = vec![None; document.descendants().count()];
    let all = expansion(document.root_element(), &ids, &mut known, lines, 0)?;
    if all.elements > MOST_ELEMENTS {
        return Err(too_many());
    }
    if all.elements.max(count).saturating_mul(rules) > MOST_MATCHES {
        return Err(ReadError::new(
            format!("the drawing has {rules} style rules for {count} elements"),
            "save it with presentation attributes (\"plain SVG\")",
        ));
    }
    Ok(())
}

fn expansion<'a>(
    node: Node<'a, 'a>,
    ids: &HashMap<&str, Node<'a, 'a>>,
    known: &mut Vec<Option<Expansion>>,
    lines: &Lines,
    depth: usize,
) -> Result<Expansion, ReadError> {
    let place = node.id().get_usize();
    if let Some(found) = known[place] {
        return Ok(found);
    }
    let at = || lines.of(node.range().start);
    if depth > 2 * MOST_DEPTH {
        return Err(ReadError::new(
            format!("symbols are nested more than {MOST_DEPTH} deep, or in a circle"),
            "replace the clones of the drawing by copies",
        )
        .at_line(at()));
    }
    let mut found = Expansion { elements: 1, depth: 0 };
    let link = match node.tag_name().name() {
        "use" => href(node).and_then(|to| ids.get(to.trim().strip_prefix('#')?).copied()),
        _ => None,
    };
    for below in node.children().filter(Node::is_element).chain(link) {
        let below = expansion(below, ids, known, lines, depth + 1)?;
        found.elements = found.elements.saturating_add(below.elements);
        found.depth = found.depth.max(below.depth + 1);
    }
    if found.depth > MOST_DEPTH {
        return Err(ReadError::new(
            format!("elements and symbols are nested more than {MOST_DEPTH} deep"),
            "ungroup the drawing, or replace its clones by copies",
        )
        .at_line(at()));
    }
    known[place] = Some(found);
    Ok(found)
}
