//! Files as one: a zip archive, the same bytes for the same files.

use std::io::{Cursor, Write};

use zip::result::{ZipError, ZipResult};
use zip::write::{SimpleFileOptions, ZipWriter};

use stickslip_base::Error;

/// Names and contents as an archive, which messages call `name`.
///
/// # Errors
/// [`Error::File`] where a name or a size is more than an archive takes.
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
    let broken = |error: ZipError| Error::file(name.as_ref(), "pack", std::io::Error::other(error));
    packed.map(Cursor::into_inner).map_err(broken)
}
