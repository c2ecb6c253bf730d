//! Plans one stretch: speed estimate, cells, a few linear programmes, and a check between the grid points.

use super::{
    build::{Held, Launch, PARTS, Problem},
    cells::{self, LAUNCHES},
    check::{Look, binding},
    ends::{Tie, Ties},
    estimate::{Estimate, MARGIN},
    program::Program,
    row::{Limits, Side, site},
    settings::{Effort, Settings},
    solver::{Outcome, Solver},
    stretch::{End, Infeasible, Stretch, launches, reaches},
    time_law::TimeLaw,
};

/// Speed bound of the next round, as a multiple of this round's speed, for rows that mix orders.
const GROWTH: [f64; 3] = [1.3, 1.15, 1.07];
/// A round that changes the time by less than this part of it is the last.
const LEAST_GAIN: f64 = 2e-3;
/// A limit used by more than this between the places at which it is held is tightened.
const MOST_USED: f64 = 1.003;
/// If a profile uses more than this fraction of a limit, the whole of it is slowed.
const TOLERATED: f64 = 1.008;
/// How often limits are tightened.
const TIGHTENINGS: usize = 3;
/// The fraction of v² at a moving end that the limits on acceleration must allow.
const MET: f64 = 0.98;
/// How much the limits of the third order are loosened to find a way to a moving end.
const LOOSENED: f64 = 1.3;
/// The part of the estimated speed about which the first round's limits of the third order are exact.
const BEGIN_ABOUT: f64 = 0.85;
/// How much less precise the first programme may be.
const ROUGH: f64 = 100.0;
/// The unknowns a first and a later programme begin with.
const BEGIN: [f64; 2] = [0.3, 0.95];

/// Plans stretches; its buffers are used again.
#[derive(Debug, Default)]
pub(crate) struct Planner {
    estimate: Estimate,
    problem: Problem,
    ties: Ties,
    program: Program,
    solver: Solver,
    look: Look,
    borders: Vec<f64>,
    columns: Vec<f64>,
    unknowns: Vec<f64>,
    coefficients: Vec<f64>,
    /// The coefficients of the programme solved last.
    found: Vec<f64>,
    /// The coefficients of the fastest law of the rounds.
    best: Vec<f64>,
    limits: Vec<u16>,
    effort: Effort,
    /// A law within the limits that begins as the next does, where one is known.
    way: Option<TimeLaw>,
    /// Whether the first programme of the last stretch found no answer.
    has_failed: bool,
}

/// Plans one stretch, see [`Planner::plan`].
#[cfg(test)]
pub(crate) fn plan(
    limits: &mut impl Limits,
    from: f64,
    to: f64,
    ends: [End; 2],
    settings: &Settings,
) -> Result<TimeLaw, Infeasible> {
    Planner::default().plan(limits, from, to, ends, settings)
}

impl Planner {
    /// With a law that begins as the stretch does and is within its limits, where one is known.
    pub(crate) fn along(way: Option<&TimeLaw>) -> Self {
        Self { way: way.cloned(), ..Self::default() }
    }

    /// The fastest law within `limits` from `from` to `to` [m]. A stretch between rests always has
    /// one; an end in motion may be out of reach.
    pub(crate) fn plan(
        &mut self,
        limits: &mut impl Limits,
        from: f64,
        to: f64,
        ends: [End; 2],
        settings: &Settings,
    ) -> Result<TimeLaw, Infeasible> {
        self.effort = Effort::default();
        self.has_failed = false;
        self.solver.steps = 0;
        let length = to - from;
        if !(length > 0.0 && length.is_finite()) {
            return Ok(TimeLaw::default());
        }
        let stretch = self.prepare(limits, from, length, ends, settings)?;
        self.rounds(&stretch, settings)?;
        self.verify(limits, &stretch, settings);
        self.effort.steps = self.solver.steps;
        Ok(self.law(&stretch))
    }

    /// Whether the last law is only a slow one within the limits, since the programme found no answer
    /// with these cells.
    pub(crate) fn has_failed(&self) -> bool {
        self.has_failed
    }

    /// What the last law took.
    #[cfg(test)]
    pub(crate) fn effort(&self) -> Effort {
        self.effort
    }

