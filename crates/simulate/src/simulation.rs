//! The loop of a position controller closed over the virtual machine: set-points in, signals out.
//!
//! No homing and no commands; the true state is reported next to the measured signals. The controller is that of a
//! preset, or an external one that is called once for each sample.

use stickslip_core::block::Block as _;
use stickslip_core::control::reference::{Generator, Setpoint, Shaped};
use stickslip_core::tick::{EncoderReading, Order, Tick, TickOutput};

use crate::fast_bench::FastBench;
use crate::rendering_law;
use stickslip_base::preset::Preset;
use stickslip_base::table::Column;
use stickslip_base::{Error, Watch};
use stickslip_design::{load_current_control, software};

/// Longest run [s].
const LONGEST: f64 = 1e5;
/// Ticks between two checks for cancellation.
const LOOK: u64 = 2048;

/// A simulation.
#[derive(Clone, Copy, Debug)]
pub struct Simulation<'a> {
    /// Machine, model and settings.
    pub preset: &'a Preset<f64>,
    /// The set-points, before the shaper of the preset.
    pub setpoints: Generator<'a>,
    /// Duration [s].
    pub duration: f64,
    /// Time at rest at position 0 before it [s].
    pub rest: f64,
    /// Whether the load motor renders the desired friction.
    pub render: bool,
    /// Seed of the noise.
    pub seed: u64,
}

/// Inputs of a controller in a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time since the start of the run [s].
    pub time: f64,
    /// Set-point.
    pub reference: Setpoint<f64>,
    /// Measured angle of the screw, unwrapped [rad].
    pub measured_angle: f64,
    /// Velocity of the motor by the tacho [rad/s].
    pub measured_velocity: f64,
}

/// An external controller, from its inputs to the torque of the drive [N m]. Its torque acts a sample later, as that of
/// any controller, within the limit of the servo amplifier; NaN gives no torque.
pub type Controller<'a, E> = &'a mut dyn FnMut(&Sample) -> Result<f64, E>;

/// Result of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulated {
    /// Time and signals, one value for each sample of the position controller.
    pub columns: Vec<Column>,
    /// Reason of an early end, with the remedy: a fault of the supervision of a bench.
    pub stopped: Option<String>,
}

/// A signal: its name, its unit and where its value comes from.
struct Signal {
    name: &'static str,
    unit: &'static str,
    value: fn(&Moment) -> f64,
}

/// All values of a tick; the true ones are those at its start, when they are measured.
struct Moment<'a> {
    time: f64,
    order: Order<f64>,
    truth: stickslip_core::plant::MachineState<f64>,
    output: TickOutput<f64>,
    preset: &'a Preset<f64>,
}

const SIGNALS: [Signal; 15] = [
    Signal { name: "time", unit: "s", value: |m| m.time },
    Signal { name: "reference_position", unit: "rad", value: |m| m.order.reference.position },
    Signal { name: "reference_velocity", unit: "rad/s", value: |m| m.order.reference.velocity },
    Signal { name: "reference_acceleration", unit: "rad/s^2", value: |m| m.order.reference.acceleration },
    Signal { name: "measured_angle", unit: "rad", value: |m| m.output.measured_angle },
    Signal { name: "measured_motor_velocity", unit: "rad/s", value: |m| m.output.measured_motor_velocity },
    Signal { name: "estimated_velocity", unit: "rad/s", value: |m| m.output.estimated_velocity },
    Signal { name: "commanded_torque", unit: "N m", value: |m| m.output.commanded_torque },
    Signal { name: "difference_torque", unit: "N m", value: |m| m.output.difference_torque },
    Signal { name: "true_angle", unit: "rad", value: |m| m.truth.angle },
    Signal { name: "true_velocity", unit: "rad/s", value: |m| m.truth.velocity },
    Signal { name: "true_motor_velocity", unit: "rad/s", value: |m| m.truth.motor_velocity },
    Signal { name: "true_motor_torque", unit: "N m", value: |m| m.truth.motor_torque },
    Signal { name: "true_friction_torque", unit: "N m", value: |m| m.truth.load_resistance - m.truth.lost_torque },
    Signal {
        name: "true_load_torque",
        unit: "N m",
        value: |m| m.truth.load_current * m.preset.plant.load_motor.winding.torque_constant,
    },
];

