//! Results: ranks, tables, figures.

use std::path::Path;

use super::{BENCH, CellResult, Entrant, Lane, Manoeuvre, Outcome, Ranked, VARIATIONS, rank};
use stickslip_base::figure::{Axis, Figure, Role, Series, panels};
use stickslip_base::preset::ControllerChoice;
use stickslip_base::quantity::{Estimate, number, tied};
use stickslip_base::report::{Provenance, Report, Table};
use stickslip_base::statistics::{bootstrap, mean};
use stickslip_base::{Error, Summary, Watch, output, parameters};

/// The panels of a figure, with their captions.
pub(super) type Panels = Vec<(Figure, String)>;

/// Number of entrants in a figure, and its time range about a reversal [s].
pub(super) const DRAWN: usize = 3;
const AROUND: [f64; 2] = [-0.05, 0.35];
/// Time of the reversal in the sine of that manoeuvre [s].
const REVERSAL: f64 = 2.5;

/// Mean and 95 % interval of the finite values.
fn estimate(values: &[f64]) -> Option<(f64, [f64; 2])> {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let all = mean(finite.iter().copied());
    (!finite.is_empty()).then(|| (all, bootstrap(finite.len(), |drawn| mean(drawn.iter().map(|&k| finite[k])))))
}

impl Outcome {
    fn cell(&self, friction: &str, entrant: &str, variation: &str) -> Option<&CellResult> {
        self.cells
            .iter()
            .find(|cell| cell.friction == friction && cell.entrant == entrant && cell.variation == variation)
    }

    fn is_simulated(&self) -> bool {
        self.plan.frictions.iter().all(|friction| friction.name != BENCH)
    }

    /// All ranks, friction by friction.
    pub fn ranks(&self) -> Vec<(&'static str, Vec<Ranked>)> {
        self.plan.frictions.iter().map(|friction| (friction.name, rank(self, friction.name))).collect()
    }

    /// Mean and 95 % interval of a measure of an entrant on a friction with the exact model; `None` without a number.
    pub fn measured(
        &self,
        friction: &str,
        entrant: &str,
        manoeuvre: Manoeuvre,
        measure: usize,
    ) -> Option<(f64, [f64; 2])> {
        estimate(&self.cell(friction, entrant, VARIATIONS[0].name)?.values(manoeuvre, measure))
    }

