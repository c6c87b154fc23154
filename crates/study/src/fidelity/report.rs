//! Results: rows, tables, figures.

use std::path::Path;

use super::plan::observer_name;
use super::study::Example;
use super::{Outcome, Row, SCENARIOS, Scenario};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::parameters::{self, presets};
use stickslip_base::quantity::number;
use stickslip_base::report::{Provenance, Report, Table};
use stickslip_base::{Error, Preset, Summary};
use stickslip_simulate::fidelity::law::PAPER;

/// Drawn time of a limit cycle [s].
const DRAWN: f64 = 4.0;
/// Drawn time before and after a reversal [s].
const DRAWN_AROUND_REVERSAL: f64 = 0.05;

/// Prefix of a file's name, figure, caption.
type Drawn = (&'static str, Figure, &'static str);

impl Outcome {
    /// The rows, under their stable names; `fidelity.complete` is 0 where the run was cancelled.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("fidelity");
        let unstable = self.rows.iter().filter(|row| !row.score.stable).count();
        summary
            .result("fidelity.complete", f64::from(u8::from(self.complete)), "1")
            .result("fidelity.seeds", self.plan.seeds.len() as f64, "1")
            .result("fidelity.rows", self.rows.len() as f64, "1")
            .result("fidelity.unstable_rows", unstable as f64, "1");
        for row in &self.rows {
            let score = &row.score;
            let interval = |[low, high]: [f64; 2]| vec![low, high].into();
            summary.row([
                ("preset", row.preset.as_str().into()),
                ("law", row.law.into()),
                ("wheel", row.wheel.into()),
                ("rate_hz", row.rate.into()),
                ("mismatch", row.mismatch.into()),
                ("observer", row.observer.into()),
                ("scenario", score.measure.into()),
                ("auto", row.auto.into()),
                ("difference", score.difference.into()),
                ("predicted", row.predicted.into()),
                ("ci95", interval(score.ci95)),
                ("excess", score.excess.into()),
                ("excess_ci95", interval(score.excess_ci95)),
                ("floor", score.floor.into()),
                ("reference", score.reference.into()),
                ("stable", u8::from(score.stable).into()),
                ("chatter", score.chatter.into()),
                ("velocity_error", score.velocity_error.into()),
                ("fade_velocity", row.fade_velocity.into()),
            ]);
        }
        summary
    }

    /// One table with its title for each machine: laws over measures, in percent and numbers of breakaways.
    pub fn tables(&self) -> Vec<(String, Table)> {
        self.plan
            .groups
            .iter()
            .filter_map(|group| {
                let of_group = |row: &&Row| {
                    row.preset == group.preset
                        && row.wheel == group.wheel
                        && row.rate == group.rate
                        && row.mismatch == group.mismatch.name
                        && row.observer == observer_name(&group.observer)
                };
                let rows: Vec<&Row> = self.rows.iter().filter(of_group).collect();
                let mut measures = vec![*rows.first()?];
                for row in &rows {
                    if !measures.iter().any(|other| other.score.measure == row.score.measure) {
                        measures.push(row);
                    }
                }
                let head = ["law".to_owned()]
                    .into_iter()
                    .chain(measures.iter().map(|row| title(row.score.measure)))
                    .chain(["Ω error, rad/s".to_owned()]);
                let wheel = if group.wheel { "with wheel" } else { "without wheel" };
                let without = if group.has_accelerometer() { "" } else { ", without accelerometer and tacho" };
                let caption = format!(
                    "{} {wheel}, {} kHz, {}{without}. Difference in %, of counts in breakaways.",
                    group.preset,
                    number(group.rate / 1000.0, 1),
                    group.mismatch.name
                );
                let mut table = Table::new(head);
                let floors = measures.iter().map(|row| shown(row, row.score.floor).into());
                table = table.row(["floor".into()].into_iter().chain(floors).chain(["".into()]));
                for of_law in rows.chunk_by(|a, b| a.law == b.law) {
                    let cells = |of: &dyn Fn(&Row) -> f64| -> Vec<String> {
                        let cell = |column: &&Row| {
                            let row_of_law = of_law.iter().find(|row| row.score.measure == column.score.measure);
                            row_of_law.map_or("–".into(), |row| shown(row, of(row)))
                        };
                        measures.iter().map(cell).collect()
                    };
                    let name = if of_law[0].auto { format!("{} (auto)", of_law[0].law) } else { of_law[0].law.into() };
                    let error = number(of_law.iter().map(|row| row.score.velocity_error).fold(0.0, f64::max), 3);
                    let line = |name: String, cells: Vec<String>, error: String| {
                        [name].into_iter().chain(cells).chain([error]).map(Into::into).collect::<Vec<_>>()
                    };
                    table = table.row(line(name, cells(&|row| row.score.difference), error));
                    if of_law[0].auto {
                        table = table.row(line("predicted".into(), cells(&|row| row.predicted), String::new()));
                    }
                }
                Some((caption, table))
            })
            .collect()
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let mut names: Vec<&str> = self.plan.groups.iter().map(|group| group.preset.as_str()).collect();
        names.dedup();
        let parameters = names.iter().filter_map(|name| {
            let preset: Preset<f64> = presets::find(name).ok()?.read().ok()?;
            Some(parameters::write_commented(&preset))
        });
        let provenance =
            Provenance::new(command, self.plan.seeds.last().copied(), parameters.collect::<Vec<_>>().join("\n"));
        let title = if self.complete { "Rendering fidelity" } else { "Rendering fidelity (incomplete)" };
        let mut report = Report::new(title, provenance).summary(self.verdict());
        for (_, figure, caption) in self.figures() {
            report = report.figure(figure, caption);
        }
        report = report.heading("All cells").paragraph(
            "The same controller, reference and noise on a machine that has the desired friction, and on the bench \
             that renders it. Angles: RMS difference of the two over the RMS difference without rendering, so that 0 is \
             indistinguishable and 100 % is nothing rendered. Limit cycles: amplitude, interval, number of breakaways. The \
             floor is what other noise does to the true machine: a difference below it has no meaning. Predicted is what the \
             bench expects of the law that it picks (auto), before it runs and without knowing the mismatch. The last column \
             is the RMS error of the velocity that a law uses when its torque starts to act, in the worst scenario.",
        );
        self.tables().into_iter().fold(report, |report, (title, table)| report.table(table.caption(title)))
    }

    /// Writes figures, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        let figures = self.figures();
        let drawn = figures.iter().map(|(name, figure, _)| (name.as_str(), figure));
        self.report(command).write_all(self.summary(), drawn, directory)
    }

    /// Main result in sentences: the paper's law and the selected one in the worst scenario of the angle.
    fn verdict(&self) -> String {
        let worst = |of: &dyn Fn(&Row) -> bool| {
            let angles = |row: &&Row| of(row) && row.score.measure.starts_with("sine");
            self.rows.iter().filter(angles).map(|row| row.score.difference).fold(f64::NAN, f64::max)
        };
        let percent = |value: f64| if value.is_nan() { "unknown".into() } else { number(100.0 * value, 1) };
        format!(
            "Following a sine, the bench differs from a machine that has the desired friction by at most {} % under \
             the law that it picks, by {} % under the paper's at its best fade-out; 100 % is nothing rendered. {} numbers \
             from {} noise seeds each.",
            percent(worst(&|row| row.auto)),
            percent(worst(&|row| row.law == PAPER)),
            self.rows.len(),
            self.plan.seeds.len(),
        )
    }

    /// The figures with the names of their files and their captions.
    pub fn figures(&self) -> Vec<(String, Figure, String)> {
        let of = |example: &Example| {
            let drawn = if example.scenario == Scenario::HUNTING {
                vec![hunting(example)]
            } else {
                vec![following(example), reversal(example)]
            };
            let wheel = if example.group.wheel { "with-wheel" } else { "without-wheel" };
            drawn
                .into_iter()
                .map(move |(what, figure, caption)| (format!("{what}-{wheel}.svg"), figure, caption.into()))
        };
        self.examples.iter().flat_map(of).chain(self.over_own_friction()).collect()
    }

    /// Difference over the error of the modelled own friction.
    fn over_own_friction(&self) -> Option<(String, Figure, String)> {
        const ERRORS: [(&str, f64); 5] =
            [("own-20%", -0.2), ("own-10%", -0.1), ("perfect", 0.0), ("own+10%", 0.1), ("own+20%", 0.2)];
        let (preset, rate) =
            self.rows.iter().find(|row| row.mismatch == "own+10%").map(|row| (&row.preset, row.rate))?;
        let mut figure = Figure::new("Sine of 2 Hz: difference over error of the own friction")
            .x(Axis::new("own friction of the machine over that of the model − 1", "1"))
            .y(Axis::new("difference E", "1"));
        let mut series = 0;
        let mut laws: Vec<(&str, bool)> = Vec::new();
        for row in &self.rows {
            if (row.law == PAPER || row.auto) && !laws.contains(&(row.law, row.wheel)) {
                laws.push((row.law, row.wheel));
            }
        }
        for (law, wheel) in laws {
            let at = |(mismatch, error): (&str, f64)| {
                let row = self.rows.iter().find(|row| {
                    row.preset == *preset
                        && row.rate == rate
                        && (row.law, row.wheel) == (law, wheel)
                        && row.mismatch == mismatch
                        && row.score.measure == Scenario::SINE_2HZ.name
                })?;
                Some((error, row.score.difference))
            };
            let points: Vec<_> = ERRORS.into_iter().filter_map(at).collect();
            let name = format!("{law}, {}", if wheel { "with wheel" } else { "without" });
            let line = Series::line(Role::Trace(series), name, points);
            figure = figure.series(if wheel { line } else { line.dashed() });
            series += 1;
        }
        let caption = "The machine has more or less friction than the model. 0 is indistinguishable from a machine \
                       that has the desired friction, 1 is nothing rendered.";
        Some(("own-friction.svg".into(), figure, caption.into()))
    }
}

