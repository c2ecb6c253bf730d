//! Drawings against the raster of `resvg`: a program that shares none of the geometry.

use kurbo::Line;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Distance of hatch lines [mm], and how many pixels there are across it: an odd number, so that each line
/// is in the middle of a row of pixels.
const SPACING: f64 = 0.1;
const FINE: usize = 11;

/// Width and height of the page [mm].
const SIDE: usize = 12;

/// How near to an edge marks may differ from paint [pixels]: 27 µm.
const NEAR: usize = 3;

/// Whether each pixel of the page is painted in full, in part, or not at all.
struct Page {
    side: usize,
    alpha: Vec<u8>,
}

impl Page {
    fn painted(svg: &str) -> Self {
        let side = SIDE * (FINE as f64 / SPACING).round() as usize;
        let tree = Tree::from_str(svg, &Options::default()).unwrap();
        let pixels = u32::try_from(side).unwrap();
        let mut pixmap = Pixmap::new(pixels, pixels).unwrap();
        let scale = side as f32 / tree.size().width();
        resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
        Self { side, alpha: pixmap.pixels().iter().map(|pixel| pixel.alpha()).collect() }
    }

    fn at(&self, row: usize, column: usize) -> u8 {
        self.alpha[row * self.side + column]
    }

    /// Whether `is_so` of all pixels at most `near` rows and columns away, those beyond the page left out.
    fn all(&self, [row, column]: [usize; 2], near: usize, is_so: impl Fn(u8) -> bool) -> bool {
        let around = |at: usize| at.saturating_sub(near)..=(at + near).min(self.side - 1);
        around(row).all(|row| around(column).all(|column| is_so(self.at(row, column))))
    }

    /// Row and column of a place [m], from the upper left corner; `None` beyond the page.
    fn pixel(&self, point: kurbo::Point) -> Option<[usize; 2]> {
        let scale = self.side as f64 / (SIDE as f64 * 1e-3);
        let place = [self.side as f64 - point.y * scale, point.x * scale];
        let inside = |at: f64| (0.0..self.side as f64).contains(&at);
        place.into_iter().all(inside).then(|| place.map(|at| at as usize))
    }

    /// The pixels that `lines` of light go through.
    fn lit(&self, lines: &[Line]) -> Vec<bool> {
        let mut lit = vec![false; self.side * self.side];
        let step = SIDE as f64 * 1e-3 / self.side as f64 / 4.0;
        for line in lines {
            let count = ((line.p1 - line.p0).hypot() / step).ceil().max(1.0) as usize;
            for index in 0..=count {
                let point = line.p0.lerp(line.p1, index as f64 / count as f64);
                let [row, column] = self.pixel(point).expect("light beside the page");
                lit[row * self.side + column] = true;
            }
        }
        lit
    }
}

fn page(inside: &str) -> String {
    format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='{SIDE}mm' height='{SIDE}mm' \
         viewBox='0 0 {SIDE} {SIDE}'>{inside}</svg>"
    )
}

fn simulated(svg: &str, more: &[&str]) -> Vec<Line> {
    let placed = ["drawing.anchor=page", "drawing.layer=all", "layers.all.speed=50 mm/s"];
    super::marked("drawing.svg", svg.as_bytes(), &[], &[&placed[..], more].concat())
}

/// Shapes that overlap, with holes by both rules, curves, arcs, transforms, inheritance and reuse.
const FILLED: &str = "
    <rect x='0.73' y='0.81' width='4.4' height='2.9' rx='0.9' fill='teal'/>
    <path d='M6 1 L11 1.3 L7 5 L8.5 0.6 L10.6 4.7 Z' fill='black' fill-rule='evenodd'/>
    <path d='M2.4 5 C5 4 5.5 8 3 8.2 S0.4 9 1 6.5 T2.4 5 M2 6 v1.1 h1.3 v-1.1 z' fill='navy'/>
    <g transform='translate(8.4 8) rotate(31) scale(1.1 0.8)' fill='maroon'>
      <path d='M-2.4 0 A2.4 1.5 20 1 1 2.4 0.2 A1.2 1.2 0 0 1 0.1 0.3 A1.2 1.2 0 0 0 -2.4 0'/>
      <g id='eye'><circle r='0.5' cy='2.4'/></g><use href='#eye' x='1.7' y='0.3'/>
    </g>
    <polygon points='1,9.4 4.2,9.9 5.3,11.4 0.6,11.2'/>";

