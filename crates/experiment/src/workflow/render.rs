//! Rendering: the load motor adds the difference torque, and the friction is measured again.

use std::path::Path;

use serde_json::Value;
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{Correction, DifferenceTorque, Law};

use super::correct::{Corrected, Iteration, Missing, Stopped, missing, render_corrected, rms};
use super::draw::{Captioned, POINTS, curve, friction, grid, load, plateaus, points, torque};
use super::judged::Verdict;
use super::measure::{Outcome as _, with_preload};
use super::results::{columns, rows};
use super::write_columns;
use crate::{FrictionCurve, FrictionPlan, expected_inside_fade, home, measure_friction, sweep_through_standstill};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::preset::{LawChoice, Model, Settings};
use stickslip_base::quantity::{Estimate, NORMAL95, number, tied};
use stickslip_base::report::{Provenance, Report, Section};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch, output, parameters};
use stickslip_bench::{Bench, Frame, VirtualBench};
use stickslip_design::{
    LARGEST_DELAY, LARGEST_GAIN, Margin, Passage, Region, STIFFNESSES, difference_torque, margin,
    predicted_velocity_noise,
};
use stickslip_simulate::rendering_law;

/// Highest speed of the sweep through standstill [rad/s].
const SWEEP_SPEED: f64 = 1.5;
/// Its acceleration [rad/s²].
const SWEEP_ACCELERATION: f64 = 1.5;

/// Name of the data table measured under the law, without ending.
pub const RENDERED: &str = "rendered";

/// A law, and the measurement under it.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The plan of the measurement.
    pub plan: FrictionPlan<f64>,
    /// Desired and own characteristic, the limit of the torque, and the interval around standstill in which the law
    /// renders no torque or less.
    pub law: DifferenceTorque<f64>,
    /// The friction measured under the law.
    pub curve: FrictionCurve,
    /// Sweep through standstill under the law; empty if the run was cancelled.
    pub sweep: Vec<Frame>,
    /// Standard deviation of the estimated velocity predicted by the data sheet [rad/s].
    pub velocity_noise: f64,
    /// Stability margin of the law.
    pub margin: Margin,
}

