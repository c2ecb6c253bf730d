//! Arms as beams: stiffness and modes of the source's links (source 003 tables 5-4, 6-4), and of the arm of a
//! polar machine (source 000).

use machine::mechanisms::{MechanismKind, Polar};
use machine::transmission::beam::{Beam, Support};
use monitor::report::chart::{Chart, Curve, colour, stack};

use super::draw::MILLIMETRES;
use super::{Cell, Figure, FigureError, Figures, Name, Subject, Table};

/// Flexural rigidity of the source's bars, 10 by 10 mm of 22e10 N/m² [N·m²].
const RIGIDITY: f64 = 22e10 * 1e-8 / 12.0;

/// Their mass by their length [kg/m].
const LINEAR_DENSITY: f64 = 0.78;

/// Names, lengths [m], masses [kg] and printed stiffnesses [N·m/rad] of tables 5-4 and 6-4.
const MEMBERS: [(&str, f64, f64, f64); 3] = [
    ("arm", 0.20, 0.156, 366.0),
    ("forearm", 0.25, 0.195, 293.0),
    ("prrrp_link", 0.30, 0.234, 440.0),
];

/// What stands for a link's bending, by E·J/L, and the columns that say so.
const FORMULAS: [(&str, f64, &str); 4] = [
    ("EJ_over_L", 1.0, "E·J/L"),
    ("three_EJ_4L", 0.75, "3·E·J/4L"),
    ("two_EJ_L", 2.0, "2·E·J/L"),
    ("three_EJ_L", 3.0, "3·E·J/L"),
];

/// Masses at the tip that are drawn, from none to twice the head's.
const MASSES: u32 = 100;

/// Modes of an arm that are drawn.
const MODES: usize = 3;

pub(super) fn add_source(figures: &mut Figures) -> Result<(), FigureError> {
    let columns = ["member", "length", "mass", "EJ", "printed_stiffness"];
    let columns = columns.into_iter().chain(FORMULAS.map(|(name, ..)| name));
    let columns = columns.chain(["pinned_1", "clamped_1"]);
    let mut table = Table::new("beams", columns);
    for (name, length, mass, printed) in MEMBERS {
        let beam = Beam { length, rigidity: RIGIDITY, mass };
        let formulas = FORMULAS.map(|(_, factor, _)| factor * RIGIDITY / length);
        let first = |support| beam.frequencies(support, 1).first().copied().unwrap_or(f64::NAN);
        let numbers = [length, mass, RIGIDITY, printed].into_iter().chain(formulas);
        let numbers = numbers.chain([first(Support::Hinges), first(Support::FREE)]);
        table.rows.push([name.into()].into_iter().chain(numbers.map(Cell::Number)).collect());
    }
    let lengths = || (150..=350).map(|millimetres: u32| f64::from(millimetres) * 1e-3);
    let along = |of: &dyn Fn(f64) -> f64| {
        vec![lengths().map(|length| (length * MILLIMETRES, of(length))).collect::<Vec<_>>()]
    };
    let mut stiffness: Vec<Curve> = (0..)
        .zip(FORMULAS)
        .map(|(index, (_, factor, name))| Curve {
            name: name.to_owned(),
            colour: colour(index),
            lines: along(&|length| factor * RIGIDITY / length),
        })
        .collect();
    stiffness.push(Curve {
        name: "printed".to_owned(),
        colour: colour(4),
        lines: MEMBERS.map(|(_, length, _, printed)| vec![(length * MILLIMETRES, printed)]).into(),
    });
    let first = |support: Support| {
        move |length: f64| {
            let beam = Beam { length, rigidity: RIGIDITY, mass: LINEAR_DENSITY * length };
            beam.frequencies(support, 1).first().copied().unwrap_or(f64::NAN)
        }
    };
    let frequency = [("hinges", Support::Hinges), ("clamped", Support::FREE)];
    let frequency = (0..).zip(frequency).map(|(index, (name, support))| Curve {
        name: name.to_owned(),
        colour: colour(index),
        lines: along(&first(support)),
    });
    let axes = ["length [mm]", "stiffness [N·m/rad]"];
    let charts = [
        chart(axes, 320, stiffness),
        chart([axes[0], "first mode [Hz]"], 260, frequency.collect()),
    ];
    figures.figures.push(Figure {
        name: Name::Modes,
        source: "5-6".to_owned(),
        title: "Links that bend: stiffness by one formula or another, and their first modes".to_owned(),
        caption: "A bar of 10 by 10 mm. The source prints 2·E·J/L, and in its tables a fifth of that. An arm that \
                  is pushed at its tip turns by 3·E·J/L at its motor. A link between hinges with a spring K at \
                  its middle has the first mode of the beam with K = π⁴·E·J/(48·L) = 2.03·E·J/L: for that use the \
                  printed formula is right."
            .to_owned(),
        axes: axes.map(str::to_owned),
        svg: stack("beams", &charts)?,
        table,
        more: Vec::new(),
    });
    Ok(())
}

