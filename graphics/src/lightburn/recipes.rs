//! Cut settings of LightBurn as recipes.

use std::collections::HashMap;

use roxmltree::Node;

use crate::shape::{Colour, FileMode, FileRecipe};

/// The colours of LightBurn's layers C00 to C29, T1 and T2.
const COLOURS: [u32; 32] = [
    0x00_00_00, 0x00_00_ff, 0xff_00_00, 0x00_e0_00, 0xd0_d0_00, 0xff_80_00, 0x00_e0_e0, 0xff_00_ff,
    0xb4_b4_b4, 0x00_00_a0, 0xa0_00_00, 0x00_a0_00, 0xa0_a0_00, 0xc0_80_00, 0x00_a0_ff, 0xa0_00_a0,
    0x80_80_80, 0x7d_87_b9, 0xbb_77_84, 0x4a_6f_e3, 0xd3_3f_6a, 0x8c_d7_8c, 0xf0_b9_8d, 0xf6_c4_e1,
    0xfa_9e_d4, 0x50_0a_78, 0xb4_5a_00, 0x00_47_54, 0x86_fa_88, 0xff_db_66, 0xf3_69_26, 0x0c_96_d9,
];

/// The colour of a layer by its index.
pub(super) fn colour(index: usize) -> Colour {
    let value = COLOURS[index % COLOURS.len()];
    let [_, red, green, blue] = value.to_be_bytes();
    Colour { red, green, blue }
}

/// The recipes of a file, and which of them each layer has, in the order in which they are marked.
#[derive(Debug, Default)]
pub(super) struct Recipes {
    pub(super) all: Vec<FileRecipe>,
    by_index: HashMap<usize, Vec<usize>>,
}

impl Recipes {
    /// Reads the settings of a file.
    pub(super) fn new(root: Node<'_, '_>) -> Self {
        let mut recipes = Self::default();
        for node in root.children() {
            if !matches!(node.tag_name().name(), "CutSetting" | "CutSetting_Img") {
                continue;
            }
            let Some(index) = value(node, "index").and_then(|text| text.trim().parse().ok()) else {
                continue;
            };
            let first = recipe(node, index);
            let name = first.name.clone();
            let mut added = vec![first];
            let below = node.children().filter(|node| node.has_tag_name("SubLayer"));
            for (number, node) in below.enumerate() {
                let mut further = recipe(node, index);
                further.name = format!("{name} ({})", number + 2);
                further.is_hidden |= added[0].is_hidden;
                added.push(further);
            }
            for recipe in added {
                recipes.by_index.entry(index).or_default().push(recipes.all.len());
                recipes.all.push(recipe);
            }
        }
        recipes
    }

    /// The recipes of a layer; images and the rest have recipes of their own under the same index.
    pub(super) fn of(&self, index: usize, is_image: bool) -> Vec<usize> {
        let known = self.by_index.get(&index).map_or(&[][..], Vec::as_slice);
        let fits = |&place: &usize| (self.all[place].mode == FileMode::Image) == is_image;
        known.iter().copied().filter(fits).collect()
    }

    /// The name of a layer.
    pub(super) fn name(&self, index: usize) -> String {
        let first = self.by_index.get(&index).and_then(|places| places.first());
        first.map_or_else(|| default_name(index), |&place| self.all[place].name.clone())
    }
}

fn default_name(index: usize) -> String {
    match index {
        0..30 => format!("C{index:02}"),
        _ => format!("T{}", index - 29),
    }
}

/// What a child, or an attribute, says.
fn value<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    let child = node.children().find(|child| child.has_tag_name(name));
    child.and_then(|child| child.attribute("Value")).or_else(|| node.attribute(name))
}

fn recipe(node: Node<'_, '_>, index: usize) -> FileRecipe {
    let number = |name: &str| {
        let value: f64 = value(node, name)?.trim().parse().ok()?;
        value.is_finite().then_some(value)
    };
    let above = |name: &str| number(name).filter(|&value| value > 0.0);
    let share = |name: &str| number(name).map(|percent| (percent / 100.0).clamp(0.0, 1.0));
    let is_on = |name: &str| value(node, name).map(|text| !matches!(text.trim(), "0" | "False"));
    let mode = match node.attribute("type").unwrap_or("Cut") {
        "Scan" | "Offset" => FileMode::Fill,
        "Scan+Cut" => FileMode::FillAndLine,
        "Image" => FileMode::Image,
        _ => FileMode::Line,
    };
    let name = value(node, "name").filter(|name| !name.trim().is_empty());
    let is_tool = node.attribute("type") == Some("Tool");
    FileRecipe {
        name: name.map_or_else(|| default_name(index), |name| name.trim().to_owned()),
        mode,
        speed: above("speed").map(|speed| speed * 1e-3),
        power: share("maxPower"),
        least_power: share("minPower"),
        passes: above("numPasses").map(|passes| passes.clamp(1.0, 10_000.0) as u32),
        interval: above("interval")
            .map(|interval| interval * 1e-3)
            .or_else(|| above("dpi").map(|dots| 0.0254 / dots)),
        angle: number("angle").map(f64::to_radians),
        is_cross: is_on("crossHatch").unwrap_or(false),
        kerf: number("kerf").map(|kerf| kerf * 1e-3),
        frequency: above("frequency"),
        focus: number("zOffset").map(|depth| depth * 1e-3),
        focus_step: number("zPerPass").map(|depth| depth * 1e-3),
        air: is_on("runBlower"),
        is_hidden: is_tool || is_on("doOutput") == Some(false),
    }
}