/// Runs it, with the controller, compensation and hold of the preset, or with an external controller instead.
///
/// # Errors
/// [`Error::OutOfRange`] for an invalid duration; errors of the software's design and of the integrator;
/// [`Error::Cancelled`]; errors of the controller.
pub fn simulate<E: From<Error>>(
    simulation: &Simulation,
    mut controller: Option<Controller<E>>,
    watch: &Watch,
) -> Result<Simulated, E> {
    let Simulation { preset, setpoints, duration, rest, render, seed } = *simulation;
    check_time("duration of a simulation", duration)?;
    check_time("time at rest before it", rest)?;
    let settings = &preset.bench;
    let (dt, divider) = (settings.tick_time(), settings.divider());
    let mut tick = software(&preset.model, settings)?;
    if render {
        tick.law = rendering_law(&preset.model, settings)?;
        tick.current = load_current_control(&tick.law, &preset.model, settings)?;
    }
    let mut bench = FastBench::new(&preset.plant, tick, settings, divider, seed)?;
    let mut setpoints = Shaped::new(setpoints, settings.shaper.shaper(&preset.model.drive, settings.tick_rate));
    let in_samples = |time: f64| (time / settings.control_period()).round() as u64 * divider;
    let (rest, cycles) = (in_samples(rest), in_samples(rest) + in_samples(duration));
    let mut columns: Vec<Vec<f64>> = SIGNALS.iter().map(|_| Vec::with_capacity((cycles / divider) as usize)).collect();
    let mut delayed = DelayedTorque::default();
    let mut stopped = None;
    for cycle in 0..cycles {
        let time = cycle as f64 * dt;
        if cycle % LOOK == 0 {
            watch.stage("simulate", cycle as f64 / cycles as f64)?;
        }
        let mut order = Order { render: f64::from(u8::from(render)), ..Order::default() };
        if cycle >= rest {
            order.reference = setpoints.next();
        }
        match &mut controller {
            None => order.control = 1.0,
            Some(controller) => {
                let read = || controller(&sample(&tick, &bench, time, order.reference));
                order.added_torque = delayed.torque(cycle, divider, read)?;
            }
        }
        let truth = bench.true_state().plant.machine;
        stopped = beyond_limits(preset, time, order.reference.position - truth.angle, truth.velocity);
        if stopped.is_some() {
            break;
        }
        let output = bench.tick(order);
        if cycle.is_multiple_of(divider) {
            let moment = Moment { time, order, truth, output, preset };
            columns.iter_mut().zip(&SIGNALS).for_each(|(column, signal)| column.push((signal.value)(&moment)));
        }
    }
    let column =
        |(signal, values): (&Signal, Vec<f64>)| Column { name: signal.name.into(), unit: signal.unit.into(), values };
    Ok(Simulated { columns: SIGNALS.iter().zip(columns).map(column).collect(), stopped })
}

/// Torque of an external controller, delayed by one sample [N m].
#[derive(Debug, Default)]
pub struct DelayedTorque {
    /// Computed in the current sample.
    computed: f64,
    /// Active torque.
    commanded: f64,
}

impl DelayedTorque {
    /// Its torque in a tick of `divider` in a sample: computed at the start of a sample, active from its end on.
    pub fn torque<E>(&mut self, cycle: u64, divider: u64, compute: impl FnOnce() -> Result<f64, E>) -> Result<f64, E> {
        if cycle.is_multiple_of(divider) {
            self.computed = compute()?;
        }
        if cycle % divider == divider - 1 {
            self.commanded = self.computed;
        }
        Ok(self.commanded)
    }
}

/// Inputs of a controller at the start of a tick, as for the built-in controller.
pub fn sample(tick: &Tick<f64>, bench: &FastBench, time: f64, reference: Setpoint<f64>) -> Sample {
    let read = &bench.true_state().measurement;
    let reading = EncoderReading { count: read.count, index: read.index, latch: read.latch };
    // The tick will decode the same readings from the same state.
    let mut decoder = bench.true_state().tick.decoder;
    let measured_angle = tick.decoder.step(&mut decoder, reading, 0.0).angle;
    Sample { time, reference, measured_angle, measured_velocity: read.tacho_voltage / tick.scaling.tacho }
}

/// Fault of the supervision of a bench.
fn beyond_limits(preset: &Preset<f64>, time: f64, deviation: f64, velocity: f64) -> Option<String> {
    let safety = &preset.bench.safety;
    // Written so that a NaN is a fault.
    let (follows, slow) = (deviation.abs() <= safety.following_error, velocity.abs() <= safety.speed);
    let (fault, allowed) = match (follows, slow) {
        (true, true) => return None,
        (false, _) => (format!("was {deviation:.4} rad from its set-point"), format!("{} rad", safety.following_error)),
        (true, false) => (format!("turned at {velocity:.1} rad/s"), format!("{} rad/s", safety.speed)),
    };
    let path = if follows { "bench.safety.speed" } else { "bench.safety.following_error" };
    let remedy = "Reduce the demand, improve the control, or raise the limit";
    Some(format!("at {time:.4} s the screw {fault}; the limit is {allowed}. {remedy} ({path})"))
}

