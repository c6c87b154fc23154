//! The file of a study, in TOML: read and checked against the preset before anything runs.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml_edit::Document;

use super::check::Checked;
use super::plan::{LONGEST_CASE, of_entrant};
use super::{Plan, sobol};
use crate::benchmark::{Entrant, MANOEUVRES, Manoeuvre};
use stickslip_base::excerpt::parser_message;
use stickslip_base::parameters::schema::nearest;
use stickslip_base::parameters::{self, Fault, ParameterProblems, Problem, presets};
use stickslip_base::preset::Preset;
use stickslip_base::{Error, input};
use stickslip_fit::uncertainty;

/// Contents of the file.
#[derive(Debug, Deserialize)]
pub(super) struct Stated {
    title: Option<String>,
    #[serde(default = "prototype")]
    preset: String,
    #[serde(default)]
    set: toml::Table,
    controller: Option<String>,
    manoeuvres: Vec<String>,
    #[serde(default = "once")]
    seeds: u64,
    places: Option<u64>,
    tolerance: Option<f64>,
    #[serde(default)]
    pub(super) design: StatedDesign,
    #[serde(default)]
    pub(super) fit: Vec<StatedFit>,
    #[serde(default)]
    pub(super) axis: Vec<StatedAxis>,
}

/// The design in the file.
#[derive(Debug, Default, Deserialize)]
pub(super) struct StatedDesign {
    #[serde(default)]
    pub(super) kind: Kind,
    pub(super) samples: Option<u64>,
    pub(super) trajectories: Option<u64>,
    pub(super) levels: Option<u64>,
    pub(super) seed: Option<u64>,
    pub(super) correlation: Option<Vec<Vec<f64>>>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Kind {
    #[default]
    Grid,
    LatinHypercube,
    Sobol,
    Normal,
    Morris,
    Saltelli,
}

/// An axis in the file.
#[derive(Debug, Deserialize)]
pub(super) struct StatedAxis {
    pub(super) name: Option<String>,
    pub(super) path: Paths,
    #[serde(default)]
    pub(super) factor: bool,
    pub(super) values: Option<Vec<f64>>,
    pub(super) range: Option<[f64; 2]>,
    pub(super) points: Option<usize>,
    #[serde(default)]
    pub(super) logarithmic: bool,
    pub(super) mean: Option<f64>,
    pub(super) sd: Option<f64>,
}

/// Fitted parameters with a joint distribution in the file.
#[derive(Debug, Deserialize)]
pub(super) struct StatedFit {
    pub(super) file: PathBuf,
    pub(super) path: Option<Paths>,
}

/// One parameter, or several that take the same value.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Paths {
    One(String),
    Several(Vec<String>),
}

impl Paths {
    pub(super) fn all(&self) -> Vec<String> {
        match self {
            Paths::One(path) => vec![path.clone()],
            Paths::Several(paths) => paths.clone(),
        }
    }
}

fn prototype() -> String {
    "prototype".into()
}

fn once() -> u64 {
    1
}

/// Keys of the file, of its design, of a fit and of an axis.
const KEYS: [&str; 11] =
    ["title", "preset", "set", "controller", "manoeuvres", "seeds", "places", "tolerance", "design", "fit", "axis"];
const DESIGN: [&str; 6] = ["kind", "samples", "trajectories", "levels", "seed", "correlation"];
const FIT: [&str; 2] = ["file", "path"];
const AXIS: [&str; 9] = ["name", "path", "factor", "values", "range", "points", "logarithmic", "mean", "sd"];

/// Default share by which measures may move when the step is halved.
const TOLERANCE: f64 = 0.01;
/// Allowed tolerances.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-9..=1.0;
/// Parameter of the step; a study that states it has no tolerance.
const STEP: &str = "bench.plant_step";

/// Largest number of axes, and of fits.
const MOST_AXES: usize = 200;
/// Longest study [s of simulated time]: months of computation on a large computer.
const LONGEST_STUDY: f64 = 1e9;
/// Unknown keys of a table that are reported.
const MOST_UNKNOWN: usize = 20;
/// Largest number of seeds or places.
const REPEATS: u64 = 1000;

