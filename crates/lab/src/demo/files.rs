//! Numbers, tables, figures and report of the demonstration, as files.

use std::path::Path;

use serde_json::Value;

use super::{Demo, Measured};
use crate::experiment::FrictionCurve;
use crate::figure::Figure;
use crate::fit::{PARAMETERS, StribeckFit};
use crate::quantity::Estimate;
use crate::report::{Cell, Provenance, Report, Table};
use crate::table::{Column, write_parquet};
use crate::{Error, Summary, output, parameters};

impl Demo {
    /// All figures with file name and caption.
    pub fn figures(&self) -> [(&'static str, Figure, &'static str); 5] {
        [
            (
                "figure-05.svg",
                self.figure_5(),
                "The friction wheel brings the breakaway torque to the desired value; the load motor does the rest.",
            ),
            (
                "figure-12.svg",
                self.figure_12(),
                "Own friction at the preload that was set, measured at constant speeds, and what the axis shall feel like.",
            ),
            (
                "figure-13.svg",
                self.figure_13(),
                "Measured again under the rendering law. Inside the fade-out only the mechanics acts.",
            ),
            (
                "figure-14.svg",
                self.figure_14(),
                "The reference of the load motor's current control, and what its current sensor shows.",
            ),
            (
                "figure-14-sweep.svg",
                self.figure_sweep(),
                "A slow sweep through standstill: the difference torque steps at the limits of the fade-out.",
            ),
        ]
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("demo");
        estimates(&mut summary, "measure", &self.own.fit);
        estimates(&mut summary, "measure.released", &self.released.fit);
        estimates(&mut summary, "measure.pressed", &self.pressed.fit);
        let dropped = [&self.released.curve, &self.pressed.curve, &self.own.curve, &self.rendered];
        let dropped: usize = dropped.iter().map(|curve| curve.dropped().count()).sum();
        summary
            .result("measure.duration", self.own.curve.duration, "s")
            .result("measure.dropped_plateaus", dropped as f64, "1")
            .result("measure.preload", self.preload.preload, "1")
            .result("measure.preload_wanted", self.preload.wanted, "1");
        for ((name, _, unit), value) in PARAMETERS.iter().zip(self.truth.parameters) {
            summary.result(&format!("truth.{name}"), value, unit);
        }
        let breakaway = self.law.desired.breakaway_torque;
        let outside = self.error_outside_fade();
        summary
            .result("truth.fit_residual", self.truth_residual, "N m")
            .result("render.rms_error", outside, "N m")
            .result("render.rms_error_over_breakaway", outside / breakaway, "1")
            .result("render.rms_error_inside_fade_over_breakaway", self.error_inside_fade() / breakaway, "1")
            .result("render.expected_inside_fade_over_breakaway", self.expected_inside_fade() / breakaway, "1")
            .result(
                "render.expected_inside_fade_if_steady_over_breakaway",
                self.expected_inside_fade_if_steady() / breakaway,
                "1",
            )
            .result("render.fade_velocity", self.law.fade_velocity, "rad/s")
            .result("render.velocity_noise", self.velocity_noise, "rad/s")
            .result("render.step_at_fade", self.step_at_fade(), "N m")
            .result("speed.bench_time", self.bench_time, "s")
            .result("speed.wall_time", self.wall_time, "s")
            .result("speed.real_time_factor", self.bench_time / self.wall_time, "1");
        summary
    }

