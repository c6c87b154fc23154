//! Parameter sets by name, which are built in, or by path.

use std::path::Path;

use stickslip_core::fields::Fields;

use super::read::read;
use super::schema::nearest;
use super::{IDENTIFIED, UNCERTAINTY};
use crate::{Error, input};

/// The built-in presets: name and text.
const PRESETS: &[(&str, &str)] = &[
    ("clm-bench", include_str!("../../../../presets/clm-bench.toml")),
    ("clm-real", include_str!("../../../../presets/clm-real.toml")),
    ("clm-soft", include_str!("../../../../presets/clm-soft.toml")),
    ("prototype", include_str!("../../../../presets/prototype.toml")),
    ("emps", include_str!("../../../../presets/emps.toml")),
];

/// The text of a parameter file.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Name in messages: the path as given, or `presets/NAME.toml`.
    pub file: String,
    /// Its contents.
    pub text: String,
}

impl Source {
    /// Whether the text itself has a value or a table at a dotted path; false if it is not TOML.
    pub fn states(&self, path: &str) -> bool {
        let table: Option<toml::Table> = self.text.parse().ok();
        let mut value = table.map(toml::Value::Table);
        for key in path.split('.') {
            value = value.and_then(|value| value.get(key).cloned());
        }
        value.is_some()
    }

    /// The source, if its text has a value or a table at a dotted path: a file holds what it is given for, and the rest
    /// of the parameters would otherwise be defaults without notice. A built-in preset is complete with its defaults.
    ///
    /// # Errors
    /// [`Error::Document`] with the missing table; an invalid file is left to [`read`](Self::read).
    pub fn stating(self, path: &str, remedy: &'static str) -> Result<Self, Error> {
        let is_built_in = PRESETS.iter().any(|(_, text)| *text == self.text);
        if is_built_in || self.states(path) || self.text.parse::<toml::Table>().is_err() {
            return Ok(self);
        }
        let reason = format!("missing table [{path}]");
        Err(Error::Document { path: self.file.into(), place: None, reason, remedy })
    }

    /// The parameters in it.
    ///
    /// # Errors
    /// [`Error::Parameters`] with all problems of the file.
    pub fn read<P: Fields<f64> + Default>(&self) -> Result<P, Error> {
        Ok(read(&self.text, &self.file)?)
    }
}

/// Names and descriptions of the presets: the first comment line of its file.
pub fn list() -> impl Iterator<Item = (&'static str, &'static str)> {
    PRESETS.iter().map(|(name, text)| (*name, first_comment(text)))
}

/// The preset of this name, or else the file at this path.
///
/// # Errors
/// [`Error::UnknownPreset`] with the nearest name; [`Error::File`] where a file cannot be read.
pub fn find(name_or_path: &str) -> Result<Source, Error> {
    find_among(PRESETS, name_or_path)
}

