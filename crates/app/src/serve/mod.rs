//! The server of a running bench, and its client. A token protects the access.

mod client;
mod connections;
mod door;
mod http;
mod known;
mod page;
mod scope;
mod socket;
#[cfg(test)]
mod tests;

pub(crate) use client::{Client, unexpected};
pub(crate) use http::{Server, Timeouts};
pub(crate) use known::{HostName, Known, Origin};

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// Address and token of a running bench, in a file of the project's folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Place {
    /// Address of the server.
    pub(crate) address: SocketAddr,
    /// Secret that gives full control of the bench.
    pub(crate) token: String,
}

impl Place {
    /// Address of the page for a browser.
    pub(crate) fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.token)
    }

    fn file(project: &Path) -> PathBuf {
        project.join("serve.json")
    }

    /// Address and token of the bench that runs for a project.
    ///
    /// # Errors
    /// No bench is running for the project, or the file cannot be read.
    pub(crate) fn find(project: &Path) -> Result<Self, Failure> {
        let none = |reason: String| {
            Failure::Served(format!(
                "no bench is running for {} ({reason}). Start one with `stickslip serve`, or name its folder with --project.",
                project.display()
            ))
        };
        let text = std::fs::read_to_string(Self::file(project)).map_err(|error| none(error.to_string()))?;
        serde_json::from_str(&text).map_err(|error| none(error.to_string()))
    }

    /// Writes the file, readable for the same user only.
    fn write(&self, project: &Path) -> std::io::Result<PlaceFile> {
        let path = Self::file(project);
        let text = serde_json::to_string(self)?;
        write_for_user(&path, &text)?;
        Ok(PlaceFile { path, text })
    }
}

/// The token of a project: the one of the last run, so that open pages reconnect, otherwise a new one.
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

/// Writes a file that only its user can read.
fn write_for_user(path: &Path, text: &str) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::io::Write as _;
        use std::os::unix::fs::OpenOptionsExt as _;
        // An existing file would keep its mode.
        let _ = std::fs::remove_file(path);
        let mut options = std::fs::OpenOptions::new();
        options.write(true).create_new(true).mode(0o600).open(path)?.write_all(text.as_bytes())
    }
    #[cfg(not(unix))]
    std::fs::write(path, text)
}

/// The file with address and token. It is removed at the end, unless another bench has replaced it.
struct PlaceFile {
    path: PathBuf,
    text: String,
}

impl Drop for PlaceFile {
    fn drop(&mut self) {
        if std::fs::read_to_string(&self.path).is_ok_and(|text| text == self.text) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
