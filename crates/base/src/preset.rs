//! Contents of a preset file: the virtual machine, the controller's model of it, and the settings of the bench.

mod amplifier;
mod compensation;
mod controller;

use crate::stability::check_step;
pub use amplifier::delay;
pub use compensation::{
    AdaptiveChoice, AssumedFriction, CompensationChoice, CurveChoice, DisturbanceObserverChoice, FeedforwardChoice,
    FrictionObserverChoice, FriedlandParkChoice, NetworkChoice,
};
pub use controller::{
    ArmDamping, ControllerChoice, ControllerMatrices, DampedArm, Disturbances, FilterChoice, NotchChoice, Observation,
    Poles, PredictiveFeedback, Quadratic, Regulation, ShaperChoice, StateFeedback, Vibration,
};
use stickslip_core::Fields;
use stickslip_core::control::compensation::Hold;
use stickslip_core::drive::{Arm, LoadAmplifier, TwoMass, Winding};
use stickslip_core::fields::{ParameterError, at_least, at_most};
use stickslip_core::friction::{Bristles, Friction, Stribeck};
use stickslip_core::plant::Plant;
use stickslip_core::scalar::Scalar;
use stickslip_core::tick::{Decoder, Scaling};
use stickslip_software::supervise::{HomingPlan, SafetyLimits};

/// A complete parameter set. The virtual machine and the controller's model are separate: controller, observer, law and
/// experiments use only `model`.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(check = Preset::check)]
pub struct Preset<T> {
    /// The virtual machine, with its deviations from the model and its faults.
    pub plant: Plant<T>,
    /// Model of the machine that controller, observer, law and experiments use. It starts as the data sheet and is
    /// changed only by measurements.
    pub model: Model<T>,
    /// Settings of the bench.
    pub bench: Settings<T>,
}

/// The controller's model of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Model<T> {
    /// Masses, coupling and screw.
    pub drive: TwoMass<T>,
    /// The drive motor.
    pub motor: Winding<T>,
    /// The load motor.
    pub load_motor: Winding<T>,
    /// Amplifier of the load motor.
    pub load_amplifier: LoadAmplifier<T>,
    /// Scaling of instruments and servo amplifier.
    pub scaling: Scaling<T>,
    /// Counts of the encoder.
    pub encoder: Decoder<T>,
    /// Lag of servo amplifier and tacho together. It limits the gain of a velocity loop.
    #[field(symbol = "τ", unit = "s", range = 0.0..=0.1, default = 0.85e-3)]
    pub drive_lag: T,
    /// Lag of the servo amplifier alone. The difference to `drive_lag` is the lag of the tacho.
    #[field(symbol = "τ_s", unit = "s", range = 2e-5..=2e-2, default = 0.32e-3)]
    pub servo_lag: T,
    /// Delay between command and torque of the drive motor, without the software's tick. At most 8 ticks.
    #[field(symbol = "T_t", unit = "s", range = 0.0..=20e-3)]
    pub servo_delay: T,
    /// Noise of the tacho at the converter, RMS.
    #[field(symbol = "σ_u", unit = "V", range = 0.0..=1.0, default = 3e-3)]
    pub tacho_noise: T,
    /// Commutator ripple of the tacho, as a share of its voltage.
    #[field(symbol = "r_T", unit = "1", range = 0.0..=0.5, default = 0.01)]
    pub tacho_ripple: T,
    /// Noise density of the accelerometer, one-sided.
    #[field(symbol = "S_n", unit = "m/s^2/√Hz", range = 0.0..=1.0, default = 2.207e-3)]
    pub accelerometer_noise: T,
    /// Natural frequency of the accelerometer, second order.
    #[field(symbol = "f_0", unit = "Hz", range = 10.0..=1e5, default = 1000.0)]
    pub accelerometer_bandwidth: T,
    /// Damping ratio of the accelerometer.
    #[field(symbol = "ζ", unit = "1", range = 0.05..=2.0, default = 0.7)]
    pub accelerometer_damping: T,
    /// Friction of the drive motor's brushes and bearings: entered, or measured with the coupling open. It is
    /// subtracted from the measured friction, because it is not part of the load.
    pub motor_friction: Friction<T>,
    /// Friction on the load side, friction wheel included, as last measured.
    pub own: Stribeck<T>,
    /// Bristles of this friction, from a presliding measurement; for the laws that render presliding.
    pub own_bristles: Bristles<T>,
    /// Uncertainty of the model.
    pub doubt: ModelUncertainty<T>,
}

