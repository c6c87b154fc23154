//! The host process of an external file: it opens the library and calls it.

use crate::BenchError;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use stickslip_rt::{Responder, take_over};

use super::Role;
use super::library::Library;
use super::process::MESSAGES;
use super::wire::{self, QUESTION};
use stickslip_base::Error;

/// Interval of the checks whether the bench still exists.
const LOOK: Duration = Duration::from_millis(100);

/// Opens the library, or the FMU with these variables as signals, sends its description, and answers until the bench
/// ends. Implements `stickslip host`.
///
/// # Errors
/// [`Error::File`] if the connection to the bench fails.
pub fn host(path: &Path, role: Role, map: &[(String, String)]) -> Result<(), Error> {
    let lost = |source| Error::file(Path::new("standard input"), "talk through", source);
    let mut socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned().map_err(lost)?);
    let memory = take_over(&socket).map_err(lost)?;
    let mut responder = Responder::open(&memory, QUESTION).map_err(lost)?;
    drop(memory);
    // The folder that the bench created for this process.
    let opened = Library::open(path, role, map, Some(std::env::temp_dir().join(MESSAGES)));
    let description = wire::encode_description(match &opened {
        Ok(library) => Ok(library.description()),
        Err(error) => Err(match error.of() {
            Some(BenchError::External { problem, .. }) => problem.clone(),
            _ => error.to_string(),
        }),
    });
    socket.write_all(&description.len().to_ne_bytes()).and_then(|()| socket.write_all(&description)).map_err(lost)?;
    let Ok(mut library) = opened else { return Ok(()) };
    socket.set_nonblocking(true).map_err(lost)?;
    loop {
        let answer = match responder.question(LOOK) {
            Some(question) => wire::execute(question, &mut library),
            None if is_closed(&mut socket) => return Ok(()),
            None => continue,
        };
        responder.answer(answer);
    }
}

/// Whether the other end has closed its socket, as the system does when a process ends.
fn is_closed(socket: &mut UnixStream) -> bool {
    !matches!(socket.read(&mut [0]), Err(error) if error.kind() == ErrorKind::WouldBlock)
}
