//! The plant as an FMU against the same plant in this program, per tick.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use stickslip::generate::{Precision, generate};
use stickslip::{Preset, integrator, parameters};
use stickslip_codegen::c::Project;
use stickslip_codegen::fmu::{Version, fmu};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::plant::{PlantInput, PlantState, VirtualMachine};

/// Ticks per round, which takes some tens of milliseconds.
const TICKS: usize = 20_000;

/// Nanoseconds per tick in the best round: the FMU with all calls of an importer, and this program.
///
/// # Errors
/// Without a C compiler; if the results differ.
pub(crate) fn run(rounds: usize) -> Result<[f64; 2], Box<dyn Error>> {
    let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    let generated = generate("plant", &preset, Precision::Double, None)?;
    let step = generated.step;
    let fmu = fmu(&Project { files: generated.files, program: generated.program }, "plant", step, Version::Three, None);
    let folder = std::env::temp_dir().join(format!("stickslip-fmu-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("sources"))?;
    let sources = fmu.files.iter().filter(|(name, _)| name.starts_with("sources/"));
    let written = sources
        .map(|(name, text)| (name.as_str(), text.as_str()))
        .chain([("sources/drive.c", include_str!("drive.c"))])
        .try_for_each(|(name, text)| std::fs::write(folder.join(name), text));
    let outcome = written.map_err(Into::into).and_then(|()| contest(&preset, step, &folder.join("sources"), rounds));
    std::fs::remove_dir_all(&folder)?;
    outcome
}

fn contest(preset: &Preset<f64>, step: f64, folder: &Path, rounds: usize) -> Result<[f64; 2], Box<dyn Error>> {
    // The flags with which the program compiles an FMU.
    let compile = ["-std=c99", "-O2", "-fvisibility=hidden", "-fPIC", "-o", "drive", "drive.c", "-lm"];
    let out = Command::new("cc").args(compile).current_dir(folder).output()?;
    if !out.status.success() {
        return Err(String::from_utf8_lossy(&out.stderr).into());
    }
    let (steps, plant_step) = preset.bench.plant_steps();
    let machine = VirtualMachine { parts: integrator::prepare(&preset.plant, steps, plant_step)? };
    let mut best = [f64::INFINITY; 2];
    for _ in 0..rounds {
        let (imported, imported_sum) = importer(folder)?;
        let (direct, sum) = native(&machine, step);
        if imported_sum.to_bits() != sum.to_bits() {
            return Err(format!("the bits differ: {sum} in this program, {imported_sum} in the FMU").into());
        }
        best = [best[0].min(imported), best[1].min(direct)];
    }
    Ok(best)
}

fn importer(folder: &Path) -> Result<(f64, f64), Box<dyn Error>> {
    let out = Command::new(folder.join("drive")).arg(TICKS.to_string()).output()?;
    let text = String::from_utf8(out.stdout)?;
    let mut numbers = text.split_whitespace().map(str::parse);
    match (numbers.next(), numbers.next()) {
        (Some(time), Some(sum)) => Ok((time?, sum?)),
        _ => Err("the FMU refused a step".into()),
    }
}

fn native(machine: &VirtualMachine<f64>, step: f64) -> (f64, f64) {
    let (mut state, mut input, mut sum) = (PlantState::default(), PlantInput::default(), 0.0);
    let start = Instant::now();
    for tick in 0..TICKS {
        input.servo_voltage = if (tick / 1000) % 2 == 0 { 2.0 } else { -2.0 };
        let output = black_box(machine).step(&mut state, input, step);
        output.map(&mut |number: f64| {
            sum += number;
            number
        });
    }
    (start.elapsed().as_secs_f64() * 1e9 / TICKS as f64, sum)
}
