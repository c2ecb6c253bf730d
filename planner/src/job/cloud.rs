//! A cloud of points inside a block of glass: thinned, put in order, and focused through its face.
//!
//! The deepest layer comes first, since the beam must not pass through points that are there already.
//! Inside a layer rings about the axis of the table follow each other outwards, and each goes on
//! round from where the one before ended, so that a table turns steadily in one sense.

use std::collections::BTreeMap;

use machine::focus::{marginal_travel, paraxial_travel, true_depth};
use messages::math;
use nalgebra::Vector3;

use messages::random::SplitMix64;

use crate::drawing::{Action, Drawing, Note, Step};

/// How a cloud is marked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cloud {
    /// Thickness of a layer [m].
    pub layer: f64,
    /// Width of a ring [m].
    pub ring: f64,
    /// The least distance of two points across the beam and along it [m]; 0 for any.
    pub spacing: [f64; 2],
    /// Where points may be: the largest distance from the table's axis [m].
    pub radius: f64,
    /// The lowest and the highest z [m].
    pub heights: [f64; 2],
    /// What the points lie in; `None` without glass.
    pub glass: Option<Glass>,
    /// How long each point is lit [s], unless it has a time of its own.
    pub dwell: f64,
    /// The first point to mark, in the order of marking, from 0.
    pub from: usize,
}

/// A block of glass below a level face, and the beam that comes through it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glass {
    /// Height of its upper face [m].
    pub face: f64,
    /// Its refractive index.
    pub index: f64,
    /// Half of the angle of the beam's cone in air [rad], 0 for rays near its axis.
    pub half_angle: f64,
}

/// Which of the two places of a point in glass its z says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Height {
    /// Where it is.
    True,
    /// Where it seems to be, seen from straight above.
    Apparent,
}

machine::keyword! {
    Height, "a word",
    "true" => Self::True,
    "apparent" => Self::Apparent,
}

impl Glass {
    /// Where a point is that seems to be at the height `z` [m]; above the face, at `z`.
    pub fn true_height(&self, z: f64) -> f64 {
        if z < self.face { self.face - true_depth(self.face - z, self.index) } else { z }
    }

    /// The height of the lens's focus in air that brings the focus in the glass to `z` [m], a true
    /// height.
    pub fn focus(&self, z: f64) -> f64 {
        if z >= self.face {
            return z;
        }
        let depth = self.face - z;
        self.face
            - if self.half_angle > 0.0 {
                marginal_travel(depth, self.index, self.half_angle)
            } else {
                paraxial_travel(depth, self.index)
            }
    }
}

/// What became of the points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ordered {
    /// The points to mark in their order [m].
    pub points: Vec<Vector3<f64>>,
    /// Left out for lying outside.
    pub outside: usize,
    /// Left out for lying too near to another.
    pub near: usize,
}

/// `count` points evenly at random inside a sphere of `radius` [m] about `center` [m].
pub fn sphere(center: Vector3<f64>, radius: f64, count: usize, seed: u64) -> Vec<Vector3<f64>> {
    let mut random = SplitMix64::new(seed);
    let mut share = || random.between(-1.0, 1.0);
    let mut points = Vec::with_capacity(count);
    while points.len() < count {
        let point = Vector3::new(share(), share(), share());
        if point.norm_squared() <= 1.0 {
            points.push(center + point * radius);
        }
    }
    points
}

impl Cloud {
    /// Leaves out what may not be marked, and puts the rest in order.
    pub fn order(&self, points: &[Vector3<f64>]) -> Ordered {
        let mut ordered = Ordered::default();
        let inside: Vec<Vector3<f64>> = points
            .iter()
            .copied()
            .filter(|point| {
                point.xy().norm() <= self.radius
                    && (self.heights[0]..=self.heights[1]).contains(&point.z)
            })
            .collect();
        ordered.outside = points.len() - inside.len();
        let kept = self.thinned(&inside);
        ordered.near = inside.len() - kept.len();
        // By layer from below, then by ring from within.
        let mut rings: BTreeMap<(i64, i64), Vec<Vector3<f64>>> = BTreeMap::new();
        for point in kept {
            let layer = (point.z / self.layer).floor() as i64;
            let ring = (point.xy().norm() / self.ring).floor() as i64;
            rings.entry((layer, ring)).or_default().push(point);
        }
        let mut angle = 0.0;
        for (_, mut ring) in rings {
            let beyond = |point: &Vector3<f64>| {
                let turned = math::atan2(point.y, point.x) - angle;
                turned - (turned / math::TURN).floor() * math::TURN
            };
            ring.sort_by(|one, other| beyond(one).total_cmp(&beyond(other)));
            if let Some(last) = ring.last() {
                angle = math::atan2(last.y, last.x);
            }
            ordered.points.extend(ring);
        }
        ordered
    }

