//! The loop of a position controller on the modelled axis: stability, speed and noise, in numbers and figures.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use nalgebra::Complex;

use super::draw::Captioned;
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, number};
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::{Error, Preset, Summary, Watch, output, parameters};
use stickslip_design::linear::{Operating, StateSpace, decibels, size, unwrapped};
use stickslip_design::{
    CORNER_LIMIT, Corner, LoopQuality, NOISE_LIMIT, PositionLoop, SENSITIVITY_LIMIT, axis_control, corners, tune,
};

/// File name of the bench with this controller, an argument of `--preset`.
pub const PRESET: &str = "preset.toml";

/// Duration of the shown steps [s].
pub const SHOWN: f64 = 0.4;

/// Tolerance of a search on a limit.
pub(crate) const TOLERANCE: f64 = 1.01;

/// A loop about one operating point.
#[derive(Clone, Debug)]
pub struct OperatingLoop {
    /// `sliding` or `stuck`.
    pub name: &'static str,
    /// Regime of the load.
    pub at: Operating,
    /// Margins and noise of the loop.
    pub quality: LoopQuality,
    /// The modelled axis.
    pub axis: StateSpace,
    /// The open loop.
    pub gain: StateSpace,
    /// The closed loop.
    pub closed: StateSpace,
    /// Frequencies of the loop gain [rad/s].
    pub frequencies: Vec<f64>,
}

/// The loop of a controller, the load sliding and stuck, and in its corners.
#[derive(Clone, Debug)]
pub struct LoopRun {
    /// The bench with its controller.
    pub preset: Preset<f64>,
    /// Sliding, then stuck.
    pub operating: [OperatingLoop; 2],
    /// Results in the corners of load inertia and coupling stiffness, the worst first.
    pub corners: Vec<Corner>,
}

pub use stickslip_design::{as_cascade, as_pid, as_predictive, as_state_feedback};

impl LoopRun {
    /// Analyses the controller of a preset on the preset's model, with the load sliding at `velocity` [rad/s] and
    /// stuck.
    ///
    /// # Errors
    /// Errors of the linearisation.
    pub fn new(preset: &Preset<f64>, velocity: f64) -> Result<Self, Error> {
        let control = axis_control(&preset.model, &preset.bench)?;
        let operating = operating(velocity).map(|(_, at)| at);
        let corners = corners(control, &preset.model, &preset.bench, &operating)?;
        Ok(LoopRun { corners, ..Self::glance(preset, velocity)? })
    }