/// Reads the file of a study.
///
/// # Errors
/// [`Error::File`]; [`Error::Parameters`] with unknown keys and paths, and with values that the preset does not admit;
/// [`Error::Document`] with contradictions in the file or in that of a fit; errors of reading preset and controller.
pub fn read(path: &Path) -> Result<Plan, Error> {
    let text = input::text(path, input::TEXT)?;
    Text { path, text: &text, has_lines: true }.plan(None)
}

/// Reads a study whose text was made by a program. Messages call it `study` and omit line numbers. A machine replaces
/// the preset of the text.
///
/// # Errors
/// As [`read`].
pub fn read_text(text: &str, machine: Option<presets::Source>) -> Result<Plan, Error> {
    Text { path: Path::new("study"), text, has_lines: false }.plan(machine)
}

impl Text<'_> {
    fn plan(&self, machine: Option<presets::Source>) -> Result<Plan, Error> {
        self.known_keys()?;
        let stated: Stated = toml::from_str(self.text).map_err(|error| {
            let place = error.span().and_then(|span| self.place(span.start));
            let reason = parser_message(error.message());
            Error::Document {
                path: self.path.into(),
                place,
                reason,
                remedy: "`stickslip study --help` has an example.",
            }
        })?;
        plan(&stated, self, machine)
    }
}

