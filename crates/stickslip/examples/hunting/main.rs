//! Accuracy of the prediction of hunting: the modelled drive compared with the virtual bench with its noise, counts and
//! ticks.

mod case;

use std::fmt::Write as _;
use std::path::PathBuf;

use case::{Case, Chance, MACHINES};
use stickslip::design::Hunting;
use stickslip::output;

/// Number of cases for each machine.
const CASES: u64 = 50;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "docs/studies".into()));
    let (mut rows, mut summary) = (String::new(), String::new());
    let mut chance = Chance(1);
    for machine in MACHINES {
        let (mut right, mut hunts, mut described) = (0, 0, 0);
        let mut errors: [Vec<f64>; 2] = Default::default();
        for number in 0..CASES {
            let case = Case::draw(machine, number, &mut chance)?;
            let outcome = case.outcome()?;
            right += u32::from(outcome.is_right());
            hunts += u32::from(outcome.truth.is_some());
            described += u32::from(outcome.truth.is_some() && outcome.radius >= 1.0);
            for (all, error) in errors.iter_mut().zip(outcome.errors().unwrap_or_default()) {
                if outcome.errors().is_some() {
                    all.push(error);
                }
            }
            let cells = |hunting: Option<Hunting>| {
                hunting.map_or("rests |".into(), |it| format!("{:.2} | {:.3}", 1e3 * it.amplitude, it.interval))
            };
            let own = case.preset.model.own;
            writeln!(
                rows,
                "| {} | {} | {:.3} | {:.3} | {:.2} | {} | {} | {} |",
                case.machine,
                if number % 4 == 3 { "state feedback" } else { "PID" },
                own.breakaway_torque,
                own.kinetic_torque,
                own.stribeck_velocity,
                cells(outcome.predicted),
                cells(outcome.truth),
                if outcome.is_right() { "" } else { "wrong" }
            )?;
        }
        let of = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            let at =
                |share: f64| values.get(((values.len() as f64 - 1.0) * share) as usize).map_or(f64::NAN, |v| 100.0 * v);
            format!("{:.1} | {:.1} | {:.1}", at(0.5), at(0.9), at(1.0))
        };
        let [amplitudes, intervals] = &mut errors;
        writeln!(
            summary,
            "| {machine} | {CASES} | {hunts} | {right} | {} | {} | {described} |",
            of(amplitudes),
            of(intervals)
        )?;
        eprintln!("{machine}: {right} of {CASES} right");
    }
    let page = format!(
        "# Prediction of hunting\n\n\
         Frictions and controllers drawn at random (M_K 0.1 to 0.4 N·m, M_S 1.1 to 2.5 times that, Ω_Strib 0.1 to 5 rad/s; \
         PID controllers with a triple pole at 8 to 40 rad/s and 1 to 3 times its integral gain, every fourth case a state \
         feedback), predicted by `stickslip hunting` from the model, and run for 18 s each from three deviations on the virtual bench with its \
         noise, counts and ticks. Hunting is a motion of more than 3 counts between extremes after 6 s. Errors in \
         percent.\n\n\
         | machine | cases | hunt | rightly predicted | amplitude: median | p90 | worst | interval: median | p90 | worst | \
         hunt by the describing function |\n|---|---|---|---|---|---|---|---|---|---|---|\n{summary}\n\
         Made by `cargo xtask study hunting`.\n\n\
         | machine | controller | M_S [N·m] | M_K [N·m] | Ω_Strib [rad/s] | predicted amplitude [mrad] | interval [s] | \
         true amplitude [mrad] | interval [s] | |\n|---|---|---|---|---|---|---|---|---|---|\n{rows}"
    );
    output::write(&folder.join("hunting.md"), page)?;
    Ok(())
}
