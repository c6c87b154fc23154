//! Frequency response of the axis: from the commanded torque to encoder and tacho, measured under control.
//!
//! An excitation R is added to the controller's torque, one period after the other, each with other phases. The controller
//! feeds noise back into the torque U, so that torque and answer Y are both referred to the excitation, G = S_yr/S_ur: this
//! is not biased by the loop, as Y/U of a record is. Because of the phases, distortion by counts and friction does not
//! repeat either: it lowers the coherence as noise does.
//! R. Pintelon, J. Schoukens, System Identification, 2nd ed. (Wiley 2012), sections 2.7 and 4.3.

mod answer;
mod plan;

use std::f64::consts::TAU;

pub use answer::{Answer, COHERENT, Line, Response};
pub use plan::ResponsePlan;

use stickslip_core::control::reference::Setpoint;
use stickslip_core::control::{Cascade, PositionController};

use super::breakaway::go_to;
use super::friction::hold_speed;
use super::{completed, give_back};
use answer::evaluate;
use plan::{ACCELERATION, Pass, RUN_IN, SETTLING};
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame, SpeedRamp};
use stickslip_design::linear::{Operating, axis};

/// Highest frequency over the tick rate.
const HIGHEST: f64 = 0.4;

/// An evaluated tick.
#[derive(Clone, Copy)]
struct Sample {
    /// Number of its period.
    period: usize,
    cycle: u64,
    /// Torque, angle from the set-point, and velocity by the tacho.
    sample: [f64; 3],
}