/// Relative errors of the model that the automatically chosen law must tolerate. The defaults are the errors after a
/// careful identification; a calibration of the bench replaces them by its results.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ModelUncertainty<T> {
    /// Error of the torque of the drive per torque of the load motor, as a share.
    #[field(unit = "1", range = 0.0..=0.5, default = 4e-3)]
    pub drive_torque: T,
    /// Error of the load inertia, as a share.
    #[field(unit = "1", range = 0.0..=0.5, default = 2e-3)]
    pub load_inertia: T,
    /// Error of the stiffness of the coupling, as a share. A law with high bandwidth tolerates only a small error.
    #[field(unit = "1", range = 0.0..=0.5, default = 2e-3)]
    pub coupling_stiffness: T,
    /// Error of breakaway and kinetic torque of the own friction, as a share.
    #[field(unit = "1", range = 0.0..=0.5, default = 0.04)]
    pub friction: T,
    /// Ripple of the own friction over a turn of the screw, as a share. It is not part of the characteristic.
    #[field(unit = "1", range = 0.0..=0.5, default = 0.04)]
    pub ripple: T,
    /// Error of the stiffness of the own bristles, as a share.
    #[field(unit = "1", range = 0.0..=0.9, default = 0.25)]
    pub bristle_stiffness: T,
}

/// Settings of the bench.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Settings<T> {
    /// Rate of sensors, observer, rendering law and load-motor current control.
    #[field(symbol = "f_tick", unit = "Hz", range = 500.0..=20_000.0, default = 4000.0)]
    pub tick_rate: T,
    /// Ticks per sample of the position controller. 0: as many as give 1 kHz, at least 1.
    #[field(symbol = "n_c", unit = "1", range = 0.0..=1000.0, whole)]
    pub control_divider: T,
    /// Longest step of the virtual machine. A tick has a whole number of equal steps.
    #[field(symbol = "h", unit = "s", range = 1e-7..=25e-6, default = 25e-6)]
    pub plant_step: T,
    /// Source of the estimated velocities besides the encoder.
    pub observer: ObserverChoice<T>,
    /// Decay rates of the observer with accelerometer, three real poles.
    #[field(symbol = "p", unit = "1/s", range = 1.0..=2000.0, default = 250.0)]
    pub observer_poles: [T; 3],
    /// The position controller.
    pub controller: ControllerChoice<T>,
    /// Filter of the controller's torque.
    pub filter: FilterChoice<T>,
    /// Shaper of the set-point.
    pub shaper: ShaperChoice<T>,
    /// Compensation of friction, in addition to the controller.
    pub compensation: CompensationChoice<T>,
    /// Hold at standstill against stiction.
    pub hold: Hold<T>,
    /// Desired characteristic, which is rendered.
    pub desired: Stribeck<T>,
    /// Bristles of the desired friction, for the laws that render presliding.
    pub desired_bristles: Bristles<T>,
    /// The rendering law.
    pub law: LawChoice<T>,
    /// Elastic arm that is rendered in addition to friction; the carriage does not carry it.
    pub arm: Arm<T>,
    /// Whether the load motor's amplifier takes a torque and has its own current control, as a servo drive on a fieldbus;
    /// otherwise it takes a voltage.
    #[field(unit = "1", flag)]
    pub torque_amplifier: T,
    /// Half width of the fade-out interval of the paper's law.
    #[field(symbol = "Ω_fade", unit = "rad/s", range = 0.0..=10.0, default = 0.3)]
    pub fade_velocity: T,
    /// Limits at which the bench stops.
    pub safety: SafetyLimits<T>,
    /// Search for the index pulse.
    pub homing: HomingPlan<T>,
}

/// Observer of the velocities of screw and motor.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum ObserverChoice<T> {
    /// Encoder, accelerometer and tacho; no model of the drive.
    Accelerometer,
    /// Encoder, torques of both motors and the model of the drive, for a bench without accelerometer and tacho.
    Model(DriveModelTrust<T>),
}

/// Trust of the observer in the model of the drive.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveModelTrust<T> {
    /// Rate at which the torque that is missing in the model may change. A larger value follows friction that differs
    /// from the model, a smaller one passes less noise of the encoder.
    #[field(symbol = "q_r", unit = "N m √Hz", range = 1e-5..=10.0, default = 0.1)]
    pub missing_torque: T,
}

