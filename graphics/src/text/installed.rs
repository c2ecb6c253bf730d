//! The fonts of this computer, by name.

use std::sync::{Arc as Shared, OnceLock};

use fontdb::{Database, FaceInfo, ID, Source, Stretch, Style};

use super::Font;
use crate::ReadError;

/// The most names that an error lists.
const MOST_NAMES: usize = 20;

/// Fonts by name.
#[derive(Debug, Clone)]
pub struct Installed {
    /// All of them, the built-in one among them.
    pub(crate) faces: Shared<Database>,
    /// The built-in one.
    pub(crate) built_in: Option<ID>,
}

impl Installed {
    /// Those of this computer, looked for once.
    pub fn here() -> &'static Self {
        static HERE: OnceLock<Installed> = OnceLock::new();
        HERE.get_or_init(|| {
            let mut faces = Database::new();
            faces.load_system_fonts();
            Self::of(faces)
        })
    }

    /// These `faces` and the built-in font.
    pub(crate) fn of(mut faces: Database) -> Self {
        let bytes = Source::Binary(Shared::new(epaint_default_fonts::UBUNTU_LIGHT));
        let built_in = faces.load_font_source(bytes).first().copied();
        Self { faces: Shared::new(faces), built_in }
    }

    /// The font called `name`, in upper or lower case: a family, of which the upright style nearest to
    /// regular is taken, or the PostScript name of one style, such as `DejaVuSans-Bold`.
    ///
    /// # Errors
    ///
    /// Where there is none, with the names that there are; or where it cannot be read.
    pub fn font(&self, name: &str) -> Result<Font, ReadError> {
        let named = self.faces.faces().filter(|face| is_called(face, name));
        let Some(face) = named.min_by_key(|face| plainness(face)) else {
            return Err(self.unknown(name));
        };
        let font = self.faces.with_face_data(face.id, Font::of_collection);
        font.unwrap_or_else(|| {
            let message = format!("the file of the font \"{name}\" cannot be read");
            Err(ReadError::new(message, "install it again, or give another font"))
        })
    }

    /// The families, each once.
    fn families(&self) -> Vec<&str> {
        let names = self.faces.faces().filter_map(|face| face.families.first());
        let mut names: Vec<&str> = names.map(|(name, _)| name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    fn unknown(&self, name: &str) -> ReadError {
        let names = self.families();
        let more = match names.len().saturating_sub(MOST_NAMES) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let listed = names.iter().take(MOST_NAMES).copied().collect::<Vec<_>>().join(", ");
        ReadError::new(
            format!("no font is called \"{name}\""),
            format!(
                "installed are {listed}{more}; else give the path of a font file (.ttf, .otf), or \
                 single_line or outline, which are built in"
            ),
        )
    }
}

fn is_called(face: &FaceInfo, name: &str) -> bool {
    let families = face.families.iter().map(|(family, _)| family.as_str());
    families.chain([face.post_script_name.as_str()]).any(|known| known.eq_ignore_ascii_case(name))
}

/// How far a style is from the regular one.
fn plainness(face: &FaceInfo) -> (bool, bool, u16) {
    let is_plain = face.style == Style::Normal;
    (!is_plain, face.stretch != Stretch::Normal, face.weight.0.abs_diff(400))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_font_is_found_by_its_family_and_by_its_style() {
        let fonts = Installed::of(Database::new());
        let family = fonts.families().first().map(|name| (*name).to_owned());
        let family = family.expect("the built-in font has a name");
        assert!(fonts.font(&family.to_uppercase()).is_ok());
        let style = fonts.faces.faces().map(|face| face.post_script_name.clone()).next();
        assert!(fonts.font(&style.expect("a face")).is_ok());
    }

    #[test]
    fn an_unknown_name_is_told_with_those_that_exist() {
        let error = Installed::of(Database::new()).font("No Such Font").expect_err("unknown");
        assert_eq!(error.message, "no font is called \"No Such Font\"");
        assert!(error.help.starts_with("installed are Ubuntu"), "{}", error.help);
    }
}
