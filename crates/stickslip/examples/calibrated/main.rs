//! Rendering error of a calibrated bench, and its automatic selection of the law.
//!
//!     cargo xtask study calibrated
//!
//! draws machines at random about their data sheet, calibrates each bench, and renders with the calibrated model, under
//! every law of the selection. Writes `docs/studies/calibrated.json` and `calibrated.md`.
//! `-- FOLDER FIRST LAST` runs some of them.

#[path = "../calibration/study.rs"]
#[allow(dead_code, reason = "the calibration itself is scored by its own study")]
mod study;

use std::fmt::Write as _;
use std::path::PathBuf;

use stickslip::fidelity::{CLOSED_LOOP, Cell, LAWS, Mismatch, Pick, Role, Runs, Score, pick_law, scores};
use stickslip::{Error, Summary, Watch, design, output};
use stickslip_core::render::Law;

const PRESET: &str = "prototype";
const SEEDS: [u64; 3] = [1, 2, 3];

/// One machine on its calibrated bench.
struct Experiment {
    seed: u64,
    pick: Pick,
    /// Scores of each law of the selection.
    laws: Vec<(&'static str, Vec<Score>)>,
}

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    let mut seed = |default| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(default);
    let (first, last) = (seed(1), seed(20));
    output::create_folder(&folder)?;
    let mut experiments = Vec::new();
    for seed in first..=last {
        experiments.push(experiment(seed)?);
        eprintln!("{seed} of {last}");
    }
    let mut summary = Summary::new("cargo xtask study calibrated");
    let text = table(&mut summary, &experiments);
    output::write(&folder.join("calibrated.json"), summary.to_json())?;
    output::write(&folder.join("calibrated.md"), text)
}

fn experiment(seed: u64) -> Result<Experiment, Error> {
    let (mut preset, calibration) = study::experiment(PRESET, seed)?;
    preset.model = calibration.model;
    preset.plant.start_angle = 0.0;
    let pick = pick_law(&preset.model, &preset.bench)?;
    let desired = preset.bench.desired_bristles.under(preset.bench.desired);
    let mut cell = Cell { preset, desired, mismatch: Mismatch::PERFECT, law: Law::Off, correct: None };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let run = |cell: &Cell, role| Runs::simulate(cell, role, CLOSED_LOOP, &SEEDS, threads, &Watch::silent());
    let (a, a0) = (run(&cell, Role::Desired)?, run(&cell, Role::Own)?);
    let mut laws = Vec::new();
    for &(name, law) in LAWS.iter().filter(|(name, _)| pick.predicted.iter().any(|other| other.law == *name)) {
        cell.preset.bench.law = law;
        cell.law = design::rendering_law(&cell.preset.model, &cell.preset.bench)?;
        laws.push((name, scores(&run(&cell, Role::Rendered)?, &a, &a0)));
    }
    Ok(Experiment { seed, pick, laws })
}

impl Experiment {
    fn of(&self, law: &str) -> &[Score] {
        self.laws.iter().find(|(name, _)| *name == law).map_or(&[], |(_, scores)| scores)
    }

    /// E, the mean difference over all measures except the counts.
    fn mean(&self, law: &str) -> f64 {
        let of: Vec<f64> = measures(self.of(law)).map(|score| score.difference).collect();
        of.iter().sum::<f64>() / of.len() as f64
    }

    fn predicted(&self) -> f64 {
        let law = self.pick.name;
        let prediction = self.pick.predicted.iter().find(|other| other.law == law);
        let of: Vec<f64> = measures(self.of(law))
            .map(|score| prediction.map_or(f64::NAN, |prediction| prediction.difference(score.measure)))
            .collect();
        of.iter().sum::<f64>() / of.len() as f64
    }

    /// E of the best law.
    fn best(&self) -> f64 {
        self.laws.iter().map(|(name, _)| self.mean(name)).fold(f64::INFINITY, f64::min)
    }

    /// E of the selected law over that of the best one.
    fn over_best(&self) -> f64 {
        self.mean(self.pick.name) / self.best()
    }

    /// Whether E of the selected law is within 1.2 times the best one, or the noise floor of the machine itself.
    fn is_near_best(&self) -> bool {
        let floors: Vec<f64> = measures(self.of(self.pick.name)).map(|score| score.floor).collect();
        let floor = floors.iter().sum::<f64>() / floors.len() as f64;
        self.mean(self.pick.name) <= 1.2 * self.best().max(floor)
    }

    /// Number of measures in which the selected law is within 1.2 times the best one, or the noise of the machine
    /// itself, and number of measures.
    fn near_best(&self) -> (usize, usize) {
        let least = |measure: &str| {
            let of =
                |scores: &[Score]| scores.iter().find(|score| score.measure == measure).map(|score| score.difference);
            self.laws.iter().filter_map(|(_, scores)| of(scores)).fold(f64::INFINITY, f64::min)
        };
        let near = |score: &&Score| score.difference <= 1.2 * least(score.measure).max(score.floor);
        let picked = self.of(self.pick.name);
        (measures(picked).filter(near).count(), measures(picked).count())
    }
}

