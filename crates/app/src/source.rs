//! Source of parameters: a preset or a file, with single values changed by `--set`.

use stickslip::parameters::presets::{self, Source};
use stickslip::{Preset, parameters};

use crate::failure::Failure;

/// One value to change: `plant.wheel.preload=0.5`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setting {
    /// Dotted path.
    pub(crate) path: String,
    /// Value as written in a file.
    pub(crate) value: String,
}

impl std::str::FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (path, value) =
            text.split_once('=').ok_or("write it as PATH=VALUE, for example plant.wheel.preload=0.5")?;
        Ok(Setting { path: path.trim().into(), value: value.trim().into() })
    }
}

/// The preset of a source after these changes of values.
pub(crate) fn preset<'a>(
    source: &str,
    settings: impl IntoIterator<Item = (&'a str, &'a str)>,
) -> Result<Preset<f64>, Failure> {
    Ok(read(source, settings)?.read()?)
}

/// The file of a source after these changes of values.
pub(crate) fn read<'a>(
    source: &str,
    settings: impl IntoIterator<Item = (&'a str, &'a str)>,
) -> Result<Source, Failure> {
    let mut source = presets::find(source)?;
    for (path, value) in settings {
        source.text = parameters::set::<Preset<f64>>(&source.text, &source.file, path, value)?;
    }
    Ok(source)
}

/// Paths and values of a preset.
pub(crate) type Values<'a> = Vec<(&'a str, &'a str)>;

/// The settings of the preset, and those of the plan without the prefix `plan.`.
pub(crate) fn split(settings: &[Setting]) -> (Values<'_>, Values<'_>) {
    let all = settings.iter().map(|setting| (setting.path.as_str(), setting.value.as_str()));
    let (plan, preset): (Values<'_>, Values<'_>) = all.partition(|(path, _)| path.starts_with(PLAN));
    (preset, plan.into_iter().map(|(path, value)| (&path[PLAN.len()..], value)).collect())
}

const PLAN: &str = "plan.";

/// The command line for a report, without the options of the output.
pub(crate) fn command_line() -> String {
    without_output_options(std::env::args().skip(1))
}

fn without_output_options(arguments: impl Iterator<Item = String>) -> String {
    let mut line = String::from("stickslip");
    let mut arguments = arguments.filter(|a| !["--json", "--quiet", "-q", "--progress"].contains(&a.as_str()));
    while let Some(argument) = arguments.next() {
        if argument == "--out" {
            arguments.next();
        } else if !argument.starts_with("--out=") {
            let plain = argument.chars().all(|c| c.is_alphanumeric() || "-_=./:+,@%".contains(c));
            line += &if plain && !argument.is_empty() { format!(" {argument}") } else { format!(" '{argument}'") };
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_a_path_and_a_value() {
        let setting = |path: &str, value: &str| Setting { path: path.into(), value: value.into() };
        assert_eq!("a.b = 0.5".parse(), Ok(setting("a.b", "0.5")));
        assert!("a.b".parse::<Setting>().unwrap_err().contains("PATH=VALUE"));
    }

    #[test]
    fn the_command_line_of_a_report_has_no_output_options() {
        let line = |text: &str| without_output_options(text.split(' ').map(String::from));
        assert_eq!(line("fit curve.csv --out results --side each --json"), "stickslip fit curve.csv --side each");
        assert_eq!(line("fit my*.csv --out=results -q"), "stickslip fit 'my*.csv'");
    }
}