#[test]
fn what_is_filled_is_marked_where_resvg_paints_it() {
    let svg = page(FILLED);
    let painted = Page::painted(&svg);
    let spacing = format!("layers.all.hatch.spacing={SPACING} mm");
    let lines = simulated(&svg, &["layers.all.mode=fill", &spacing]);
    for line in &lines {
        for point in [line.p0, line.p1] {
            let row = point.y * 1e3 / SPACING;
            assert!((row - row.floor() - 0.5).abs() < 0.2, "{line:?} is beside its row");
        }
    }
    let lit = painted.lit(&lines);
    let (mut full, mut empty) = (0, 0);
    let middles = (FINE / 2..painted.side).step_by(FINE);
    for (middle, column) in middles.flat_map(|row| (0..painted.side).map(move |at| (row, at))) {
        // The tool is not in the very middle of its row.
        let rows = middle - 2..=middle + 2;
        let is_lit = rows.clone().any(|row| lit[row * painted.side + column]);
        if painted.all([middle, column], NEAR, |alpha| alpha == u8::MAX) {
            full += 1;
            assert!(is_lit, "row {middle}, column {column} is painted, and dark");
        } else if painted.all([middle, column], NEAR, |alpha| alpha == 0) {
            empty += 1;
            assert!(!is_lit, "row {middle}, column {column} is empty, and lit");
        }
    }
    // Nearly all pixels are held to be one or the other.
    assert!(full > 40_000 && empty > 60_000, "{full} full, {empty} empty");
}

/// Lines of 0.1 mm.
const LINES: &str = "
    <g fill='none' stroke='black' stroke-width='0.1' stroke-linejoin='round' stroke-linecap='round'>
      <path d='M1 1 C4 6 7 -3 10.6 3.2 S5 6 6 8 Q9 11 3 10.5'/>
      <ellipse cx='3.2' cy='6.4' rx='2' ry='1.2' transform='rotate(-20 3 6)'/>
      <path d='M8.5 6.5 A1.6 1.6 0 1 0 11 9 L7.2 11 H6.1'/>
      <polyline points='0.6,9 1.4,11.2 2.2,9.2 0.9,10.2'/>
    </g>";

#[test]
fn lines_are_marked_along_the_middle_of_what_resvg_paints() {
    let svg = page(LINES);
    let painted = Page::painted(&svg);
    let lit = painted.lit(&simulated(&svg, &[]));
    let marks = Page { side: painted.side, alpha: lit.iter().map(|is| u8::from(*is)).collect() };
    // Half of a line's width is 5.5 pixels; corners and ends are round.
    let half = FINE / 2;
    let (mut on, mut along) = (0, 0);
    for place in (0..painted.side).flat_map(|row| (0..painted.side).map(move |at| [row, at])) {
        let [row, column] = place;
        if marks.at(row, column) != 0 {
            on += 1;
            assert!(painted.all(place, half - 1 - NEAR, |alpha| alpha != 0), "{place:?} is stray");
        }
        if painted.at(row, column) == u8::MAX && !painted.all(place, 2 * half, |alpha| alpha != 0) {
            along += 1;
            let is_dark = marks.all(place, half + 2 * NEAR, |alpha| alpha == 0);
            assert!(!is_dark, "{place:?} is painted, and no mark is near");
        }
    }
    assert!(on > 3_000 && along > 20_000, "{on} marked, {along} painted");
}
