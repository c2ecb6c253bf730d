//! How a layer is marked: what its table, its file and the job say of it.

use graphics::FileRecipe;
use graphics::dither::{Dither, Method, Tone};
use machine::Machine;
use machine::document::{Diagnostics, Span};

use super::Recipe;
use super::tables::{HatchStyle, ImageMode, LayerTable};
use crate::drawing::{Note, Power};
use crate::job::frequency;
use crate::job::whole::whole;
use crate::light::Policy;

/// The most passes of a layer.
const MOST_PASSES: u64 = 1000;

/// What holds for layers that say nothing else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::job) struct Defaults {
    /// [m/s]; `None` leaves it to the planner.
    pub(in crate::job) speed: Option<f64>,
    pub(in crate::job) power: Power,
    /// Of the laser's pulses [pulses/s], 0 as its source is set.
    pub(in crate::job) frequency: f64,
}

/// How a layer is marked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Way {
    pub(super) recipe: Recipe,
    pub(super) hatch: Hatch,
    pub(super) image: Image,
    /// Width of the cut [m], 0 for none.
    pub(super) kerf: f64,
}

/// How shapes are filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hatch {
    pub(super) style: HatchStyle,
    /// [m].
    pub(super) spacing: f64,
    /// [rad].
    pub(super) angle: f64,
    pub(super) is_cross: bool,
    /// [m].
    pub(super) inset: f64,
    pub(super) is_bidirectional: bool,
}

/// How images are marked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Image {
    pub(super) dither: Dither,
    pub(super) is_bidirectional: bool,
}

/// Levels of power of a grey image.
const GREYS: u16 = 256;

/// Distance of hatch lines and rows where nothing says it [m].
const INTERVAL: f64 = 1e-4;

/// How what is on a layer is marked: its `table` before what `of_file` says, whose drawing stands at the
/// place beside it, and that before the `defaults`. What is wrong goes to `diagnostics`, what the machine does not have to `notes`.
pub(super) fn recipe(
    table: Option<&LayerTable>,
    of_file: Option<(&FileRecipe, Span)>,
    defaults: &Defaults,
    machine: &Machine,
    diagnostics: &mut Diagnostics,
    notes: &mut Vec<Note>,
) -> Way {
    let frequency = frequency_of(table, of_file, machine, diagnostics, notes);
    let of_file = of_file.map(|(file, _)| file);
    let own = |value: Option<f64>, file: fn(&FileRecipe) -> Option<f64>| {
        value.or_else(|| of_file.and_then(file))
    };
    let passes = table.and_then(|table| table.passes.as_ref());
    let passes = passes.and_then(|passes| whole(passes, 1..=MOST_PASSES, "passes", diagnostics));
    let file_passes = of_file.and_then(|file| file.passes).map(u64::from);
    let passes = passes.or(file_passes).unwrap_or(1).clamp(1, MOST_PASSES) as u32;

    let policy = table.and_then(|table| table.policy.as_ref());
    let follows_speed =
        policy.map_or(defaults.power.follows_speed, |policy| policy.value == Policy::Proportional);
    let level =
        own(table.and_then(|table| table.power.as_ref()).map(|power| power.value), |file| {
            file.power
        });
    let level = level.filter(|level| *level > 0.0).unwrap_or(defaults.power.level);
    let speed =
        own(table.and_then(|table| table.speed.as_ref()).map(|speed| speed.value), |file| {
            file.speed
        });

    let focus = table.and_then(|table| table.focus.as_ref());
    let step = table.and_then(|table| table.focus_step.as_ref());
    let [focus, focus_step] = focus_of(
        [focus.map(|focus| (focus.value, focus.span)), step.map(|step| (step.value, step.span))],
        of_file,
        machine,
        diagnostics,
        notes,
    );
    let air = table.and_then(|table| table.air.as_ref()).map(|air| air.value);
    let air = air.or_else(|| of_file.and_then(|file| file.air)).unwrap_or(false);
    if air && !machine.gcode.air_assist {
        once(notes, "air has no effect: this machine has no air assist (gcode.air_assist)");
    }
    Way {
        recipe: Recipe {
            speed: speed.or(defaults.speed),
            power: Power { level, follows_speed },
            passes,
            focus,
            focus_step,
            air: air && machine.gcode.air_assist,
            frequency: frequency.unwrap_or(defaults.frequency),
        },
        hatch: hatch(table, of_file),
        image: image(table, of_file),
        kerf: own(table.and_then(|table| table.kerf.as_ref()).map(|kerf| kerf.value), |file| {
            file.kerf.map(|offset| 2.0 * offset)
        })
        .unwrap_or(0.0),
    }
}

