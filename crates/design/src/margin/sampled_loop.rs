//! The loop of a rendering law about a state at rest, with exact slopes.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, RowDVector};
use stickslip_core::block::Block as _;
use stickslip_core::control::{CurrentControl, CurrentControlInput, CurrentControlState, VelocityObserverState};
use stickslip_core::drive::LONGEST_DELAY;
use stickslip_core::estimate::{DriveObserver, DriveObserverInput, DriveObserverState, MotionEstimate, MotionObserver};
use stickslip_core::fields::Fields as _;
use stickslip_core::render::{ArmState, Law, LawInput, LawState, RenderedArm};
use stickslip_core::scalar::{Dual, Scalar};

use super::super::drive_observer::{CONVERTER_NOISE, modelled_drive};
use super::super::{load_current_control, motion_observer};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// Longest step of the modelled machine [s].
const STEP: f64 = 25e-6;
/// Number of stored voltages: the active one, and one for each tick of delay.
const WAITING: usize = 1 + LONGEST_DELAY + super::LARGEST_DELAY as usize;
/// Derivatives taken at once.
const WIDTH: usize = 6;
/// Noise of a usual current sensor [A].
const CURRENT_NOISE: f64 = 0.01;
/// Disturbances of the loop. The accelerometer's noise passes its low-pass, that of its converter does not.
const NOISES: [&str; 5] = [
    "counts of the encoder",
    "noise of the tacho",
    "noise of the accelerometer",
    "noise of the accelerometer's converter",
    "noise of the current sensor",
];

/// The modelled machine under a law; the position controller is far slower and left out.
#[derive(Clone, Copy)]
pub(super) struct SampledLoop<T> {
    /// Drive and pickups, without correction.
    machine: DriveObserver<T>,
    /// Steps of the machine in a tick.
    pub(super) steps: usize,
    observer: MotionObserver<T>,
    pub(super) law: Law<T>,
    pub(super) arm: RenderedArm<T>,
    current: CurrentControl<T>,
    /// Factor of the law's torque.
    pub(super) gain: T,
    /// Delay of the amplifier, in steps.
    delay: usize,
    /// Additional delay of the voltage, in steps.
    pub(super) late: usize,
    dt: T,
}

/// State of the loop.
#[derive(Clone, Copy)]
struct State<T: Scalar> {
    machine: DriveObserverState<T>,
    observer: VelocityObserverState<T>,
    law: LawState<T>,
    arm: ArmState<T>,
    current: CurrentControlState<T>,
    voltages: [T; WAITING],
}

impl<T: Scalar> State<T> {
    fn map<U: Scalar>(&self, convert: &mut dyn FnMut(T) -> U) -> State<U> {
        State {
            machine: self.machine.map(convert),
            observer: self.observer.map(convert),
            law: self.law.map(convert),
            arm: self.arm.map(convert),
            current: self.current.map(convert),
            voltages: self.voltages.map(convert),
        }
    }
}