/// The arm of a polar machine whose first joint yields as an arm does.
pub(super) fn add(subject: &Subject, figures: &mut Figures) -> Result<(), FigureError> {
    let MechanismKind::Polar(polar) = &subject.machine.mechanism else { return Ok(()) };
    let Some(beam) = arm(polar) else { return Ok(()) };
    let modes = (1..=MODES).map(|mode| format!("mode_{mode}"));
    let columns = ["head_mass".to_owned()].into_iter().chain(modes).chain(["sag".to_owned()]);
    let mut table = Table::new(format!("beam_{}", subject.stem), columns);
    let head = polar.load.head_mass;
    for step in 0..=MASSES {
        let mass = 2.0 * head * f64::from(step) / f64::from(MASSES);
        table.numbers(with_head(&beam, polar, mass));
    }
    let column = |name: &str| table.column(name).unwrap_or_default();
    let curve = |name: String, index: usize, of: &str, scale: f64| {
        let line = column("head_mass").into_iter().zip(column(of));
        let line: Vec<(f64, f64)> = line.map(|(mass, value)| (mass, value * scale)).collect();
        // The machine's own head is half way.
        let own = line.get(MASSES as usize / 2).map(|point| vec![*point]);
        let lines = [line].into_iter().chain(own).collect();
        Curve { name, colour: colour(index), lines }
    };
    let modes = (1..=MODES)
        .map(|mode| curve(format!("mode {mode}"), mode - 1, &format!("mode_{mode}"), 1.0))
        .collect();
    let axes = ["mass of the head [kg]", "frequency [Hz]"];
    let charts = [
        chart(axes, 340, modes),
        chart([axes[0], "sag of the tip [µm]"], 240, vec![curve(String::new(), 1, "sag", 1e6)]),
    ];
    figures.figures.push(Figure {
        name: Name::Modes,
        source: String::new(),
        title: format!("{}: the arm as a beam", subject.machine.name),
        caption: format!(
            "An arm of {:.0} mm and {:.2} kg, clamped at its pivot, whose E·J of {:.1} N·m² follows from the \
             stiffness of its joint, 3·E·J/L, and is taken for bending up and down too. Dots are the machine's \
             own head of {head:.2} kg; the counterbalance is left out.",
            beam.length * 1e3,
            beam.mass,
            beam.rigidity
        ),
        axes: axes.map(str::to_owned),
        svg: stack("beam", &charts)?,
        table,
        more: Vec::new(),
    });
    Ok(())
}

/// The arm as a beam that gives the stiffness of its joint; `None` where that is rigid.
pub(super) fn arm(polar: &Polar) -> Option<Beam> {
    let stiffness = polar.elasticity?[0].stiffness;
    let rigidity = stiffness * polar.arm / 3.0;
    Some(Beam { length: polar.arm, rigidity, mass: polar.load.arm_mass })
}

/// A row of the arm with a head of `mass` [kg], whose inertia goes with its mass.
fn with_head(beam: &Beam, polar: &Polar, mass: f64) -> Vec<f64> {
    let inertia = polar.load.head_inertia * mass / polar.load.head_mass;
    let support = Support::Clamped { tip_mass: mass, tip_inertia: inertia };
    let gravity = polar.load.gravity;
    [mass]
        .into_iter()
        .chain(beam.frequencies(support, MODES))
        .chain([beam.sag(mass * gravity, gravity)])
        .collect()
}

fn chart<'a>(axes: [&'a str; 2], height: u32, curves: Vec<Curve>) -> Chart<'a> {
    Chart {
        title: "beam",
        across: axes[0],
        up: axes[1],
        height,
        at_least: Some((0.0, 0.0)),
        curves,
    }
}