    /// The numbers, under their stable names; `benchmark.complete` is 0 where the run was cancelled.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("benchmark");
        let failures: usize = self.cells.iter().map(CellResult::failures).sum();
        summary
            .result("benchmark.complete", f64::from(u8::from(self.complete)), "1")
            .result("benchmark.cells", self.cells.len() as f64, "1")
            .result("benchmark.failed_runs", failures as f64, "1");
        for (friction, ranks) in self.ranks() {
            for it in ranks {
                let place = it.place.map_or(serde_json::Value::Null, |place| place.to_vec().into());
                summary.row([
                    ("kind", "rank".into()),
                    ("machine", self.plan.machine.as_str().into()),
                    ("friction", friction.into()),
                    ("controller", it.entrant.as_str().into()),
                    ("place", place),
                    ("factor", it.factor.into()),
                    ("ci95", it.ci95.to_vec().into()),
                    ("failures", it.failures.into()),
                ]);
            }
        }
        for cell in &self.cells {
            for manoeuvre in &self.plan.manoeuvres {
                for (index, measure) in manoeuvre.measures().iter().enumerate() {
                    let values = cell.values(*manoeuvre, index);
                    if values.is_empty() {
                        continue;
                    }
                    let (value, ci95) = estimate(&values).unwrap_or((f64::NAN, [f64::NAN; 2]));
                    summary.row([
                        ("kind", "measure".into()),
                        ("machine", self.plan.machine.as_str().into()),
                        ("friction", cell.friction.as_str().into()),
                        ("variation", cell.variation.as_str().into()),
                        ("controller", cell.entrant.as_str().into()),
                        ("measure", measure.name.into()),
                        ("unit", measure.unit.into()),
                        ("value", value.into()),
                        ("ci95", ci95.to_vec().into()),
                    ]);
                }
            }
        }
        summary
    }

    /// Two tables for each friction: the ranks with the measures that count, and the other measures.
    pub fn tables(&self) -> Vec<(String, Table)> {
        let count = std::f64::consts::TAU / self.plan.preset.model.encoder.counts_per_revolution;
        let mut tables = Vec::new();
        for case in &self.plan.frictions {
            let ranks = rank(self, case.name);
            let preset = case.on(&self.plan.preset);
            let own = preset.model.own;
            let quantity = |value: f64, unit: &str| tied(&Estimate::new(value, unit));
            let mut machine = format!("{}, {} friction", self.plan.machine, case.name);
            let friction = format!(
                "{machine}: M_S {}, M_K {}, Ω_Strib {}",
                quantity(own.breakaway_torque, "N m"),
                quantity(own.kinetic_torque, "N m"),
                quantity(own.stribeck_velocity, "rad/s"),
            );
            if self.measures(true).next().is_some() {
                let caption = format!(
                    "{friction}. Factor: deviations of {} over those of the controller. One count is {}.",
                    self.plan.entrants[0].name,
                    quantity(count, "rad")
                );
                tables.push((caption, self.table(case.name, &ranks, true)));
            } else {
                // Measures other than tracking do not rank.
                machine = friction;
            }
            if self.measures(false).next().is_some() {
                let tolerance = quantity(stickslip_simulate::manoeuvre::tolerance(&preset), "rad");
                let caption = format!("{machine}: settling and rest. A move has settled within {tolerance}.");
                tables.push((caption, self.table(case.name, &ranks, false)));
            }
        }
        tables
    }

    /// Measures of tracking with its noise, or the others.
    fn measures(&self, of_tracking: bool) -> impl Iterator<Item = (Manoeuvre, usize)> + '_ {
        let tracks = |manoeuvre: &Manoeuvre| manoeuvre.measures().iter().any(|measure| measure.ranks);
        let chosen = self.plan.manoeuvres.iter().filter(move |manoeuvre| tracks(manoeuvre) == of_tracking);
        chosen.flat_map(|manoeuvre| (0..manoeuvre.measures().len()).map(|index| (*manoeuvre, index)))
    }

    /// Table of entrants over measures.
    fn table(&self, friction: &str, ranks: &[Ranked], of_tracking: bool) -> Table {
        let title = |(manoeuvre, index): (Manoeuvre, usize)| {
            let measure = &manoeuvre.measures()[index];
            format!("{}{}", measure.title, shown_unit(measure.unit))
        };
        let first: &[&str] = if of_tracking { &["place", "controller", "factor"] } else { &["controller"] };
        let head = first.iter().map(|word| (*word).to_owned()).chain(self.measures(of_tracking).map(title));
        let rows = ranks.iter().map(|it| {
            let cells = self.measures(of_tracking).map(|(manoeuvre, index)| {
                let cell = self.cell(friction, &it.entrant, VARIATIONS[0].name);
                let values = cell.map(|cell| cell.values(manoeuvre, index)).unwrap_or_default();
                shown(manoeuvre.measures()[index].unit, &values)
            });
            let place = match it.place {
                None => "failed".into(),
                Some([first, last]) if first == last => first.to_string(),
                Some([first, last]) => format!("{first}–{last}"),
            };
            let factor = if it.factor.is_finite() {
                format!("{} ± {}", number(it.factor, 2), number(0.5 * (it.ci95[1] - it.ci95[0]), 2))
            } else {
                "–".into()
            };
            let first = if of_tracking { vec![place, it.entrant.clone(), factor] } else { vec![it.entrant.clone()] };
            first.into_iter().chain(cells).map(Into::into).collect::<Vec<_>>()
        });
        rows.fold(Table::new(head), Table::row)
    }

    /// A table for each friction: the peak at the reversal where machine and model differ.
    pub fn robustness(&self) -> Vec<(String, Table)> {
        if self.plan.variations.is_empty() || !self.plan.manoeuvres.contains(&Manoeuvre::Reversal) {
            return Vec::new();
        }
        let variations: Vec<&str> =
            VARIATIONS[..1].iter().chain(&self.plan.variations).map(|variation| variation.name).collect();
        let of = |friction: &'static str| {
            let head = ["controller"].into_iter().chain(variations.iter().copied()).chain(["worst"]);
            let rows = self.plan.entrants.iter().map(|entrant| {
                let values: Vec<Vec<f64>> = variations
                    .iter()
                    .map(|variation| {
                        let cell = self.cell(friction, &entrant.name, variation);
                        cell.map(|cell| cell.values(Manoeuvre::Reversal, 0)).unwrap_or_default()
                    })
                    .collect();
                let failed = values.iter().flatten().any(|value| value.is_nan());
                let worst =
                    values.iter().filter_map(|all| estimate(all)).fold(0.0, |worst: f64, (mean, _)| worst.max(mean));
                let worst = if failed { "fails".into() } else { number(1e3 * worst, 1) };
                let cells = values.iter().map(|all| shown("rad", all));
                [entrant.name.clone()].into_iter().chain(cells).chain([worst]).map(Into::into).collect::<Vec<_>>()
            });
            let caption = format!("{}, {friction} friction: peak at a reversal in mrad.", self.plan.machine);
            (caption, rows.fold(Table::new(head), Table::row))
        };
        self.plan.frictions.iter().map(|friction| of(friction.name)).collect()
    }

    /// Files with their figures and captions. In simulation the deviation about a reversal: the reference and the best,
    /// for each friction.
    fn figures(&self) -> Result<Vec<(String, Panels)>, Error> {
        let mut figures = Vec::new();
        if !self.is_simulated() {
            return Ok(self.figures_of_bench());
        }
        if !self.plan.manoeuvres.contains(&Manoeuvre::Reversal) {
            return Ok(figures);
        }
        for friction in &self.plan.frictions {
            let ranks = rank(self, friction.name);
            let first = &self.plan.entrants[0].name;
            let best = ranks.iter().filter(|it| it.place.is_some() && it.entrant != *first).take(DRAWN);
            let names: Vec<&String> = std::iter::once(first).chain(best.map(|it| &it.entrant)).collect();
            let mut figure = Figure::new(format!("A reversal, {} friction", friction.name))
                .x(Axis::new("time from the reversal", "s"))
                .y(Axis::new("deviation", "mrad"));
            for (index, name) in names.into_iter().enumerate() {
                let Some(entrant) = self.plan.entrants.iter().find(|entrant| entrant.name == *name) else { continue };
                let preset = entrant.on(&friction.on(&self.plan.preset), self.controller(entrant));
                let lane =
                    Lane { preset: &preset, manoeuvre: Manoeuvre::Reversal, seed: 1, chance: 0.5, long_steps: false };
                let Some(course) = entrant.run(&[lane], &Watch::silent())?.pop().flatten() else { continue };
                let points =
                    course.deviation.iter().enumerate().map(|(k, e)| (k as f64 * course.period - REVERSAL, 1e3 * e));
                let near = points.filter(|(time, _)| (AROUND[0]..AROUND[1]).contains(time));
                let role = if index == 0 { Role::Reference } else { Role::Trace(index - 1) };
                figure = figure.series(Series::line(role, name.clone(), near.collect::<Vec<_>>()));
            }
            let caption = format!(
                "{}, {} friction: set-point less angle of the screw about a reversal, the first seed.",
                self.plan.machine, friction.name
            );
            figures.push((format!("reversal_{}.svg", friction.name), vec![(figure, caption)]));
        }
        Ok(figures)
    }

    /// The tuned controller of an entrant.
    fn controller(&self, entrant: &Entrant) -> Option<ControllerChoice<f64>> {
        let name = entrant.tuned_as()?;
        self.tuned.iter().find(|(other, _)| *other == name).map(|(_, controller)| *controller)
    }

    /// Main results, in sentences.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks: Vec<String> = self
            .ranks()
            .into_iter()
            .filter_map(|(friction, ranks)| {
                let best: Vec<&Ranked> =
                    ranks.iter().filter(|it| it.place.is_some_and(|place| place[0] == 1)).collect();
                let names: Vec<&str> = best.iter().map(|it| it.entrant.as_str()).collect();
                let factor = best.first()?.factor;
                if names.contains(&self.plan.entrants[0].name.as_str()) {
                    return Some(format!("{friction} friction: least deviation with {}.", names.join(" and ")));
                }
                let shared = if names.len() > 1 { " (no significant difference between them)" } else { "" };
                Some(format!(
                    "{friction} friction: least deviation with {}{shared}, {} times less than {}.",
                    names.join(", "),
                    number(factor, 1),
                    self.plan.entrants[0].name
                ))
            })
            .collect();
        if ["pid", "cascade"].iter().all(|name| self.plan.entrants.iter().any(|entrant| entrant.name == *name)) {
            remarks.push(
                "PID and cascade have the same structure: the gains of one can be converted to the other, except that a \
                 cascade has real zeros. A difference between them is a difference of tuning."
                    .into(),
            );
        }
        let failed: Vec<String> = self
            .cells
            .iter()
            .filter(|cell| cell.failures() > 0)
            .map(|cell| format!("{} ({} friction, {})", cell.entrant, cell.friction, cell.variation))
            .collect();
        if !failed.is_empty() {
            remarks.push(format!("Failed runs, stopped by the supervision: {}.", failed.join("; ")));
        }
        for entrant in &self.plan.entrants {
            remarks.extend(entrant.fault().map(|fault| format!("{} failed; first fault: {fault}", entrant.name)));
        }
        if !self.complete {
            remarks.push(if self.is_simulated() {
                "The benchmark was cancelled. Start it again with the same folder to continue.".into()
            } else {
                "The comparison ended early; controllers without all their runs are missing.".into()
            });
        }
        remarks
    }

    /// The report.
    ///
    /// # Errors
    /// An invalid preset.
    pub fn report(&self, command: &str) -> Result<Report, Error> {
        let provenance = Provenance::new(command, None, parameters::write_commented(&self.plan.preset));
        let mut report =
            Report::new("Position controllers compared", provenance).summary(self.remarks().join(" ")).heading("Ranks");
        for (caption, table) in self.tables() {
            report = report.table(table.caption(caption));
        }
        let robustness = self.robustness();
        if !robustness.is_empty() {
            report = report.heading("Machine and model differ");
        }
        for (caption, table) in robustness {
            report = report.table(table.caption(caption));
        }
        for (figure, caption) in self.figures()?.into_iter().flat_map(|(_, figures)| figures) {
            report = report.figure(figure, caption);
        }
        Ok(report)
    }

    /// Writes figures, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses; an invalid preset.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        for (name, figures) in self.figures()? {
            let figures: Vec<Figure> = figures.into_iter().map(|(figure, _)| figure).collect();
            let text = if let [one] = &figures[..] { one.svg() } else { panels(figures[0].title(), &figures) };
            output::write(&directory.join(&name), text)?;
            summary.file(&name);
        }
        self.report(command)?.write_all(summary, [], directory)
    }
}

/// The unit in a table head; values are scaled to it.
fn shown_unit(unit: &str) -> &'static str {
    match unit {
        "rad" => ", mrad",
        "N m" => ", mN·m",
        "s" => ", ms",
        _ => ", %",
    }
}

/// Mean and half of the 95 % interval in that unit.
fn shown(unit: &str, values: &[f64]) -> String {
    if values.iter().any(|value| value.is_nan()) && unit != "s" {
        return "fails".into();
    }
    let scale = if unit == "1" { 100.0 } else { 1e3 };
    let Some((mean, [low, high])) = estimate(values) else { return "–".into() };
    let (mean, half) = (scale * mean, scale * 0.5 * (high - low));
    let decimals = if unit == "1" {
        0
    } else if mean.abs() < 10.0 {
        2
    } else {
        1
    };
    if half > 0.0 && unit != "1" {
        format!("{} ± {}", number(mean, decimals), number(half, decimals))
    } else {
        number(mean, decimals)
    }
}