fn plan(stated: &Stated, source: &Text<'_>, machine: Option<presets::Source>) -> Result<Plan, Error> {
    let entrant = stated.controller.as_deref().map(Entrant::find).transpose()?;
    let name = machine.as_ref().map_or_else(|| stated.preset.clone(), |source| stem(Path::new(&source.file)));
    let mut preset = machine.map_or_else(|| presets::find(&stated.preset), Ok)?;
    let mut settings = Vec::new();
    flat(&stated.set, "", &mut settings);
    if let Some((path, _)) = settings.iter().find(|(path, _)| entrant.is_some() && of_entrant(path)) {
        let reason = format!("[set] sets {path}, which the controller sets too");
        return Err(source.wrong("set", reason, "Remove one of them, or name a parameter file as controller."));
    }
    if !settings.is_empty() {
        preset.text = parameters::set_all::<Preset<f64>>(&preset.text, &preset.file, &settings)?;
    }
    let manoeuvres = manoeuvres(stated, source)?;
    let places = stated.places.unwrap_or(stated.seeds);
    if !(1..=REPEATS).contains(&stated.seeds) || !(1..=REPEATS).contains(&places) {
        let reason = format!("seeds = {} and places = {places} must be within 1 … {REPEATS}", stated.seeds);
        return Err(source.wrong("seeds", reason, "Use 1 for both if only the parameters matter."));
    }
    let own_step = settings.iter().any(|(path, _)| path == STEP)
        || stated.axis.iter().any(|axis| axis.path.all().iter().any(|path| path == STEP));
    let tolerance = tolerance(stated, source, own_step)?;
    let preset: Preset<f64> = preset.read()?;
    let mut plan = Plan {
        title: stated.title.clone().unwrap_or_else(|| stem(source.path)),
        machine: name,
        preset,
        entrant,
        manoeuvres,
        seeds: stated.seeds,
        places,
        tolerance,
        axes: Vec::new(),
        design: super::Design::Grid,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    check_axes(stated, source)?;
    let fits = stated.fit.iter().map(|fit| uncertainty::read(&fit.file)).collect::<Result<_, _>>()?;
    let checked = Checked { stated, source, fits, preset: plan.stated() };
    plan.design = checked.design()?;
    plan.axes = checked.axes(&plan)?;
    let cases = plan.cases()?;
    check_sequence(&plan, cases, source)?;
    check_duration(&plan, cases, source)?;
    Ok(plan)
}

/// Refuses a number of axes that no study needs: the place of each takes a pass over the text.
fn check_axes(stated: &Stated, source: &Text<'_>) -> Result<(), Error> {
    for (key, count) in [("axis", stated.axis.len()), ("fit", stated.fit.len())] {
        if count > MOST_AXES {
            let reason = format!("{count} tables [[{key}]]; the limit is {MOST_AXES}");
            return Err(source.wrong(key, reason, "Keep the parameters that matter, or divide the study."));
        }
    }
    Ok(())
}

/// Refuses a study that would take years, with the numbers that make it long.
fn check_duration(plan: &Plan, cases: u64, source: &Text<'_>) -> Result<(), Error> {
    let case = plan.case_time(&plan.preset);
    if case.is_nan() || case > LONGEST_CASE {
        let reason = format!(
            "seeds = {} and places = {} take {case:.3e} s of simulated time a case; the limit is {LONGEST_CASE:.0e} s",
            plan.seeds, plan.places
        );
        return Err(source.wrong("manoeuvres", reason, "Use fewer seeds and places, or fewer manoeuvres."));
    }
    let all = case * cases as f64;
    if all > LONGEST_STUDY {
        let reason = format!(
            "{cases} cases of {case:.1} s take {all:.3e} s of simulated time; the limit is {LONGEST_STUDY:.0e} s"
        );
        return Err(source.wrong("design", reason, "Use fewer samples, fewer values of the axes, or fewer seeds."));
    }
    Ok(())
}

/// The manoeuvres, each once and at least one.
fn manoeuvres(stated: &Stated, source: &Text<'_>) -> Result<Vec<Manoeuvre>, Error> {
    let names = MANOEUVRES.map(|manoeuvre| manoeuvre.name());
    let manoeuvre = |name: &String| {
        let index = names.iter().position(|manoeuvre| manoeuvre == name);
        index.map(|index| MANOEUVRES[index]).ok_or_else(|| Error::NothingToCompare {
            what: "manoeuvre",
            name: name.clone(),
            known: names.to_vec(),
        })
    };
    let manoeuvres = stated.manoeuvres.iter().map(manoeuvre).collect::<Result<Vec<_>, _>>()?;
    let twice = manoeuvres.iter().enumerate().any(|(k, one)| manoeuvres[..k].contains(one));
    if manoeuvres.is_empty() || twice {
        return Err(source.wrong(
            "manoeuvres",
            "each manoeuvre once, and at least one".into(),
            "List at least one, each once.",
        ));
    }
    Ok(manoeuvres)
}

/// The tolerance that selects the steps; `None` where the study states the step itself.
fn tolerance(stated: &Stated, source: &Text<'_>, own_step: bool) -> Result<Option<f64>, Error> {
    match stated.tolerance {
        None if own_step => Ok(None),
        None => Ok(Some(TOLERANCE)),
        Some(_) if own_step => {
            let reason = format!("both the tolerance and {STEP} are stated, and the tolerance selects the step");
            Err(source.wrong("tolerance", reason, "Remove one of them."))
        }
        Some(tolerance) if TOLERANCES.contains(&tolerance) => Ok(Some(tolerance)),
        Some(tolerance) => {
            let reason = format!("tolerance = {tolerance} must be within 1e-9 … 1");
            Err(source.wrong("tolerance", reason, "It is a share of each measure: 0.01 is 1 %."))
        }
    }
}

/// Refuses more dimensions or points than Sobol's sequence has.
fn check_sequence(plan: &Plan, cases: u64, source: &Text<'_>) -> Result<(), Error> {
    let (dimensions, points) = match plan.design {
        super::Design::Sobol { samples } => (plan.axes.len(), samples),
        super::Design::Saltelli { samples } => (2 * plan.axes.len(), samples),
        _ => (0, cases.min(1)),
    };
    if dimensions > sobol::dimensions() || points > 1 << 32 {
        let reason = format!(
            "{dimensions} dimensions and {points} points of Sobol's sequence; the limits are {} and 2^32",
            sobol::dimensions()
        );
        return Err(source.wrong("design", reason, "Use fewer axes or samples, or a Latin hypercube."));
    }
    Ok(())
}

/// Tables as dotted paths with their values, as a file has them.
fn flat(table: &toml::Table, group: &str, into: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let path = if group.is_empty() { key.clone() } else { format!("{group}.{key}") };
        match value {
            toml::Value::Table(table) => flat(table, &path, into),
            toml::Value::String(text) => into.push((path, text.clone())),
            other => into.push((path, literal(other))),
        }
    }
}

