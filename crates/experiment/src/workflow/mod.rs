//! The work on the bench in steps that leave files: measure, fit, design, render.
//!
//! Each step is a function from values to a result, and a result writes itself into a folder: `summary.json`, the
//! report, tables. The next step reads the files of the one before; [`demo`](crate::demo) does all on one bench.

pub mod calibrate;
pub mod correct;
pub mod design;
pub mod draw;
pub mod experiment;
pub mod fit;
pub mod hunting;
pub mod judged;
pub mod measure;
pub mod position_loop;
pub mod render;
pub mod results;
pub mod sketch;
mod through;

use std::path::Path;

use stickslip_base::table::{Column, write_csv};
use stickslip_base::{Error, Summary, output};
use stickslip_recording::table::write_parquet;

/// Writes columns as `STEM.csv` and `STEM.parquet`.
///
/// # Errors
/// [`Error::File`] if the system refuses.
pub fn write_columns(summary: &mut Summary, stem: &str, columns: &[Column], directory: &Path) -> Result<(), Error> {
    output::create_folder(directory)?;
    for (ending, write) in [("csv", write_csv as fn(&Path, &[Column]) -> _), ("parquet", write_parquet)] {
        let name = format!("{stem}.{ending}");
        write(&directory.join(&name), columns)?;
        summary.file(&name);
    }
    Ok(())
}