/// Deviation from the set-point in a limit cycle.
fn hunting(example: &Example) -> Drawn {
    let period = example.a.period;
    let from = (example.scenario.evaluated_from() / period) as usize;
    let deviation = |trace: &super::Trace| -> Vec<(f64, f64)> {
        let end = trace.angle.len().min(from + (DRAWN / period) as usize);
        (from..end).map(|k| ((k - from) as f64 * period, trace.angle[k] - trace.reference[k])).collect()
    };
    let figure = Figure::new(format!("Hunting {}", wheel(example)))
        .x(Axis::new("time", "s"))
        .y(Axis::new("deviation from the set-point", "rad"))
        .series(Series::line(Role::Desired, "true friction", deviation(&example.a)))
        .series(Series::line(Role::Own, "own friction", deviation(&example.a0)).dashed());
    let figure = with_laws(figure, example, |trace| deviation(trace));
    let caption = "A PID controller with too much integral action. With the desired friction it hunts, with the machine's \
                   own friction it does not; the bench should hunt in the same way.";
    ("hunting", figure, caption)
}

/// Distance from the machine with the true friction in a sine.
fn following(example: &Example) -> Drawn {
    let period = example.a.period;
    let from = (example.scenario.evaluated_from() / period) as usize;
    let distance = |trace: &super::Trace| -> Vec<(f64, f64)> {
        let end = trace.angle.len().min(example.a.angle.len()).min(from + (1.0 / period) as usize);
        (from..end).map(|k| ((k - from) as f64 * period, trace.angle[k] - example.a.angle[k])).collect()
    };
    let figure = Figure::new(format!("Sine of 2 Hz {}", wheel(example)))
        .x(Axis::new("time", "s"))
        .y(Axis::new("distance from the true friction's angle", "rad"))
        .series(Series::line(Role::Own, "nothing rendered", distance(&example.a0)).dashed());
    let figure = with_laws(figure, example, |trace| distance(trace));
    let caption = "Distance of the load from its angle with the true friction; the same noise in all runs.";
    ("sine", figure, caption)
}

