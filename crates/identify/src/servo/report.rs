//! The report of a servo: errors of the models, and the limits of the runs.

use super::{Kind, ServoIdentification, fields, values};
use crate::machine::{Machine, Run};
use stickslip_base::Watch;
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, number, tied};
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_recording::Recording;

/// The whole report. `command` is its command line.
pub fn report(found: &ServoIdentification, machine: &Machine, recording: &Recording, command: &str) -> Report {
    let provenance = Provenance::new(command, None, machine.text.clone());
    let file = recording.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut report = Report::new(format!("{}: motor and friction from {file}", machine.name), provenance)
        .summary(main_result(found))
        .heading("Comparison of models")
        .table(models(found))
        .paragraph(
            "Root mean square of measured minus simulated angle. Each simulation uses the first angle of its run and \
             the reference, nothing else that was measured. Published parameters come from the machine file and took \
             no part; they are simulated by the same equations on the same runs.",
        );
    for (_, figure, caption) in found.figures() {
        report = report.figure(figure, caption);
    }
    report = report.heading("Not identifiable from these runs");
    for limit in found.limits(machine) {
        report = report.paragraph(limit);
    }
    report.heading("Parameters of the best model").table(parameters(found)).paragraph(
        "Each ± is half of the width of the 95\u{a0}% interval; the intervals themselves, which are not symmetric, \
         stand in summary.json. Samples of a run follow each other, so that only whole runs count as news: each run \
         was left out in turn (jackknife to first order).",
    )
}

fn main_result(found: &ServoIdentification) -> String {
    let best = found.best();
    let names: Vec<String> = found.held_out().map(|run| run.number.to_string()).collect();
    let [low, high] = found.controller_slopes();
    let published = found.candidates.iter().filter_map(|c| c.published.map(|(_, rms)| rms)).reduce(f64::min);
    let beside = published.map_or(String::new(), |rms| format!("; that of the best published model is {}", angle(rms)));
    format!(
        "Simulated in the closed loop with the servo's own controller, the best model ({}) gives the angle of the runs \
         that its fit did not use ({}) within {} rms{beside}. The duty that the servo recorded is {} to {} times that of the \
         controller in the machine file.",
        best.fitted.kind.title(),
        names.join(", "),
        angle(best.held_out_rms),
        number(low, 2),
        number(high, 2),
    )
}

/// In mrad and degrees.
pub(super) fn angle(rms: f64) -> String {
    format!("{} ({}\u{a0}°)", tied(&Estimate::new(rms, "rad")), number(rms.to_degrees(), 2))
}

fn models(found: &ServoIdentification) -> Table {
    let head = ["", "parameters", "runs fitted", "runs held out", "held out, published parameters"];
    found.candidates.iter().enumerate().fold(Table::new(head), |table, (index, candidate)| {
        let kind = candidate.fitted.kind;
        let best = if index == found.best { ", best" } else { "" };
        let published = candidate.published.map_or_else(String::new, |(_, rms)| angle(rms));
        table.row([
            Cell::Text(format!("{}{best}", kind.title())),
            Cell::Text(fields().iter().filter(|field| kind.has(field.name)).count().to_string()),
            Cell::Text(angle(candidate.fit_rms)),
            Cell::Text(angle(candidate.held_out_rms)),
            Cell::Text(published),
        ])
    })
}

fn parameters(found: &ServoIdentification) -> Table {
    let best = found.best();
    let published = best.published.map(|(servo, _)| values(&servo));
    let head: &[&str] = if published.is_some() { &["", "identified", "published"] } else { &["", "identified"] };
    let named = fields().iter().enumerate().filter(|(_, field)| best.fitted.kind.has(field.name));
    named.fold(Table::new(head.iter().copied()), |table, (i, field)| {
        let half_width = best.fitted.ci95[i].map_or(f64::INFINITY, |[low, high]| 0.5 * (high - low));
        let identified = Estimate::new(values(&best.fitted.servo)[i], field.unit).with_half_width(half_width);
        let name = format!("{} {}", field.help.trim().trim_end_matches('.'), field.symbol);
        let cells = [Cell::Text(name), Cell::Estimate(identified)];
        let published = published.map(|all| Cell::Estimate(Estimate::new(all[i], field.unit)));
        table.row(cells.into_iter().chain(published))
    })
}

impl ServoIdentification {
    /// A figure for each run that was held out, with file name and caption.
    pub fn figures(&self) -> Vec<(String, Figure, String)> {
        self.held_out().map(|run| self.figure(run)).collect()
    }

    fn figure(&self, run: &Run) -> (String, Figure, String) {
        let pairs = |angles: &[f64]| run.time.iter().copied().zip(angles.iter().copied()).collect::<Vec<_>>();
        let simulated = |candidate: &super::Candidate, published: bool| {
            let servo =
                if published { candidate.published.map(|(servo, _)| servo) } else { Some(candidate.fitted.servo) };
            // A silent watch never cancels.
            servo.and_then(|servo| servo.simulate(candidate.fitted.kind, run, &Watch::silent()).ok())
        };
        let best = self.best();
        let mut figure = Figure::new(format!("Angle of run {}, held out", run.number))
            .x(Axis::new("time", "s"))
            .y(Axis::new("angle", "rad"))
            .series(Series::points(Role::Measured, "measured", pairs(&run.position)));
        if let Some(angles) = simulated(best, true) {
            figure = figure.series(Series::line(Role::Reference, "published", pairs(&angles)).dashed());
        }
        let coulomb = self.candidates.iter().find(|c| c.fitted.kind == Kind::Coulomb && c != &best);
        if let Some(angles) = coulomb.and_then(|candidate| simulated(candidate, false)) {
            figure = figure.series(Series::line(Role::Trace(1), "Coulomb and viscous", pairs(&angles)).dashed());
        }
        if let Some(angles) = simulated(best, false) {
            figure = figure.series(Series::line(Role::Fitted, best.fitted.kind.title(), pairs(&angles)));
        }
        let caption = "Measured, and simulated from the first angle and the reference alone.".to_owned();
        (format!("figure-run-{}.svg", run.number), figure, caption)
    }
}