fn check_time(name: &'static str, value: f64) -> Result<(), Error> {
    if (0.0..=LONGEST).contains(&value) {
        return Ok(());
    }
    let remedy = "Give a time in seconds.";
    Err(Error::OutOfRange { name, value, unit: "s", minimum: 0.0, maximum: LONGEST, remedy })
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters::presets::find;
    use stickslip_core::control::reference::{Constant, Reference, Sine};
    use stickslip_core::control::{AxisControlInput, AxisControlState};

    fn prototype() -> Preset<f64> {
        find("prototype").unwrap().read().unwrap()
    }

    fn run<E: From<Error>>(
        preset: &Preset<f64>,
        reference: Reference<f64>,
        controller: Option<Controller<E>>,
    ) -> Result<Simulated, E> {
        let setpoints = Generator::new(reference, preset.bench.tick_rate);
        let simulation = Simulation { preset, setpoints, duration: 0.25, rest: 0.02, render: false, seed: 3 };
        simulate(&simulation, controller, &Watch::silent())
    }

    fn sine() -> Reference<f64> {
        Reference::Sine(Sine { amplitude: 1.0, frequency: 4.0, fade_time: 0.0 })
    }

    #[test]
    fn an_external_controller_acts_at_the_time_of_the_built_in_one() {
        for control_divider in [1.0, 4.0, 7.0] {
            let mut preset = prototype();
            preset.bench.control_divider = control_divider;
            let built_in = run::<Error>(&preset, sine(), None).unwrap();
            let control = stickslip_design::axis_control(&preset.model, &preset.bench).unwrap();
            let mut state = AxisControlState::default();
            let mut same = |sample: &Sample| {
                let Sample { reference, measured_angle, measured_velocity, .. } = *sample;
                let input = AxisControlInput { reference, measured_angle, measured_velocity };
                Ok::<_, Error>(control.step(&mut state, input, preset.bench.control_period()).torque)
            };
            let external = run(&preset, sine(), Some(&mut same)).unwrap();
            assert_eq!(external, built_in, "every {control_divider} ticks");
            let way = built_in.columns.iter().find(|column| column.name == "true_angle").unwrap();
            assert!(way.values.iter().any(|angle| angle.abs() > 0.5), "it moves");
        }
    }

    #[test]
    fn without_torque_or_with_nan_the_axis_does_not_move_and_the_limits_end_it() {
        let preset = prototype();
        let resting = Reference::Constant(Constant { position: 0.0 });
        let none = run(&preset, resting, Some(&mut |_| Ok::<_, Error>(0.0))).unwrap();
        let nan = run(&preset, resting, Some(&mut |_| Ok::<_, Error>(f64::NAN))).unwrap();
        assert_eq!(none, nan);
        assert_eq!(none.stopped, None);
        let far = Reference::Constant(Constant { position: 50.0 });
        let stopped = run(&preset, far, Some(&mut |_| Ok::<_, Error>(f64::NAN))).unwrap();
        assert_eq!(stopped.columns[0].values.len(), 20, "the time at rest");
        assert!(stopped.stopped.unwrap().contains("bench.safety.following_error"));
        let mut fast = preset;
        fast.bench.safety.speed = 0.5;
        fast.bench.fade_velocity = 0.3;
        let stopped = run::<Error>(&fast, sine(), None).unwrap().stopped.unwrap();
        assert!(stopped.contains("bench.safety.speed"), "{stopped}");
    }

    #[test]
    fn an_error_of_the_controller_ends_it() {
        #[derive(Debug, PartialEq)]
        struct Own(u64);
        impl From<Error> for Own {
            fn from(error: Error) -> Self {
                panic!("{error}")
            }
        }
        let mut calls = 0;
        let ended = run(
            &prototype(),
            sine(),
            Some(&mut |_| {
                calls += 1;
                if calls == 5 { Err(Own(calls)) } else { Ok(0.0) }
            }),
        );
        assert_eq!(ended, Err(Own(5)));
    }

    #[test]
    fn an_invalid_duration_is_refused() {
        let preset = prototype();
        for duration in [-1.0, f64::NAN, f64::INFINITY] {
            let setpoints = Generator::new(sine(), preset.bench.tick_rate);
            let simulation = Simulation { preset: &preset, setpoints, duration, rest: 0.0, render: false, seed: 1 };
            let refused = simulate::<Error>(&simulation, None, &Watch::silent());
            assert!(matches!(refused, Err(Error::OutOfRange { .. })), "{refused:?}");
        }
    }
}