/// Law that renders the difference of desired and own friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum LawChoice<T> {
    /// Law of the paper: static difference, sign of the estimated velocity, fade-out around standstill.
    Paper,
    /// The same with a smooth sign instead of the fade-out.
    Smooth,
    /// Karnopp's: within a band around standstill the load motor balances the torque of the drive.
    Karnopp,
    /// Desired less own friction, both with bristles, on an observer that contains the drive and its friction.
    Bristle,
    /// The same with an estimate of the friction that is missing in the model, as one torque.
    Residual(Residual<T>),
    /// A virtual load with the desired friction; the load motor makes the load follow it.
    Admittance(Tracking<T>),
    /// The law with the best result in a simulation of the model, with its parameters varied by their uncertainty.
    Auto,
}

/// Estimate of the torque that is missing in the model.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Residual<T> {
    /// Rate at which the missing torque may change. A larger value follows friction that differs from the model, a
    /// smaller one passes less noise.
    #[field(symbol = "q_r", unit = "N m √Hz", range = 1e-5..=10.0, default = 0.03)]
    pub missing_torque: T,
}

/// Tracking of the virtual load.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Tracking<T> {
    /// Bandwidth of the tracking, critically damped.
    #[field(symbol = "ω_t", unit = "rad/s", range = 1.0..=1000.0, default = 350.0)]
    pub bandwidth: T,
    /// Rate at which the torque that is missing in the model may change. A larger value follows friction that differs
    /// from the model, a smaller one passes less noise.
    #[field(symbol = "q_r", unit = "N m √Hz", range = 1e-5..=10.0, default = 0.1)]
    pub missing_torque: T,
}

impl<T: Scalar> Settings<T> {
    /// Time of a tick [s].
    pub fn tick_time(&self) -> T {
        T::of(1.0) / self.tick_rate
    }
}

impl Settings<f64> {
    /// Ticks per sample of the position controller.
    pub fn divider(&self) -> u64 {
        if self.control_divider > 0.0 {
            self.control_divider as u64
        } else {
            (self.tick_rate / 1000.0).round().max(1.0) as u64
        }
    }

    /// Sampling time of the position controller [s].
    pub fn control_period(&self) -> f64 {
        self.tick_time() * self.divider() as f64
    }

    /// Steps of the virtual machine in a tick, and the length of one [s].
    pub fn plant_steps(&self) -> (usize, f64) {
        // A small deviation from a whole number is a rounding error, not another step.
        let steps = (self.tick_time() / self.plant_step - 1e-9).ceil().max(1.0);
        (steps as usize, self.tick_time() / steps)
    }
}

impl Preset<f64> {
    /// Whether this law and this arm can be combined: a virtual load has no arm, and the load follows it.
    pub fn bears_arm(law: &LawChoice<f64>, arm: &Arm<f64>) -> bool {
        !matches!((law, arm), (LawChoice::Admittance(_), Arm::Elastic(_)))
    }

