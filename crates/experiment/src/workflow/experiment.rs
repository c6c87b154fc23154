//! Report of an experiment in steps on one bench: own friction, desired friction, rendered friction.
//!
//! It is assembled from the results of the steps.

use std::path::Path;

use crate::workflow::fit::{FrictionFits, fit_file};
use stickslip_base::parameters::{Value, flatten};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Provenance, Report, Section, Table};
use stickslip_base::{Error, Preset, Summary, parameters};
use stickslip_fit::{PARAMETERS, values};
use stickslip_identify::curve_file::CurveColumns;

/// Results of the steps.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// The measurement of the own friction, and its fit, if there are enough points.
    own: Option<(Report, Option<FrictionFits>)>,
    /// The measurement under the law.
    rendered: Option<Report>,
    /// The active parameters.
    preset: Preset<f64>,
}

impl Experiment {
    /// From the folders of the two measurements.
    ///
    /// # Errors
    /// [`Error::TooFew`] without any; errors of their files.
    pub fn read(own: Option<&Path>, rendered: Option<&Path>, preset: Preset<f64>) -> Result<Self, Error> {
        if own.or(rendered).is_none() {
            let remedy = "Measure the friction first.";
            return Err(Error::TooFew { what: "measured friction curves", found: 0, needed: 1, remedy });
        }
        let own = match own {
            Some(folder) => {
                let fits = match fit_file(folder, &CurveColumns::default(), false) {
                    Err(Error::TooFew { .. }) => None,
                    fits => Some(fits?),
                };
                Some((Report::read(folder)?, fits))
            }
            None => None,
        };
        Ok(Experiment { own, rendered: rendered.map(Report::read).transpose()?, preset })
    }

    /// The report; `command` is the command that writes it.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, None, parameters::write_commented(&self.preset));
        let mut report = Report::new("Friction measured, designed and rendered", provenance);
        if let Some(rendered) = &self.rendered {
            report = report.summary(rendered.summary_text());
        }
        if let Some((measured, fits)) = &self.own {
            let fitted = fits.as_ref().and_then(|fits| Some((fits, fits.fits.first()?)));
            for (name, estimate) in fitted.iter().flat_map(|(_, one)| one.fit.lines()) {
                report = report.key(format!("own {name}"), estimate);
            }
            report = added(report.heading("Own friction").paragraph(measured.summary_text()), measured);
            if let Some((fits, one)) = fitted {
                report = report.list(fits.advice(one));
            }
        }
        report = report.heading("Desired friction").table(self.desired());
        if let Some(rendered) = &self.rendered {
            for (name, estimate) in rendered.keys() {
                report = report.key(name, estimate.clone());
            }
            report = added(report.heading("Rendered friction"), rendered);
        }
        report.heading("Controller and law").table(self.choices())
    }

    /// Active desired and own parameters.
    fn desired(&self) -> Table {
        let Preset { model, bench, .. } = &self.preset;
        let table = Table::new(["parameter", "own, subtracted", "desired"])
            .caption("Active own friction, subtracted by the law, and desired friction.");
        let rows = PARAMETERS.iter().zip(values(&model.own).into_iter().zip(values(&bench.desired)));
        rows.fold(table, |table, ((_, name, unit), (own, desired))| {
            let cell = |value: f64| Cell::Estimate(Estimate::new(value, *unit));
            table.row([Cell::Text((*name).into()), cell(own), cell(desired)])
        })
    }

    /// Selected controller, law and rate.
    fn choices(&self) -> Table {
        let chosen = |path: &str| {
            let entry = flatten(&self.preset).into_iter().find(|it| it.path == path);
            match entry.map(|entry| entry.value) {
                Some(Value::Variant(name)) => Cell::Text(name.into()),
                _ => Cell::Text("unknown".into()),
            }
        };
        Table::new(["", "active"])
            .row(["position controller under test".into(), chosen("bench.controller.kind")])
            .row(["rendering law".into(), chosen("bench.law.kind")])
            .row(["tick rate".into(), Cell::Estimate(Estimate::new(self.preset.bench.tick_rate, "Hz"))])
    }

    /// Writes report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        let mut summary = Summary::new("report");
        let keys = self.rendered.iter().flat_map(Report::keys);
        if let Some((_, error)) = keys.into_iter().next() {
            summary.result("report.rms_error", error.value, &error.unit);
        }
        self.report(command).write_all(summary, [], directory)
    }
}

/// The tables and figures of another report.
fn added(report: Report, other: &Report) -> Report {
    let sections =
        other.sections().iter().filter(|section| matches!(section, Section::Table(_) | Section::Figure { .. }));
    sections.cloned().fold(report, Report::section)
}