fn measures(scores: &[Score]) -> impl Iterator<Item = &Score> {
    scores.iter().filter(|score| !score.measure.ends_with("count"))
}

fn table(summary: &mut Summary, experiments: &[Experiment]) -> String {
    let count = experiments.len() as f64;
    let mut text = format!(
        "# Rendering error of a calibrated bench\n\n\
         {count} machines drawn at random about `{PRESET}` as in the study of the calibration: torque constants ± 5 %, \
         masses, stiffness, friction, resistance and inductance ± 20 %, damping and lags ± 50 %, scales of tacho and \
         accelerometer ± 2 %, offsets. The bench starts from the data sheet, is calibrated, selects its law, and renders at \
         4 kHz with the wheel pressed on; {} noise seeds each. E is the mean over all measures in closed loop except the \
         counts. Made by `cargo xtask study calibrated`; the numbers are in `calibrated.json`.\n\n\
         | machine | selected law | E, % | over the best law's E | predicted E, % |\n|-|-|-|-|-|\n",
        SEEDS.len()
    );
    for experiment in experiments {
        let _ = writeln!(
            text,
            "| {} | {} | {:.2} | {:.2} | {:.2} |",
            experiment.seed,
            experiment.pick.name,
            100.0 * experiment.mean(experiment.pick.name),
            experiment.over_best(),
            100.0 * experiment.predicted()
        );
        for (law, scores) in &experiment.laws {
            for score in scores {
                let prediction = experiment.pick.predicted.iter().find(|other| other.law == *law);
                let predicted = prediction.map_or(f64::NAN, |prediction| prediction.difference(score.measure));
                summary.row([
                    ("seed", experiment.seed.into()),
                    ("law", (*law).into()),
                    ("auto", (*law == experiment.pick.name).into()),
                    ("scenario", score.measure.into()),
                    ("difference", score.difference.into()),
                    ("floor", score.floor.into()),
                    ("predicted", predicted.into()),
                ]);
            }
        }
    }
    let share = |inside: &dyn Fn(&Experiment) -> bool| {
        experiments.iter().filter(|experiment| inside(experiment)).count() as f64 / count
    };
    let near_best = share(&|experiment| experiment.over_best() <= 1.2);
    let near_best_or_floor = share(&Experiment::is_near_best);
    let foreseen = share(&|experiment| {
        let ratio = experiment.predicted() / experiment.mean(experiment.pick.name);
        (1.0 / 1.5..=1.5).contains(&ratio)
    });
    let cells = experiments.iter().map(Experiment::near_best).fold((0, 0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
    let near_best_in = cells.0 as f64 / cells.1 as f64;
    summary
        .result("machines", count, "1")
        .result("picked_within_1.2_of_best", near_best, "1")
        .result("picked_within_1.2_of_best_or_floor", near_best_or_floor, "1")
        .result("cells_within_1.2_of_best_or_floor", near_best_in, "1")
        .result("predicted_within_1.5", foreseen, "1");
    let _ = writeln!(
        text,
        "\nThe selected law has at most 1.2 times the best law's E on {:.0} % of the machines. On {:.0} of {count} machines \
         its E is within 1.2 times the larger of the best law's E and the machine's own noise floor. In {:.0} % of the \
         single measures it is within the corresponding limit. The predicted E is within a factor of 1.5 of the measured one on \
         {:.0} %.\n\n\
         | measure of the selected law | median | worst |\n|-|-|-|",
        100.0 * near_best,
        near_best_or_floor * count,
        100.0 * near_best_in,
        100.0 * foreseen
    );
    let names: Vec<&str> =
        experiments.first().map_or_else(Vec::new, |first| first.laws[0].1.iter().map(|s| s.measure).collect());
    for name in names {
        let mut values: Vec<f64> = experiments
            .iter()
            .filter_map(|experiment| experiment.of(experiment.pick.name).iter().find(|score| score.measure == name))
            .map(|score| score.difference)
            .collect();
        values.sort_by(f64::total_cmp);
        let (median, worst) = (values[values.len() / 2], values[values.len() - 1]);
        summary.result(&format!("{name}.median"), median, "1").result(&format!("{name}.worst"), worst, "1");
        let _ = if name.ends_with("count") {
            writeln!(text, "| `{name}`, breakaways | {median:.1} | {worst:.1} |")
        } else {
            writeln!(text, "| `{name}`, % | {:.1} | {:.1} |", 100.0 * median, 100.0 * worst)
        };
    }
    text
}
