//! A serial port as a file that gives what has come and waits for nothing.

use std::fs::File;
use std::io::Error;
use std::path::Path;

/// Opens a serial port, or whatever stands for one: bytes as they are, at the speed that it is set to (`stty`).
///
/// # Errors
/// What the system refuses; one that is no serial port.
pub fn open_serial(path: &Path) -> Result<File, Error> {
    crate::system::open_serial(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_serial_port_is_refused() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        assert!(open_serial(file.path()).is_err());
        assert!(open_serial(Path::new("/nowhere")).is_err());
    }
}
