//! Checks of axes and design of a file against the preset.

use super::file::{Kind, Stated, StatedAxis, StatedDesign, Text};
use super::table::{CASE, ERROR, FAILURE, STEP};
use super::{Axis, Design, Plan, Spread};
use stickslip_base::Error;
use stickslip_base::parameters::{self, Entry, Fault, ParameterProblems, Problem, Value, flatten};
use stickslip_base::preset::Preset;
use stickslip_base::quantity::rough;
use stickslip_fit::uncertainty::{self, Known};

/// Largest number of values of an axis.
const MOST_POINTS: usize = 1_000_000;
/// Share of the draws from a fit that may lie outside the range of a parameter: more would bias the results of the
/// others. Each of them is a failed case with its reason.
const OUTSIDE: f64 = 1e-3;

/// A file with the preset that it changes.
pub(super) struct Checked<'a> {
    pub(super) stated: &'a Stated,
    pub(super) source: &'a Text<'a>,
    /// One for each fit of the file.
    pub(super) fits: Vec<Known>,
    /// Preset with the kind of controller of the cases.
    pub(super) preset: Preset<f64>,
}

impl Checked<'_> {
    /// The design. Each number must be stated where the design uses it, and nowhere else.
    pub(super) fn design(&self) -> Result<Design, Error> {
        let StatedDesign { kind, samples, trajectories, levels, seed, correlation } = &self.stated.design;
        let wrong = |reason: String, remedy| self.source.wrong("design", reason, remedy);
        let stated = [
            ("samples", samples.is_some()),
            ("trajectories", trajectories.is_some()),
            ("levels", levels.is_some()),
            ("seed", seed.is_some()),
            ("correlation", correlation.is_some()),
        ];
        let takes: &[&str] = match kind {
            Kind::Grid => &[],
            Kind::LatinHypercube => &["samples", "seed"],
            Kind::Sobol | Kind::Saltelli => &["samples"],
            Kind::Normal => &["samples", "seed", "correlation"],
            Kind::Morris => &["trajectories", "levels", "seed"],
        };
        if let Some((name, _)) = stated.iter().find(|(name, is_set)| *is_set && !takes.contains(name)) {
            let reason = format!("the design has no {name}; it has {}", listed(takes));
            return Err(wrong(reason, "Remove it, or choose another design."));
        }
        let count = |name: &str, value: Option<u64>, least: u64| match value {
            Some(value) if value >= least => Ok(value),
            Some(value) => Err(wrong(format!("{name} = {value}, at least {least} required"), "Increase it.")),
            None => Err(wrong(format!("missing {name}"), "Set it under [design].")),
        };
        let seed = seed.unwrap_or(1);
        Ok(match kind {
            Kind::Grid => Design::Grid,
            Kind::LatinHypercube => Design::LatinHypercube { samples: count("samples", *samples, 1)?, seed },
            Kind::Sobol => Design::Sobol { samples: count("samples", *samples, 1)? },
            Kind::Normal => Design::Normal {
                samples: count("samples", *samples, 1)?,
                seed,
                factor: self.factor(correlation.as_deref())?,
            },
            Kind::Morris => {
                let levels = count("levels", Some(levels.unwrap_or(4)), 2)?;
                if levels % 2 == 1 {
                    let remedy = "Use an even number: a step covers half of the levels.";
                    return Err(wrong(format!("levels = {levels} is odd"), remedy));
                }
                Design::Morris { trajectories: count("trajectories", *trajectories, 2)?, levels, seed }
            }
            Kind::Saltelli => Design::Saltelli { samples: count("samples", *samples, 2)? },
        })
    }

    /// L of the correlation L·Lᵀ of all axes: those of the fits, then the stated one; independent axes by default.
    fn factor(&self, correlation: Option<&[Vec<f64>]>) -> Result<Vec<Vec<f64>>, Error> {
        let count = self.stated.axis.len();
        let wrong = |reason: String| {
            let remedy = "A correlation has a row and a column an axis, is symmetric, has ones on its diagonal, and no \
                          combination of axes has a negative variance.";
            self.source.wrong("design", reason, remedy)
        };
        let independent = || (0..count).map(|i| (0..count).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        let of_axes = match correlation {
            None => independent(),
            Some(stated) if stated.len() != count || stated.iter().any(|row| row.len() != count) => {
                return Err(wrong(format!("correlation is not {count} × {count}")));
            }
            Some(stated) => uncertainty::factor(stated).ok_or_else(|| wrong("invalid correlation".into()))?,
        };
        let blocks: Vec<&Vec<Vec<f64>>> = self.fits.iter().map(|fit| &fit.factor).chain([&of_axes]).collect();
        let all: usize = blocks.iter().map(|block| block.len()).sum();
        let mut factor = Vec::new();
        for block in blocks {
            let before = factor.len();
            factor.extend(block.iter().map(|row| {
                let mut whole = vec![0.0; all];
                whole[before..before + row.len()].copy_from_slice(row);
                whole
            }));
        }
        Ok(factor)
    }

    /// The fitted parameters as axes: with the distribution of each file, at the paths of the study.
    fn of_fits(&self, design: &Design) -> Result<Vec<Request>, Error> {
        let mut requests = Vec::new();
        for (index, (stated, Known { together, values, .. })) in self.stated.fit.iter().zip(&self.fits).enumerate() {
            let key = format!("fit.{index}");
            if !matches!(design, Design::Normal { .. }) {
                let reason = "a fit requires a normal design".into();
                return Err(self.source.wrong(&key, reason, "Set kind = \"normal\" and samples under [design]."));
            }
            for ((path, sd), value) in together.parameters.iter().zip(&together.sd).zip(values) {
                let (_, last) = path.rsplit_once('.').unwrap_or(("", path));
                let paths = stated.path.as_ref().map_or_else(
                    || vec![path.clone()],
                    |groups| groups.all().iter().map(|group| format!("{group}.{last}")).collect(),
                );
                let spread = if together.logarithmic {
                    Spread::LogNormal { median: *value, sd: *sd }
                } else {
                    Spread::Normal { mean: *value, sd: *sd }
                };
                requests.push(Request { key: key.clone(), name: None, paths, factor: false, spread });
            }
        }
        Ok(requests)
    }

    /// Nearly all draws from a fit must be allowed values of the parameter.
    fn within(&self, key: &str, entry: &Entry, spread: &Spread) -> Result<(), Error> {
        let stickslip_core::fields::Field { minimum, maximum, unit, .. } = *entry.field;
        let share = spread.outside(minimum, maximum);
        if share <= OUTSIDE {
            return Ok(());
        }
        let reason = format!(
            "{} % of the draws of {} would lie outside {minimum} … {maximum} {unit}",
            rough(100.0 * share),
            entry.path
        );
        let remedy = "Measure more (`stickslip fit` lists the missing measurements), or draw from another fit.";
        Err(self.source.wrong(key, reason, remedy))
    }

    /// All axes, those of fits first; reports all wrong paths and values together.
    pub(super) fn axes(&self, plan: &Plan) -> Result<Vec<Axis>, Error> {
        let entries = flatten(&self.preset);
        let mut requests = self.of_fits(&plan.design)?;
        for (index, stated) in self.stated.axis.iter().enumerate() {
            let key = format!("axis.{index}");
            let spread = self.spread(&key, stated, &plan.design)?;
            let StatedAxis { name, path, factor, .. } = stated;
            requests.push(Request { key, name: name.clone(), paths: path.all(), factor: *factor, spread });
        }
        let (mut axes, mut problems): (Vec<Axis>, Vec<Problem>) = (Vec::new(), Vec::new());
        for Request { key, name, paths, factor, spread } in requests {
            let line = self.source.place_of(&key).map(|[line, _]| line);
            let [Some(first), last] = [paths.first(), paths.last()] else {
                return Err(self.source.wrong(&key, "missing path".into(), "Give the path of a parameter."));
            };
            let mut units = Vec::new();
            for path in &paths {
                match entry(&entries, path) {
                    Ok(entry) => {
                        if factor && entry.value == Value::Number(0.0) {
                            let reason = format!("{path} is 0, so that a factor has no effect");
                            return Err(self.source.wrong(
                                &key,
                                reason,
                                "Set a value under [set], or remove the factor.",
                            ));
                        }
                        if key.starts_with("fit") {
                            self.within(&key, entry, &spread)?;
                        }
                        units.push(entry.field.unit);
                        problems.extend(value_fault(entry, factor, &spread).map(|fault| Problem {
                            line,
                            path: path.clone(),
                            fault,
                        }));
                    }
                    Err(fault) => problems.push(Problem { line, path: path.clone(), fault }),
                }
            }
            if !factor && units.iter().any(|unit| *unit != units[0]) {
                let reason = format!("{first} and {} have different units", last.unwrap_or(first));
                return Err(self.source.wrong(&key, reason, "Use two axes, or one with factor = true."));
            }
            let unit = if factor { "1" } else { units.first().copied().unwrap_or("1") };
            let name = name.unwrap_or_else(|| first.clone());
            let in_use = axes.iter().any(|axis| axis.name == name)
                || [CASE, STEP, ERROR, FAILURE].contains(&name.as_str())
                || plan.measures().any(|measure| measure.name == name);
            if in_use {
                let reason = format!("duplicate column {name}");
                return Err(self.source.wrong(&key, reason, "Rename the axis."));
            }
            let sets_the_same = |axis: &&Axis| !factor && axis.paths.iter().any(|path| paths.contains(path));
            if let Some(other) = axes.iter().find(sets_the_same) {
                let reason = format!("it sets the same parameter as axis {}", other.name);
                return Err(self.source.wrong(&key, reason, "A later axis may only multiply: factor = true."));
            }
            axes.push(Axis { name, paths, factor, unit: unit.into(), spread });
        }
        if axes.is_empty() {
            let remedy = "Add [[axis]] with a path and values, or [[fit]] with a file.";
            return Err(self.source.wrong("axis", "there is no axis".into(), remedy));
        }
        let file = self.source.file();
        if problems.is_empty() { Ok(axes) } else { Err(ParameterProblems { file, problems }.into()) }
    }

    /// The distribution of the values of an axis, stated in one way and supported by the design.
    fn spread(&self, key: &str, stated: &StatedAxis, design: &Design) -> Result<Spread, Error> {
        let wrong = |reason: &str, remedy| Err(self.source.wrong(key, reason.into(), remedy));
        let StatedAxis { values, range, points, logarithmic, mean, sd, .. } = stated;
        if points.is_some_and(|points| points > MOST_POINTS) {
            return wrong("more than a million points", "Use fewer, or draw a sample.");
        }
        let spread = match (values, range, mean, sd) {
            (Some(values), None, None, None) if points.is_none() && !logarithmic => Spread::Values(values.clone()),
            (None, Some([low, high]), None, None) => {
                if !(low < high && (high - low).is_finite()) || (*logarithmic && *low <= 0.0) {
                    return wrong("invalid range", "Give the smaller end first; above 0 if logarithmic.");
                }
                let range = Spread::Range { low: *low, high: *high, logarithmic: *logarithmic };
                points.map_or(range, |points| Spread::evenly(*low, *high, points, *logarithmic))
            }
            (None, None, Some(mean), Some(sd)) if points.is_none() && !logarithmic => {
                if !(*sd > 0.0 && sd.is_finite() && mean.is_finite()) {
                    return wrong("invalid sd", "A standard deviation is above 0.");
                }
                Spread::Normal { mean: *mean, sd: *sd }
            }
            _ => {
                return wrong("its values are stated incompletely or twice", "Give values, or range, or mean and sd.");
            }
        };
        let valid = match &spread {
            Spread::Values(values) => !values.is_empty() && values.iter().all(|value| value.is_finite()),
            Spread::Range { .. } | Spread::Normal { .. } | Spread::LogNormal { .. } => true,
        };
        if !valid {
            return wrong("no value, or a non-finite one", "Give at least one finite value, and points from 1.");
        }
        match (design, &spread) {
            (Design::Grid, Spread::Values(_)) | (Design::Normal { .. }, Spread::Normal { .. }) => Ok(spread),
            (Design::Grid, _) => wrong("a grid requires a list of values", "Give values, or a range with points."),
            (Design::Normal { .. }, _) => wrong("a normal sample requires means", "Give mean and sd."),
            (Design::Morris { .. }, Spread::Normal { .. }) => wrong("a screening requires ranges", "Give a range."),
            _ => Ok(spread),
        }
    }
}

