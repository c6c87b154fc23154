//! Small JSON files of the project's state, each with its schema: written completely or not at all.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::LiveError;
use stickslip_base::{Error, input, output};

/// A file of the state.
#[derive(Clone, Debug)]
pub(super) struct StateFile {
    path: PathBuf,
    schema: &'static str,
}

/// Contents with their schema.
#[derive(Serialize, Deserialize)]
struct Versioned<T> {
    schema: String,
    #[serde(flatten)]
    contents: T,
}

impl StateFile {
    pub(super) fn new(folder: &Path, name: &str, schema: &'static str) -> Self {
        StateFile { path: folder.join(name), schema }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The contents; `None` if the file does not exist.
    ///
    /// # Errors
    /// [`LiveError::State`] with the name of a file that cannot be read.
    pub(super) fn read<T: DeserializeOwned>(&self) -> Result<Option<T>, Error> {
        let unreadable = |fault: String| LiveError::State { path: self.path.clone(), fault };
        match fs::metadata(&self.path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            found => found.map_err(|error| unreadable(error.to_string()))?,
        };
        let text = input::text(&self.path, input::RESULT).map_err(|error| unreadable(error.to_string()))?;
        let versioned: Versioned<T> = serde_json::from_str(&text).map_err(|error| unreadable(error.to_string()))?;
        if versioned.schema != self.schema {
            let fault = format!("its format is {}, this version reads {}", versioned.schema, self.schema);
            return Err(unreadable(fault).into());
        }
        Ok(Some(versioned.contents))
    }

    /// Replaces the contents.
    ///
    /// # Errors
    /// [`Error::File`]; the old contents are unchanged.
    pub(super) fn write<T: Serialize>(&self, contents: T) -> Result<(), Error> {
        if let Some(folder) = self.path.parent() {
            output::create_folder(folder)?;
        }
        let versioned = Versioned { schema: self.schema.into(), contents };
        let mut text = serde_json::to_string_pretty(&versioned).expect("strings and numbers");
        text.push('\n');
        output::write(&self.path, text)
    }

    /// Preserves the present contents under another name, if there are any.
    pub(super) fn set_aside(&self, name: &str) -> Result<(), Error> {
        let to = self.path.with_file_name(name);
        match fs::rename(&self.path, &to) {
            Err(source) if source.kind() != ErrorKind::NotFound => Err(Error::file(&self.path, "rename", source)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Contents {
        value: f64,
    }

    #[test]
    fn a_damaged_file_and_one_of_another_version_are_refused_with_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let file = StateFile::new(&folder.path().join("state"), "target.json", "stickslip.test/2");
        assert_eq!(file.read::<Contents>().unwrap(), None);
        file.write(Contents { value: 0.1 + 0.2 }).unwrap();
        assert_eq!(file.read().unwrap(), Some(Contents { value: 0.1 + 0.2 }));
        let whole = fs::read_to_string(file.path()).unwrap();
        for (text, fault) in [(&whole[..whole.len() / 2], "EOF"), (&whole.replace("test/2", "test/1"), "test/1")] {
            fs::write(file.path(), text).unwrap();
            let error = file.read::<Contents>().unwrap_err().to_string();
            assert!(error.contains("target.json") && error.contains(fault), "{error}");
        }
        file.set_aside("target-before.json").unwrap();
        assert!(!file.path().exists() && file.path().with_file_name("target-before.json").exists());
        file.set_aside("target-before.json").unwrap();
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_reported_and_the_old_state_stays() {
        let folder = tempfile::tempdir().unwrap();
        let file = StateFile::new(folder.path(), "target.json", "stickslip.test/1");
        std::os::unix::fs::symlink("/dev/full", file.path()).unwrap();
        let error = file.write(Contents { value: 1.0 }).unwrap_err().to_string();
        assert!(error.contains("target.json") && error.contains("make room"), "{error}");
    }
}