    /// The same without corners, in a fifth of the time.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn glance(preset: &Preset<f64>, velocity: f64) -> Result<Self, Error> {
        let control = axis_control(&preset.model, &preset.bench)?;
        let analyse = |(name, at): (&'static str, Operating)| -> Result<_, Error> {
            let closes = PositionLoop::new(control, &preset.model, &preset.bench, at)?;
            let (gain, closed) = (closes.gain()?, closes.closed()?);
            let frequencies = gain.frequencies()?;
            let (quality, axis) = (closes.quality(&preset.model)?, closes.axis().clone());
            Ok(OperatingLoop { name, at, quality, axis, gain, closed, frequencies })
        };
        let [sliding, stuck] = operating(velocity).map(analyse);
        Ok(LoopRun { preset: *preset, operating: [sliding?, stuck?], corners: Vec::new() })
    }

    /// The same with automatic tuning first, see [`tune`].
    ///
    /// # Errors
    /// As [`tune`].
    pub fn tuned(preset: &Preset<f64>, velocity: f64, watch: &Watch) -> Result<Self, Error> {
        let Preset { model, bench, .. } = preset;
        let tuned = tune(&bench.controller, model, bench, velocity, watch)?;
        let mut preset = *preset;
        preset.bench.controller = tuned.controller;
        Self::new(&preset, velocity)
    }

    /// Whether the loop meets all robustness limits.
    pub fn is_fair(&self) -> bool {
        let within = |it: &OperatingLoop| {
            it.quality.stable && it.quality.margins.sensitivity.value <= TOLERANCE * SENSITIVITY_LIMIT
        };
        self.operating.iter().all(within)
            && self.corners.iter().all(|corner| corner.sensitivity <= TOLERANCE * CORNER_LIMIT)
    }

    /// Whether the noise of the commanded torque by counts and tacho is within its limit, with the load sliding.
    pub fn is_quiet(&self) -> bool {
        let limit = NOISE_LIMIT * self.preset.bench.controller.torque_limit();
        self.operating[0].quality.noise_torque <= TOLERANCE * limit
    }

    /// Remarks for the report.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        for it in &self.operating {
            let peak = it.quality.margins.sensitivity;
            if !it.quality.stable {
                remarks.push(format!("The loop is unstable while the load is {}: reduce its gains.", it.name));
            } else if peak.value > TOLERANCE * SENSITIVITY_LIMIT {
                remarks.push(format!(
                    "While the load is {} the sensitivity reaches {} at {} Hz; the robustness limit is {}.",
                    it.name,
                    number(peak.value, 2),
                    number(peak.frequency / TAU, 0),
                    number(SENSITIVITY_LIMIT, 1)
                ));
            }
        }
        if let Some(worst) = self.corners.first().filter(|worst| worst.sensitivity > TOLERANCE * CORNER_LIMIT) {
            remarks.push(format!(
                "With {} × the load inertia and {} × the coupling stiffness {}: not robust against the uncertainty of \
                 the model.",
                worst.load_inertia,
                worst.coupling_stiffness,
                if worst.sensitivity.is_finite() {
                    format!("the sensitivity reaches {}", number(worst.sensitivity, 2))
                } else {
                    "the loop is unstable".into()
                }
            ));
        }
        if remarks.is_empty() {
            remarks.push("Meets all robustness limits: sliding, stuck and in all corners.".into());
        }
        remarks
    }

    /// Numbers of both operating points.
    pub fn table(&self) -> Table {
        let [sliding, stuck] = &self.operating;
        let numbers = |it: &OperatingLoop| numbers(&it.quality);
        let head = Table::new(["number", "sliding", "stuck"]).caption("The loop, opened at the commanded torque.");
        numbers(sliding).into_iter().zip(numbers(stuck)).fold(head, |table, ((_, words, unit, one), (.., other))| {
            let cell = |value: Option<f64>| match value {
                Some(value) if value.is_finite() => Cell::Estimate(Estimate::new(value, unit)),
                _ => "no limit".into(),
            };
            table.row([words.into(), cell(one), cell(other)])
        })
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("loop");
        for it in &self.operating {
            for (key, _, unit, value) in numbers(&it.quality) {
                summary.result(&format!("loop.{}.{key}", it.name), value.unwrap_or(f64::INFINITY), unit);
            }
            let stable = f64::from(u8::from(it.quality.stable));
            summary.result(&format!("loop.{}.stable", it.name), stable, "1");
            for pole in &it.quality.poles {
                summary.row([
                    ("kind", "pole".into()),
                    ("load", it.name.into()),
                    ("real", pole.re.into()),
                    ("imaginary", pole.im.into()),
                ]);
            }
        }
        for corner in &self.corners {
            summary.row([
                ("kind", "corner".into()),
                ("load", if corner.at == Operating::Stuck { "stuck" } else { "sliding" }.into()),
                ("load_inertia", corner.load_inertia.into()),
                ("coupling_stiffness", corner.coupling_stiffness.into()),
                ("sensitivity_peak", corner.sensitivity.into()),
            ]);
        }
        let worst = self.corners.first().map_or(f64::NAN, |corner| corner.sensitivity);
        summary.result("loop.worst_corner.sensitivity_peak", worst, "1").result(
            "loop.fair",
            f64::from(u8::from(self.is_fair())),
            "1",
        );
        summary
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, None, parameters::write_commented(&self.preset));
        let report = Report::new("Loop of the position controller", provenance)
            .summary(self.remarks().join(" "))
            .table(self.table());
        self.figures().into_iter().fold(report, |report, (_, figure, caption)| report.figure(figure, caption))
    }

    /// Writes figures, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        output::write(&directory.join(PRESET), parameters::write_commented(&self.preset))?;
        summary.file(PRESET);
        for (name, figure, _) in self.figures() {
            output::write(&directory.join(name), figure.svg())?;
            summary.file(name);
        }
        self.report(command).write_all(summary, [], directory)
    }

    /// One line each for sliding and stuck.
    fn both(&self, figure: Figure, line: impl Fn(&OperatingLoop, &[Complex<f64>]) -> Vec<(f64, f64)>) -> Figure {
        self.operating.iter().enumerate().fold(figure, |figure, (index, it)| {
            let gains = it.gain.response(&it.frequencies);
            figure.series(Series::line(Role::Trace(index), it.name, line(it, &gains)))
        })
    }

    /// All figures with file name and caption.
    fn figures(&self) -> Vec<Captioned> {
        vec![
            (
                "magnitude.svg",
                self.magnitude(),
                "Above 0 dB the controller determines the motion, below it the axis.".into(),
            ),
            ("phase.svg", self.phase(), "At −180° the loop gain must be below 0 dB.".into()),
            (
                "nyquist.svg",
                self.nyquist(),
                "Outside the circle the sensitivity is below 1.8 at all frequencies.".into(),
            ),
            (
                "sensitivity.svg",
                self.sensitivity(),
                "Amplification of disturbances by the loop; below 1 they are reduced.".into(),
            ),
            (
                "setpoint_step.svg",
                self.step("Step of the set-point", "rad", 0, 1.0),
                "Angle after a set-point step of 1 rad, without limits.".into(),
            ),
            (
                "load_step.svg",
                self.step("Step of the load torque", "mrad", 2, 100.0),
                "Angle after a load torque step of 0.1 N·m.".into(),
            ),
            ("poles.svg", self.poles(), "In the z plane: poles within the circle decay.".into()),
        ]
    }

    fn magnitude(&self) -> Figure {
        let figure = Figure::new("Loop gain").x(frequency()).y(Axis::new("magnitude", "dB").range(-60.0, 60.0));
        self.both(figure, |it, gains| it.over_frequency(gains.iter().map(|l| decibels(*l).clamp(-60.0, 60.0))))
    }

    fn phase(&self) -> Figure {
        let figure = Figure::new("Phase of the loop gain").x(frequency()).y(Axis::new("phase", "°"));
        self.both(figure, |it, gains| it.over_frequency(unwrapped(gains.iter().copied(), -180.0)))
    }

    /// The loop gain in the complex plane, with the circle of the sensitivity limit about −1.
    fn nyquist(&self) -> Figure {
        let circle = (0..=120).map(|k| f64::from(k) * TAU / 120.0).map(|angle| {
            let radius = 1.0 / SENSITIVITY_LIMIT;
            (radius * libm::cos(angle) - 1.0, radius * libm::sin(angle))
        });
        let plane = Figure::new("Loop gain in the complex plane")
            .x(Axis::new("real part", "1").range(-3.0, 1.5))
            .y(Axis::new("imaginary part", "1").range(-2.0, 1.0));
        let inside = |l: &Complex<f64>| (-3.0..=1.5).contains(&l.re) && (-2.0..=1.0).contains(&l.im);
        self.both(plane, |_, gains| {
            gains.iter().map(|l| if inside(l) { (l.re, l.im) } else { (f64::NAN, f64::NAN) }).collect()
        })
        .series(Series::line(Role::Reference, "M_s = 1.8", circle))
        .series(Series::points(Role::Reference, "−1", [(-1.0, 0.0)]).large())
    }

    fn sensitivity(&self) -> Figure {
        let figure = Figure::new("Sensitivity").x(frequency()).y(Axis::new("|1/(1 + L)|", "1"));
        let last = self.operating[0].frequencies.last().map_or(1.0, |last| last / TAU);
        let limit = [0.0, last].map(|f| (f, SENSITIVITY_LIMIT));
        self.both(figure, |it, gains| it.over_frequency(gains.iter().map(|l| 1.0 / size(*l + 1.0))))
            .series(Series::line(Role::Reference, "robustness limit", limit))
    }

    /// The angle after a step of this input of the closed loop, times a scale.
    fn step(&self, title: &str, unit: &str, input: usize, scale: f64) -> Figure {
        let figure = Figure::new(title).x(Axis::new("time", "s")).y(Axis::new("angle", unit));
        self.both(figure, |it, _| {
            let dt = it.closed.dt.unwrap_or(SHOWN);
            let channel = it.closed.channel(input, 0).and_then(|way| way.step_response((SHOWN / dt) as usize, dt));
            let answers = channel.unwrap_or_default().into_iter().enumerate();
            answers.map(|(k, angle)| (k as f64 * dt, scale * angle)).collect()
        })
    }

    /// The poles of the closed loop, with the unit circle.
    fn poles(&self) -> Figure {
        let circle = (0..=120).map(|k| {
            let angle = f64::from(k) * PI / 60.0;
            (libm::cos(angle), libm::sin(angle))
        });
        let plane = Figure::new("Poles of the closed loop")
            .x(Axis::new("real part", "1").range(-1.6, 1.6))
            .y(Axis::new("imaginary part", "1").range(-1.1, 1.1))
            .series(Series::line(Role::Reference, "limit of stability", circle));
        self.operating.iter().enumerate().fold(plane, |figure, (index, it)| {
            let points = it.quality.poles.iter().map(|pole| (pole.re, pole.im));
            figure.series(Series::points(Role::Trace(index), it.name, points).large())
        })
    }
}

