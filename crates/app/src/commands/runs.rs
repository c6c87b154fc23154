//! `stickslip runs`: the catalogue of runs: search, name, tag, delete.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::{Args, Subcommand};
use serde_json::json;
use stickslip::catalogue::{Catalogue, Details, Found, Run, RunOrigin, State};
use stickslip::quantity::Estimate;

use crate::failure::Failure;

/// Query or action on the catalogue.
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct RunsCommand {
    /// Query: words; law:bristle, tag:good; M_S>0.2 for parameters and results; -word excludes a word.
    query: Vec<String>,
    /// Largest number of runs, the newest first.
    #[arg(long, value_name = "N", default_value_t = 50)]
    limit: u64,
    /// Rebuild the catalogue from the folders: after it was lost, or runs were moved by hand.
    #[arg(long)]
    rebuild: bool,
    #[command(flatten)]
    scope: Scope,
    #[command(subcommand)]
    action: Option<Action>,
}

/// Project and form of the output.
#[derive(Args)]
struct Scope {
    /// Project folder of a running bench outside the working folder.
    #[arg(long, value_name = "DIR", global = true)]
    project: Option<PathBuf>,
    /// Print JSON.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Action {
    /// Show all data of a run.
    #[command(after_help = "Example: stickslip runs show 1")]
    Show {
        /// Number of the run.
        number: i64,
    },
    /// Rename a run.
    #[command(after_help = "Example: stickslip runs rename 1 \"before the repair\"")]
    Rename {
        /// Number of the run.
        number: i64,
        /// New name.
        name: String,
    },
    /// Add tags to a run, or remove tags.
    #[command(after_help = "Example: stickslip runs tag 1 +good -bad")]
    Tag {
        /// Number of the run.
        number: i64,
        /// Tags: +TAG or TAG adds, -TAG removes.
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        tags: Vec<String>,
    },
    /// Write a note for a run; an empty text removes it.
    #[command(after_help = "Example: stickslip runs note 1 \"new grease\"")]
    Note {
        /// Number of the run.
        number: i64,
        /// Text of the note.
        text: String,
    },
    /// Move runs into the bin, which keeps them for 30 days.
    #[command(after_help = "Example: stickslip runs delete 1")]
    Delete {
        /// Numbers of the runs.
        #[arg(required = true)]
        numbers: Vec<i64>,
    },
    /// Restore runs from the bin.
    #[command(after_help = "Example: stickslip runs restore 1")]
    Restore {
        /// Numbers of the runs.
        #[arg(required = true)]
        numbers: Vec<i64>,
    },
}

impl RunsCommand {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let here = Path::new(".");
        let catalogue = match &self.scope.project {
            Some(project) => Catalogue::of_project(project, here),
            None => Catalogue::in_folder(here),
        };
        if self.rebuild {
            let rebuilt = catalogue.rebuild()?;
            let new = rebuilt.unlabelled;
            return Ok(writeln!(out, "{} runs in the catalogue, {new} of them new to it.", rebuilt.runs)?);
        }
        match self.action {
            None => list(&catalogue.runs(&self.query.join(" "), self.limit)?, self.scope.json, out),
            Some(Action::Show { number }) => show(&catalogue.details(number)?, self.scope.json, out),
            Some(Action::Rename { number, name }) => {
                catalogue.rename(number, &name)?;
                print_run(&catalogue, number, self.scope.json, out)
            }
            Some(Action::Tag { number, tags }) => {
                let (remove, add): (Vec<String>, Vec<String>) = tags.into_iter().partition(|tag| tag.starts_with('-'));
                let plain =
                    |tags: Vec<String>, sign| tags.iter().map(|tag| without_sign(tag, sign)).collect::<Vec<_>>();
                catalogue.tag(number, &plain(add, '+'), &plain(remove, '-'))?;
                print_run(&catalogue, number, self.scope.json, out)
            }
            Some(Action::Note { number, text }) => {
                catalogue.note(number, &text)?;
                print_run(&catalogue, number, self.scope.json, out)
            }
            Some(Action::Delete { numbers }) => numbers.into_iter().try_for_each(|number| {
                catalogue.delete(number)?;
                print_run(&catalogue, number, self.scope.json, out)
            }),
            Some(Action::Restore { numbers }) => numbers.into_iter().try_for_each(|number| {
                catalogue.restore(number)?;
                print_run(&catalogue, number, self.scope.json, out)
            }),
        }
    }
}

fn without_sign(tag: &str, sign: char) -> String {
    tag.strip_prefix(sign).unwrap_or(tag).into()
}

/// Prints the current state of a run in one line.
fn print_run(catalogue: &Catalogue, number: i64, json: bool, out: &mut dyn Write) -> Result<(), Failure> {
    let run = catalogue.details(number)?.run;
    match json {
        true => Ok(writeln!(out, "{}", json!(run))?),
        false => table(&[run], out),
    }
}

fn list(result: &Found, json: bool, out: &mut dyn Write) -> Result<(), Failure> {
    if json {
        let list = json!({ "runs": result.runs, "of": result.of, "hints": result.hints });
        return Ok(writeln!(out, "{list}")?);
    }
    for hint in &result.hints {
        writeln!(out, "Note: {hint}")?;
    }
    table(&result.runs, out)?;
    match result.of as usize - result.runs.len() {
        0 if result.runs.is_empty() => Ok(writeln!(out, "No runs.")?),
        0 => Ok(()),
        more => Ok(writeln!(out, "{more} more, see --limit")?),
    }
}

