//! One random bench of the study: the predicted limit, and that of the whole virtual bench.

use stickslip::DesignError;
use stickslip::design::{self, CHATTER_LIMIT, STIFFNESSES};
use stickslip::fidelity::{Cell, Mismatch, Role, Runs, Scenario, TestBed, Trace};
use stickslip::noise::Normals;
use stickslip::{Error, LawChoice, Residual, Tracking, Watch};
use stickslip_core::friction::Model;

/// The laws whose stiffness is limited.
pub(crate) fn laws() -> [(&'static str, LawChoice<f64>); 2] {
    [("bristle", LawChoice::Bristle), ("residual", LawChoice::Residual(Residual::default()))]
}

/// Tick rates of the random benches [Hz].
const RATES: [f64; 6] = [1e3, 2e3, 4e3, 5e3, 8e3, 1e4];
/// Ratio of the stiffnesses of the first search, and halvings of its interval.
const STRIDE: f64 = 1.25;
const HALVINGS: usize = 3;

/// Stiffnesses up to which there is no chatter [N m/rad]; `None`: no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    pub(crate) tick_rate: f64,
    pub(crate) predicted: Option<f64>,
    pub(crate) observed: Option<f64>,
}

/// The prototype with every value of drive, load motor and amplifier up to 30 % off, own friction and its bristles up to
/// twice or half as much, at a random tick rate, with and without its wheel. The software's model has the same values.
pub(crate) fn bench(law: LawChoice<f64>, seed: u64) -> Result<Cell, Error> {
    let normals = Normals::new(seed);
    let mut channel = 1000;
    let mut normal = || {
        channel += 1;
        normals.pair(channel, 0)[0].clamp(-2.0, 2.0)
    };
    let rate = RATES[(seed as usize) % RATES.len()];
    let mut cell = TestBed::find("prototype")?.cell(seed.is_multiple_of(2), rate, Mismatch::PERFECT);
    let (plant, model) = (&mut cell.preset.plant, &mut cell.preset.model);
    let mut third = || 1.0 + 0.15 * normal();
    for value in [
        &mut model.drive.motor_inertia,
        &mut model.drive.load_inertia,
        &mut model.drive.coupling_stiffness,
        &mut model.drive.coupling_damping,
        &mut model.load_motor.torque_constant,
        &mut model.load_motor.resistance,
        &mut model.load_motor.inductance,
        &mut model.servo_lag,
        &mut model.tacho_noise,
        &mut model.accelerometer_noise,
    ] {
        *value *= third();
    }
    model.drive_lag += model.servo_lag - plant.servo.lag;
    let mut twice = || libm::exp2(0.5 * normal());
    let friction = twice();
    model.own.breakaway_torque *= friction;
    model.own.kinetic_torque *= friction;
    model.own_bristles.stiffness *= twice();
    model.own_bristles.damping *= twice();

    plant.drive = model.drive;
    plant.load_motor.winding = model.load_motor;
    plant.servo.lag = model.servo_lag;
    plant.tacho.noise = model.tacho_noise;
    plant.accelerometer.noise_density = model.accelerometer_noise;
    if let Model::ElastoPlastic(own) = &mut plant.screw_friction.model {
        own.lugre.sliding = model.own;
        own.lugre.bristle_stiffness = model.own_bristles.stiffness;
        own.lugre.bristle_damping = model.own_bristles.damping;
    }
    cell.preset.bench.law = law;
    Ok(cell)
}

/// The predicted limit, and the observed one near it.
pub(crate) fn limits(law: LawChoice<f64>, seed: u64) -> Result<Limits, Error> {
    let cell = bench(law, seed)?;
    let bench = &cell.preset;
    let rendering = design::rendering_law(&bench.model, &bench.bench)?;
    let predicted = design::stiffness_limit(&rendering, &bench.model, &bench.bench)?;
    Ok(Limits { tick_rate: bench.bench.tick_rate, predicted, observed: observed(&cell, predicted, seed)? })
}

/// Chatter under the admittance with the preset's desired bristles [N m]: predicted, and observed; infinite for an
/// unstable loop.
pub(crate) fn levels(seed: u64) -> Result<[f64; 2], Error> {
    let cell = bench(LawChoice::Admittance(Tracking::default()), seed)?;
    let bench = &cell.preset;
    let rendering = design::rendering_law(&bench.model, &bench.bench)?;
    let predicted = match design::margin(&rendering, &bench.model, &bench.bench) {
        Ok(margin) => margin.predicted_chatter,
        Err(error) if matches!(error.of(), Some(DesignError::Chatters { .. })) => f64::INFINITY,
        Err(error) => return Err(error),
    };
    Ok([predicted, chatter(&cell, bench.bench.desired_bristles.stiffness, seed)?])
}

/// Chatter of a hunting run with these desired bristles [N m/rad]; infinite if it is not completed [N m].
fn chatter(cell: &Cell, stiffness: f64, seed: u64) -> Result<f64, Error> {
    let mut cell = cell.clone();
    cell.preset.bench.desired_bristles.stiffness = stiffness;
    cell.law = design::rendering_law(&cell.preset.model, &cell.preset.bench)?;
    let runs = Runs::simulate(&cell, Role::Rendered, &[Scenario::HUNTING], &[seed], 1, &Watch::silent())?;
    let trace = &runs.traces[0][0];
    Ok(if trace.stable { chatter_at_rest(trace) } else { f64::INFINITY })
}

/// Chatter while the load sticks: slower than 0.02 rad/s over the 30 ms before and after [N m]. In a slip the load
/// motor's torque has to change; infinite if the load hardly ever sticks.
fn chatter_at_rest(trace: &Trace) -> f64 {
    let window = (0.03 / trace.period).round() as usize;
    let samples = trace.angle.len();
    let still = |from: usize, to: usize| (trace.angle[to] - trace.angle[from]).abs() < 0.02 * 0.03;
    let at_rest = (window..samples.saturating_sub(window)).filter(|&k| still(k - window, k) && still(k, k + window));
    let squares: Vec<f64> = at_rest.map(|k| (trace.load_torque[k] - trace.load_torque[k - 1]).powi(2)).collect();
    if squares.len() < samples / 10 {
        return f64::INFINITY;
    }
    libm::sqrt(squares.iter().sum::<f64>() / squares.len() as f64)
}

fn observed(cell: &Cell, predicted: Option<f64>, seed: u64) -> Result<Option<f64>, Error> {
    let [_, stiffest] = STIFFNESSES;
    let quiet = |stiffness: f64| Ok::<_, Error>(chatter(cell, stiffness, seed)? <= CHATTER_LIMIT);
    let Some(start) = predicted.filter(|&limit| limit > 0.0) else {
        for stiffness in [3e3, 1e4, 3e4, stiffest] {
            if !quiet(stiffness)? {
                return Ok(Some(stiffness));
            }
        }
        return Ok(None);
    };
    let (mut good, mut bad) = (0.95 * start, 0.95 * start);
    if quiet(good)? {
        while quiet(bad * STRIDE)? {
            if bad * STRIDE > stiffest {
                return Ok(None);
            }
            bad *= STRIDE;
        }
        (good, bad) = (bad, bad * STRIDE);
    } else {
        while !quiet(good / STRIDE)? {
            if good < 300.0 {
                return Ok(Some(0.0));
            }
            good /= STRIDE;
        }
        (good, bad) = (good / STRIDE, good);
    }
    for _ in 0..HALVINGS {
        let middle = libm::sqrt(good * bad);
        if quiet(middle)? { good = middle } else { bad = middle }
    }
    Ok(Some(good))
}
