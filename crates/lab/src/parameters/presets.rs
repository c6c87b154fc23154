//! Parameter sets by name, which the program brings along, or by path.

use std::path::Path;

use stickslip_core::fields::Fields;

use super::read::read;
use super::schema::nearest;
use crate::Error;

/// The presets that the program brings along: name and text.
const PRESETS: &[(&str, &str)] = &[
    ("clm-bench", include_str!("../../../../presets/clm-bench.toml")),
    ("clm-real", include_str!("../../../../presets/clm-real.toml")),
    ("clm-soft", include_str!("../../../../presets/clm-soft.toml")),
    ("prototype", include_str!("../../../../presets/prototype.toml")),
    ("emps", include_str!("../../../../presets/emps.toml")),
];

/// A parameter file, read but not yet understood.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// How messages call it: the path as given, or `presets/NAME.toml`.
    pub file: String,
    /// Its contents.
    pub text: String,
}

impl Source {
    /// The parameters in it.
    ///
    /// # Errors
    /// [`Error::Parameters`] with all problems of the file.
    pub fn read<P: Fields<f64> + Default>(&self) -> Result<P, Error> {
        Ok(read(&self.text, &self.file)?)
    }
}

/// Names of the presets and what each is: the first comment line of its file.
pub fn list() -> impl Iterator<Item = (&'static str, &'static str)> {
    PRESETS.iter().map(|(name, text)| (*name, first_comment(text)))
}

/// The preset of that name, or else the file at that path.
///
/// # Errors
/// [`Error::UnknownPreset`] with the nearest name; [`Error::File`] where a file cannot be read.
pub fn find(name_or_path: &str) -> Result<Source, Error> {
    if let Some((name, text)) = PRESETS.iter().find(|(name, _)| *name == name_or_path) {
        return Ok(Source { file: format!("presets/{name}.toml"), text: (*text).into() });
    }
    let path = Path::new(name_or_path);
    let looks_like_a_path = path.components().count() > 1 || path.extension().is_some() || path.exists();
    if !looks_like_a_path {
        let names = || PRESETS.iter().map(|(name, _)| *name);
        return Err(Error::UnknownPreset {
            name: name_or_path.into(),
            nearest: nearest(name_or_path, names()),
            known: names().collect(),
        });
    }
    let text = std::fs::read_to_string(path).map_err(|source| Error::file(path, "read", source))?;
    Ok(Source { file: name_or_path.into(), text })
}

fn first_comment(text: &'static str) -> &'static str {
    text.lines().next().and_then(|line| line.strip_prefix('#')).unwrap_or_default().trim()
}
