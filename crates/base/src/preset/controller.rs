//! Parameters of the position controller; `design::position_controller` prepares it.

use std::f64::consts::TAU;

use stickslip_core::Fields;
use stickslip_core::control::reference::Shaper;
use stickslip_core::control::{Cascade, INPUTS, Pid, STATES};
use stickslip_core::drive::{Arm, ElasticArm, TwoMass};

/// The controller under test.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum ControllerChoice<T> {
    /// P control of the position around PI control of the velocity, as in servo drives.
    Cascade(Cascade<T>),
    /// One PID controller of the position.
    Pid(Pid<T>),
    /// Feedback of all states of the drive, which an observer estimates. It damps the coupling actively. The defaults
    /// are tuned for `clm-bench` with its control at 1 kHz.
    StateFeedback(StateFeedback<T>),
    /// State feedback that predicts and keeps the limits of torque, torque rate and velocity.
    Predictive(PredictiveFeedback<T>),
    /// A custom controller by matrices from another tool.
    Linear(ControllerMatrices<T>),
}

/// A linear controller by its matrices, for one sampling time:
///
///   x⁺ = A·x + B·v,   M = C·x + D·v + I,   İ = K_i·(r − φ),   v = (φ − r, ω, Δr, ṙ, r̈, M₋, M_c₋, M_c)
///
/// φ and ω are measured by encoder and tacho, r is the set-point and Δr its change since the previous sample; M₋ is the
/// controller's limited torque that is active until the next sample, M_c₋ the torque of friction compensation added to
/// it, and M_c that added to the computed torque. Unused rows and columns are 0.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ControllerMatrices<T> {
    /// System matrix: one row per state.
    #[field(symbol = "A", unit = "1", range = -1e15..=1e15)]
    pub system: [[T; STATES]; STATES],
    /// Input matrix: one row per state, one column per input.
    #[field(symbol = "B", unit = "1", range = -1e15..=1e15)]
    pub input: [[T; INPUTS]; STATES],
    /// Output matrix, from the states to the torque.
    #[field(symbol = "C", unit = "1", range = -1e15..=1e15)]
    pub output: [T; STATES],
    /// Feedthrough, from the inputs to the torque.
    #[field(symbol = "D", unit = "1", range = -1e15..=1e15)]
    pub direct: [T; INPUTS],
    /// Torque per deviation of the position and time. At the torque limit the integral only moves back.
    #[field(symbol = "K_i", unit = "N m/(rad s)", range = 0.0..=1e8)]
    pub integral_gain: T,
    /// Sampling time of the matrices. It must be that of the bench.
    #[field(symbol = "T", unit = "s", range = 1e-6..=1.0, default = 1e-3)]
    pub sampling_time: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// Filter of the controller's torque.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum FilterChoice<T> {
    /// No filter.
    Nothing,
    /// A notch: around its frequency the loop gain is small, below it the phase margin is reduced.
    Notch(NotchChoice<T>),
}

/// A notch: (s² + 2·ζ_n·ω·s + ω²)/(s² + 2·ζ_d·ω·s + ω²).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NotchChoice<T> {
    /// Frequency; 0 is that of the coupling between motor and load, from the model.
    #[field(symbol = "f_n", unit = "Hz", range = 0.0..=5000.0)]
    pub frequency: T,
    /// Damping ratio of the zeros: 0 is full attenuation.
    #[field(symbol = "ζ_n", unit = "1", range = 0.0..=1.0, default = 0.05)]
    pub depth: T,
    /// Damping ratio of the poles: a larger value is wider.
    #[field(symbol = "ζ_d", unit = "1", range = 0.01..=1.0, default = 0.5)]
    pub width: T,
}

/// Input shaper that avoids vibration after a motion. The controller gets the shaped set-point.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum ShaperChoice<T> {
    /// No shaping.
    Nothing,
    /// Two impulses half a period apart (ZV): a motion takes half a period longer.
    ZeroVibration(Vibration<T>),
    /// Three impulses (ZVD): a motion takes a period longer; tolerates a frequency error of a few percent.
    Robust(Vibration<T>),
}

