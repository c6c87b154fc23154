//! A serial port as a non-blocking file.

use std::fs::File;
use std::io::Error;
use std::path::Path;

/// Opens a serial port or pseudo-terminal in raw mode, at its present speed (`stty`).
///
/// # Errors
/// Errors of the operating system; a file that is not a serial port.
pub fn open_serial(path: &Path) -> Result<File, Error> {
    crate::system::open_serial(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_a_serial_port_is_refused() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        assert!(open_serial(file.path()).is_err());
        assert!(open_serial(Path::new("/nowhere")).is_err());
    }
}
