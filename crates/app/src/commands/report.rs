//! `stickslip report`: the report of saved results, or one that compares several.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use stickslip::output;
use stickslip::report::Report;

use crate::failure::Failure;

/// Results and page of the report.
#[derive(Args)]
pub(crate) struct ReportCommand {
    /// Folders with a report.json, or numbers of runs in the catalogue. Curves of several results are overlaid.
    #[arg(required = true, value_name = "DIR")]
    results: Vec<PathBuf>,
    /// Page to write [default: report.html in the folder of the data; stickslip-out/comparison.html for several].
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
}

impl ReportCommand {
    /// Reads the results and writes the page. All invalid folders are reported together.
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let (mut reports, mut errors) = (Vec::new(), Vec::new());
        let results: Vec<PathBuf> =
            self.results.iter().map(|run| super::runs::run_path(run)).collect::<Result<_, _>>()?;
        for (path, name) in results.iter().zip(names(&results)) {
            match Report::read(path) {
                Ok(report) => reports.push((name, report)),
                Err(error) => errors.push(error),
            }
        }
        if !errors.is_empty() {
            return Err(Failure::Several(errors));
        }
        let default_page = |path: &Path| match path.is_dir() {
            true => path.join("report.html"),
            false => path.with_file_name("report.html"),
        };
        let page = self.out.unwrap_or_else(|| match results.as_slice() {
            [one] => default_page(one),
            _ => "stickslip-out/comparison.html".into(),
        });
        let report = match reports.len() {
            1 => reports.remove(0).1,
            _ => Report::together(reports),
        };
        if let Some(folder) = page.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            output::create_folder(folder)?;
        }
        output::write(&page, report.html())?;
        Ok(writeln!(out, "Report with figures: {}", page.display())?)
    }
}

/// The names of the folders; the given paths if two names are the same.
fn names(paths: &[PathBuf]) -> Vec<String> {
    let short = |path: &PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let distinct: std::collections::BTreeSet<_> = paths.iter().map(short).collect();
    let name = |path: &PathBuf| short(path).filter(|_| distinct.len() == paths.len());
    paths.iter().map(|path| name(path).unwrap_or_else(|| path.display().to_string())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_with_the_same_name_have_their_paths_as_names() {
        let names = |paths: &[&str]| names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(names(&["old/demo", "new/emps/"]), ["demo", "emps"]);
        assert_eq!(names(&["old/demo", "new/demo"]), ["old/demo", "new/demo"]);
        assert_eq!(names(&["."]), ["."]);
    }
}