/// Vibration after a motion.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Vibration<T> {
    /// Frequency; 0 is that of the coupling between motor and load, from the model.
    #[field(symbol = "f_v", unit = "Hz", range = 0.0..=5000.0)]
    pub frequency: T,
    /// Damping ratio.
    #[field(symbol = "ζ_v", unit = "1", range = 0.0..=0.9, default = 0.02)]
    pub damping: T,
}

/// State feedback designed on the modelled drive: desired dynamics, sensors and disturbances.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct StateFeedback<T> {
    /// Design of the gains.
    pub regulator: Regulation<T>,
    /// Estimator of the states.
    pub observer: Observation<T>,
    /// Elastic arm on the carriage, carried or rendered, whose vibration is damped, too.
    pub arm: DampedArm<T>,
    /// Whether the estimated load torque is compensated instead of an integral of the deviation.
    #[field(unit = "1", flag)]
    pub compensates_load: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State feedback within limits: its torque is the admissible one nearest to that of the state feedback alone.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PredictiveFeedback<T> {
    /// State feedback without active limits.
    pub feedback: StateFeedback<T>,
    /// Largest rate of the torque.
    #[field(symbol = "dM_max", unit = "N m/s", range = 1e-3..=1e9, default = 1e4)]
    pub torque_rate_limit: T,
    /// Largest velocity of the load.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-3..=1e6, default = 100.0)]
    pub speed_limit: T,
}

/// Elastic arm in the model of a state feedback.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum DampedArm<T> {
    /// No arm: it is only a load.
    Nothing,
    /// A separate observer, driven by the observed motion of the carriage: nothing is measured at the arm, and the
    /// observer of the drive does not contain it.
    Elastic(ArmDamping<T>),
}

/// Modelled arm and weight of its twist.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ArmDamping<T> {
    /// The modelled arm.
    pub believed: ElasticArm<T>,
    /// Twist of the arm that is weighted as the full torque; only with LQR.
    #[field(symbol = "q_t", unit = "rad", range = 1e-6..=1e3, default = 0.05)]
    pub twist: T,
}

/// Design of the gains of a state feedback.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Regulation<T> {
    /// Least sum of squares (LQR): each deviation below is weighted as the full torque.
    Quadratic(Quadratic<T>),
    /// Placement of the poles of the controlled drive.
    Poles(Poles<T>),
}

/// Weights of the deviations: a smaller value gives stronger control.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Quadratic<T> {
    /// Deviation of the angle that is weighted as the full torque.
    #[field(symbol = "φ_t", unit = "rad", range = 1e-6..=1e3, default = 0.16)]
    pub angle: T,
    /// Deviation of the velocity that is weighted as the full torque.
    #[field(symbol = "Ω_t", unit = "rad/s", range = 1e-4..=1e6, default = 600.0)]
    pub velocity: T,
    /// Velocity of the motor relative to the load (vibration) that is weighted as the full torque.
    #[field(symbol = "Ω_v", unit = "rad/s", range = 1e-4..=1e6, default = 18.0)]
    pub vibration: T,
    /// Time after which the integral of a deviation has the weight of the deviation.
    #[field(symbol = "T_i", unit = "s", range = 1e-4..=100.0, default = 0.0065)]
    pub integral_time: T,
}

/// Desired poles of the controlled drive.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Poles<T> {
    /// Natural frequency of drive and load together.
    #[field(symbol = "ω_0", unit = "rad/s", range = 0.1..=1e4, default = 60.0)]
    pub bandwidth: T,
    /// Damping ratio.
    #[field(symbol = "ζ", unit = "1", range = 0.1..=2.0, default = 0.8)]
    pub damping: T,
    /// Damping ratio of the vibration of motor against load, at its natural frequency.
    #[field(symbol = "ζ_v", unit = "1", range = 1e-3..=2.0, default = 0.3)]
    pub vibration_damping: T,
    /// Rate at which the integral compensates a load.
    #[field(symbol = "ω_i", unit = "1/s", range = 0.1..=1e4, default = 30.0)]
    pub integral_rate: T,
}

