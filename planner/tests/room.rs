//! A drawing that says no place of its own lies around home where there is room, else in the middle of the area.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use machine::{Machine, Override};
use planner::job::Job;
use planner::preview::preview;
use planner::{PlanError, plan};

/// What is drawn is 80 mm by 30 mm.
const DRAWING: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" viewBox="0 0 100 80">
<rect x="10" y="20" width="80" height="30" fill="none" stroke="red"/></svg>"##;

fn machine(name: &str, settings: &[&str]) -> Machine {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../machines/{name}.toml"));
    Machine::load(&path, &overrides(settings)).unwrap()
}

fn overrides(settings: &[&str]) -> Vec<Override> {
    settings.iter().map(|setting| setting.parse().unwrap()).collect()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    fn job(&self, name: &str, text: &str, settings: &[&str], machine: &Machine) -> Job {
        Job::read(&self.file(name, text), &overrides(settings), machine).unwrap()
    }
}

/// The rectangle around all that is marked, from `home` where it is given [µm].
fn extent(machine: &Machine, job: &Job, is_from_home: bool) -> [i64; 4] {
    let bounds = preview(machine, job, 10_000).unwrap().bounds.unwrap();
    let home = if is_from_home { machine.home } else { [0.0; 3] };
    let at = |point: [f64; 3], row: usize| ((point[row] - home[row]) * 1e6).round() as i64;
    [at(bounds.lower, 0), at(bounds.lower, 1), at(bounds.upper, 0), at(bounds.upper, 1)]
}

fn note(job: &Job) -> Option<&str> {
    let mut notes = job.drawing.notes.iter().map(|note| note.text.as_str());
    notes.find(|text| text.contains("no room around home"))
}

#[test]
fn where_there_is_no_room_around_home_it_lies_in_the_middle() {
    let folder = Folder::new();
    let gantry = machine("gantry", &[]);
    let job = folder.job("a.svg", DRAWING, &[], &gantry);
    assert_eq!(extent(&gantry, &job, false), [260_000, 185_000, 340_000, 215_000]);
    assert_eq!(
        note(&job).unwrap(),
        "there is no room around home: it lies in the middle of the area, at [\"-290 mm\", \"-190 mm\"] from \
         home; `at` puts it elsewhere"
    );
    plan(&gantry, &job).unwrap();
    // The same place, written.
    let at = r#"drawing.at=["-290 mm", "-190 mm"]"#;
    let written = folder.job("a.svg", DRAWING, &[at], &gantry);
    assert_eq!(extent(&gantry, &written, false), extent(&gantry, &job, false));
    assert_eq!(note(&written), None);
    // With its corner there it has room.
    let fits = folder.job("a.svg", DRAWING, &["drawing.anchor=upper_right"], &gantry);
    assert_eq!(extent(&gantry, &fits, true), [-80_000, -30_000, 0, 0]);
    assert_eq!(note(&fits), None);
}