/// Measures the frequency response of the axis. The bench must be homed and running.
///
/// # Errors
/// [`Error::NotHomed`]; [`Error::OutOfRange`] for frequencies beyond those of the ticks, and a velocity at which the
/// load creeps; [`Error::BenchFault`], at the ends of the stroke as well; [`Error::TooFew`] where ticks were missed in all periods but
/// one; [`Error::Cancelled`] before two periods have ended, afterwards a cancelled measurement returns its periods as not complete.
pub fn measure_response(plan: &ResponsePlan<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<Response, Error> {
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let dt = bench.settings().tick_time();
    let highest = HIGHEST / dt;
    if plan.highest_frequency > highest {
        return Err(Error::OutOfRange {
            name: "the highest frequency of the response",
            value: plan.highest_frequency,
            unit: "Hz",
            minimum: plan.lowest_frequency,
            maximum: highest,
            remedy: "Use a lower frequency (plan.highest_frequency) or a faster tick.",
        });
    }
    let modelled_axis = axis(bench.model(), bench.settings(), plan.operating())?;
    let multiples = plan.multiples();
    let limits = bench.settings().safety;
    let pass = plan.pass([limits.lower_end, limits.upper_end])?;
    let samples = (plan.period / dt).round() as usize;
    let waves: Vec<Vec<f64>> =
        (0..plan.periods as usize).map(|number| plan.excitation(number, &multiples, samples)).collect();
    let first = bench.step(Command::default())?;
    hold_speed(bench)?;
    let mut ticks = Vec::new();
    let ended = visit(plan, &pass, &waves, first.angle, bench, watch, &mut ticks);
    let complete = completed(give_back(bench, ended), ticks.len() >= 2 * samples)?;
    let last = bench.step(Command::default())?;
    let count = bench.model().encoder.resolution();
    let duration = (last.cycle - first.cycle) as f64 * dt;
    let model = bench.model();
    let motor_friction = match plan.operating() {
        Operating::Sliding(_) => 0.0,
        Operating::Stuck => {
            model.motor_friction.steady_torque(1e-9, 0.0, 0.0) / (plan.share * model.own.breakaway_torque)
        }
    };
    Ok(Response {
        motor_friction,
        complete,
        duration,
        ..evaluate(plan, &modelled_axis, &multiples, &waves, &ticks, count)?
    })
}

fn visit(
    plan: &ResponsePlan<f64>,
    pass: &Pass,
    waves: &[Vec<f64>],
    from: f64,
    bench: &mut dyn Bench,
    watch: &Watch,
    ticks: &mut Vec<Sample>,
) -> Result<(), Error> {
    let pace = [plan.velocity.abs(), ACCELERATION];
    let mut here = from;
    let numbered: Vec<(usize, &Vec<f64>)> = waves.iter().enumerate().collect();
    for some in numbered.chunks(pass.periods) {
        if here != pass.start && plan.velocity != 0.0 {
            go_to(bench, here, pass.start, pace, watch)?;
            here = pass.start;
        }
        watch.stage("frequency response", some[0].0 as f64 / plan.periods)?;
        here = excite(plan, here, some, bench, watch, ticks)?;
    }
    Ok(())
}

/// One pass from an angle [rad]; returns the angle at its end.
fn excite(
    plan: &ResponsePlan<f64>,
    start: f64,
    waves: &[(usize, &Vec<f64>)],
    bench: &mut dyn Bench,
    watch: &Watch,
    ticks: &mut Vec<Sample>,
) -> Result<f64, Error> {
    let dt = bench.settings().tick_time();
    let model = bench.model();
    // A load at rest is shaken without control, since control would make it creep.
    let (control, torque) = match plan.operating() {
        Operating::Sliding(_) => (true, model.scaling.torque_per_volt * model.scaling.servo_limit),
        Operating::Stuck => (false, model.own.breakaway_torque),
    };
    let mut traveller = SpeedRamp::new(start, ACCELERATION, dt);
    let go = |setpoint: Setpoint<f64>| Command { setpoint, control, ..Command::default() };
    while traveller.setpoint.velocity != plan.velocity {
        bench.hand_over(go(traveller.toward(plan.velocity)))?;
    }
    soften(plan, bench)?;
    for _ in 0..(SETTLING / dt) as u64 {
        bench.hand_over(go(traveller.toward(plan.velocity)))?;
    }
    let collect = |ticks: &mut Vec<Sample>, frame: &Frame| {
        // The mark is the number of the evaluated period, from 1.
        let Some(period) = (frame.command.mark as usize).checked_sub(1) else { return };
        let signals = &frame.signals;
        let from = frame.angle - frame.command.setpoint.position;
        let sample = [signals.commanded_torque, from, signals.measured_motor_velocity];
        ticks.push(Sample { period, cycle: frame.cycle, sample });
    };
    let run_in = (RUN_IN / dt) as usize;
    for (number, wave) in waves {
        watch.check()?;
        let counts = *number as u32 + 1;
        // It is preceded by the end of the same wave.
        let before = (0..run_in).rev().map(|k| (wave[wave.len() - 1 - k % wave.len()], 0));
        for (value, mark) in before.chain(wave.iter().map(|value| (*value, counts))) {
            let added_torque = plan.share * torque * value;
            let command = Command { added_torque, mark, ..go(traveller.toward(plan.velocity)) };
            bench.hand_over(command)?.iter().for_each(|frame| collect(ticks, frame));
        }
    }
    bench.drain(&mut |frame| collect(ticks, frame))?;
    hold_speed(bench)?;
    while traveller.setpoint.velocity != 0.0 {
        bench.hand_over(go(traveller.toward(0.0)))?;
    }
    Ok(traveller.setpoint.position)
}

/// Holds the speed with the least stiffness required: the speed control hides the axis at low frequencies and turns the
/// tacho's noise into torque.
fn soften(plan: &ResponsePlan<f64>, bench: &mut dyn Bench) -> Result<(), Error> {
    let PositionController::Cascade(holder) = bench.parameters().tick.control.controller else { return Ok(()) };
    let rate = TAU * plan.lowest_frequency;
    let velocity_gain = holder.velocity_gain.min(rate * bench.model().drive.inertia());
    let soft = Cascade {
        velocity_gain,
        position_gain: holder.position_gain.min(0.25 * rate),
        integral_gain: holder.integral_gain.min(0.25 * rate * velocity_gain),
        ..holder
    };
    bench.set_controller(PositionController::Cascade(soft), 1)
}