    /// Estimates the speed, chooses the cells and gathers the limits.
    fn prepare(
        &mut self,
        limits: &mut impl Limits,
        from: f64,
        length: f64,
        ends: [End; 2],
        settings: &Settings,
    ) -> Result<Stretch, Infeasible> {
        self.borders.clear();
        limits.borders(from, from + length, &mut self.borders);
        self.borders.iter_mut().for_each(|border| *border -= from);
        self.borders.retain(|border| *border > 0.0 && *border < length);
        self.borders.dedup();
        let problem = &mut self.problem;
        problem.rows.clear();
        let (reaches, most) = reaches(limits, from, length, ends, &mut problem.rows);
        let cell_time = settings.cell_time.max(1e-6);
        self.estimate.make(limits, from, length, &self.borders, reaches, cell_time);
        for (end, met) in self.estimate.met().into_iter().enumerate() {
            if met < MET {
                let place = from + if end == 0 { 0.0 } else { length };
                return Err(Infeasible { at_end: end == 1, place });
            }
        }
        let cell_time = self.estimate.cell_time;
        let spans = [
            self.borders.first().copied().unwrap_or(length),
            length - self.borders.last().copied().unwrap_or(0.0),
        ];
        let mut ties = [Tie::Launch(0.0); 2];
        let (mut cut, mut first) = ([0.0; 2], [f64::INFINITY; 2]);
        for end in 0..2 {
            let reach = &reaches[end];
            if reach.speed == 0.0 {
                let span = [spans[end], length];
                for times in LAUNCHES {
                    let time = times * cell_time;
                    cut[end] = cells::launch(reach, most[end], [time, cell_time], span);
                    let stretch = [from, length];
                    if launches(limits, stretch, reach.jerk, cut[end], end, &mut problem.rows) {
                        break;
                    }
                }
                ties[end] = Tie::Launch(cut[end]);
            } else {
                first[end] = cells::moving(reach, reach.speed * cell_time);
                ties[end] = Tie::Fixed(reach.speed * reach.speed, reach.acceleration);
            }
        }
        let borders = &mut problem.spline.borders;
        let [low, high] = [cut[0], length - cut[1]];
        cells::choose(&self.estimate, &self.borders, low, high, first, borders);
        let stretch = Stretch { from, length, ties };
        self.gather(limits, &stretch);
        self.effort.cells = self.problem.spline.cells();
        Ok(stretch)
    }

    /// Gathers the limits of all places at which they are held.
    fn gather(&mut self, limits: &mut impl Limits, stretch: &Stretch) {
        let problem = &mut self.problem;
        let Stretch { from, length, .. } = *stretch;
        problem.tightenings.clear();
        problem.loosened = 1.0;
        problem.held.clear();
        problem.rows.clear();
        let about = if stretch.fixed() { 1.0 / MARGIN } else { BEGIN_ABOUT };
        let way = Way::new(self.way.as_ref(), stretch);
        let mut near = 0;
        for cell in 0..problem.spline.cells() {
            for (part, side) in PARTS.into_iter().zip([Side::After, Side::At, Side::Before]) {
                let place = problem.spline.place(cell, part);
                let site = site(limits, from + place, side, &mut problem.rows);
                let estimate = self.estimate.speed(place).min(site.speed);
                problem.held.push(Held {
                    speed: site.speed,
                    speed_limit: site.speed_limit,
                    rows: site.rows,
                    estimate,
                    bound: estimate,
                    about: way.about(place, about * estimate, &mut near),
                });
            }
        }
        problem.hold_likely();
        for end in 0..2 {
            problem.launches[end] = None;
            if let Tie::Launch(launch) = stretch.ties[end] {
                let (place, side, rest, inner) = if end == 0 {
                    (launch, Side::Before, 0.0, Side::After)
                } else {
                    (length - launch, Side::After, length, Side::Before)
                };
                let start = problem.rows.len();
                let jerk = site(limits, from + rest, inner, &mut problem.rows);
                problem.rows.truncate(start);
                let site = site(limits, from + place, side, &mut problem.rows);
                problem.launches[end] =
                    Some(Launch { jerk: (jerk.launch, jerk.launch_limit), site, part: 1.0 });
            }
        }
    }

    /// The rounds: each a programme, its speed bounds from the law of the one before.
    fn rounds(&mut self, stretch: &Stretch, settings: &Settings) -> Result<(), Infeasible> {
        let spline = &self.problem.spline;
        self.columns.clear();
        for index in 0..spline.coefficients() {
            let speed = self.estimate.speed(spline.centre(index)).max(1e-9);
            self.columns.push(speed * speed);
        }
        let (mut before, mut least) = (f64::INFINITY, f64::INFINITY);
        // Whether the first law breaks rows that were left out: only the next is one to keep.
        let mut is_rough = false;
        for round in 0..settings.rounds.max(1) {
            if round == 0 {
                is_rough = self.first_round(stretch, settings)?;
            } else if !self.round(stretch, settings, false) {
                if is_rough && !self.round(stretch, settings, true) {
                    self.first_way(stretch, settings)?;
                } else if !is_rough {
                    break;
                }
            }
            let time = self.time(stretch);
            if round == 0 && is_rough {
                self.bound(GROWTH[0]);
                continue;
            }
            is_rough = false;
            if time < least {
                least = time;
                self.best.clone_from(&self.coefficients);
            }
            if (time - before).abs() < LEAST_GAIN * time {
                break;
            }
            // From a round that lost time none can be sure to gain: the fastest law is gone on from.
            self.coefficients.clone_from(&self.best);
            before = least;
            if round + 1 < settings.rounds {
                self.bound(GROWTH[round.min(GROWTH.len() - 1)]);
            }
        }
        self.coefficients.clone_from(&self.best);
        Ok(())
    }