fn find_among(presets: &[(&'static str, &str)], name_or_path: &str) -> Result<Source, Error> {
    if let Some((name, text)) = presets.iter().find(|(name, _)| *name == name_or_path) {
        return Ok(Source { file: format!("presets/{name}.toml"), text: (*text).into() });
    }
    let path = Path::new(name_or_path);
    let looks_like_a_path = path.components().count() > 1 || path.extension().is_some() || path.exists();
    if !looks_like_a_path {
        let known: Vec<_> = presets.iter().map(|(name, _)| *name).collect();
        let nearest = nearest(name_or_path, known.iter().copied());
        return Err(Error::UnknownPreset { name: name_or_path.into(), nearest, known });
    }
    let text = input::text(path, input::TEXT)?;
    if text.parse().is_ok_and(|table: toml::Table| !has_parameters(&table)) {
        let reason = "it has no parameter".into();
        let remedy =
            "Give a file with values under [plant], [model] or [bench]; `stickslip params write clm-bench` prints one.";
        return Err(Error::Document { path: path.into(), place: None, reason, remedy });
    }
    Ok(Source { file: name_or_path.into(), text })
}

/// Whether a file has a value, known or not, besides the results of an identification or a fit.
fn has_parameters(table: &toml::Table) -> bool {
    let is_result = |key: &str| [IDENTIFIED, UNCERTAINTY].contains(&key);
    table.iter().any(|(key, value)| !is_result(key) && has_value(value))
}

/// Whether there is a value in a table or in one below it.
fn has_value(value: &toml::Value) -> bool {
    value.as_table().is_none_or(|table| table.values().any(has_value))
}

fn first_comment(text: &'static str) -> &'static str {
    text.lines().next().and_then(|line| line.strip_prefix('#')).unwrap_or_default().trim()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use crate::parameters::{diff, flatten, write_commented};

    #[test]
    fn every_preset_has_a_description_and_is_complete_when_written() {
        for (name, about) in list() {
            assert!(!about.is_empty(), "{name}");
            let preset: Preset<f64> = find(name).unwrap().read().unwrap_or_else(|error| panic!("{error}"));
            let back: Preset<f64> = read(&write_commented(&preset), name).unwrap_or_else(|error| panic!("{error}"));
            assert!(diff(&preset, &back).is_empty(), "{name}: {:?}", diff(&preset, &back));
        }
    }

    #[test]
    fn a_file_without_parameters_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("empty.toml");
        for text in ["", "# A comment.\n", "[plant]\n[model.own]\n", "[identified]\nmass = 1.0\n"] {
            std::fs::write(&path, text).unwrap();
            let message = find(path.to_str().unwrap()).unwrap_err().to_string();
            assert!(message.contains("empty.toml: it has no parameter. Give a file with values"), "{text}: {message}");
        }
        std::fs::write(&path, "[bench]\ntick_rate = 2000\n").unwrap();
        assert!(find("clm-bench").unwrap().stating("model.own", "").is_ok());
        let source = find(path.to_str().unwrap()).unwrap();
        let message = source.stating("model.own", "Give a fit.toml.").unwrap_err().to_string();
        assert!(message.ends_with("empty.toml: missing table [model.own]. Give a fit.toml."), "{message}");
    }

    #[test]
    fn no_two_values_of_a_preset_share_a_path() {
        // A field with the name of the key of its choice would have the same path.
        for (name, _) in list() {
            let preset: Preset<f64> = find(name).unwrap().read().unwrap_or_else(|error| panic!("{error}"));
            let mut paths: Vec<_> = flatten(&preset).into_iter().map(|entry| entry.path).collect();
            let count = paths.len();
            paths.sort();
            paths.dedup();
            assert_eq!(paths.len(), count, "{name}");
        }
    }

    const TWO: &[(&str, &str)] = &[("clm-bench", "# Ideal.\nrate = 1\n"), ("clm-real", "")];

    #[test]
    fn a_preset_is_read_by_its_name() {
        let source = find_among(TWO, "clm-bench").unwrap();
        assert_eq!((source.file.as_str(), first_comment(TWO[0].1)), ("presets/clm-bench.toml", "Ideal."));
        assert_eq!(first_comment(TWO[1].1), "");
    }

    #[test]
    fn values_of_a_text_differ_from_defaults() {
        let source = Source { file: "x".into(), text: "[model.own]\nkinetic_torque = 0.1\n".into() };
        assert!(source.states("model.own") && source.states("model.own.kinetic_torque"));
        assert!(!source.states("model.own.breakaway_torque") && !source.states("plant"));
        assert!(!Source { text: "[model".into(), ..source }.states("model"));
    }

    #[test]
    fn an_unknown_name_gets_the_nearest_or_all() {
        let message = |name| find_among(TWO, name).unwrap_err().to_string();
        assert_eq!(
            message("clm-bensh"),
            "unknown preset clm-bensh. Did you mean clm-bench? A path to a file is accepted, too."
        );
        assert_eq!(message("x"), "unknown preset x. Presets: clm-bench, clm-real. A path to a file is accepted, too.");
    }

    #[test]
    fn a_file_is_read_by_its_path_and_a_missing_one_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine");
        std::fs::write(&path, "rate = 2").unwrap();
        let name = path.to_str().unwrap();
        assert_eq!(find_among(TWO, name).unwrap(), Source { file: name.into(), text: "rate = 2".into() });
        let error = find_among(TWO, "absent.toml").unwrap_err();
        assert!(matches!(&error, Error::File { action: "read", .. }), "{error}");
    }
}