/// Estimator of the states of the drive.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Observation<T> {
    /// A Kalman filter on encoder and tacho.
    Full(Disturbances<T>),
    /// The same with the encoder's angle used directly.
    Reduced(Disturbances<T>),
    /// The encoder alone, without a measurement at the motor.
    LoadSide(Disturbances<T>),
    /// Motion and vibration by the tacho alone, the angle by the encoder: two independent observers.
    MotorSide(Disturbances<T>),
}

/// Disturbances of the drive in the model of an observer.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Disturbances<T> {
    /// Rate at which the unknown load torque may change. A larger value follows it faster, a smaller one passes less
    /// noise.
    #[field(symbol = "q_L", unit = "N m √Hz", range = 1e-6..=1e4, default = 6.0)]
    pub load_torque: T,
    /// Torque noise of the drive motor. A larger value gives less weight to the model of the drive.
    #[field(symbol = "q_M", unit = "N m/√Hz", range = 1e-9..=1e3, default = 0.02)]
    pub motor_torque: T,
}

impl ControllerChoice<f64> {
    /// Largest torque of the drive [N m].
    pub fn torque_limit(&self) -> f64 {
        match self {
            ControllerChoice::Cascade(it) => it.torque_limit,
            ControllerChoice::Pid(it) => it.torque_limit,
            ControllerChoice::StateFeedback(it) => it.torque_limit,
            ControllerChoice::Predictive(it) => it.feedback.torque_limit,
            ControllerChoice::Linear(it) => it.torque_limit,
        }
    }
}

impl<T> ControllerChoice<T> {
    /// Its state feedback, if it has one.
    pub fn feedback(&self) -> Option<&StateFeedback<T>> {
        match self {
            ControllerChoice::StateFeedback(it) => Some(it),
            ControllerChoice::Predictive(it) => Some(&it.feedback),
            _ => None,
        }
    }
}

impl ControllerChoice<f64> {
    /// The arm in its model.
    pub fn arm(&self) -> Arm<f64> {
        match self.feedback().map(|feedback| &feedback.arm) {
            Some(DampedArm::Elastic(it)) => Arm::Elastic(it.believed),
            _ => Arm::Nothing,
        }
    }
}

impl NotchChoice<f64> {
    /// Its angular frequency [rad/s], for the modelled drive.
    pub fn angular_frequency(&self, drive: &TwoMass<f64>) -> f64 {
        stated_or_coupling(self.frequency, drive)
    }
}

impl ShaperChoice<f64> {
    /// The impulses for the modelled drive, at `rate` set-points per second.
    pub fn shaper(&self, drive: &TwoMass<f64>, rate: f64) -> Shaper {
        let of = |it: &Vibration<f64>| (stated_or_coupling(it.frequency, drive), it.damping);
        match self {
            ShaperChoice::Nothing => Shaper::NOTHING,
            ShaperChoice::ZeroVibration(it) => {
                let (frequency, damping) = of(it);
                Shaper::zero_vibration(frequency, damping, rate)
            }
            ShaperChoice::Robust(it) => {
                let (frequency, damping) = of(it);
                Shaper::robust(frequency, damping, rate)
            }
        }
    }
}

/// The stated frequency [Hz], or that of the coupling if it is 0, in rad/s.
fn stated_or_coupling(frequency: f64, drive: &TwoMass<f64>) -> f64 {
    if frequency > 0.0 { TAU * frequency } else { drive.vibration() }
}

impl<T> Observation<T> {
    /// The disturbances of the drive.
    pub fn disturbances(&self) -> &Disturbances<T> {
        match self {
            Observation::Full(it)
            | Observation::Reduced(it)
            | Observation::LoadSide(it)
            | Observation::MotorSide(it) => it,
        }
    }

    /// The same, mutable.
    pub fn disturbances_mut(&mut self) -> &mut Disturbances<T> {
        match self {
            Observation::Full(it)
            | Observation::Reduced(it)
            | Observation::LoadSide(it)
            | Observation::MotorSide(it) => it,
        }
    }
}