/// Prints a line for each run, with aligned columns.
fn table(runs: &[Run], out: &mut dyn Write) -> Result<(), Failure> {
    let rows: Vec<[String; 7]> = runs.iter().map(cells).collect();
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: [usize; 7] = std::array::from_fn(width);
    for row in &rows {
        let cell = |(k, text): (usize, &String)| format!("{text:width$}", width = widths[k]);
        // Empty columns are omitted.
        let shown = row.iter().enumerate().filter(|(k, _)| widths[*k] > 0);
        let line: Vec<String> = shown.map(cell).collect();
        writeln!(out, "{}", line.join("  ").trim_end())?;
    }
    Ok(())
}

fn cells(run: &Run) -> [String; 7] {
    let state = match run.state {
        State::Here if run.incomplete.is_some() => "incomplete",
        State::Here => "",
        State::Missing => "missing",
        State::Replaced => "replaced",
        State::Deleted => "in the bin",
    };
    let law = if run.law.is_empty() { String::new() } else { format!("law {}", run.law) };
    [
        format!("{:>4}", run.number),
        start_time(&run.begun),
        run.name.clone(),
        [run.controller.clone(), law].into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join(", "),
        key(run),
        run.tags.iter().map(|tag| format!("+{tag}")).collect::<Vec<_>>().join(" "),
        state.into(),
    ]
}

/// Start of a run, to the minute.
fn start_time(begun: &str) -> String {
    begun.get(..16).unwrap_or(begun).replace('T', " ")
}

/// The main result of a run.
fn key(run: &Run) -> String {
    let Some(key) = &run.key else { return String::new() };
    // Results have dotted paths; other names are texts already.
    let name = match key.name.contains(' ') {
        true => key.name.clone(),
        false => key.name.rsplit('.').next().unwrap_or_default().replace('_', " "),
    };
    format!("{name} {}", Estimate::new(key.value, key.unit.as_str()))
}

fn show(details: &Details, json: bool, out: &mut dyn Write) -> Result<(), Failure> {
    let Details { run, values } = details;
    if json {
        let details = json!({ "run": run, "values": values });
        return Ok(writeln!(out, "{details}")?);
    }
    table(std::slice::from_ref(run), out)?;
    let duration = run.duration.map_or(String::new(), |duration| Estimate::new(duration, "s").to_string());
    let lines = [
        ("command", run.command.clone()),
        ("started", run.begun.clone()),
        ("duration", duration),
        ("preset", run.preset.clone()),
        ("version", run.version.clone()),
        ("folder", run.folder.clone()),
        ("files", run.files.join(", ")),
        ("record", run.record.clone().unwrap_or_default()),
        ("incomplete", run.incomplete.clone().unwrap_or_default()),
        ("note", run.note.clone()),
    ];
    for (name, text) in lines.into_iter().filter(|(_, text)| !text.is_empty()) {
        writeln!(out, "  {name:10} {text}")?;
    }
    let results: Vec<_> = values.iter().filter(|value| value.result).collect();
    let width = results.iter().map(|value| value.path.chars().count()).max().unwrap_or(0);
    for value in results {
        let unit = if value.unit == "1" { "" } else { &value.unit };
        writeln!(out, "{}", format!("  {:width$}  {} {unit}", value.path, value.text).trim_end())?;
    }
    let parameters = values.iter().filter(|value| !value.result).count();
    Ok(writeln!(out, "  {parameters} parameters: see the report, or --json")?)
}

/// The entry in the catalogue for the results that a command is about to write.
pub(crate) struct PendingEntry {
    folder: PathBuf,
    preset: Option<String>,
    start: SystemTime,
    written_before: Option<SystemTime>,
}

impl PendingEntry {
    pub(crate) fn new(folder: PathBuf, preset: Option<String>) -> Self {
        let written_before = time_written(&folder);
        PendingEntry { folder, preset, start: SystemTime::now(), written_before }
    }

    /// Adds the run to the catalogue if it has new results within the working folder. An error is only a warning.
    pub(crate) fn enter(self) {
        let catalogue = Catalogue::in_folder(Path::new("."));
        let written = time_written(&self.folder);
        if written.is_none() || written == self.written_before || !catalogue.covers(&self.folder) {
            return;
        }
        if let Err(error) = catalogue.enter(&RunOrigin::now(&self.folder, self.start, self.preset)) {
            warn(&error);
        }
    }
}

/// Time when results were written into a folder.
fn time_written(folder: &Path) -> Option<SystemTime> {
    let time = |name: &str| folder.join(name).metadata().and_then(|file| file.modified()).ok();
    time("summary.json").max(time("run.mf4"))
}

/// Warns that a run is not in the catalogue.
fn warn(error: &stickslip::Error) {
    // Ignored: stderr may be closed.
    let _ = writeln!(io::stderr(), "Note: the run is not in the catalogue. {error}");
}

/// The folder or file of a run, from a path or its number in the catalogue.
pub(crate) fn run_path(run: &Path) -> Result<PathBuf, Failure> {
    match run.to_str().and_then(|text| text.parse().ok()) {
        Some(number) if !run.exists() => Ok(Catalogue::in_folder(Path::new(".")).folder(number)?),
        _ => Ok(run.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_unchanged_and_the_number_of_an_unknown_run_is_refused() {
        assert_eq!(run_path(Path::new("somewhere/42")).unwrap(), Path::new("somewhere/42"));
        let refused = run_path(Path::new("4711")).unwrap_err().to_string();
        assert!(refused.contains("no run 4711"), "{refused}");
    }

    #[test]
    fn the_sign_of_a_tag_is_removed() {
        assert_eq!(
            [without_sign("+good", '+'), without_sign("good", '+'), without_sign("-bad", '-')],
            ["good", "good", "bad"]
        );
    }
}