/// Renders and measures the desired friction on a homed bench with identified own friction.
///
/// # Errors
/// [`Error::Cancelled`] without any data; afterwards the rendering is not [complete](Rendering::complete);
/// [`DesignError::NotRenderable`](stickslip_design::DesignError::NotRenderable) and
/// [`DesignError::Chatters`](stickslip_design::DesignError::Chatters) before any motion; [`Error::BenchFault`]; errors
/// of the design.
pub fn render(
    plan: &FrictionPlan<f64>,
    desired: &Stribeck<f64>,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Rendering, Error> {
    let (planned, law) = Rendering::planned(plan, desired, bench.model(), bench.settings())?;
    bench.set_law(law)?;
    let curve = measure_friction(plan, bench, true, watch)?;
    let sweep = match sweep_through_standstill(bench, SWEEP_SPEED, SWEEP_ACCELERATION, watch) {
        Err(Error::Cancelled) => Vec::new(),
        ended => ended?,
    };
    Ok(Rendering { curve, sweep, ..planned })
}

/// Speed up to which the active law renders no torque, or less than the difference [rad/s].
pub fn faded_below(settings: &Settings<f64>) -> f64 {
    match settings.law {
        LawChoice::Paper | LawChoice::Smooth | LawChoice::Karnopp => settings.fade_velocity,
        LawChoice::Bristle | LawChoice::Residual(_) | LawChoice::Admittance(_) | LawChoice::Auto => 0.0,
    }
}

impl Rendering {
    /// The planned rendering and its law, before any measurement.
    ///
    /// # Errors
    /// As [`render`], without those of the bench.
    pub fn planned(
        plan: &FrictionPlan<f64>,
        desired: &Stribeck<f64>,
        model: &Model<f64>,
        settings: &Settings<f64>,
    ) -> Result<(Self, Law<f64>), Error> {
        let passage = Passage { acceleration: plan.acceleration, ..Passage::default() };
        Region::of(model, settings, passage)?.admit(&model.own, desired, plan.fastest)?;
        let settings = Settings { desired: *desired, ..*settings };
        let law =
            DifferenceTorque { fade_velocity: faded_below(&settings), ..difference_torque(desired, model, &settings) };
        let renders = rendering_law(model, &settings)?;
        let margin = margin(&renders, model, &settings)?;
        let velocity_noise = predicted_velocity_noise(model, &settings)?;
        let curve = FrictionCurve { plateaus: Vec::new(), ripple: 0.0, duration: 0.0, complete: false };
        Ok((Rendering { plan: *plan, law, curve, sweep: Vec::new(), velocity_noise, margin }, renders))
    }

    /// Missing torque on each valid plateau outside the fade-out.
    pub(crate) fn missing(&self) -> Vec<Missing> {
        missing(&self.curve, &self.law.desired, self.law.fade_velocity)
    }

    /// Whether it was completed.
    pub fn complete(&self) -> bool {
        self.curve.complete && !self.sweep.is_empty()
    }

    /// RMS of measured minus desired outside the fade-out [N m].
    pub fn error_outside_fade(&self) -> f64 {
        self.curve.rms_from(&self.law.desired, |speed| speed > self.law.fade_velocity)
    }

    /// The same inside [N m].
    pub fn error_inside_fade(&self) -> f64 {
        self.curve.rms_from(&self.law.desired, |speed| speed <= self.law.fade_velocity)
    }

    /// RMS error inside expected under the law [N m], for the spread of the estimated velocity on each plateau: noise
    /// of the observer and motion of the load, excited by the steps at the fade limits.
    pub fn expected_inside_fade(&self) -> f64 {
        let plateaus = self.curve.valid().map(|plateau| (plateau.set_velocity, plateau.velocity_spread));
        expected_inside_fade(&self.law, plateaus)
    }

    /// The same for a load in steady motion [N m]: by the observer's noise alone, as the data sheet predicts it.
    pub fn expected_inside_fade_if_steady(&self) -> f64 {
        expected_inside_fade(&self.law, self.plan.speeds().map(|speed| (speed, self.velocity_noise)))
    }

    /// The key numbers, as far as they are available.
    fn keys(&self) -> Vec<(&'static str, Estimate)> {
        let missing = self.missing();
        let [outside, uncertainty] = rms(&missing);
        let worst = missing.iter().max_by(|a, b| a.torque.abs().total_cmp(&b.torque.abs()));
        let largest = worst.map_or(Estimate::new(f64::NAN, "N m"), |worst| {
            Estimate::new(worst.torque.abs(), "N m").with_half_width(NORMAL95 * worst.standard_error)
        });
        let keys = [
            ("RMS error outside the fade-out", Estimate::new(outside, "N m").with_half_width(NORMAL95 * uncertainty)),
            ("RMS error inside", Estimate::new(self.error_inside_fade(), "N m")),
            ("largest deviation outside", largest),
            ("at a speed of", Estimate::new(worst.map_or(f64::NAN, |worst| worst.speed), "rad/s")),
        ];
        keys.into_iter().filter(|(_, estimate)| estimate.value.is_finite()).collect()
    }

    /// Adds key numbers and figures; `own` as in [`figures`](Self::figures).
    pub fn add_to_report(&self, report: Report, own: Option<&Series>) -> Report {
        let report = self.keys().into_iter().fold(report, |report, (name, estimate)| report.key(name, estimate));
        self.figures(own.cloned()).into_iter().fold(report, |report, (_, figure, caption)| {
            report.section(Section::Figure { figure: Box::new(figure), caption })
        })
    }

    /// Highest speed of the curves [rad/s]: beyond the plan, up to the change of sign of the difference torque.
    pub(crate) fn drawn_to(&self) -> f64 {
        1.6 * self.plan.fastest
    }

    /// The numbers, under their stable names.
    pub(crate) fn add_to(&self, summary: &mut Summary) {
        let breakaway = self.law.desired.breakaway_torque;
        let outside = self.error_outside_fade();
        let over_breakaway = [
            ("rms_error", outside),
            ("rms_error_inside_fade", self.error_inside_fade()),
            ("expected_inside_fade", self.expected_inside_fade()),
            ("expected_inside_fade_if_steady", self.expected_inside_fade_if_steady()),
        ];
        for (name, torque) in over_breakaway {
            summary.result(&format!("render.{name}_over_breakaway"), torque / breakaway, "1");
        }
        summary
            .result("render.rms_error", outside, "N m")
            .result("render.fade_velocity", self.law.fade_velocity, "rad/s")
            .result("render.velocity_noise", self.velocity_noise, "rad/s")
            .result("render.step_at_fade", self.step_at_fade(), "N m");
    }

    /// The results, in lines for a terminal.
    pub fn lines(&self) -> Vec<String> {
        let (outcome, reasons) = self.judged();
        let breakaway = self.law.desired.breakaway_torque;
        let percent = |torque: f64| number(100.0 * torque / breakaway, 2);
        if self.law.fade_velocity == 0.0 {
            return vec![
                format!("at all speeds              {} % of M_S", percent(self.error_outside_fade())),
                format!("margin                     {}", self.margin),
                format!("{}: {}", outcome.word(), reasons.join(" ")),
            ];
        }
        vec![
            format!("outside the fade-out       {} % of M_S", percent(self.error_outside_fade())),
            format!(
                "inside                     {} % of M_S, expected {} %",
                percent(self.error_inside_fade()),
                percent(self.expected_inside_fade())
            ),
            format!("{}: {}", outcome.word(), reasons.join(" ")),
        ]
    }

    /// The outcome with its reasons, and the deviation inside the fade-out.
    pub(crate) fn verdict(&self) -> String {
        let (outcome, reasons) = self.judged();
        let verdict = format!("{}: {}", outcome.word(), reasons.join(" "));
        // All speeds of a plan may be above the fade-out.
        let inside = self.error_inside_fade();
        if self.law.fade_velocity == 0.0 || inside.is_nan() {
            return verdict;
        }
        format!(
            "{verdict} RMS deviation outside: {}; inside, where the load motor is off: {}, expected {}.",
            self.over_breakaway(self.error_outside_fade()),
            self.over_breakaway(inside),
            self.over_breakaway(self.expected_inside_fade()),
        )
    }

    /// Figures 12 to 14 of the paper, and a detail of the step at the fade limits; `own` is the friction measured
    /// before, if available.
    pub fn figures(&self, own: Option<Series>) -> [(&'static str, Figure, String); 4] {
        [self.own_and_desired(own), self.desired_and_rendered(), self.load_torque(), self.sweep_through_standstill()]
    }

    /// Figure 12: measured own friction, and the desired characteristic.
    fn own_and_desired(&self, own: Option<Series>) -> Captioned {
        let fastest = self.drawn_to();
        let figure = own
            .into_iter()
            .fold(friction("Own friction and desired characteristic"), Figure::series)
            .series(Series::line(Role::Own, "own, fitted", curve(&self.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", curve(&self.law.desired, fastest)));
        let widest = grid(fastest).map(|velocity| self.law.torque(velocity).abs()).fold(0.0, f64::max);
        let caption = format!(
            "Own friction measured at the active preload, and desired friction; figure 12 of the paper. The load motor \
             renders a difference of up to {}.",
            torque(widest),
        );
        ("figure-12.svg", figure, caption)
    }

    /// Figure 13: desired characteristic, and the friction measured under the rendering law.
    fn desired_and_rendered(&self) -> Captioned {
        let (fastest, fade) = (self.drawn_to(), self.law.fade_velocity);
        let figure = friction("Desired and rendered friction")
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", points(&self.curve)))
            .series(Series::line(Role::Own, "own", curve(&self.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", curve(&self.law.desired, fastest)))
            .series(plateaus(Role::Rendered, &self.curve));
        let mut caption = format!(
            "Friction measured while the load motor renders the difference; figure 13 of the paper. Outside the fade-out \
             the plateaus deviate by {} rms from the desired characteristic",
            self.over_breakaway(self.error_outside_fade()),
        );
        let inside = self.error_inside_fade();
        if !inside.is_nan() {
            caption += &format!(", inside, where only the mechanics acts, by {}", self.over_breakaway(inside));
        }
        caption.push('.');
        ("figure-13.svg", figure, caption)
    }

    /// Figure 14: difference torque of the law, and torque of the load motor by its current.
    fn load_torque(&self) -> Captioned {
        let (fastest, fade) = (self.drawn_to(), self.law.fade_velocity);
        let measured = self
            .curve
            .valid()
            .flat_map(|plateau| plateau.blocks.iter().map(|block| (block.velocity, block.load_torque)));
        let commanded = grid(fastest).map(|velocity| (velocity, self.law.torque(velocity)));
        let figure = load("Difference torque, and torque of the load motor")
            .x(Axis::new("speed Ω", "rad/s").stretched())
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", measured))
            .series(Series::line(Role::Reference, "difference torque", commanded));
        let caption = "The reference of the load motor's current control, and its torque by the current sensor; \
                       figure 14 of the paper.";
        ("figure-14.svg", figure, caption.into())
    }

    /// The step at the fade limits.
    fn sweep_through_standstill(&self) -> Captioned {
        let fade = self.law.fade_velocity;
        let of = |value: fn(&Frame) -> f64| {
            self.sweep.iter().map(|frame| (frame.signals.estimated_velocity, value(frame))).collect::<Vec<_>>()
        };
        let limit = self.sweep.iter().fold(0.0, |most: f64, frame| most.max(frame.signals.estimated_velocity.abs()));
        let commanded = (0..=POINTS)
            .map(|k| limit * (2.0 * k as f64 / POINTS as f64 - 1.0))
            .map(|velocity| (velocity, self.law.torque(velocity)));
        let figure = load("Sweep through standstill")
            .x(Axis::new("estimated speed Ω", "rad/s"))
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", of(|frame| frame.signals.measured_load_torque)))
            .series(Series::line(Role::Reference, "difference torque", commanded));
        let caption = format!(
            "A slow sweep in both directions: at the limits of the fade-out, ± {}, the difference torque steps by {}; a \
             detail of figure 14 of the paper.",
            tied(&Estimate::new(fade, "rad/s")),
            torque(self.step_at_fade()),
        );
        ("figure-14-sweep.svg", figure, caption)
    }

    /// Height of the torque step at the limits of the fade-out [N m].
    pub(crate) fn step_at_fade(&self) -> f64 {
        let fade = self.law.fade_velocity;
        (self.law.desired.magnitude(fade) - self.law.own.magnitude(fade)).abs()
    }

    /// A torque relative to the desired breakaway torque: "1.23 % of M_S".
    pub(crate) fn over_breakaway(&self, torque: f64) -> String {
        format!("{}\u{a0}% of M_S", number(100.0 * torque / self.law.desired.breakaway_torque, 2))
    }
}

/// A rendering, with preset and seed to repeat it.
#[derive(Clone, Debug)]
pub struct RenderRun {
    /// The bench, with the model of the own friction and the desired friction.
    pub preset: Preset<f64>,
    /// Seed of its noise, for a virtual bench in this process.
    pub seed: Option<u64>,
    /// The own friction measured before, if available.
    pub own: Option<Series>,
    /// The measurements and their corrections.
    pub corrected: Corrected<Rendering>,
}

/// Switches a virtual bench on, homes it and renders `bench.desired` with `model.own` as its own friction, with at most
/// `corrections` corrections.
///
/// # Errors
/// As [`render`].
pub fn render_run(
    plan: &FrictionPlan<f64>,
    preset: &Preset<f64>,
    corrections: usize,
    seed: u64,
    watch: &Watch,
) -> Result<RenderRun, Error> {
    let mut bench = VirtualBench::new(preset, seed)?;
    home(&mut bench, watch)?;
    let corrected = render_corrected(plan, &preset.bench.desired, corrections, &mut bench, watch)?;
    Ok(RenderRun { preset: *preset, seed: Some(seed), own: None, corrected })
}

impl RenderRun {
    /// The measurement under the best correction.
    pub fn rendering(&self) -> &Rendering {
        &self.corrected.best().measured
    }

    /// Whether it was completed.
    pub fn complete(&self) -> bool {
        self.rendering().complete() && self.corrected.stopped != Stopped::Cancelled
    }

    /// Results of the corrections, in lines for a terminal; empty without corrections.
    pub fn lines(&self) -> Vec<String> {
        let Corrected { iterations, best_index, stopped } = &self.corrected;
        if iterations.len() == 1 && *stopped == Stopped::Enough {
            return Vec::new();
        }
        let breakaway = self.rendering().law.desired.breakaway_torque;
        let line = |(k, iteration): (usize, &Iteration<Rendering>)| {
            let mark = if k == *best_index { ", active" } else { "" };
            format!("after {k} corrections        {} % of M_S{mark}", number(100.0 * iteration.error / breakaway, 3))
        };
        iterations.iter().enumerate().map(line).chain([format!("Ended: {stopped}.")]).collect()
    }

    /// The numbers, under their stable names; `render.complete` is 0 where the run was cancelled.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("render");
        let rendering = self.rendering();
        let Corrected { iterations, best_index, .. } = &self.corrected;
        summary
            .result("render.complete", f64::from(u8::from(self.complete())), "1")
            .result("render.preload", self.preset.plant.wheel.preload, "1")
            .result("render.met", f64::from(u8::from(rendering.judged().0 == Verdict::Met)), "1")
            .result("render.dropped_plateaus", rendering.curve.dropped().count() as f64, "1")
            .result("margin.stiffness_limit", rendering.margin.stiffness_limit.unwrap_or(STIFFNESSES[1]), "N m/rad")
            .result("margin.gain", rendering.margin.gain_margin.unwrap_or(LARGEST_GAIN), "1")
            .result(
                "margin.delay",
                rendering.margin.delay_margin.unwrap_or(LARGEST_DELAY / self.preset.bench.tick_rate),
                "s",
            )
            .result("margin.chatter", rendering.margin.predicted_chatter, "N m")
            .result("render.corrections", (iterations.len() - 1) as f64, "1")
            .result("render.corrections_kept", *best_index as f64, "1")
            .result("render.rms_error_uncorrected", iterations[0].error, "N m");
        rendering.add_to(&mut summary);
        for (k, iteration) in iterations.iter().enumerate() {
            summary.row([
                ("measurement", Value::from("correction")),
                ("corrections", k.into()),
                ("rms_error", iteration.error.into()),
                ("uncertainty", iteration.uncertainty.into()),
                ("kept", (k == *best_index).into()),
            ]);
        }
        rows(&mut summary, "rendered", &rendering.curve);
        summary
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, self.seed, parameters::write_commented(&self.preset));
        let rendering = self.rendering();
        let title = if self.complete() { "Rendered friction" } else { "Rendered friction (incomplete)" };
        let report = Report::new(title, provenance)
            .summary([rendering.verdict()].into_iter().chain(self.lines()).collect::<Vec<_>>().join(" "));
        rendering.add_to_report(report, self.own.as_ref())
    }

    /// The best correction, as columns.
    fn correction(&self) -> Option<[Column; 2]> {
        let Correction::Table(table) = self.corrected.best().correction else { return None };
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        Some([column("speed", "rad/s", table.speeds().collect()), column("torque", "N m", table.torque.to_vec())])
    }

    /// Writes figures, data, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        for (name, figure, _) in self.rendering().figures(self.own.clone()) {
            output::write(&directory.join(name), figure.svg())?;
            summary.file(name);
        }
        write_columns(&mut summary, RENDERED, &columns(&self.rendering().curve), directory)?;
        // In the form of a friction measurement, as input of `fit` and comparisons.
        let curve = with_preload(self.rendering().curve.columns(), self.preset.plant.wheel.preload);
        write_columns(&mut summary, FrictionCurve::DATA, &curve, directory)?;
        if let Some(correction) = self.correction() {
            write_columns(&mut summary, "correction", &correction, directory)?;
        }
        self.report(command).write_all(summary, [], directory)
    }
}
