//! `stickslip runs`: the catalogue of runs, searched, named, tidied.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::{Args, Subcommand};
use serde_json::json;
use stickslip::catalogue::{Catalogue, Details, Found, Run, RunOrigin, State};
use stickslip::quantity::Estimate;

use crate::failure::Failure;

/// Which runs.
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct RunsCommand {
    /// What to look for: words; law:bristle, tag:good; M_S>0.2 over parameters and results; -word for what must not be.
    query: Vec<String>,
    /// At most so many, the newest.
    #[arg(long, value_name = "N", default_value_t = 50)]
    limit: u64,
    /// Look through the folders again: after the catalogue was lost, or runs were moved by hand.
    #[arg(long)]
    rebuild: bool,
    #[command(flatten)]
    whose: Whose,
    #[command(subcommand)]
    order: Option<Order>,
}

/// Of which project, in which form.
#[derive(Args)]
struct Whose {
    /// Folder of a served bench's project outside the working folder.
    #[arg(long, value_name = "DIR", global = true)]
    project: Option<PathBuf>,
    /// Print JSON.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Order {
    /// All that is known of a run.
    #[command(after_help = "Example: stickslip runs show 1")]
    Show {
        /// Its number.
        number: i64,
    },
    /// Give a run another name.
    #[command(after_help = "Example: stickslip runs rename 1 \"before the repair\"")]
    Rename {
        /// Its number.
        number: i64,
        /// In words.
        name: String,
    },
    /// Add tags to a run, and take others away.
    #[command(after_help = "Example: stickslip runs tag 1 +good -bad")]
    Tag {
        /// Its number.
        number: i64,
        /// +TAG or TAG adds, -TAG takes away.
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        tags: Vec<String>,
    },
    /// Write a note to a run; an empty one takes it away.
    #[command(after_help = "Example: stickslip runs note 1 \"new grease\"")]
    Note {
        /// Its number.
        number: i64,
        /// In words.
        text: String,
    },
    /// Move runs into the bin, where they lie for 30 days.
    #[command(after_help = "Example: stickslip runs delete 1")]
    Delete {
        /// Their numbers.
        #[arg(required = true)]
        numbers: Vec<i64>,
    },
    /// Bring runs back from the bin.
    #[command(after_help = "Example: stickslip runs restore 1")]
    Restore {
        /// Their numbers.
        #[arg(required = true)]
        numbers: Vec<i64>,
    },
}

impl RunsCommand {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let here = Path::new(".");
        let catalogue = match &self.whose.project {
            Some(project) => Catalogue::of_project(project, here),
            None => Catalogue::in_folder(here),
        };
        if self.rebuild {
            let rebuilt = catalogue.rebuild()?;
            let new = rebuilt.unlabelled;
            return Ok(writeln!(out, "{} runs in the catalogue, {new} of them new to it.", rebuilt.runs)?);
        }
        match self.order {
            None => list(&catalogue.runs(&self.query.join(" "), self.limit)?, self.whose.json, out),
            Some(Order::Show { number }) => show(&catalogue.details(number)?, self.whose.json, out),
            Some(Order::Rename { number, name }) => {
                catalogue.rename(number, &name)?;
                tell(&catalogue, number, self.whose.json, out)
            }
            Some(Order::Tag { number, tags }) => {
                let (remove, add): (Vec<String>, Vec<String>) = tags.into_iter().partition(|tag| tag.starts_with('-'));
                let plain = |tags: Vec<String>, sign| tags.iter().map(|tag| bare(tag, sign)).collect::<Vec<_>>();
                catalogue.tag(number, &plain(add, '+'), &plain(remove, '-'))?;
                tell(&catalogue, number, self.whose.json, out)
            }
            Some(Order::Note { number, text }) => {
                catalogue.note(number, &text)?;
                tell(&catalogue, number, self.whose.json, out)
            }
            Some(Order::Delete { numbers }) => numbers.into_iter().try_for_each(|number| {
                catalogue.delete(number)?;
                tell(&catalogue, number, self.whose.json, out)
            }),
            Some(Order::Restore { numbers }) => numbers.into_iter().try_for_each(|number| {
                catalogue.restore(number)?;
                tell(&catalogue, number, self.whose.json, out)
            }),
        }
    }
}

fn bare(tag: &str, sign: char) -> String {
    tag.strip_prefix(sign).unwrap_or(tag).into()
}

/// How a run is now, in a line.
fn tell(catalogue: &Catalogue, number: i64, json: bool, out: &mut dyn Write) -> Result<(), Failure> {
    let run = catalogue.details(number)?.run;
    match json {
        true => Ok(writeln!(out, "{}", json!(run))?),
        false => table(&[run], out),
    }
}

fn list(found: &Found, json: bool, out: &mut dyn Write) -> Result<(), Failure> {
    if json {
        let told = json!({ "runs": found.runs, "of": found.of, "hints": found.hints });
        return Ok(writeln!(out, "{told}")?);
    }
    for hint in &found.hints {
        writeln!(out, "Note: {hint}")?;
    }
    table(&found.runs, out)?;
    match found.of as usize - found.runs.len() {
        0 if found.runs.is_empty() => Ok(writeln!(out, "No runs.")?),
        0 => Ok(()),
        more => Ok(writeln!(out, "and {more} more: see --limit")?),
    }
}

