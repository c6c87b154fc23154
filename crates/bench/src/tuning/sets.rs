//! Named parameter sets as files of a project.

use std::path::{Path, PathBuf};

use stickslip_base::parameters::presets::Source;
use stickslip_base::parameters::schema::nearest;
use stickslip_base::{Error, output};

/// The folder of a project's named sets: `NAME.toml`, each a whole parameter file.
#[derive(Clone, Debug)]
pub struct Sets {
    folder: PathBuf,
}

impl Sets {
    /// Sets in this folder, which need not exist yet.
    pub fn new(folder: &Path) -> Self {
        Sets { folder: folder.into() }
    }

    /// Saves a set; an existing set with this name is replaced.
    ///
    /// # Errors
    /// [`Error::Answer`] for an invalid name; [`Error::File`].
    pub fn save(&self, name: &str, text: &str) -> Result<(), Error> {
        let path = self.path(name)?;
        output::create_folder(&self.folder)?;
        output::write(&path, text)
    }

    /// The set with this name.
    ///
    /// # Errors
    /// [`Error::Unknown`] with the nearest name; [`Error::File`].
    pub fn find(&self, name: &str) -> Result<Source, Error> {
        let path = self.path(name)?;
        match std::fs::read_to_string(&path) {
            Ok(text) => Ok(Source { file: path.display().to_string(), text }),
            Err(source) if source.kind() == std::io::ErrorKind::NotFound => {
                let names = self.names();
                let remedy = match nearest(name, names.iter().map(String::as_str)) {
                    Some(nearest) => format!("Did you mean {nearest}?"),
                    None if names.is_empty() => "No set is saved yet.".into(),
                    None => format!("Available: {}.", names.join(", ")),
                };
                Err(Error::Unknown { what: "parameter set", name: name.into(), remedy })
            }
            Err(source) => Err(Error::file(&path, "read", source)),
        }
    }

    /// The names, sorted.
    pub fn names(&self) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(&self.folder) else { return Vec::new() };
        let name = |path: PathBuf| {
            (path.extension()? == "toml").then(|| Some(path.file_stem()?.to_str()?.to_owned())).flatten()
        };
        let mut names: Vec<_> = entries.filter_map(|entry| name(entry.ok()?.path())).collect();
        names.sort();
        names
    }

    /// The file of a name. Only letters, digits, `-` and `_` are permitted, so that the file is inside the folder.
    fn path(&self, name: &str) -> Result<PathBuf, Error> {
        let permitted = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.len() > 64 || !name.chars().all(permitted) {
            return Err(Error::Answer {
                question: "name of a parameter set".into(),
                answer: name.into(),
                remedy: "Use up to 64 letters, digits, `-` and `_`.".into(),
            });
        }
        Ok(self.folder.join(format!("{name}.toml")))
    }
}