    /// The points, of those that are too near to each other the first only.
    fn thinned(&self, points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let [across, along] = self.spacing;
        if across <= 0.0 || along <= 0.0 {
            return points.to_vec();
        }
        let scaled = |point: &Vector3<f64>| {
            Vector3::new(point.x / across, point.y / across, point.z / along)
        };
        let cell = |scaled: &Vector3<f64>| [0, 1, 2].map(|row| scaled[row].floor() as i64);
        let mut cells: BTreeMap<[i64; 3], Vec<Vector3<f64>>> = BTreeMap::new();
        let mut kept = Vec::with_capacity(points.len());
        for point in points {
            let place = scaled(point);
            let [x, y, z] = cell(&place);
            let neighbours = (-1..=1)
                .flat_map(|dx| (-1..=1).flat_map(move |dy| (-1..=1).map(move |dz| [dx, dy, dz])));
            let crowded = neighbours
                .filter_map(|[dx, dy, dz]| cells.get(&[x + dx, y + dy, z + dz]))
                .flatten()
                .any(|other| (other - place).norm_squared() < 1.0);
            if !crowded {
                cells.entry([x, y, z]).or_default().push(place);
                kept.push(*point);
            }
        }
        kept
    }

    /// The drawing of `points`, all at their true places, at `power`, reached from `home`.
    pub fn draw(
        &self,
        name: &str,
        points: &[Vector3<f64>],
        power: f64,
        home: Vector3<f64>,
        line: u64,
    ) -> Drawing {
        let ordered = self.order(points);
        let first = self.from.min(ordered.points.len());
        let mut steps = Vec::with_capacity(2 * (ordered.points.len() - first));
        for point in &ordered.points[first..] {
            let focus = self.glass.map_or(point.z, |glass| glass.focus(point.z));
            let to = Vector3::new(point.x, point.y, focus);
            steps.push(Step { action: Action::Rapid { to }, line });
            let dwell = Action::Dwell { time: self.dwell, lit: Some(power) };
            steps.push(Step { action: dwell, line });
        }
        let mut notes = Vec::new();
        let mut note = |count: usize, text: &str| {
            if count > 0 {
                notes.push(Note { line, text: format!("{count} points {text}") });
            }
        };
        note(ordered.outside, "are left out: they lie where none may be");
        note(ordered.near, "are left out: they are nearer to another than the spacing");
        note(first, "are taken as marked already: the job goes on from there");
        Drawing { name: name.to_owned(), start: home, steps, notes }
    }
}

/// The points of a file with these bytes: of a PLY file, or else of a table; in units of `unit` [m], or of
/// what the file itself says, or metres.
///
/// # Errors
/// What is wrong, and what would be right.
pub fn read(bytes: &[u8], unit: Option<f64>) -> Result<Vec<Vector3<f64>>, (String, String)> {
    if bytes.starts_with(b"ply") {
        let points = graphics::points::ply(bytes).map_err(|error| (error.message, error.help))?;
        let unit = unit.unwrap_or(1.0);
        return Ok(points.into_iter().map(|point| Vector3::from(point) * unit).collect());
    }
    let help = "give lines of x, y, z, and the unit in the first line".to_owned();
    let Ok(text) = core::str::from_utf8(bytes) else {
        return Err(("this is neither a PLY file nor a table in UTF-8".to_owned(), help));
    };
    parse(text, unit).map_err(|line| (format!("line {line} is no point x, y, z"), help))
}

/// Points from a table of x, y and z, separated by commas, semicolons or blanks, in units of `unit` [m], or
/// in metres unless the first line names a unit. Numbers after the third, such as colours, are passed over;
/// lines that begin with `#` are remarks.
///
/// # Errors
/// The line, from 1, that is no point.
pub fn parse(text: &str, unit: Option<f64>) -> Result<Vec<Vector3<f64>>, usize> {
    let mut scale = unit.unwrap_or(1.0);
    let mut points = Vec::new();
    let mut is_first = true;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let remark = line.starts_with('#');
        let split = |character: char| character.is_whitespace() || ",;".contains(character);
        let words: Vec<&str> = line.split(split).filter(|word| !word.is_empty()).collect();
        let numbers: Vec<f64> = words.iter().filter_map(|word| word.parse().ok()).collect();
        if remark || (is_first && numbers.is_empty()) {
            if is_first && unit.is_none() {
                scale = unit_of(line);
            }
            is_first = false;
            continue;
        }
        is_first = false;
        match numbers[..] {
            [x, y, z, ..]
                if words.len() == numbers.len()
                    && [x, y, z].iter().all(|value| value.is_finite()) =>
            {
                points.push(Vector3::new(x, y, z) * scale);
            }
            _ => return Err(index + 1),
        }
    }
    Ok(points)
}

/// The unit that a heading names [m].
fn unit_of(heading: &str) -> f64 {
    let names = |name: &str| {
        heading
            .split(|character: char| !character.is_alphanumeric() && character != '\u{b5}')
            .any(|word| word == name)
    };
    if names("mm") {
        1e-3
    } else if names("um") || names("\u{b5}m") {
        1e-6
    } else {
        1.0
    }
}