/// A run a line, its cells below each other.
fn table(runs: &[Run], out: &mut dyn Write) -> Result<(), Failure> {
    let rows: Vec<[String; 7]> = runs.iter().map(cells).collect();
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: [usize; 7] = std::array::from_fn(width);
    for row in &rows {
        let cell = |(k, text): (usize, &String)| format!("{text:width$}", width = widths[k]);
        // An empty column has no place.
        let shown = row.iter().enumerate().filter(|(k, _)| widths[*k] > 0);
        let line: Vec<String> = shown.map(cell).collect();
        writeln!(out, "{}", line.join("  ").trim_end())?;
    }
    Ok(())
}

fn cells(run: &Run) -> [String; 7] {
    let state = match run.state {
        State::Here => "",
        State::Missing => "missing",
        State::Replaced => "replaced",
        State::Deleted => "in the bin",
    };
    let law = if run.law.is_empty() { String::new() } else { format!("law {}", run.law) };
    [
        format!("{:>4}", run.number),
        when(&run.begun),
        run.name.clone(),
        [run.controller.clone(), law].into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join(", "),
        key(run),
        run.tags.iter().map(|tag| format!("+{tag}")).collect::<Vec<_>>().join(" "),
        state.into(),
    ]
}

/// To the minute.
fn when(begun: &str) -> String {
    begun.get(..16).unwrap_or(begun).replace('T', " ")
}

fn key(run: &Run) -> String {
    let Some(key) = &run.key else { return String::new() };
    // A result has a path; what is none is in words already.
    let name = match key.name.contains(' ') {
        true => key.name.clone(),
        false => key.name.rsplit('.').next().unwrap_or_default().replace('_', " "),
    };
    format!("{name} {}", Estimate::new(key.value, key.unit.as_str()))
}

fn show(details: &Details, json: bool, out: &mut dyn Write) -> Result<(), Failure> {
    let Details { run, values } = details;
    if json {
        let told = json!({ "run": run, "values": values });
        return Ok(writeln!(out, "{told}")?);
    }
    table(std::slice::from_ref(run), out)?;
    let duration = run.duration.map_or(String::new(), |duration| Estimate::new(duration, "s").to_string());
    let lines = [
        ("command", run.command.clone()),
        ("begun", run.begun.clone()),
        ("duration", duration),
        ("preset", run.preset.clone()),
        ("version", run.version.clone()),
        ("folder", run.folder.clone()),
        ("files", run.files.join(", ")),
        ("record", run.record.clone().unwrap_or_default()),
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
    Ok(writeln!(out, "  {parameters} parameters: see its report, or --json")?)
}

/// A run that a command is about to leave.
pub(crate) struct Leaving {
    folder: PathBuf,
    preset: Option<String>,
    begun: SystemTime,
    before: Option<SystemTime>,
}

impl Leaving {
    pub(crate) fn into(folder: PathBuf, preset: Option<String>) -> Self {
        let before = written(&folder);
        Leaving { folder, preset, begun: SystemTime::now(), before }
    }

    /// Enters it, if it was left within the working folder. A catalogue that cannot be written costs a warning.
    pub(crate) fn enter(self) {
        let catalogue = Catalogue::in_folder(Path::new("."));
        let after = written(&self.folder);
        if after.is_none() || after == self.before || !catalogue.covers(&self.folder) {
            return;
        }
        if let Err(error) = catalogue.enter(&RunOrigin::now(&self.folder, self.begun, self.preset)) {
            warn(&error);
        }
    }
}

/// When a folder got its results.
fn written(folder: &Path) -> Option<SystemTime> {
    let time = |name: &str| folder.join(name).metadata().and_then(|file| file.modified()).ok();
    time("summary.json").max(time("run.mf4"))
}

/// Says that a run is not in the catalogue.
fn warn(error: &stickslip::Error) {
    // Nobody is left to tell if stderr is closed as well.
    let _ = writeln!(io::stderr(), "Note: the run is not in the catalogue. {error}");
}

/// A run's folder or file: a path, or its number in the catalogue.
pub(crate) fn named(run: &Path) -> Result<PathBuf, Failure> {
    match run.to_str().and_then(|text| text.parse().ok()) {
        Some(number) if !run.exists() => Ok(Catalogue::in_folder(Path::new(".")).folder(number)?),
        _ => Ok(run.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_itself_and_a_number_that_is_no_run_is_refused() {
        assert_eq!(named(Path::new("somewhere/42")).unwrap(), Path::new("somewhere/42"));
        let refused = named(Path::new("4711")).unwrap_err().to_string();
        assert!(refused.contains("no run 4711"), "{refused}");
    }

    #[test]
    fn a_tag_loses_its_sign() {
        assert_eq!([bare("+good", '+'), bare("good", '+'), bare("-bad", '-')], ["good", "good", "bad"]);
    }
}
