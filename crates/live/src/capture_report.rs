//! A capture as files: data, one figure per unit, a report.

use std::path::Path;

use crate::protocol::{Captured, Signal};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Summary, output};
use stickslip_experiment::workflow::write_columns;

/// A capture with the descriptions that a reader needs.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The rows.
    pub captured: Captured,
    /// All signals of the bench.
    pub signals: Vec<Signal>,
    /// The requested trigger.
    pub trigger: String,
    /// The active parameters when it was fetched.
    pub parameters: String,
}

/// Maximum number of series in a figure: the number of distinct colours.
const TRACES: usize = 3;

impl Capture {
    fn unit(&self, name: &str) -> &str {
        self.signals.iter().find(|signal| signal.name == name).map_or("1", |signal| &signal.unit)
    }

    fn values(&self, k: usize) -> impl Iterator<Item = f64> {
        self.captured.columns.get(k).into_iter().flatten().map(|value| value.unwrap_or(f64::NAN))
    }

    /// Time, cycle and signals as columns.
    fn columns(&self) -> Vec<Column> {
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        let mut columns = vec![
            column("time", "s", self.captured.times.clone()),
            column("cycle", "1", self.captured.cycles.iter().map(|&cycle| cycle as f64).collect()),
        ];
        let signals = self.captured.signals.iter().enumerate();
        columns.extend(signals.map(|(k, name)| column(name, self.unit(name), self.values(k).collect())));
        columns
    }

    /// Least, mean and largest value of each signal.
    pub fn table(&self) -> Table {
        let head = Table::new(["signal", "unit", "least", "mean", "largest"]);
        self.captured.signals.iter().enumerate().fold(head, |table, (k, name)| {
            let (mut least, mut largest, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0_f64);
            for value in self.values(k).filter(|value| value.is_finite()) {
                (least, largest) = (least.min(value), largest.max(value));
                (sum, count) = (sum + value, count + 1.0);
            }
            let number = |value: f64| Cell::Text(if count > 0.0 { format!("{value:.6}") } else { "none".into() });
            let unit = Cell::Text(self.unit(name).into());
            table.row([Cell::Text(name.clone()), unit, number(least), number(sum / count), number(largest)])
        })
    }

    /// Warnings, each with a remedy.
    pub fn warnings(&self) -> Vec<String> {
        let Captured { lost, missing, .. } = self.captured;
        let mut warnings = Vec::new();
        if lost > 0 {
            warnings.push(format!("{lost} cycles were lost: the listener thread was too slow. Close other programs."));
        }
        if missing > 0 {
            warnings.push(format!(
                "{missing} of the requested ticks before the trigger are missing: the trigger came too early."
            ));
        }
        warnings
    }

    /// One figure for each unit and each group of [`TRACES`] signals.
    fn figures(&self) -> Vec<(Figure, String)> {
        let mut units: Vec<&str> = Vec::new();
        for name in &self.captured.signals {
            if !units.contains(&self.unit(name)) {
                units.push(self.unit(name));
            }
        }
        let of_unit = |unit: &str| {
            let all = self.captured.signals.iter().enumerate();
            all.filter(|(_, name)| self.unit(name) == unit).collect::<Vec<_>>()
        };
        let mut figures = Vec::new();
        for unit in units {
            for group in of_unit(unit).chunks(TRACES) {
                let names: Vec<&str> = group.iter().map(|(_, name)| name.as_str()).collect();
                let title = format!("Capture: {}", names.join(", "));
                let axes = Figure::new(title).x(Axis::new("time from the trigger", "s")).y(Axis::new("value", unit));
                let figure = group.iter().enumerate().fold(axes, |figure, (trace, (k, name))| {
                    let points = self.captured.times.iter().copied().zip(self.values(*k));
                    figure.series(Series::line(
                        Role::Trace(trace),
                        name.as_str(),
                        points.filter(|(_, value)| value.is_finite()),
                    ))
                });
                figures.push((figure, format!("Trigger: {}.", self.trigger)));
            }
        }
        figures
    }

    /// Writes data, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        let provenance = Provenance::new(command, None, self.parameters.clone());
        let rows = self.captured.cycles.len();
        let mut report = Report::new("Capture", provenance)
            .summary(format!("{rows} rows around the trigger: {}.", self.trigger))
            .table(self.table().caption("Over all rows."));
        for (figure, caption) in self.figures() {
            report = report.figure(figure, caption);
        }
        let warnings = self.warnings();
        if !warnings.is_empty() {
            report = report.heading("Warnings").list(warnings);
        }
        output::create_folder(directory)?;
        let pages = report.write(directory)?;
        let mut summary = Summary::new("capture");
        summary.result("capture.rows", rows as f64, "1").result("capture.lost", self.captured.lost as f64, "1").result(
            "capture.missing",
            self.captured.missing as f64,
            "1",
        );
        write_columns(&mut summary, "capture", &self.columns(), directory)?;
        for page in pages {
            summary.file(page);
        }
        summary.write(directory)?;
        Ok(summary)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capture_has_a_figure_for_each_unit_and_warns_of_missing_cycles() {
        let signal = |name: &str, unit: &str| Signal { name: name.into(), unit: unit.into(), ..Signal::default() };
        let captured = Captured {
            signals: vec!["angle".into(), "torque".into(), "aim".into()],
            cycles: vec![9, 10, 11],
            times: vec![-0.1, 0.0, 0.1],
            columns: vec![vec![Some(1.0), None, Some(3.0)], vec![Some(0.5); 3], vec![None; 3]],
            trigger: 1,
            lost: 2,
            missing: 5,
        };
        let signals = vec![signal("angle", "rad"), signal("torque", "N m"), signal("aim", "rad")];
        let capture = Capture { captured, signals, trigger: "angle above 1".into(), parameters: String::new() };
        assert_eq!(capture.figures().len(), 2);
        assert_eq!(capture.warnings().len(), 2);
        let folder = tempfile::tempdir().unwrap();
        capture.write(folder.path(), "stickslip capture").unwrap();
        let read = stickslip_recording::Recording::read(&folder.path().join("capture.parquet")).unwrap();
        let torque = read.column("torque").unwrap();
        assert_eq!((&torque.values[..], torque.unit.as_deref()), (&[0.5; 3][..], Some("N m")));
        let lines = capture.table().lines();
        assert!(lines.iter().any(|line| line.contains("angle") && line.contains("2.000000")), "{lines:?}");
        assert!(lines.iter().any(|line| line.contains("aim") && line.contains("none")), "{lines:?}");
    }
}
