//! Clouds in glass: which place z says, and where the lens goes for it.

#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use machine::Machine;
use miette::Diagnostic;
use planner::Job;
use planner::drawing::Action;
use serde_json::Value;

/// Height of the glass's face [mm].
const FACE: f64 = 30.0;

/// A folder of its own for one test, removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("graver-glass-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// A cloud of points on the axis with these heights [mm], under a face at [`FACE`].
    fn cloud(&self, heights: &[f64], keys: &str) -> PathBuf {
        let points: String = heights.iter().map(|z| format!("0,0,{z:.17}\n")).collect();
        std::fs::write(self.0.join("points.csv"), format!("x,y,z mm\n{points}")).unwrap();
        let path = self.0.join("cloud.toml");
        let text = format!("[cloud]\nfile = \"points.csv\"\ndwell = \"1 ms\"\n{keys}\n");
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn polar() -> Machine {
    Machine::parse("polar.toml", include_str!("../../machines/polar.toml"), &[]).unwrap()
}

/// Heights of the lens's focus in the order of marking [m].
fn focused(folder: &Folder, heights: &[f64], keys: &str) -> Vec<f64> {
    let job = Job::read(&folder.cloud(heights, keys), &[], &polar()).unwrap();
    let steps = job.drawing.steps.iter();
    let to = steps.filter_map(|step| match step.action {
        Action::Rapid { to } => Some(to.z),
        _ => None,
    });
    to.collect()
}

/// With true heights the lens travels as source 000's golden vectors say; with apparent ones it does
/// so for a point that is the index times as deep.
#[test]
fn the_lens_travels_as_the_golden_vectors_say_for_true_and_apparent_heights() {
    let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/polar.json"));
    let golden: Value = serde_json::from_str(text).unwrap();
    let cases = golden["focus"].as_array().unwrap();
    assert_eq!(cases.len(), 6);
    let folder = Folder::new("golden");
    for case in cases {
        let of = |key: &str| case[key].as_f64().unwrap();
        let (depth, index, angle) = (of("depth"), of("n"), of("u"));
        for (key, half_angle) in [
            ("lens_paraxial", String::new()),
            ("lens_marginal", format!("half_angle = \"{angle} rad\"\n")),
        ] {
            let glass = format!("face = \"{FACE} mm\"\nindex = {index}\n{half_angle}");
            let expected = FACE * 1e-3 - of(key);
            for (seen, z) in
                [(depth, ""), (depth, "z = \"true\"\n"), (depth / index, "z = \"apparent\"\n")]
            {
                let heights = focused(&folder, &[FACE - seen * 1e3], &format!("{glass}{z}"));
                assert_eq!(heights.len(), 1);
                let off = heights[0] - expected;
                assert!(off.abs() < 1e-12, "{key} {z}{case}: off by {off:e} m");
            }
        }
    }
}

/// For rays near the axis the lens travels by the very depth that a point seems to have.
#[test]
fn an_apparent_depth_is_the_travel_of_the_lens_near_the_axis() {
    let folder = Folder::new("travel");
    let keys = format!("face = \"{FACE} mm\"\nindex = 1.6\nz = \"apparent\"\n");
    // The deepest first; what is on the face, or above it, stays.
    let heights = focused(&folder, &[FACE + 1.0, FACE, 20.0, 10.0], &keys);
    for (height, expected) in heights.iter().zip([0.01, 0.02, 0.03, 0.031]) {
        assert!((height - expected).abs() < 1e-15, "{heights:?}");
    }
    assert_eq!(heights.len(), 4);
}

/// Two points seem to be 0.15 mm apart, which is 0.24 mm in the glass: more than the spacing of 0.2 mm.
/// One seems to be at 10 mm and is at −2 mm, below what is allowed.
#[test]
fn spacing_and_heights_are_true_ones() {
    let folder = Folder::new("lengths");
    let keys = format!(
        "face = \"{FACE} mm\"\nindex = 1.6\nheights = [\"0 mm\", \"30 mm\"]\n\
         depth_spacing = \"0.2 mm\"\n"
    );
    let points = [20.0, 20.15, 10.0];
    assert_eq!(focused(&folder, &points, &format!("{keys}z = \"apparent\"\n")).len(), 2);
    assert_eq!(focused(&folder, &points, &keys).len(), 2, "10 mm and one of the two others");
    let near = focused(&folder, &points, &format!("{keys}z = \"apparent\"\n"));
    assert!((near[0] - 0.02).abs() < 1e-15 && (near[1] - 0.02015).abs() < 1e-15, "{near:?}");
}

#[test]
fn an_apparent_height_without_glass_is_refused_at_its_place() {
    let folder = Folder::new("refused");
    let refused = |keys: &str| {
        let error = Job::read(&folder.cloud(&[10.0], keys), &[], &polar()).unwrap_err();
        let help = error.help().map(|help| help.to_string());
        format!("{error}; {}", help.unwrap_or_default())
    };
    let error = refused("z = \"apparent\"");
    assert!(error.contains("cloud.toml:4"), "{error}");
    assert!(error.contains("add `face`"), "{error}");
    for (wrong, part) in
        [("z = true", "\"true\", \"apparent\""), ("z = \"aparent\"", "\"apparent\"")]
    {
        let error = refused(&format!("face = \"30 mm\"\n{wrong}"));
        assert!(error.contains("cloud.toml:5") && error.contains(part), "{error}");
    }
}
