//! Numbers, tables, figures and report of the demonstration, as files.

use std::path::Path;

use super::{Demo, Measured};
use crate::FrictionCurve;
use crate::workflow::results::{columns, estimate, estimates, rows};
use stickslip_base::quantity::{Estimate, number};
use stickslip_base::report::{Cell, Provenance, Report, Section, Table};
use stickslip_base::{Error, Summary, output, parameters};
use stickslip_fit::PARAMETERS;
use stickslip_recording::table::write_parquet;

impl Demo {
    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("demo");
        estimates(&mut summary, "measure", &self.own.fit);
        estimates(&mut summary, "measure.released", &self.released.fit);
        estimates(&mut summary, "measure.pressed", &self.pressed.fit);
        let dropped = [&self.released.curve, &self.pressed.curve, &self.own.curve, &self.rendering.curve];
        let dropped: usize = dropped.iter().map(|curve| curve.dropped().count()).sum();
        summary
            .result("measure.duration", self.own.curve.duration, "s")
            .result("measure.dropped_plateaus", dropped as f64, "1")
            .result("measure.preload", self.preload.preload, "1")
            .result("measure.preload_wanted", self.preload.wanted, "1");
        for ((name, _, unit), value) in PARAMETERS.iter().zip(self.truth.parameters) {
            summary.result(&format!("truth.{name}"), value, unit);
        }
        summary.result("truth.fit_residual", self.truth_residual, "N m");
        self.rendering.add_to(&mut summary);
        summary.result("speed.bench_time", self.bench_time, "s").result("speed.wall_time", self.wall_time, "s").result(
            "speed.real_time_factor",
            self.bench_time / self.wall_time,
            "1",
        );
        summary
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, Some(self.seed), parameters::write_commented(&self.preset));
        let own = &self.own.fit;
        let mut report =
            Report::new("Friction rendered on the virtual bench", provenance).summary(self.rendering.verdict());
        for (k, (_, name, unit)) in PARAMETERS.iter().enumerate() {
            report = report.key(format!("own {name}"), estimate(own, k, unit));
        }
        report = report
            .key("RMS error outside the fade-out", Estimate::new(self.rendering.error_outside_fade(), "N m"))
            .key("RMS error inside", Estimate::new(self.rendering.error_inside_fade(), "N m"))
            .key("preload of the friction wheel", Estimate::new(self.preload.preload, "1"))
            .key("torque step at the fade-out", Estimate::new(self.rendering.step_at_fade(), "N m"));
        let [shaping, measurement, design, own_and_desired, rendered, load_torque, sweep] =
            self.figures().map(|(_, figure, caption)| Section::Figure { figure: Box::new(figure), caption });
        report = report
            .heading("Shaping friction by wheel and load motor")
            .section(shaping)
            .heading("Own friction")
            .paragraph(format!(
                "Measured at {} speeds in each direction, {} of bench time. The true values are those of the virtual \
                 machine; the measurement does not use them.",
                self.plan.speeds().count(),
                Estimate::new(self.own.curve.duration, "s"),
            ))
            .table(self.comparison())
            .section(measurement)
            .heading("Desired friction")
            .section(design)
            .section(own_and_desired)
            .heading("Rendered friction")
            .section(rendered)
            .section(load_torque)
            .section(sweep);
        let mut dropped =
            Table::new(["measurement", "velocity, rad/s", "reason"]).caption("Plateaus excluded from fits and errors.");
        let mut any = false;
        for (name, curve) in self.curves() {
            for plateau in curve.dropped() {
                any = true;
                let why = plateau.dropped.map(|reason| reason.to_string()).unwrap_or_default();
                dropped = dropped.row([name.into(), number(plateau.set_velocity, 3).into(), why.into()]);
            }
        }
        if any {
            report = report.heading("Excluded plateaus").table(dropped);
        }
        report
    }

    fn curves(&self) -> [(&'static str, &FrictionCurve); 4] {
        [
            ("released", &self.released.curve),
            ("pressed", &self.pressed.curve),
            ("own", &self.own.curve),
            ("rendered", &self.rendering.curve),
        ]
    }

    /// Measured and true parameters.
    fn comparison(&self) -> Table {
        let mut table = Table::new(["parameter", "measured", "true"])
            .caption("Own friction at the active preload: measured, with 95\u{a0}% intervals, and true.");
        for (k, (_, name, unit)) in PARAMETERS.iter().enumerate() {
            table = table.row([
                Cell::Text((*name).into()),
                Cell::Estimate(estimate(&self.own.fit, k, unit)),
                Cell::Estimate(Estimate::new(self.truth.parameters[k], *unit)),
            ]);
        }
        table
    }

    /// Writes everything into a folder: summary, report, figures, tables.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        for (name, figure, _) in self.figures() {
            output::write(&directory.join(name), figure.svg())?;
            summary.file(name);
        }
        for (name, curve) in [("measured.parquet", &self.own.curve), ("rendered.parquet", &self.rendering.curve)] {
            write_parquet(&directory.join(name), &columns(curve))?;
            summary.file(name);
        }
        for name in self.report(command).write(directory)? {
            summary.file(name);
        }
        for (name, curve) in self.curves() {
            rows(&mut summary, name, curve);
        }
        summary.write(directory)?;
        Ok(summary)
    }
}

impl Measured {
    /// The fit as text for a terminal: name, value ± half width.
    pub fn lines(&self) -> impl Iterator<Item = (&'static str, Estimate)> + '_ {
        self.fit.lines()
    }
}