impl SampledLoop<f64> {
    /// The loop without a rendered arm.
    pub(super) fn new(law: Law<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<Self, Error> {
        let dt = settings.tick_time();
        let steps = (dt / STEP - 1e-9).ceil().max(1.0) as usize;
        Ok(SampledLoop {
            machine: modelled_drive(&settings.model_with_amplifier(model), dt / steps as f64)?,
            steps,
            delay: (model.load_amplifier.delay / dt * steps as f64).round() as usize,
            observer: motion_observer(model, settings)?,
            law,
            arm: RenderedArm::Nothing,
            current: load_current_control(&law, model, settings)?,
            gain: 1.0,
            late: 0,
            dt,
        })
    }

    /// A step of the voltage's delay [s].
    pub(super) fn step(&self) -> f64 {
        self.dt / self.steps as f64
    }

    /// The loop for small deviations from rest. Converters and counts are left out: they have no slope.
    pub(super) fn linearised(&self, model: &Model<f64>) -> Linearised {
        let wide = SampledLoop::<Dual<WIDTH>> {
            machine: self.machine.map(&mut Dual::of),
            steps: self.steps,
            observer: self.observer.map(&mut Dual::of),
            law: self.law.map(&mut Dual::of),
            arm: self.arm.map(&mut Dual::of),
            current: self.current.map(&mut Dual::of),
            gain: Dual::of(self.gain),
            delay: self.delay,
            late: self.late,
            dt: Dual::of(self.dt),
        };
        let rest = at_rest();
        let mut states = 0;
        rest.map(&mut |value| {
            states += 1;
            value
        });
        let mut a = DMatrix::zeros(states, states + NOISES.len());
        for first in (0..states + NOISES.len()).step_by(WIDTH) {
            let mut index = 0;
            let mut seeded = |value: f64| {
                let slot = usize::wrapping_sub(index, first);
                index += 1;
                if slot < WIDTH { Dual::variable(value, slot) } else { Dual::of(value) }
            };
            let mut state = rest.map(&mut seeded);
            let noise = [0.0; NOISES.len()].map(&mut seeded);
            wide.tick(&mut state, noise);
            let mut row = 0;
            state.map(&mut |value| {
                for slot in 0..WIDTH.min(states + NOISES.len() - first) {
                    a[(row, first + slot)] = value.gradient[slot];
                }
                row += 1;
                value
            });
        }
        // The load current is located among the states by a marked value.
        let mut marked = at_rest();
        marked.machine.drive.load_current = f64::NAN;
        let mut torque = RowDVector::zeros(states);
        let mut index = 0;
        marked.map(&mut |value| {
            torque[index] = if value.is_nan() { self.current.torque_constant } else { 0.0 };
            index += 1;
            value
        });
        let noises = deviations(&self.law, model, 1.0 / self.dt);
        let b = DMatrix::from_fn(states, NOISES.len(), |i, j| a[(i, states + j)] * noises[j]);
        Linearised { a: a.columns(0, states).into(), b, torque }.relevant()
    }
}

/// A stuck load with undeflected bristles. At exactly zero velocity |Ω| has no slope.
fn at_rest() -> State<f64> {
    let creep = 1e-9;
    let mut machine = DriveObserverState { started: 1.0, ..DriveObserverState::default() };
    machine.drive.velocity = creep;
    machine.drive.motor_velocity = creep;
    let mut observer = VelocityObserverState::at(0.0);
    observer.velocity = creep;
    let law = LawState { observer: machine, virtual_velocity: creep, ..LawState::default() };
    let arm = ArmState { velocity: creep, started: 1.0, ..ArmState::default() };
    State { machine, observer, law, arm, current: CurrentControlState::default(), voltages: [0.0; WAITING] }
}

/// Standard deviations of the noises. A load at rest on the edge between two counts makes the encoder flicker by one
/// count, a variance of 1/4; a moving load has 1/12. A law that follows a position moves the load to an edge and holds
/// it there; the other laws have the mean of both.
fn deviations(law: &Law<f64>, model: &Model<f64>, rate: f64) -> [f64; NOISES.len()] {
    let scaling = &model.scaling;
    let counts = if matches!(law, Law::Admittance(_)) { 1.0 / 4.0 } else { 1.0 / 6.0 };
    [
        libm::sqrt(counts) * TAU / model.encoder.counts_per_revolution,
        libm::hypot(model.tacho_noise, CONVERTER_NOISE) / scaling.tacho,
        model.accelerometer_noise * libm::sqrt(0.5 * rate),
        CONVERTER_NOISE / scaling.accelerometer,
        libm::hypot(CURRENT_NOISE, CONVERTER_NOISE / scaling.current_sensor),
    ]
}

impl<T: Scalar> SampledLoop<T> {
    /// One tick, in the order of [`Tick`](stickslip_core::tick::Tick): the software on the readings at its start, while
    /// the machine runs under the outputs written before.
    fn tick(&self, state: &mut State<T>, noise: [T; NOISES.len()]) {
        let [angle, tacho, felt, acceleration, current] = noise;
        let zero = T::of(0.0);
        let (dt, machine) = (self.dt, &state.machine);
        let acceleration = machine.acceleration + acceleration;
        let angle = machine.drive.angle + angle;
        let current = machine.drive.load_current + current;
        let seen = DriveObserverInput {
            angle,
            motor_velocity: machine.tacho + tacho,
            acceleration,
            current,
            motor_torque: zero,
            voltage: state.law.voltage,
            estimated_velocity: zero,
        };
        let states = (&mut state.observer, &mut state.law.observer);
        let MotionEstimate { screw: observed, motor_velocity } =
            self.observer.observe(states, self.law.follows(), seen, dt);
        let felt_by_law = LawInput {
            estimated_velocity: observed.velocity,
            angle,
            motor_velocity,
            acceleration,
            current,
            motor_torque: zero,
        };
        let demand_of_law = self.law.render(&mut state.law, felt_by_law, dt);
        let mut torque = demand_of_law.torque;
        if let RenderedArm::Elastic(arm) = &self.arm {
            torque += arm.run(&mut state.arm, observed, dt).torque;
        }
        let torque = self.gain * torque;
        let demand = CurrentControlInput {
            reference_current: torque / self.current.torque_constant,
            measured_current: demand_of_law.current,
            estimated_velocity: demand_of_law.velocity,
        };
        let voltage = self.current.run(&mut state.current, demand, dt).voltage;
        state.law.voltage = voltage;
        state.law.torque = torque;

        let step = dt / T::of(self.steps as f64);
        let shares = self.machine.accelerometer.flow;
        for k in 0..self.steps {
            // The newest of the stored voltages is due now; a delayed one later.
            let due = (self.delay + self.late + self.steps - 1 - k) / self.steps;
            let input = DriveObserverInput { voltage: state.voltages[due], ..DriveObserverInput::default() };
            self.machine.follow(&mut state.machine, &input, step, |_, _| {});
            state.machine.acceleration += shares[0][2] * felt;
            state.machine.acceleration_rate += shares[1][2] * felt;
        }
        for k in (1..WAITING).rev() {
            state.voltages[k] = state.voltages[k - 1];
        }
        state.voltages[0] = voltage;
    }
}

/// x⁺ = A·x + B·w with white w of variance 1; torque of the load motor [N m] of x.
pub(super) struct Linearised {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    torque: RowDVector<f64>,
}

/// Effect of the noises on the load torque.
pub(super) struct Chatter {
    /// Variance of its change, by each of [`NOISES`] [(N m)²].
    pub(super) variances: [f64; NOISES.len()],
    /// Whether it is still growing, other than by accumulated noise.
    pub(super) grows: bool,
}

impl Linearised {
    /// The part that the noises reach and that has an effect on the torque: most states belong to other laws and
    /// frictions. Their zeros would only take time.
    fn relevant(&self) -> Self {
        let grown = |mut found: Vec<bool>, leads: &dyn Fn(usize, usize) -> bool| {
            let mut fresh: Vec<usize> = (0..found.len()).filter(|&state| found[state]).collect();
            while let Some(from) = fresh.pop() {
                for to in 0..found.len() {
                    if !found[to] && leads(from, to) {
                        found[to] = true;
                        fresh.push(to);
                    }
                }
            }
            found
        };
        let excited = self.b.row_iter().map(|row| row.iter().any(|share| *share != 0.0)).collect();
        let reached = grown(excited, &|from, to| self.a[(to, from)] != 0.0);
        let shown = self.torque.iter().map(|share| *share != 0.0).collect();
        let effective = grown(shown, &|from, to| self.a[(from, to)] != 0.0);
        let kept: Vec<usize> = (0..reached.len()).filter(|&state| reached[state] && effective[state]).collect();
        Linearised {
            a: self.a.select_rows(&kept).select_columns(&kept),
            b: self.b.select_rows(&kept),
            torque: self.torque.select_columns(&kept),
        }
    }