    /// The step must be stable for the virtual machine, and resolve the jitter of the ticks.
    fn check(&self) -> Result<(), ParameterError> {
        let step = self.bench.plant_steps().1;
        check_step(&self.plant, step).map_err(|error| ParameterError { field: "bench.plant_step", ..error })?;
        self.check_delays()?;
        let jitter = self.plant.tick_jitter;
        if jitter > 0.0 {
            let remedy = "Jitter is a number of whole steps of the virtual machine: choose a step that is not longer \
            than the jitter.";
            at_most("bench.plant_step", step, jitter, remedy).check()?;
            let remedy = "The jitter must be far below the tick: reduce it, or reduce bench.tick_rate.";
            at_most("plant.tick_jitter", jitter, self.bench.tick_time() / 8.0, remedy).check()?;
        }
        let observed = matches!(self.bench.compensation, CompensationChoice::DisturbanceObserver(_));
        if let (Some(feedback), true) = (self.bench.controller.feedback(), observed) {
            let remedy = "The disturbance observer compensates the load, too: choose one of the two.";
            let name = match self.bench.controller {
                ControllerChoice::Predictive(_) => "bench.controller.feedback.compensates_load",
                _ => "bench.controller.compensates_load",
            };
            at_most(name, feedback.compensates_load, 0.0, remedy).check()?;
        }
        if let (Some(_), FilterChoice::Notch(notch)) = (self.bench.controller.feedback(), self.bench.filter) {
            let remedy = "State feedback damps the coupling and requires the unfiltered torque: choose one of the two.";
            at_most("bench.filter.width", notch.width, 0.0, remedy).check()?;
        }
        if let ControllerChoice::Linear(matrices) = self.bench.controller {
            let remedy = "Matrices are for one sampling time: compute them for that of the bench (bench.tick_rate, \
            bench.control_divider), or change the bench.";
            let (own, period) = (matrices.sampling_time, self.bench.control_period());
            at_most("bench.controller.sampling_time", own, period * (1.0 + 1e-9), remedy).check()?;
            at_least("bench.controller.sampling_time", own, period * (1.0 - 1e-9), remedy).check()?;
        }
        if let (Arm::Elastic(arm), false) = (self.bench.arm, Self::bears_arm(&self.bench.law, &self.bench.arm)) {
            let remedy = "The admittance law follows a virtual load without the arm: choose another law \
            (bench.law.kind), or no arm (bench.arm.kind = \"nothing\").";
            at_most("bench.arm.inertia", arm.inertia, 0.0, remedy).check()?;
        }
        if let FilterChoice::Notch(notch) = self.bench.filter {
            let frequency = notch.angular_frequency(&self.model.drive) / std::f64::consts::TAU;
            let remedy = "A notch requires more than two samples per period: increase the control rate, or reduce the \
            frequency.";
            at_most("bench.filter.frequency", frequency, 0.45 / self.bench.control_period(), remedy).check()?;
        }
        at_most(
            "bench.fade_velocity",
            self.bench.fade_velocity,
            self.bench.safety.speed,
            "The fade-out interval must be within the speed limit of the bench.",
        )
        .check()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_cannot_be_compensated_twice() {
        let mut preset = Preset::<f64>::default();
        let feedback = StateFeedback { compensates_load: 1.0, ..StateFeedback::default() };
        preset.bench.controller = ControllerChoice::StateFeedback(feedback);
        assert_eq!(preset.check(), Ok(()));
        preset.bench.compensation = CompensationChoice::DisturbanceObserver(DisturbanceObserverChoice::default());
        assert_eq!(preset.check().unwrap_err().field, "bench.controller.compensates_load");
        preset.bench.controller = ControllerChoice::StateFeedback(StateFeedback::default());
        assert_eq!(preset.check(), Ok(()));
    }

    #[test]
    fn matrices_for_another_sampling_time_are_refused() {
        let with = |sampling_time: f64| {
            let mut preset = Preset::<f64>::default();
            preset.bench.controller =
                ControllerChoice::Linear(ControllerMatrices { sampling_time, ..ControllerMatrices::default() });
            preset.check().map_err(|error| error.field)
        };
        assert_eq!(with(1e-3), Ok(()));
        assert_eq!([0.5e-3, 1.001e-3].map(with), [Err("bench.controller.sampling_time"); 2]);
    }

    #[test]
    fn a_notch_above_its_sampling_limit_or_with_state_feedback_is_refused() {
        let with = |frequency: f64, controller: ControllerChoice<f64>| {
            let mut preset = Preset::<f64>::default();
            preset.bench.filter = FilterChoice::Notch(NotchChoice { frequency, ..NotchChoice::default() });
            preset.bench.controller = controller;
            preset.check().map_err(|error| error.field)
        };
        let cascade = Preset::<f64>::default().bench.controller;
        assert_eq!(with(0.0, cascade), Ok(()));
        assert_eq!(with(460.0, cascade), Err("bench.filter.frequency"));
        let state_feedback = ControllerChoice::StateFeedback(StateFeedback::default());
        assert_eq!(with(100.0, state_feedback), Err("bench.filter.width"));
    }

    #[test]
    fn a_jitter_below_the_step_or_too_large_for_the_tick_is_refused() {
        let with = |jitter: f64, step: f64| {
            let mut preset = Preset::<f64>::default();
            preset.plant.tick_jitter = jitter;
            preset.bench.plant_step = step;
            preset.check().map_err(|error| error.field)
        };
        // The default tick of 250 µs.
        assert_eq!(with(0.0, 25e-6), Ok(()));
        assert_eq!(with(10e-6, 10e-6), Ok(()));
        assert_eq!(with(10e-6, 25e-6), Err("bench.plant_step"));
        assert_eq!(with(40e-6, 25e-6), Err("plant.tick_jitter"));
    }
}