    /// Height of the torque step at the limits of the fade-out [N m].
    fn step_at_fade(&self) -> f64 {
        let fade = self.law.fade_velocity;
        (self.law.desired.magnitude(fade) - self.law.own.magnitude(fade)).abs()
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance {
            command: command.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            seed: Some(self.seed),
            parameters: parameters::write_commented(&self.preset),
        };
        let breakaway = self.law.desired.breakaway_torque;
        let percent = |torque: f64| format!("{:.2} % of M_S", 100.0 * torque / breakaway);
        let mut report = Report::new("Friction rendered on the virtual bench", provenance)
            .paragraph(format!(
                "The own friction was measured at {} speeds in both directions, a desired characteristic was set, the \
                 load motor rendered the difference through observer, current control and all delays, and the \
                 friction was measured again: {} from the desired characteristic outside the fade-out, {} inside, \
                 where {} is expected.",
                self.plan.speeds().count(),
                percent(self.error_outside_fade()),
                percent(self.error_inside_fade()),
                percent(self.expected_inside_fade()),
            ))
            .heading("Own friction")
            .table(self.comparison());
        for (_, figure, caption) in self.figures() {
            report = report.figure(figure, caption);
        }
        let text = |text: String| Cell::Text(text);
        let mut dropped = Table::new(["measurement", "velocity, rad/s", "why it does not count"]);
        let mut any = false;
        for (name, curve) in self.curves() {
            for plateau in curve.dropped() {
                any = true;
                let why = plateau.dropped.map(|reason| reason.to_string()).unwrap_or_default();
                dropped = dropped.row([text(name.into()), text(format!("{:.3}", plateau.set_velocity)), text(why)]);
            }
        }
        if any {
            report = report.heading("Plateaus that do not count").table(dropped);
        }
        report
    }

    fn curves(&self) -> [(&'static str, &FrictionCurve); 4] {
        [
            ("released", &self.released.curve),
            ("pressed", &self.pressed.curve),
            ("own", &self.own.curve),
            ("rendered", &self.rendered),
        ]
    }

    /// Measured beside true parameters.
    fn comparison(&self) -> Table {
        let mut table = Table::new(["parameter", "measured", "true"]);
        for ((name, measured), truth) in self.own.lines().zip(self.truth.parameters) {
            let exact = Estimate::new(truth, measured.unit.clone());
            table = table.row([Cell::Text(name.into()), Cell::Estimate(measured), Cell::Estimate(exact)]);
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
        for (name, curve) in [("measured.parquet", &self.own.curve), ("rendered.parquet", &self.rendered)] {
            write_parquet(&directory.join(name), &columns(curve))?;
            summary.file(name);
        }
        self.report(command).write(&directory.join("report.html"))?;
        summary.file("report.html");
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

fn estimates(summary: &mut Summary, prefix: &str, fit: &StribeckFit) {
    for (k, (name, _, unit)) in PARAMETERS.iter().enumerate() {
        summary.with_interval(&format!("{prefix}.{name}"), fit.parameters[k], fit.ci95[k], unit);
    }
}

fn rows(summary: &mut Summary, measurement: &str, curve: &FrictionCurve) {
    for plateau in &curve.plateaus {
        summary.row([
            ("measurement", Value::from(measurement)),
            ("set_velocity", plateau.set_velocity.into()),
            ("velocity", plateau.velocity.into()),
            ("velocity_spread", plateau.velocity_spread.into()),
            ("torque", plateau.torque.into()),
            ("standard_error", plateau.standard_error.into()),
            ("speed_deviation", plateau.deviation.into()),
            ("counts", plateau.dropped.is_none().into()),
        ]);
    }
}

fn columns(curve: &FrictionCurve) -> [Column; 8] {
    let blocks = || curve.plateaus.iter().flat_map(|plateau| plateau.blocks.iter().map(move |block| (plateau, block)));
    let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
    [
        column("set_velocity", "rad/s", blocks().map(|(plateau, _)| plateau.set_velocity).collect()),
        column("plateau_velocity", "rad/s", blocks().map(|(plateau, _)| plateau.velocity).collect()),
        column("plateau_torque", "N m", blocks().map(|(plateau, _)| plateau.torque).collect()),
        column("plateau_standard_error", "N m", blocks().map(|(plateau, _)| plateau.standard_error).collect()),
        column("counts", "1", blocks().map(|(plateau, _)| f64::from(u8::from(plateau.dropped.is_none()))).collect()),
        column("velocity", "rad/s", blocks().map(|(_, block)| block.velocity).collect()),
        column("torque", "N m", blocks().map(|(_, block)| block.torque).collect()),
        column("load_torque", "N m", blocks().map(|(_, block)| block.load_torque).collect()),
    ]
}