/// The pulse repetition rate that a layer asks for [pulses/s].
fn frequency_of(
    table: Option<&LayerTable>,
    of_file: Option<(&FileRecipe, Span)>,
    machine: &Machine,
    diagnostics: &mut Diagnostics,
    notes: &mut Vec<Note>,
) -> Option<f64> {
    let source = &machine.laser;
    if let Some(written) = table.and_then(|table| table.frequency.as_ref()) {
        return frequency::asked(Some(written), source, diagnostics);
    }
    let (file, span) = of_file?;
    let asked = file.frequency?;
    if source.frequency.is_none() {
        once(
            notes,
            "frequencies in the file have no effect: this machine's cannot be set (laser.frequency)",
        );
        return None;
    }
    let who = format!("layer `{}` of the drawing", file.name);
    frequency::held(asked, span, &who, source, diagnostics)
}

/// How far the tool is above the drawing, and how much lower in each further pass [m].
fn focus_of(
    written: [Option<(f64, Span)>; 2],
    of_file: Option<&FileRecipe>,
    machine: &Machine,
    diagnostics: &mut Diagnostics,
    notes: &mut Vec<Note>,
) -> [f64; 2] {
    let in_file = [
        of_file.and_then(|file| file.focus).map(|down| -down),
        of_file.and_then(|file| file.focus_step),
    ];
    let moves = machine.mechanism.moves_in_z();
    let asks = |value: Option<f64>| value.is_some_and(|value| value != 0.0);
    for (value, span) in written.into_iter().flatten().filter(|(value, _)| *value != 0.0) {
        if !moves {
            let text = format!("the focus cannot be moved by {:.3} mm", value * 1e3);
            diagnostics.contradict(span, text, "this machine has no z axis: leave it out");
        }
    }
    if !moves && in_file.into_iter().any(asks) {
        once(notes, "steps of the focus in the file have no effect: this machine has no z axis");
    }
    if !moves {
        return [0.0; 2];
    }
    [0, 1].map(|index| written[index].map(|(value, _)| value).or(in_file[index]).unwrap_or(0.0))
}

fn hatch(table: Option<&LayerTable>, of_file: Option<&FileRecipe>) -> Hatch {
    if let Some(table) = table.and_then(|table| table.hatch.as_ref()) {
        return Hatch {
            style: table.style.value,
            spacing: table.spacing.value,
            angle: table.angle.value,
            is_cross: table.cross.value,
            inset: table.inset.value,
            is_bidirectional: table.bidirectional.value,
        };
    }
    Hatch {
        style: HatchStyle::Lines,
        spacing: of_file.and_then(|file| file.interval).unwrap_or(INTERVAL),
        angle: of_file.and_then(|file| file.angle).unwrap_or(0.0),
        is_cross: of_file.is_some_and(|file| file.is_cross),
        inset: 0.0,
        is_bidirectional: true,
    }
}

fn image(table: Option<&LayerTable>, of_file: Option<&FileRecipe>) -> Image {
    let Some(table) = table.and_then(|table| table.image.as_ref()) else {
        let interval = of_file.and_then(|file| file.interval).unwrap_or(INTERVAL);
        let method = Method::FloydSteinberg;
        let dither = Dither { pitch: interval, interval, tone: Tone::default(), method };
        return Image { dither, is_bidirectional: true };
    };
    let interval = table.interval.value;
    Image {
        dither: Dither {
            pitch: table.pitch.as_ref().map_or(interval, |pitch| pitch.value),
            interval,
            tone: Tone {
                is_inverted: table.inverted.value,
                contrast: table.contrast.value,
                brightness: table.brightness.value,
                gamma: table.gamma.value,
            },
            method: match table.mode.value {
                ImageMode::Grey => Method::Grey(GREYS),
                ImageMode::Threshold => {
                    Method::Threshold((table.threshold.value * f64::from(u8::MAX)).round() as u8)
                }
                ImageMode::Ordered => Method::Ordered,
                ImageMode::FloydSteinberg => Method::FloydSteinberg,
                ImageMode::Jarvis => Method::Jarvis,
                ImageMode::Stucki => Method::Stucki,
            },
        },
        is_bidirectional: table.bidirectional.value,
    }
}

/// Makes a note unless it was made before.
fn once(notes: &mut Vec<Note>, text: &str) {
    if !notes.iter().any(|note| note.text == text) {
        notes.push(Note { line: 0, text: text.to_owned() });
    }
}