/// A value as a file has it.
fn literal(value: &toml::Value) -> String {
    match value {
        toml::Value::Integer(number) => number.to_string(),
        toml::Value::Float(number) => format!("{number:?}"),
        toml::Value::Boolean(flag) => flag.to_string(),
        toml::Value::Array(list) => format!("[{}]", list.iter().map(literal).collect::<Vec<_>>().join(", ")),
        // Never a parameter: the reader of the preset reports it.
        toml::Value::Datetime(time) => time.to_string(),
        toml::Value::String(_) | toml::Value::Table(_) => String::new(),
    }
}

/// The text with its places, for messages.
pub(super) struct Text<'a> {
    path: &'a Path,
    text: &'a str,
    /// Whether messages have line numbers.
    has_lines: bool,
}

/// The name of a file without its ending.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

impl Text<'_> {
    /// Name of the file in messages.
    pub(super) fn file(&self) -> String {
        self.path.display().to_string()
    }

    /// Line and column of a byte, from 1, if messages have them.
    fn place(&self, offset: usize) -> Option<[usize; 2]> {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line = before.bytes().filter(|byte| *byte == b'\n').count();
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count();
        self.has_lines.then_some([line + 1, column + 1])
    }

    /// Place of a key of the file, as `seeds`, `design` or `axis.0`.
    pub(super) fn place_of(&self, key: &str) -> Option<[usize; 2]> {
        let document = Document::parse(self.text).ok()?;
        let (key, index) = key.split_once('.').unwrap_or((key, ""));
        let span = match (document.get(key)?, index.parse::<usize>()) {
            (toml_edit::Item::ArrayOfTables(list), Ok(index)) => list.get(index)?.span(),
            (item, _) => item.span().or_else(|| document.key(key).and_then(toml_edit::Key::span)),
        };
        span.and_then(|span| self.place(span.start))
    }

    /// An error of the document, with its place.
    pub(super) fn wrong(&self, key: &str, reason: String, remedy: &'static str) -> Error {
        Error::Document { path: self.path.into(), place: self.place_of(key), reason, remedy }
    }

    /// Refuses unknown keys.
    fn known_keys(&self) -> Result<(), Error> {
        // Invalid TOML is reported by the parser.
        let Ok(document) = Document::parse(self.text) else { return Ok(()) };
        let mut problems = self.unknown(document.as_table(), "", &KEYS);
        if let Some(design) = document.get("design").and_then(toml_edit::Item::as_table_like) {
            problems.extend(self.unknown(design, "design.", &DESIGN));
        }
        for (group, dotted, known) in [("fit", "fit.", &FIT[..]), ("axis", "axis.", &AXIS[..])] {
            if let Some(tables) = document.get(group).and_then(toml_edit::Item::as_array_of_tables) {
                problems.extend(tables.iter().flat_map(|table| self.unknown(table, dotted, known)));
            }
        }
        if problems.is_empty() { Ok(()) } else { Err(ParameterProblems { file: self.file(), problems }.into()) }
    }

    fn unknown(&self, table: &dyn toml_edit::TableLike, group: &str, known: &[&'static str]) -> Vec<Problem> {
        let problem = |key: &str| {
            let line = table
                .key(key)
                .and_then(toml_edit::Key::span)
                .and_then(|span| self.place(span.start))
                .map(|[line, _]| line);
            let nearest = nearest(key, known.iter().copied()).map(|name| format!("{group}{name}"));
            let fault = Fault::Unknown { nearest, known: known.to_vec() };
            Problem { line, path: format!("{group}{key}"), fault }
        };
        // The place of each takes a pass over the text.
        table.iter().map(|(key, _)| key).filter(|key| !known.contains(key)).take(MOST_UNKNOWN).map(problem).collect()
    }
}