#[test]
fn where_there_is_room_around_home_it_stays() {
    let folder = Folder::new();
    for (name, machine) in [
        ("corexy", machine("corexy", &[])),
        ("edge", machine("corexy", &[r#"home=["159.99 mm", "184.99 mm"]"#])),
        ("five_bar", machine("five_bar", &[])),
        ("galvo", machine("galvo", &[])),
        ("polar", machine("polar", &[])),
    ] {
        let job = folder.job("a.svg", DRAWING, &[], &machine);
        assert_eq!(extent(&machine, &job, true), [-40_000, -15_000, 40_000, 15_000], "{name}");
        assert_eq!(note(&job), None, "{name}");
    }
}

#[test]
fn all_of_a_job_is_moved_together() {
    let folder = Folder::new();
    let gantry = machine("gantry", &[]);
    let array = ["drawing.array.columns=3", r#"drawing.array.spacing=["100 mm", "0 mm"]"#];
    let job = folder.job("a.svg", DRAWING, &array, &gantry);
    assert_eq!(extent(&gantry, &job, false), [160_000, 185_000, 440_000, 215_000]);
    // Two files keep their places to each other.
    folder.file("a.svg", DRAWING);
    let text = "[drawings.one]\nfile = \"a.svg\"\n[drawings.two]\nfile = \"a.svg\"\nrotation = \"90 deg\"\n";
    let job = folder.job("two.toml", text, &[], &gantry);
    assert_eq!(extent(&gantry, &job, false), [260_000, 160_000, 340_000, 240_000]);
    assert!(note(&job).is_some());
    // One that says where it lies is seen from home, and so are the others.
    let job =
        folder.job("two.toml", &format!("{text}at = [\"-200 mm\", \"-100 mm\"]\n"), &[], &gantry);
    assert_eq!(extent(&gantry, &job, true), [-215_000, -140_000, 40_000, 15_000]);
    assert_eq!(note(&job), None);
}

#[test]
fn the_cut_beside_a_line_needs_room_too() {
    let folder = Folder::new();
    let settings = [r#"home=["159.9 mm", "184.9 mm"]"#];
    let corner = machine("corexy", &settings);
    let kerf = ["layers.red.kerf=1 mm"];
    let job = folder.job("a.svg", DRAWING, &kerf, &corner);
    assert_eq!(extent(&corner, &job, false), [59_500, 84_500, 140_500, 115_500]);
    // Its frame is shown where it will lie.
    let frame = [kerf[0], "frame.power=1 %"];
    let job = folder.job("a.svg", DRAWING, &frame, &corner);
    assert_eq!(extent(&corner, &job, false), [60_000, 85_000, 140_000, 115_000]);
}

#[test]
fn images_texts_codes_and_letters_find_room_as_well() {
    let folder = Folder::new();
    let gantry = machine("gantry", &[]);
    let mut image = Vec::new();
    image.extend(b"BM");
    // 8 by 4 black pixels of 24 bits at 1000 pixels in a metre.
    for word in [54_u32 + 96, 0, 54, 40, 8, 4, 1 | 24 << 16, 0, 96, 1000, 1000, 0, 0] {
        image.extend(word.to_le_bytes());
    }
    image.extend([0_u8; 96]);
    let wide = overrides(&["drawing.width=40 mm"]);
    let image = Job::read(&folder.file("a.bmp", image), &wide, &gantry).unwrap();
    let [left, low, right, high] = extent(&gantry, &image, false);
    assert_eq!([left + right, low + high], [600_000, 400_000]);
    assert_eq!(right - left, 40_000);
    for text in [
        "[drawing.text]\ncontent = \"Graver\"\nheight = \"10 mm\"\n",
        "[drawing.code]\nqr = \"Graver\"\nmodule = \"1 mm\"\n",
        "[letters]\ntext = \"NASO\"\n",
        "[letters]\ntext = \"NASO\"\nstyle = \"h1\"\n",
    ] {
        let job = folder.job("it.toml", text, &[], &gantry);
        assert!(note(&job).is_some(), "{text}");
        plan(&gantry, &job).unwrap();
        let [left, low, right, high] = extent(&gantry, &job, false);
        // Hatch lines lie a little within.
        assert!((left + right - 600_000).abs() < 200, "{text}: {left} {right}");
        assert!((low + high - 400_000).abs() < 200, "{text}: {low} {high}");
    }
}

#[test]
fn what_is_too_large_is_told_with_both_sizes() {
    let folder = Folder::new();
    let gantry = machine("gantry", &[]);
    for (settings, right) in [
        (
            &["drawing.width=700 mm"][..],
            "what is drawn is 700.000 mm × 262.500 mm, and the area of the machine 600.000 mm × 400.000 mm: make \
             it smaller",
        ),
        (
            &["drawing.height=500 mm", "drawing.width=300 mm"],
            "what is drawn is 300.000 mm × 500.000 mm, and the area of the machine 600.000 mm × 400.000 mm: make \
             it smaller, or turn it by 90 degrees",
        ),
    ] {
        for at in [None, Some(r#"drawing.at=["-290 mm", "-190 mm"]"#)] {
            let settings: Vec<&str> = settings.iter().copied().chain(at).collect();
            let job = folder.job("a.svg", DRAWING, &settings, &gantry);
            let refused = plan(&gantry, &job).unwrap_err();
            assert!(matches!(refused, PlanError::TooLarge(_)), "{refused}");
            assert_eq!(refused.to_string(), right);
        }
    }
    let framed = ["drawing.width=700 mm", "marking.frame=true"];
    let refused = plan(&gantry, &folder.job("a.svg", DRAWING, &framed, &gantry)).unwrap_err();
    assert!(matches!(refused, PlanError::TooLarge(_)), "{refused}");
}

#[test]
fn what_lies_on_a_surface_is_not_moved() {
    let folder = Folder::new();
    let mcm = machine("mcm", &[]);
    let surface = ["surface.cylinder.radius=40 mm", "surface.cylinder.height=60 mm"];
    let job = folder.job("a.svg", DRAWING, &surface, &mcm);
    assert_eq!(note(&job), None);
}
