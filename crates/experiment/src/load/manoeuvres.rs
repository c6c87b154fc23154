//! Manoeuvres with the loaded controller and with the preset's controller.

use stickslip_core::control::reference::Generator;

use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Table};
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::{Bench, Command, Frame};
use stickslip_simulate::manoeuvre::Manoeuvre;

/// The manoeuvres, in this order.
const MANOEUVRES: [Manoeuvre; 4] =
    [Manoeuvre::SlowSine, Manoeuvre::FastSine, Manoeuvre::PointToPoint, Manoeuvre::Reversal];
/// Caption of the table of deviations.
const CAPTION: &str =
    "Deviation over each manoeuvre, by the encoder, with the loaded controller and with the preset's.";
/// Largest number of points of a curve.
const POINTS: usize = 4000;

/// Deviation over a manoeuvre, by the encoder.
#[derive(Clone, Debug, Default, PartialEq)]
struct Followed {
    /// Stable name of the manoeuvre.
    manoeuvre: &'static str,
    /// Deviation, RMS and largest magnitude [rad].
    deviation: [f64; 2],
    /// Time and deviation of each sample [s], [rad].
    course: Vec<(f64, f64)>,
}

/// The results of both controllers.
pub(super) struct Manoeuvres {
    planned: Vec<Manoeuvre>,
    loaded: Vec<Followed>,
    own: Vec<Followed>,
}

impl Manoeuvres {
    /// The manoeuvres that fit into a duration [s], at least the first.
    pub(super) fn planned(preset: &Preset<f64>, duration: f64) -> Self {
        let (mut planned, mut total) = (Vec::new(), 0.0);
        for manoeuvre in MANOEUVRES {
            total += manoeuvre.reference(preset, 0.5).1;
            if planned.is_empty() || total <= duration {
                planned.push(manoeuvre);
            }
        }
        Manoeuvres { planned, loaded: Vec::new(), own: Vec::new() }
    }

    /// With the loaded controller; after a fault the completed manoeuvres remain.
    pub(super) fn with(&mut self, preset: &Preset<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        follow(&self.planned, preset, bench, &mut self.loaded, watch)
    }

    /// With the preset's own controller.
    pub(super) fn without(&mut self, preset: &Preset<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        follow(&self.planned, preset, bench, &mut self.own, watch)
    }

    pub(super) fn table(&self) -> Table {
        let cell = |followed: Option<&Followed>, index: usize| {
            followed
                .map_or_else(|| Cell::from("stopped"), |it| Cell::Estimate(Estimate::new(it.deviation[index], "rad")))
        };
        self.own.iter().enumerate().fold(
            Table::new(["manoeuvre", "RMS", "RMS, preset's", "peak", "peak, preset's"]).caption(CAPTION),
            |table, (k, own)| {
                let loaded = self.loaded.get(k);
                table.row([
                    own.manoeuvre.into(),
                    cell(loaded, 0),
                    cell(Some(own), 0),
                    cell(loaded, 1),
                    cell(Some(own), 1),
                ])
            },
        )
    }

    pub(super) fn add_to(&self, summary: &mut Summary) {
        for (controller, all) in [("controller", &self.loaded), ("own", &self.own)] {
            for Followed { manoeuvre, deviation: [rms, peak], .. } in all {
                summary.result(&format!("{controller}.{manoeuvre}.rms"), *rms, "rad");
                summary.result(&format!("{controller}.{manoeuvre}.peak"), *peak, "rad");
            }
        }
    }

    /// The results, in sentences.
    pub(super) fn lead(&self) -> Vec<String> {
        let compared = self.loaded.iter().zip(&self.own).map(|(loaded, own)| {
            let [loaded_rms, own_rms] = [loaded, own].map(|it| Estimate::new(it.deviation[0], "rad").to_string());
            format!("{}: {loaded_rms} RMS; with the preset's controller {own_rms}.", loaded.manoeuvre)
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
            let figure = match self.loaded.get(k) {
                Some(loaded) => figure.series(line(Role::Trace(0), "loaded controller", loaded)),
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
    planned: &[Manoeuvre],
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    followed: &mut Vec<Followed>,
    watch: &Watch,
) -> Result<(), Error> {
    let (rate, divider) = (preset.bench.tick_rate, preset.bench.divider());
    for (number, manoeuvre) in planned.iter().enumerate() {
        // One tick without torque gives the angle of the screw.
        let home = bench.step(Command::default())?.angle;
        let (reference, duration) = manoeuvre.reference(preset, 0.5);
        let mut setpoints = Generator::new(reference, rate).with_origin(home);
        let mut course = Vec::new();
        let mut start = None;
        let mut see = |frame: &Frame| {
            let before = *start.get_or_insert(frame.cycle - 1);
            if frame.cycle.is_multiple_of(divider) {
                let time = (frame.cycle - before) as f64 / rate;
                course.push((time, frame.command.setpoint.position - frame.angle));
            }
        };
        let ticks = (duration * rate).round() as u64;
        for tick in 0..ticks {
            if tick.is_multiple_of(2048) {
                let part = (number as f64 + tick as f64 / ticks as f64) / planned.len() as f64;
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
