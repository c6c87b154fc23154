//! Coverage of the 95 % intervals of an identification from a recording.
//!
//!     cargo xtask study intervals
//!
//! simulates axes drawn at random, identifies each and writes `docs/studies/intervals.md`: for each kind of axis how often
//! the intervals contain the truth.

mod axis;

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use axis::{Axis, Plan, Random, Record};
use stickslip::identify::machine::Machine;
use stickslip::identify::{Identification, identify};
use stickslip::recording::{Column, Recording};
use stickslip::{Error, Watch, output};

/// Axes of each kind.
const COUNT: u64 = 200;

/// Makes a plain axis one of a kind.
type Change = fn(&mut Axis, &mut Random);

/// Kinds: name, and what it changes.
const KINDS: [(&str, Change); 13] = [
    ("plain", |_, _| {}),
    ("position late", |axis, random| axis.delay = random.between(1.0, 12.0) as usize),
    ("lag of the drive", |axis, random| axis.lag = random.decades(3e-4, 3e-3)),
    ("friction by load", |axis, random| axis.load = random.between(0.05, 0.25)),
    ("periodic force", |axis, random| {
        axis.ripple = Some([axis.coulomb * random.between(0.2, 0.6), 1e-2 * random.between(1.0, 3.0)]);
    }),
    ("late, and friction by load", |axis, random| {
        axis.delay = random.between(1.0, 12.0) as usize;
        axis.load = random.between(0.05, 0.25);
    }),
    ("late, and a periodic force", |axis, random| {
        axis.delay = random.between(1.0, 12.0) as usize;
        axis.ripple = Some([axis.coulomb * random.between(0.2, 0.6), 1e-2 * random.between(1.0, 3.0)]);
    }),
    ("lag, and friction by load", |axis, random| {
        axis.lag = random.decades(3e-4, 3e-3);
        axis.load = random.between(0.05, 0.25);
    }),
    ("lag, and a periodic force", |axis, random| {
        axis.lag = random.decades(3e-4, 3e-3);
        axis.ripple = Some([axis.coulomb * random.between(0.2, 0.6), 1e-2 * random.between(1.0, 3.0)]);
    }),
    ("friction falls by 10 to 40 %", |axis, random| axis.warm_up = random.between(0.1, 0.4)),
    ("rotary", |_, _| {}),
    ("rotary, with weight", |axis, random| axis.ripple = Some([axis.coulomb * random.between(0.2, 2.0), TAU])),
    ("no set-point recorded", |_, _| {}),
];

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    let count = arguments.next().and_then(|count| count.parse().ok()).unwrap_or(COUNT);
    output::create_folder(&folder)?;
    let mut text = String::from(
        "# Coverage of intervals from a recording\n\nAxes drawn at random: 0.1 to 1000 kg, or 1e-4 to 10 kg·m², 250 Hz to \
         10 kHz, grid and noise of the encoder, a random force of 0.5 to 10 % of the Coulomb friction, strokes with \
         trapezoidal speed under a cascade controller whose gains are unknown to the identification. Axes on which the \
         report states that the motion does not determine the delay are counted apart. Of the others: share of 95 % \
         intervals that contain the truth, and share on which the delay or the extra force was found, and no other. Made \
         by `cargo xtask study intervals`.\n\n\
         | kind | axes | refused | delay not determined | mass | viscous | Coulomb | delay | found |\n|-|-|-|-|-|-|-|-|-|\n",
    );
    for (index, (name, change)) in KINDS.into_iter().enumerate() {
        let (mut hits, mut found, mut done, mut unknown) = ([0u64; 4], 0, 0, 0);
        for seed in 0..count {
            let (axis, plan) = drawn(seed + 10_000 * index as u64, name.starts_with("rotary"), change);
            let Ok(result) = identified(&axis, &plan, name) else { continue };
            done += 1;
            // Without the delay the assumption is stated, and no interval holds for sure.
            if !result.findings.delay.is_determined {
                unknown += 1;
                continue;
            }
            for (hit, holds) in hits.iter_mut().zip(holds(&result, &axis)) {
                *hit += u64::from(holds);
            }
            found += u64::from(finds(&result, &axis));
        }
        let share = |hits: u64| format!("{:.1} %", 100.0 * hits as f64 / (done - unknown).max(1) as f64);
        let [mass, viscous, coulomb, delay] = hits.map(share);
        let refused = count - done;
        let _ = writeln!(
            text,
            "| {name} | {count} | {refused} | {unknown} | {mass} | {viscous} | {coulomb} | {delay} | {} |",
            share(found)
        );
        eprintln!("{}", text.lines().last().unwrap_or_default());
    }
    output::write(&folder.join("intervals.md"), text)
}

