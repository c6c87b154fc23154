//! Zip archives: the same bytes for the same files.

use std::io::{Cursor, Write};

use zip::result::{ZipError, ZipResult};
use zip::write::{SimpleFileOptions, ZipWriter};

use stickslip_base::Error;

/// Names and contents as an archive; `name` is for messages.
///
/// # Errors
/// [`Error::File`] if a name or a size exceeds the limits of an archive.
pub fn archive<'a>(name: &str, files: impl IntoIterator<Item = (String, &'a [u8])>) -> Result<Vec<u8>, Error> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let pack = || -> ZipResult<()> {
        for (name, contents) in files {
            archive.start_file(name, SimpleFileOptions::default())?;
            archive.write_all(contents)?;
        }
        Ok(())
    };
    let packed = pack().and_then(|()| archive.finish());
    let error_of = |error: ZipError| Error::file(name.as_ref(), "pack", std::io::Error::other(error));
    packed.map(Cursor::into_inner).map_err(error_of)
}