/// Request for an axis.
struct Request {
    /// Key in the file.
    key: String,
    name: Option<String>,
    paths: Vec<String>,
    factor: bool,
    spread: Spread,
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() { "only the values of its axes".into() } else { names.join(", ") }
}

/// The number at a path, or the fault of the path.
fn entry<'a>(entries: &'a [Entry], path: &str) -> Result<&'a Entry, Fault> {
    let candidate = entries.iter().find(|entry| entry.path == path);
    if let Some(entry) = candidate.filter(|entry| matches!(entry.value, Value::Number(_))) {
        return Ok(entry);
    }
    Err(match parameters::describe::<Preset<f64>>(path) {
        Err(Error::UnknownParameter { nearest, .. }) => {
            Fault::Unknown { nearest, known: vec!["plant", "model", "bench"] }
        }
        // It belongs to a variant that is not chosen.
        Ok(rows) if rows.iter().all(|row| row.path == path && row.only_with.is_some()) => {
            let only: Vec<String> = rows.into_iter().filter_map(|row| row.only_with).collect();
            let expected = format!("another path, or choose {}", only.join(" or "));
            Fault::WrongType { expected, got: "a parameter of another choice".into() }
        }
        _ => Fault::WrongType { expected: "the path of a single number".into(), got: "not a single number".into() },
    })
}

/// Fault of the values of an axis within the ranges of the preset.
fn value_fault(entry: &Entry, factor: bool, spread: &Spread) -> Option<Fault> {
    let Value::Number(base) = entry.value else { return None };
    let values = spread.extremes();
    values.into_iter().find_map(|value| Fault::of_number(if factor { base * value } else { value }, entry.field))
}