impl OperatingLoop {
    /// A value for each frequency [Hz].
    fn over_frequency(&self, values: impl IntoIterator<Item = f64>) -> Vec<(f64, f64)> {
        values.into_iter().enumerate().map(|(k, value)| (self.frequencies[k] / TAU, value)).collect()
    }
}

fn frequency() -> Axis {
    Axis::new("frequency", "Hz").stretched()
}

/// Operating points of a loop, with names.
fn operating(velocity: f64) -> [(&'static str, Operating); 2] {
    [("sliding", Operating::Sliding(velocity)), ("stuck", Operating::Stuck)]
}

/// Key, words, unit and value of a loop's numbers; no value without a limit.
pub fn numbers(quality: &LoopQuality) -> Vec<(&'static str, &'static str, &'static str, Option<f64>)> {
    let LoopQuality { margins, bandwidth, noise_torque, .. } = quality;
    let degrees = margins.phase.map(|phase| phase.value.to_degrees());
    vec![
        ("sensitivity_peak", "peak of the sensitivity M_s", "1", Some(margins.sensitivity.value)),
        ("sensitivity_peak_at", "… at", "Hz", Some(margins.sensitivity.frequency / TAU)),
        ("complementary_peak", "peak of the complementary sensitivity M_t", "1", Some(margins.complementary.value)),
        ("gain_margin", "gain margin", "1", margins.gain.map(|gain| gain.value)),
        ("gain_reduction", "lower gain margin", "1", Some(margins.gain_reduction.map_or(0.0, |gain| gain.value))),
        ("phase_margin", "phase margin", "°", degrees),
        ("delay_margin", "delay margin", "s", margins.delay.map(|delay| delay.value)),
        ("crossover", "crossover", "Hz", margins.phase.map(|phase| phase.frequency / TAU)),
        ("bandwidth", "bandwidth", "Hz", bandwidth.map(|bandwidth| bandwidth / TAU)),
        ("noise_torque", "noise of the commanded torque, RMS", "N m", Some(*noise_torque)),
    ]
}