    /// The first programme. Says whether its law breaks rows that were left out of it.
    fn first_round(&mut self, stretch: &Stretch, settings: &Settings) -> Result<bool, Infeasible> {
        self.effort.rounds += 1;
        self.ties.tie(&self.problem.spline, stretch.ties, &self.columns);
        if self.solve(stretch, settings, true) {
            self.ties.coefficients(&self.unknowns, &mut self.coefficients);
            return Ok(
                settings.rounds > 1 && self.problem.hold_broken(stretch.ties, &self.coefficients)
            );
        }
        self.problem.hold_all();
        // By way of loosened limits the law is as good as any.
        self.has_failed = !stretch.fixed();
        self.first_way(stretch, settings)?;
        Ok(false)
    }

    /// A programme within the speed bounds as they are. Where it fails the law stays as it was.
    fn round(&mut self, stretch: &Stretch, settings: &Settings, first: bool) -> bool {
        self.effort.rounds += 1;
        self.ties.tie(&self.problem.spline, stretch.ties, &self.columns);
        // Rows that should be far from the law are left out until they are broken.
        let mut first = first;
        loop {
            if !self.solve(stretch, settings, first) {
                return false;
            }
            self.ties.coefficients(&self.unknowns, &mut self.found);
            if !self.problem.hold_broken(stretch.ties, &self.found) {
                core::mem::swap(&mut self.coefficients, &mut self.found);
                return true;
            }
            take_as_units(&mut self.columns, &self.found);
            self.ties.tie(&self.problem.spline, stretch.ties, &self.columns);
            first = false;
        }
    }

    /// Solves the programme of the rows that are held. Says whether an answer was found.
    fn solve(&mut self, stretch: &Stretch, settings: &Settings, first: bool) -> bool {
        self.problem.build(&self.ties, stretch.ties, &mut self.program);
        self.effort.rows = self.program.rows();
        self.unknowns.clear();
        self.unknowns.resize(self.program.unknowns(), BEGIN[usize::from(!first)]);
        // The first law only says about which speed the limits are exact in the next.
        let (weight, precision) =
            if first { (0.1, ROUGH * settings.precision) } else { (0.03, settings.precision) };
        let outcome = self.solver.solve(&mut self.program, &mut self.unknowns, weight, precision);
        let sound = self.unknowns.iter().all(|value| value.is_finite() && *value > 0.0);
        outcome != Outcome::Failed && sound
    }

    /// A first law where the first programme failed: between rests the estimate, slow enough for
    /// every limit; otherwise by way of a law of loosened limits.
    fn first_way(&mut self, stretch: &Stretch, settings: &Settings) -> Result<(), Infeasible> {
        if !stretch.fixed() {
            self.unknowns.fill(BEGIN[0]);
            let factor = self.program.factor(&self.unknowns);
            self.unknowns.fill(BEGIN[0] * factor);
            self.ties.coefficients(&self.unknowns, &mut self.coefficients);
            return Ok(());
        }
        self.problem.loosened = LOOSENED;
        let loose = self.round(stretch, settings, true);
        self.problem.loosened = 1.0;
        if loose {
            self.bound(1.05);
            if self.round(stretch, settings, true) {
                return Ok(());
            }
        }
        let place = self.problem.spline.place(self.program.dearest(), 0.5);
        let at_end = match stretch.ties {
            [Tie::Fixed(..), Tie::Fixed(..)] => place > stretch.length / 2.0,
            [_, Tie::Fixed(..)] => true,
            _ => false,
        };
        Err(Infeasible { at_end, place: stretch.from + place })
    }

    /// Bounds the speed by `growth` times that of the law, and makes the law the unit of the
    /// unknowns.
    fn bound(&mut self, growth: f64) {
        let problem = &mut self.problem;
        problem.hold_near(&self.coefficients);
        for cell in 0..problem.spline.cells() {
            for (which, part) in PARTS.into_iter().enumerate() {
                let square = problem.spline.state(&self.coefficients, cell, part)[2];
                let held = &mut problem.held[3 * cell + which];
                held.about = square.max(1e-18).sqrt();
                held.bound = held.estimate.min(growth * held.about);
            }
        }
        take_as_units(&mut self.columns, &self.coefficients);
    }