/// An axis and its movement.
fn drawn(seed: u64, is_rotary: bool, change: Change) -> (Axis, Plan) {
    let mut random = Random(seed);
    let (inertia, speed) = match is_rotary {
        true => (random.decades(1e-4, 10.0), random.decades(2.0, 50.0)),
        false => (random.decades(0.1, 1000.0), random.decades(0.1, 1.0)),
    };
    let rate = random.decades(250.0, 1e4).round();
    let acceleration = speed * random.between(5.0, 15.0);
    let coulomb = inertia * acceleration * random.between(0.05, 0.4);
    let grid = speed / rate * random.decades(1e-4, 3e-2);
    let mut axis = Axis {
        inertia,
        viscous: inertia * acceleration / speed * random.between(0.05, 0.4),
        coulomb,
        gain: inertia,
        offset: 0.0,
        load: 0.0,
        ripple: None,
        lag: 0.0,
        delay: 0,
        grid,
        noise: grid * random.between(0.0, 1.0),
        disturbance: [coulomb * random.decades(5e-3, 0.1), random.decades(3e-3, 0.1)],
        warm_up: 0.0,
        elastic: None,
    };
    change(&mut axis, &mut random);
    let stroke = speed * random.between(0.4, 1.0);
    let plan = Plan { rate, seconds: 30.0, stroke, speed, acceleration, forward_only: false, pulses: 0.0, seed };
    (axis, plan)
}

fn identified(axis: &Axis, plan: &Plan, kind: &str) -> Result<Identification, Error> {
    let Record { position, reference, command, .. } = axis.record(plan);
    let columns = [("q", position), ("r", reference), ("u", command)];
    let recording = Recording::from_columns("axis.csv", columns.map(|(name, values)| Column::new(name, values)).into());
    let (axis_kind, length, force) =
        if kind.starts_with("rotary") { ("rotary", "rad", "N m") } else { ("linear", "m", "N") };
    let reference = match kind.starts_with("no set-point") {
        true => String::new(),
        false => format!("reference = {{ name = \"r\", unit = \"{length}\" }}\n"),
    };
    let text = format!(
        "name = \"axis\"\naxis = \"{axis_kind}\"\nsampling_period = {{ value = {}, unit = \"s\" }}\n[columns]\nposition = {{ name = \
         \"q\", unit = \"{length}\" }}\n{reference}command = {{ name = \"u\", unit = \"V\" }}\n\
         [drive]\ngain = {{ value = {}, unit = \"{force}/V\" }}\n[recipe]\nlow_pass = {}\n",
        1.0 / plan.rate,
        axis.gain,
        (0.2 * plan.rate).min(100.0)
    );
    identify(&recording, &Machine::parse(Path::new("axis.toml"), &text)?, &Watch::silent())
}

/// Whether the intervals of mass, viscous and Coulomb friction of positive velocity, and of the delay hold the truth.
fn holds(found: &Identification, axis: &Axis) -> [bool; 4] {
    let within = |[low, high]: [f64; 2], truth: f64| low <= truth && truth <= high;
    let ci95 = &found.asymmetric.fit.ci95;
    let delay = axis.lag + axis.delay as f64 * found.signals.period;
    // Of friction that falls, its mean.
    let share = 1.0 - 0.5 * axis.warm_up;
    let truth = [(0, axis.inertia), (1, share * axis.viscous), (2, share * axis.coulomb)];
    let friction = truth.map(|(k, truth)| within(ci95[k], truth));
    [friction[0], friction[1], friction[2], within(found.findings.delay.ci95, delay)]
}

/// Whether what the axis has beside mass and friction was found, and nothing that it has not.
fn finds(found: &Identification, axis: &Axis) -> bool {
    let findings = &found.findings;
    let is_late = axis.delay > 0 || axis.lag > 0.0;
    findings.load.is_some() == (axis.load > 0.0)
        && (findings.periodic.is_some() || findings.weight.is_some()) == axis.ripple.is_some()
        && findings.delay.is_significant == is_late
}
