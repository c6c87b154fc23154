//! The bench behind an address, for whoever has its token.

mod client;
mod door;
mod http;
mod page;
mod socket;
#[cfg(test)]
mod tests;

pub(crate) use client::{Client, unexpected};
pub(crate) use http::{Patience, Server};

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// Where a served bench is found, kept in its project's folder while it runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Place {
    /// Its address.
    pub(crate) address: SocketAddr,
    /// Who has it may do everything that the bench can.
    pub(crate) token: String,
}

impl Place {
    /// For people: a page that a browser can open.
    pub(crate) fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.token)
    }

    fn file(project: &Path) -> PathBuf {
        project.join("serve.json")
    }

    /// Of the bench that is served for a project.
    ///
    /// # Errors
    /// None is, or its file cannot be read.
    pub(crate) fn find(project: &Path) -> Result<Self, Failure> {
        let none = |why: String| {
            Failure::Served(format!(
                "no bench is served for {} ({why}). Start one with `stickslip serve`, or name its project with --project.",
                project.display()
            ))
        };
        let text = std::fs::read_to_string(Self::file(project)).map_err(|error| none(error.to_string()))?;
        serde_json::from_str(&text).map_err(|error| none(error.to_string()))
    }

    /// Leaves it where others of the same user find it.
    fn leave(&self, project: &Path) -> std::io::Result<Left> {
        let path = Self::file(project);
        let text = serde_json::to_string(self)?;
        write_for_user(&path, &text)?;
        Ok(Left { path, text })
    }
}

/// The token of a project: that of the last time, so that an open page finds its bench again, or a new one.
fn token(project: &Path) -> std::io::Result<String> {
    let path = project.join("serve-token");
    if let Ok(token) = std::fs::read_to_string(&path)
        && token.len() == 32
        && token.bytes().all(|byte| byte.is_ascii_hexdigit())
    {
        return Ok(token);
    }
    let mut secret = [0; 16];
    getrandom::fill(&mut secret).map_err(std::io::Error::other)?;
    let token: String = secret.iter().map(|byte| format!("{byte:02x}")).collect();
    write_for_user(&path, &token)?;
    Ok(token)
}

/// Writes a file that its user alone can read.
fn write_for_user(path: &Path, text: &str) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::io::Write as _;
        use std::os::unix::fs::OpenOptionsExt as _;
        // A file that others can read is not written over: its mode would stay.
        let _ = std::fs::remove_file(path);
        let mut options = std::fs::OpenOptions::new();
        options.write(true).create_new(true).mode(0o600).open(path)?.write_all(text.as_bytes())
    }
    #[cfg(not(unix))]
    std::fs::write(path, text)
}

/// Takes the file away again, unless it is another bench's by now.
struct Left {
    path: PathBuf,
    text: String,
}

impl Drop for Left {
    fn drop(&mut self) {
        if std::fs::read_to_string(&self.path).is_ok_and(|text| text == self.text) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
