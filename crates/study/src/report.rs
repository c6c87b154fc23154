//! The report of a study: results in sentences and pictures, and its plan.

use std::path::Path;
use std::{fs, io};

use super::outcome::{Findings, Overview};
use super::pictures::Picture;
use super::run::FILE;
use super::{Axis, Design, Plan, Spread};
use stickslip_base::parameters::number;
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::{Error, Summary, output, parameters};

impl Findings {
    /// The report; `command` is its command line.
    pub fn report(&self, command: &str) -> Report {
        let Findings { outcome, overview, sensitivities, pictures } = self;
        let plan = &outcome.plan;
        let provenance = Provenance::new(command, None, parameters::write_commented(&plan.preset));
        let mut report = Report::new(plan.title.clone(), provenance).summary(self.sentences());
        if !sensitivities.is_empty() {
            report = report.heading("Sensitivities");
        }
        for sensitivity in sensitivities {
            report = report.figure(sensitivity.figure(), sensitivity.caption()).table(sensitivity.table());
        }
        report = report.heading("Measures");
        for picture in pictures {
            report = match picture {
                Picture::Figure(figure, caption) => report.figure(figure.clone(), caption),
                Picture::Map(map, caption) => report.map(map.clone(), caption),
            };
        }
        report = report.table(measures(overview)).heading("Axes").table(axes(plan));
        report = correlation(plan).into_iter().fold(report, Report::table);
        report = report.paragraph(design(plan)).paragraph(steps(plan));
        if overview.failed > 0 {
            report = report.heading("Cases without all numbers").list(reasons(overview));
        }
        report
    }

    /// Writes report and summary into a folder, and a copy of the file of the study if that is elsewhere.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let (from, to) = (&self.outcome.file, directory.join(FILE));
        let absolute = |path: &Path| fs::canonicalize(path).ok();
        if absolute(&to).is_none() || absolute(&to) != absolute(from) {
            let mut file = fs::File::open(from).map_err(|source| Error::file(from, "read", source))?;
            output::write_with(&to, |out| io::copy(&mut file, out).map(drop))?;
        }
        let mut summary = self.summary();
        summary.file(FILE);
        self.report(command).write_all(summary, [], directory)
    }
}

/// The axes, their parameters and values.
fn axes(plan: &Plan) -> Table {
    let table = Table::new(["axis", "parameters", "values", "unit"]).caption(
        "Axes: plant is the machine, model the software's model of it, bench its control. A factor multiplies \
             the value of the preset.",
    );
    plan.axes.iter().fold(table, |table, axis| {
        let unit = if axis.factor { "factor".into() } else { stickslip_base::quantity::unit(&axis.unit) };
        let cells = [axis.name.clone(), axis.paths.join(", "), values(axis), unit];
        table.row(cells.map(|text| Cell::from(text.as_str())))
    })
}

/// Correlation of the axes; none for independent axes.
fn correlation(plan: &Plan) -> Option<Table> {
    let Design::Normal { factor, .. } = &plan.design else { return None };
    let between = |i: usize, j: usize| factor[i].iter().zip(&factor[j]).map(|(a, b)| a * b).sum::<f64>();
    let count = factor.len();
    if (0..count).all(|i| (0..i).all(|j| between(i, j) == 0.0)) {
        return None;
    }
    let numbers = (1..=count).map(|k| k.to_string());
    let table = Table::new(["axis".to_owned()].into_iter().chain(numbers))
        .caption("Correlation of the axes, of their logarithms where they are log-normal.");
    let row = |(i, axis): (usize, &Axis)| {
        let name = format!("{} {}", i + 1, axis.name);
        let cells = (0..count).map(|j| number::rounded(between(i, j), 3));
        [name].into_iter().chain(cells).map(|text| Cell::from(text.as_str())).collect::<Vec<_>>()
    };
    Some(plan.axes.iter().enumerate().map(row).fold(table, Table::row))
}

/// Design, controller, seeds.
fn design(plan: &Plan) -> String {
    let design = match &plan.design {
        Design::Grid => "Each value of each axis with each of the others".into(),
        Design::LatinHypercube { samples, seed } => format!("A Latin hypercube of {samples} cases, seed {seed}"),
        Design::Sobol { samples } => format!("{samples} points of Sobol's sequence"),
        Design::Normal { samples, seed, .. } => format!("{samples} cases of a normal distribution, seed {seed}"),
        Design::Morris { trajectories, levels, seed } => {
            format!("{trajectories} trajectories over {levels} levels (Morris), seed {seed}")
        }
        Design::Saltelli { samples } => format!("Saltelli's design on {samples} rows of Sobol's sequence"),
    };
    let controller = plan.entrant.as_ref().map_or("that of the preset", |entrant| entrant.name.as_str());
    let manoeuvres: Vec<&str> = plan.manoeuvres.iter().map(|manoeuvre| manoeuvre.name()).collect();
    let noise = match plan.seeds {
        1 => "one seed, the same in each case".into(),
        seeds => format!("the mean over {seeds} seeds, the same in each case"),
    };
    format!("{design}. Controller: {controller}. Manoeuvres: {}. Noise: {noise}.", manoeuvres.join(", "))
}

/// Steps of the virtual machine and their error.
fn steps(plan: &Plan) -> String {
    match plan.tolerance {
        Some(tolerance) => format!(
            "Steps of the virtual machine: in each case they were halved until no measure moved by more than {} %, or \
             halving made no difference (columns plant_step and step_error).",
            number::rounded(100.0 * tolerance, 3)
        ),
        None => "Steps of the virtual machine: bench.plant_step. Their error is not estimated.".into(),
    }
}

/// The values of an axis, as text.
fn values(axis: &Axis) -> String {
    match &axis.spread {
        Spread::Values(values) if values.len() <= 6 => {
            values.iter().map(|value| number::rounded(*value, 5)).collect::<Vec<_>>().join(", ")
        }
        Spread::Values(values) => {
            let [first, last] = [values.first(), values.last()].map(|value| value.copied().unwrap_or(f64::NAN));
            format!("{} values, {} … {}", values.len(), number::rounded(first, 5), number::rounded(last, 5))
        }
        Spread::Range { low, high, logarithmic } => {
            let how = if *logarithmic { ", logarithmic" } else { "" };
            format!("{} … {}{how}", number::text(*low), number::text(*high))
        }
        Spread::Normal { mean, sd } => {
            format!("normal, {} ± {} (standard deviation)", number::text(*mean), number::text(*sd))
        }
        Spread::LogNormal { median, sd } => {
            format!(
                "log-normal, {} ± {} % (standard deviation)",
                number::rounded(*median, 5),
                number::rounded(100.0 * sd, 3)
            )
        }
    }
}

/// Smallest, mean and largest of each measure.
fn measures(overview: &Overview) -> Table {
    let table = Table::new(["measure", "cases", "smallest", "mean", "largest"]).caption("Measures over all cases.");
    overview.ranges.iter().fold(table, |table, range| {
        let estimate = |value: f64| Cell::Estimate(Estimate::new(value, range.measure.unit));
        table.row([
            Cell::from(range.measure.title),
            Cell::from(range.known.to_string().as_str()),
            estimate(range.smallest.0),
            estimate(range.mean()),
            estimate(range.largest.0),
        ])
    })
}

/// Reasons in order of occurrence.
fn reasons(overview: &Overview) -> Vec<String> {
    let line = |(reason, case, more): &(String, u64, u64)| match more {
        0 => format!("Case {case}: {reason}"),
        more => format!("Case {case} and {more} similar ones: {reason}"),
    };
    overview.reasons.iter().map(line).collect()
}
