//! A job that a stranger sent reads the files of its own folder, and there is no way out of it.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use machine::Machine;
use planner::request::JobRequest;

const DRAWING: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width="10mm" height="10mm" viewBox="0 0 10 10">
<path d="M1 1 H 9" fill="none" stroke="black"/></svg>"#;
const PROGRAM: &str = "G21 G90\nM4 S500\nG1 X5 F1000\nM5\nM2\n";
const ROWS: &str = "name\nAda\n";
/// A font that is read, and refused for what is in it.
const BROKEN: &str = "broken";
const CLOUD: &str = "x,y,z\n1,2,0\n";

/// Each kind of file that a job file can name, by the text of the job around `FILE`.
const KINDS: [(&str, &str, &str); 5] = [
    ("drawing.svg", DRAWING, "[drawing]\nfile = \"FILE\"\n"),
    ("program.ngc", PROGRAM, "[gcode]\nfile = \"FILE\"\n"),
    ("cloud.csv", CLOUD, "[cloud]\nfile = \"FILE\"\nunit = \"1 mm\"\ndwell = \"1 ms\"\n"),
    (
        "rows.csv",
        ROWS,
        "[drawing.text]\ncontent = \"{name}\"\nheight = \"5 mm\"\n[drawing.serial]\ncsv = \"FILE\"\n",
    ),
    ("font.ttf", BROKEN, "[drawing.text]\ncontent = \"A\"\nheight = \"5 mm\"\nfont = \"FILE\"\n"),
];

/// A folder with an upload's own folder in it, and files of each kind in both and in a folder of the upload.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        for folder in [place.outside(), place.own(), place.own().join("inner")] {
            fs::create_dir_all(&folder).unwrap();
            for (name, content, _) in KINDS {
                fs::write(folder.join(name), content).unwrap();
            }
        }
        place
    }

    fn outside(&self) -> PathBuf {
        self.0.path().join("outside")
    }

    fn own(&self) -> PathBuf {
        self.0.path().join("own")
    }

    /// What is wrong with the job of this text, in the upload's folder.
    fn refused(&self, text: &str, set: &[String], confined: bool) -> Option<String> {
        let path = self.own().join("job.toml");
        fs::write(&path, text).unwrap();
        refused(&path, set, confined)
    }
}

fn refused(path: &Path, set: &[String], confined: bool) -> Option<String> {
    let request =
        JobRequest { job: Some(path.to_owned()), set: set.to_vec(), offsets: None, confined };
    request.open(&Machine::builtin()).err().map(|refusal| refusal.message)
}

/// What an attempt that leads out is told, with the name of the file.
fn is_not_allowed(told: Option<&String>, name: &str) -> bool {
    told.is_some_and(|told| told.contains(name) && told.contains(runtime::beneath::ALLOWED))
}

#[test]
fn files_of_its_own_folder_are_read() {
    let place = Place::new();
    for (name, content, job) in KINDS {
        for written in [name.to_owned(), format!("inner/{name}"), format!("./{name}")] {
            let told = place.refused(&job.replace("FILE", &written), &[], true);
            match told {
                Some(told) => {
                    assert!(content == BROKEN && !told.contains("may be opened"), "{told}")
                }
                None => assert_ne!(content, BROKEN, "{written}"),
            }
        }
    }
}

#[test]
fn no_way_leads_out_of_its_folder() {
    let place = Place::new();
    for (name, content, job) in KINDS {
        let outside = place.outside().join(name);
        symlink(&outside, place.own().join(format!("link_{name}"))).unwrap();
        let ways = [
            outside.display().to_string(),
            place.own().join(name).display().to_string().replace("/own/", "/own/../own/"),
            format!("../outside/{name}"),
            format!("inner/../../outside/{name}"),
            format!("link_{name}"),
            format!("way/{name}"),
        ];
        if !place.own().join("way").exists() {
            symlink(place.outside(), place.own().join("way")).unwrap();
        }
        for way in ways {
            let text = job.replace("FILE", &way);
            let told = place.refused(&text, &[], true);
            assert!(is_not_allowed(told.as_ref(), name), "{way}: {told:?}");
            // What a person's own job may do.
            let told = place.refused(&text, &[], false);
            assert!(told.is_none() || content == BROKEN, "{way}: {told:?}");
        }
    }
}

#[test]
fn nor_does_a_change_of_it_or_a_link_that_is_the_job_itself() {
    let place = Place::new();
    let (drawing, _, job) = KINDS[0];
    let outside = place.outside().join(drawing);
    let set = [format!("drawing.file={}", outside.display())];
    let told = place.refused(&job.replace("FILE", drawing), &set, true);
    assert!(is_not_allowed(told.as_ref(), drawing), "{told:?}");
    for (name, _, _) in &KINDS[..2] {
        let link = place.own().join(format!("upload_{name}"));
        symlink(place.outside().join(name), &link).unwrap();
        let told = refused(&link, &[], true);
        assert!(is_not_allowed(told.as_ref(), name), "{told:?}");
        assert_eq!(refused(&link, &[], false), None);
        assert_eq!(refused(&place.own().join(name), &[], true), None);
    }
    // One whose kind its content tells, and a job file.
    for (target, link) in [("program.ngc", "upload.job"), ("job.toml", "upload.toml")] {
        fs::write(place.outside().join("job.toml"), job.replace("FILE", drawing)).unwrap();
        let link = place.own().join(link);
        symlink(place.outside().join(target), &link).unwrap();
        assert!(refused(&link, &[], true).is_some(), "{}", link.display());
    }
}