    /// Change of the load torque over `ticks`, after 2ᵏ ticks for k `doublings`. An unstable loop has grown until then.
    pub(super) fn chatter(&self, doublings: usize, ticks: usize) -> Chatter {
        // Input within the ticks, and free response of the state.
        let mut variances = [0.0; NOISES.len()];
        let mut ahead = self.torque.clone();
        for _ in 0..ticks {
            let direct = &ahead * &self.b;
            (0..NOISES.len()).for_each(|j| variances[j] += direct[j] * direct[j]);
            ahead *= &self.a;
        }
        let change = ahead - &self.torque;
        // ∑ (Aᵀ)ᵏ·hᵀh·Aᵏ, the sum doubled with each power squared.
        let (mut power, mut sum) = (self.a.clone(), change.transpose() * &change);
        let mut grows = false;
        for _ in 0..doublings {
            let more = power.transpose() * &sum * &power;
            // Accumulated noise doubles the variance in twice the time.
            let (new, old) = (self.of(&more), self.of(&sum));
            let [new, old]: [f64; 2] = [new, old].map(|variances| variances.iter().sum());
            grows = new > 4.0 * old || !new.is_finite();
            sum += more;
            power = &power * &power;
        }
        let own = self.of(&sum);
        (0..NOISES.len()).for_each(|j| variances[j] += own[j]);
        Chatter { variances, grows }
    }

    /// bᵀ·S·b for each noise.
    fn of(&self, sum: &DMatrix<f64>) -> [f64; NOISES.len()] {
        std::array::from_fn(|j| (self.b.column(j).transpose() * sum * self.b.column(j))[0])
    }
}

impl Chatter {
    /// Root mean square of the change [N m]; infinite after an overflow.
    pub(super) fn rms(&self) -> f64 {
        let variance: f64 = self.variances.iter().sum();
        if variance.is_finite() { libm::sqrt(variance) } else { f64::INFINITY }
    }

    /// Its main cause.
    pub(super) fn cause(&self) -> &'static str {
        if self.grows {
            return "growing oscillation";
        }
        let most = (0..NOISES.len()).max_by(|&i, &j| self.variances[i].total_cmp(&self.variances[j]));
        NOISES[most.unwrap_or(0)]
    }
}
