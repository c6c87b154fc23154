//! Captures of the scope as runs of the project: single shots of the page, and the signals around each fault.

use std::fs::File;
use std::path::Path;
use std::time::SystemTime;

use super::runs::Runs;
use super::{Live, LiveError, Shared};
use crate::catalogue::{CAPTURE, RunOrigin};
use stickslip_base::{Error, Summary, Watch, output};
use stickslip_bench::run::channels;
use stickslip_recording::capture::Segment;
use stickslip_recording::export::{self, Part};
use stickslip_recording::samples::{Head, SampledSignal, Samples};

/// Longest name.
const LONGEST: usize = 80;
/// The format that needs no conversion.
const MDF: &str = "mf4";

impl Runs {
    /// Saves samples as a run with this name. Returns its number.
    pub(super) fn save_capture(&self, samples: &Samples, name: &str, preset: String) -> Result<i64, Error> {
        let begun = SystemTime::now();
        let (number, folder) = self.folder("capture")?;
        output::create_folder(&folder)?;
        samples.write(&folder.join(CAPTURE), name)?;
        let mut summary = Summary::new("capture");
        summary.result("capture.rows", samples.cycles.len() as f64, "1").file(CAPTURE);
        summary.write(&folder)?;
        let number = i64::try_from(number).unwrap_or_default();
        let duration = samples.cycles.len() as f64 / samples.head.rate;
        let origin = RunOrigin::now(&folder, begun, Some(preset));
        let origin = RunOrigin { number: Some(number), words: Some(name.into()), duration, automatic: true, ..origin };
        self.enter_now(&origin)
    }
}

impl Shared {
    /// Saves the signals around a fault, named by its code, in a cycle.
    pub(super) fn save_fault(&self, segment: Segment, code: &str, cycle: u64) -> Result<i64, Error> {
        let signal = |entry: stickslip_base::parameters::Entry| SampledSignal {
            name: entry.path,
            unit: entry.field.unit.into(),
            help: entry.field.help.into(),
        };
        let head = Head {
            rate: self.parameters.rate(),
            trigger: Some(cycle),
            signals: channels().into_iter().map(signal).collect(),
        };
        let samples = Samples { head, cycles: segment.cycles, columns: segment.columns };
        let name = format!("fault, {}", code.replace('-', " "));
        self.runs.save_capture(&samples, &name, self.parameters.file())
    }
}

impl Live {
    /// Saves samples of the page's scope as a run. Returns its number.
    ///
    /// # Errors
    /// Invalid samples or name; [`Error::File`].
    pub fn keep_samples(&self, name: &str, bytes: &[u8]) -> Result<i64, Error> {
        let name = name.trim();
        if name.is_empty() || name.chars().count() > LONGEST {
            let remedy = "The name of a capture has 1 to 80 characters.";
            return Err(LiveError::RunText { text: name.into(), remedy }.into());
        }
        self.shared.runs.save_capture(&Samples::read(bytes)?, name, self.shared.parameters.file())
    }

    /// Samples of a saved capture.
    ///
    /// # Errors
    /// As [`run_file`](Self::run_file); an unreadable file.
    pub fn kept_samples(&self, number: i64) -> Result<Vec<u8>, Error> {
        Samples::read_file(&self.run_file(number, CAPTURE)?).map(|samples| samples.to_bytes())
    }

    /// Samples of the page's scope as a file for other programs; the file is deleted when it is closed.
    ///
    /// # Errors
    /// Invalid samples; an unknown kind of file; [`Error::File`].
    pub fn export_samples(&self, bytes: &[u8], kind: &str, watch: &Watch) -> Result<File, Error> {
        // Checked before it becomes part of a file name.
        if kind != MDF {
            export::check_kind(kind)?;
        }
        let samples = Samples::read(bytes)?;
        let folder = tempfile::tempdir();
        let folder = folder.map_err(|source| Error::file(&std::env::temp_dir(), "write into", source))?;
        let recorded = folder.path().join("scope.mf4");
        samples.write(&recorded, "stickslip serve, export of the scope")?;
        let exported = folder.path().join(format!("export.{kind}"));
        let path: &Path = if kind == MDF { &recorded } else { &exported };
        if kind != MDF {
            export::export(&recorded, path, &Part::default(), watch)?;
        }
        File::open(path).map_err(|source| Error::file(path, "open", source))
    }
}
