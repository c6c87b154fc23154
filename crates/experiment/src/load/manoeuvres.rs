//! Manoeuvres that a loaded controller follows, and the preset's own behind it.

use stickslip_core::control::reference::Generator;

use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Table};
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::{Bench, Command, Frame};
use stickslip_simulate::manoeuvre::Manoeuvre;

/// What is followed, in this order.
const MANOEUVRES: [Manoeuvre; 4] =
    [Manoeuvre::SlowSine, Manoeuvre::FastSine, Manoeuvre::PointToPoint, Manoeuvre::Reversal];
/// What the table of deviations has.
const CAPTION: &str =
    "Deviation over the whole of each manoeuvre, by the encoder, with the loaded controller and with the preset's.";
/// What is shown of a course at most, in points.
const POINTS: usize = 4000;

/// How a manoeuvre was followed, by the encoder.
#[derive(Clone, Debug, Default, PartialEq)]
struct Followed {
    /// Its stable name.
    manoeuvre: &'static str,
    /// Deviation, RMS and largest magnitude [rad].
    deviation: [f64; 2],
    /// Time and deviation of each sample [s], [rad].
    course: Vec<(f64, f64)>,
}

/// All of them, by both.
pub(super) struct Manoeuvres {
    wanted: Vec<Manoeuvre>,
    brought: Vec<Followed>,
    own: Vec<Followed>,
}

impl Manoeuvres {
    /// Those that fit into a duration [s], the first in any case.
    pub(super) fn planned(preset: &Preset<f64>, duration: f64) -> Self {
        let (mut wanted, mut total) = (Vec::new(), 0.0);
        for manoeuvre in MANOEUVRES {
            total += manoeuvre.reference(preset, 0.5).1;
            if wanted.is_empty() || total <= duration {
                wanted.push(manoeuvre);
            }
        }
        Manoeuvres { wanted, brought: Vec::new(), own: Vec::new() }
    }

    /// With what was brought along; what was followed until a fault is kept.
    pub(super) fn with(&mut self, preset: &Preset<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        follow(&self.wanted, preset, bench, &mut self.brought, watch)
    }

    /// With the preset's own controller.
    pub(super) fn without(&mut self, preset: &Preset<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        follow(&self.wanted, preset, bench, &mut self.own, watch)
    }

    pub(super) fn table(&self) -> Table {
        let cell = |followed: Option<&Followed>, which: usize| {
            followed
                .map_or_else(|| Cell::from("stopped"), |it| Cell::Estimate(Estimate::new(it.deviation[which], "rad")))
        };
        self.own.iter().enumerate().fold(
            Table::new(["manoeuvre", "RMS", "RMS, preset's", "peak", "peak, preset's"]).caption(CAPTION),
            |table, (k, own)| {
                let brought = self.brought.get(k);
                table.row([
                    own.manoeuvre.into(),
                    cell(brought, 0),
                    cell(Some(own), 0),
                    cell(brought, 1),
                    cell(Some(own), 1),
                ])
            },
        )
    }

    pub(super) fn tell(&self, summary: &mut Summary) {
        for (who, all) in [("controller", &self.brought), ("own", &self.own)] {
            for Followed { manoeuvre, deviation: [rms, peak], .. } in all {
                summary.result(&format!("{who}.{manoeuvre}.rms"), *rms, "rad");
                summary.result(&format!("{who}.{manoeuvre}.peak"), *peak, "rad");
            }
        }
    }

    /// What came of it, in sentences.
    pub(super) fn lead(&self) -> Vec<String> {
        let compared = self.brought.iter().zip(&self.own).map(|(brought, own)| {
            let [brought_rms, own_rms] = [brought, own].map(|it| Estimate::new(it.deviation[0], "rad").to_string());
            format!("{}: {brought_rms} RMS, with the preset's controller {own_rms}.", brought.manoeuvre)
        });
        compared.collect()
    }

    /// Names of files, figures and captions.
    pub(super) fn figures(&self) -> Vec<(String, Figure, String)> {
        let figure = |(k, own): (usize, &Followed)| {
            let line = |role, name: &'static str, of: &Followed| {
                let stride = of.course.len().div_ceil(POINTS).max(1);
                let points = of.course.iter().step_by(stride).map(|(time, deviation)| (*time, 1e3 * deviation));
                Series::line(role, name, points.collect::<Vec<_>>())
            };
            let figure = Figure::new(format!("Deviation: {}", own.manoeuvre))
                .x(Axis::new("time", "s"))
                .y(Axis::new("deviation", "mrad"))
                .series(line(Role::Reference, "preset's controller", own));
            let figure = match self.brought.get(k) {
                Some(brought) => figure.series(line(Role::Trace(0), "loaded controller", brought)),
                None => figure,
            };
            let caption =
                "Deviation of the measured angle from the set-point, with the loaded controller and with the preset's.";
            (format!("{}.svg", own.manoeuvre), figure, caption.into())
        };
        self.own.iter().enumerate().map(figure).collect()
    }
}

fn follow(
    wanted: &[Manoeuvre],
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    followed: &mut Vec<Followed>,
    watch: &Watch,
) -> Result<(), Error> {
    let (rate, divider) = (preset.bench.tick_rate, preset.bench.divider());
    for (number, manoeuvre) in wanted.iter().enumerate() {
        // One tick without torque tells where the screw is.
        let home = bench.step(Command::default())?.angle;
        let (reference, duration) = manoeuvre.reference(preset, 0.5);
        let mut setpoints = Generator::new(reference, rate).with_origin(home);
        let mut course = Vec::new();
        let mut begin = None;
        let mut see = |frame: &Frame| {
            let before = *begin.get_or_insert(frame.cycle - 1);
            if frame.cycle.is_multiple_of(divider) {
                let time = (frame.cycle - before) as f64 / rate;
                course.push((time, frame.command.setpoint.position - frame.angle));
            }
        };
        let ticks = (duration * rate).round() as u64;
        for tick in 0..ticks {
            if tick.is_multiple_of(2048) {
                let part = (number as f64 + tick as f64 / ticks as f64) / wanted.len() as f64;
                watch.stage(manoeuvre.name(), part)?;
            }
            let command = Command { setpoint: setpoints.next(), control: true, ..Command::default() };
            bench.hand_over(command)?.iter().for_each(&mut see);
        }
        bench.drain(&mut see)?;
        bench.come_to_rest()?;
        let square: f64 = course.iter().map(|(_, deviation)| deviation * deviation).sum();
        let peak = course.iter().fold(0.0f64, |most, (_, deviation)| most.max(deviation.abs()));
        let deviation = [libm::sqrt(square / course.len() as f64), peak];
        followed.push(Followed { manoeuvre: manoeuvre.name(), deviation, course });
    }
    Ok(())
}