/// Torque that resists the load through a reversal.
fn reversal(example: &Example) -> Drawn {
    let period = example.a.period;
    let from = (example.scenario.evaluated_from() / period) as usize;
    let turns = |k: &usize| {
        (example.a.angle[*k] - example.a.angle[k - 1]) * (example.a.angle[k + 1] - example.a.angle[*k]) <= 0.0
    };
    let reversal = (from + 1..example.a.angle.len().saturating_sub(1)).find(turns).unwrap_or(from);
    let around = (DRAWN_AROUND_REVERSAL / period) as usize;
    let resisting = |trace: &super::Trace| -> Vec<(f64, f64)> {
        let (begin, end) = (reversal.saturating_sub(around), (reversal + around).min(trace.angle.len()));
        (begin..end).map(|k| ((k as f64 - reversal as f64) * period, trace.resisting_torque[k])).collect()
    };
    let figure = Figure::new(format!("A reversal {}", wheel(example)))
        .x(Axis::new("time from the reversal", "s"))
        .y(Axis::new("torque that resists the load", "N m"))
        .series(Series::line(Role::Desired, "true friction", resisting(&example.a)))
        .series(Series::line(Role::Own, "own friction", resisting(&example.a0)).dashed());
    let figure = with_laws(figure, example, |trace| resisting(trace));
    let caption = "Friction and load motor together, at a reversal of the sine of 2 Hz: the load sticks, its bristles bend \
                   the other way, and it breaks away.";
    ("reversal", figure, caption)
}

fn wheel(example: &Example) -> &'static str {
    if example.group.wheel { "with the wheel" } else { "without the wheel" }
}

fn with_laws(figure: Figure, example: &Example, of: impl Fn(&super::Trace) -> Vec<(f64, f64)>) -> Figure {
    example.b.iter().fold(figure, |figure, (law, trace)| {
        let role = if *law == PAPER { Role::Trace(0) } else { Role::Rendered };
        figure.series(Series::line(role, *law, of(trace)))
    })
}

/// A difference, formatted.
fn shown(row: &Row, value: f64) -> String {
    if value.is_nan() {
        return if row.score.stable { "–".into() } else { "unstable".into() };
    }
    if row.score.measure.ends_with("count") { number(value, 1) } else { number(100.0 * value, 1) }
}

/// The name of a measure as the title of a column.
fn title(measure: &'static str) -> String {
    let short = [
        ("point_to_point", "p-p"),
        ("hunting_", "hunt "),
        ("stick_slip_", "s-s "),
        ("amplitude", "ampl."),
        ("interval", "int."),
        ("presliding", "presl."),
    ];
    debug_assert!(SCENARIOS.iter().any(|scenario| scenario.has(measure)));
    short.iter().fold(measure.to_owned(), |title, (long, short)| title.replace(long, short)).replace('_', " ")
}
