//! What a limit is to the time law: a row linear in (ü′, ü, u̇²).

use core::ops::Range;

/// Where the limits of a place are taken, as they may jump at the border of two spans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Just before the place, from the span that ends there.
    Before,
    /// At a place inside a span.
    At,
    /// Just after the place, from the span that begins there.
    After,
}

/// One limit at one place: `(base + v̄·by_speed) · (ü′, ü, u̇²) ≤ top + v̄·top_by_speed`, where v̄ is
/// an upper bound of the speed u̇ there [m/s].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    /// Weights of ü′, ü and u̇²; the first is 0, as the third order comes with the speed.
    pub base: [f64; 3],
    /// Weights of ü′, ü and u̇² for each unit of speed; 0 for a limit of the second order.
    pub by_speed: [f64; 3],
    /// Positive: rest is within every limit.
    pub top: f64,
    /// What a unit of speed adds to `top`; 0 or negative where speed costs room.
    pub top_by_speed: f64,
    /// Which limit this is, for the report of what binds.
    pub limit: u16,
}

/// The least `top` a row is taken to have: below it the row means standstill.
const LEAST_TOP: f64 = 1e-9;
/// The part of the speed at which a row leaves no room at all that a law may use.
const ROOM_OF_SPEED: f64 = 0.995;

impl Row {
    /// The weights of (ü′, ü, u̇²) at the speed bound `speed` [m/s], and the top.
    pub(super) fn at(&self, speed: f64) -> ([f64; 3], f64) {
        let weight = |order: usize| self.base[order] + speed * self.by_speed[order];
        let top = (self.top + speed * self.top_by_speed).max(LEAST_TOP);
        ([weight(0), weight(1), weight(2)], top)
    }

    /// The part of the limit used in the state (ü′, ü, u̇²) at the speed `speed` [m/s]; 1 is all.
    pub(super) fn used(&self, state: [f64; 3], speed: f64) -> f64 {
        let (weights, top) = self.at(speed);
        dot(weights, state) / top
    }

    /// Whether the row is of the third order alone: `v·by_speed·(ü′, ü, u̇²) ≤ top`.
    pub(super) fn third_order(&self) -> bool {
        self.base == [0.0; 3] && self.top_by_speed == 0.0
    }

    /// The weights and the top of a row of the third order, of which `part` may be used, about the
    /// speed v₀ `speed` [m/s]. The room top/v is convex in v², so its tangent, top·(1.5/v₀ −
    /// v²/(2·v₀³)), is safe at every speed and exact at v₀.
    pub(super) fn about(&self, speed: f64, part: f64) -> ([f64; 3], f64) {
        let room = self.top.max(LEAST_TOP) * part / speed;
        let [third, second, first] = self.by_speed;
        ([third, second, first + 0.5 * room / (speed * speed)], 1.5 * room)
    }

    /// Whether the row mixes orders, so that a slower law may break it although a faster keeps it.
    pub(super) fn mixed(&self) -> bool {
        !self.third_order() && (self.top_by_speed != 0.0 || self.by_speed != [0.0; 3])
    }

    /// Whether the row says something of the second order alone.
    pub(super) fn second_order(&self) -> bool {
        self.base[1] != 0.0 || self.base[2] != 0.0
    }

    /// The largest speed at which the row leaves room for rest in ü [m/s], or infinity.
    pub(super) fn speed(&self) -> f64 {
        if self.top_by_speed < 0.0 {
            ROOM_OF_SPEED * self.top.max(LEAST_TOP) / -self.top_by_speed
        } else {
            f64::INFINITY
        }
    }

    /// Whether the row limits anything: all weights finite and a finite top.
    pub(super) fn says_something(&self) -> bool {
        let all = self.base.iter().chain(&self.by_speed);
        all.clone().all(|weight| weight.is_finite())
            && all.clone().any(|weight| *weight != 0.0)
            && self.top.is_finite()
            && self.top_by_speed.is_finite()
    }
}

/// The scalar product.
pub(super) fn dot(left: [f64; 3], right: [f64; 3]) -> f64 {
    left[0] * right[0] + left[1] * right[1] + left[2] * right[2]
}

/// What the limits say at one place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Site {
    /// The largest u̇ [m/s].
    pub speed: f64,
    /// Which limit `speed` is.
    pub speed_limit: u16,
    /// The rows of the place in the vector they were appended to.
    pub rows: Range<usize>,
    /// The largest third derivative of u from rest here [m/s³].
    pub launch: f64,
    /// Which limit `launch` is.
    pub launch_limit: u16,
}

/// The limits along a stretch of a path.
pub(crate) trait Limits {
    /// Appends where the limits may jump or bend sharply: the borders of the path's spans at `from`, at
    /// `to` and between [m], growing.
    fn borders(&self, from: f64, to: f64, borders: &mut Vec<f64>);

    /// The limits at `place` [m], taken on `side`; the rows are appended to `rows`.
    fn site(&mut self, place: f64, side: Side, rows: &mut Vec<Row>) -> Site;
}

/// The least speed a site is taken to allow [m/s].
const LEAST_SPEED: f64 = 1e-9;
/// The range of the third derivative from rest [m/s³].
const LAUNCHES: [f64; 2] = [1e-9, 1e9];

/// The site at `place`, with rows that say nothing dropped and numbers out of range mended.
pub(super) fn site(limits: &mut impl Limits, place: f64, side: Side, rows: &mut Vec<Row>) -> Site {
    let start = rows.len();
    let mut site = limits.site(place, side, rows);
    let mut kept = start;
    for index in start..rows.len() {
        let row = rows[index];
        if row.says_something() {
            rows[kept] = row;
            kept += 1;
            if row.speed() < site.speed {
                site.speed = row.speed();
                site.speed_limit = row.limit;
            }
            let launch = row.top / row.by_speed[0].abs().max(1e-300);
            if launch < site.launch {
                site.launch = launch;
                site.launch_limit = row.limit;
            }
        }
    }
    rows.truncate(kept);
    site.rows = start..kept;
    site.speed = site.speed.clamp(LEAST_SPEED, 1e6);
    if site.speed.is_nan() {
        site.speed = LEAST_SPEED;
    }
    site.launch = site.launch.clamp(LAUNCHES[0], LAUNCHES[1]);
    if site.launch.is_nan() {
        site.launch = LAUNCHES[0];
    }
    site
}