    /// The time of the law, near enough to compare [s].
    fn time(&self, stretch: &Stretch) -> f64 {
        let mut time = self.problem.spline.duration(&self.coefficients);
        let last = self.coefficients.len() - 1;
        for (tie, index) in stretch.ties.into_iter().zip([0, last]) {
            if let Tie::Launch(length) = tie {
                time += 3.0 * length / self.coefficients[index].max(1e-24).sqrt();
            }
        }
        time
    }

    /// Looks at the law between the places at which its limits are held, and tightens what is
    /// broken there.
    fn verify(&mut self, limits: &mut impl Limits, stretch: &Stretch, settings: &Settings) {
        if settings.checks == 0 {
            return;
        }
        for pass in 0..=TIGHTENINGS {
            self.look.look(
                limits,
                [stretch.from, stretch.length],
                &self.problem.spline,
                &self.coefficients,
                stretch.ties,
                (settings.checks, MOST_USED),
            );
            self.effort.most = self.look.most;
            if self.look.most <= MOST_USED || pass == TIGHTENINGS {
                break;
            }
            self.tighten();
            self.bound(GROWTH[GROWTH.len() - 1]);
            if !self.round(stretch, settings, false) {
                break;
            }
        }
        if self.look.most > TOLERATED && !stretch.fixed() {
            let factor = 1.0 / self.look.most;
            self.coefficients.iter_mut().for_each(|coefficient| *coefficient *= factor);
            self.effort.most = 1.0;
        }
    }

    /// Tightens the limits the last look found broken.
    fn tighten(&mut self) {
        let tightenings = &mut self.problem.tightenings;
        for broken in &self.look.broken {
            let same = tightenings
                .iter_mut()
                .find(|tight| tight.cell == broken.cell && tight.limit == broken.limit);
            match same {
                Some(tight) => tight.part *= broken.part,
                None => tightenings.push(*broken),
            }
        }
        for (launch, used) in self.problem.launches.iter_mut().zip(self.look.launches) {
            if let Some(launch) = launch.as_mut().filter(|_| used > MOST_USED) {
                launch.part *= 0.999 / used;
            }
        }
    }

    /// The law of the coefficients.
    fn law(&mut self, stretch: &Stretch) -> TimeLaw {
        binding(&self.problem, &self.coefficients, &mut self.limits);
        let mut law = TimeLaw::default();
        let last = self.coefficients.len() - 1;
        let launch_limit = |end: usize| match &self.problem.launches[end] {
            Some(launch) => launch.jerk.1,
            None => 0,
        };
        if let Tie::Launch(length) = stretch.ties[0] {
            law.launch(stretch.from, length, self.coefficients[0].max(1e-24), launch_limit(0));
        }
        law.spline(stretch.from, &self.problem.spline, &self.coefficients, &self.limits);
        if let Tie::Launch(length) = stretch.ties[1] {
            let place = stretch.from + stretch.length - length;
            law.land(place, length, self.coefficients[last].max(1e-24), launch_limit(1));
        }
        law
    }
}

/// Makes the coefficients of a law the units of the unknowns.
fn take_as_units(columns: &mut [f64], coefficients: &[f64]) {
    for (column, coefficient) in columns.iter_mut().zip(coefficients) {
        *column = coefficient.max(1e-9 * *column);
    }
}

/// A law known to be within the limits, as a first guess of the speed where the new one begins.
struct Way<'a> {
    law: Option<&'a TimeLaw>,
    from: f64,
    /// How far it is followed [m].
    length: f64,
}

impl<'a> Way<'a> {
    /// The part of the law that is followed: the rest of it only comes to rest.
    const FOLLOWED: f64 = 0.5;

    fn new(law: Option<&'a TimeLaw>, stretch: &Stretch) -> Self {
        let places = law.map_or(0.0..0.0, TimeLaw::places);
        let length = Self::FOLLOWED * (places.end - places.start).min(stretch.length);
        Self { law: law.filter(|_| length > 0.0), from: stretch.from, length }
    }

    /// The speed to be exact about at `place` from the start [m/s], `speed` where nothing else is known.
    fn about(&self, place: f64, speed: f64, near: &mut usize) -> f64 {
        let Some(law) = self.law.filter(|_| place < self.length) else { return speed };
        let known = law.speed_at(self.from + place, near).min(speed);
        known + (speed - known) * place / self.length
    }
}
