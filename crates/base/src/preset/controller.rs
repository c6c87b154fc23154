//! What is stated of the position controller; `design::position_controller` prepares it.

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
    /// Feedback of all states of the drive, which an observer estimates: it damps the coupling actively. The defaults are
    /// tuned for `clm-bench` with its control at 1 kHz.
    StateFeedback(StateFeedback<T>),
    /// State feedback that sees the limits of torque, its rate and velocity coming.
    Predictive(PredictiveFeedback<T>),
    /// Your own, by the matrices that another tool has made.
    Linear(ControllerMatrices<T>),
}

/// A linear controller by its matrices, for one sampling time:
///
///   x⁺ = A·x + B·v,   M = C·x + D·v + I,   İ = K_i·(r − φ),   v = (φ − r, ω, Δr, ṙ, r̈, M₋, M_c₋, M_c)
///
/// φ and ω are measured by encoder and tacho, r is the set-point and Δr how far it went since the sample before; M₋ is the
/// controller's own torque, limited, that is in force until the next sample, M_c₋ what compensation of friction adds to
/// it, and M_c what it adds to the torque that is computed. Rows and columns that are not needed are 0.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ControllerMatrices<T> {
    /// What becomes of the states: a row each, from all states.
    #[field(symbol = "A", unit = "1", range = -1e15..=1e15)]
    pub system: [[T; STATES]; STATES],
    /// What moves them: a row each, from all that comes in.
    #[field(symbol = "B", unit = "1", range = -1e15..=1e15)]
    pub input: [[T; INPUTS]; STATES],
    /// From the states to the torque.
    #[field(symbol = "C", unit = "1", range = -1e15..=1e15)]
    pub output: [T; STATES],
    /// From what comes in to the torque.
    #[field(symbol = "D", unit = "1", range = -1e15..=1e15)]
    pub direct: [T; INPUTS],
    /// Torque per deviation of the position and time; at the limit of the torque it moves only back.
    #[field(symbol = "K_i", unit = "N m/(rad s)", range = 0.0..=1e8)]
    pub integral_gain: T,
    /// Sampling time that the matrices are for; it must be that of the bench.
    #[field(symbol = "T", unit = "s", range = 1e-6..=1.0, default = 1e-3)]
    pub sampling_time: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// What the controller's torque goes through.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum FilterChoice<T> {
    /// Nothing.
    Nothing,
    /// A notch: around its frequency the loop gain is small, below it the loop loses phase.
    Notch(NotchChoice<T>),
}

/// A notch: (s² + 2·ζ_n·ω·s + ω²)/(s² + 2·ζ_d·ω·s + ω²).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NotchChoice<T> {
    /// Its frequency; 0 is that of the believed coupling between motor and load.
    #[field(symbol = "f_n", unit = "Hz", range = 0.0..=5000.0)]
    pub frequency: T,
    /// Damping ratio of what is stopped: 0 stops it wholly.
    #[field(symbol = "ζ_n", unit = "1", range = 0.0..=1.0, default = 0.05)]
    pub depth: T,
    /// Damping ratio of what is left: more is wider.
    #[field(symbol = "ζ_d", unit = "1", range = 0.01..=1.0, default = 0.5)]
    pub width: T,
}

/// What a motion is shaped with, so that what vibrates comes to rest with it. The controller sees the shaped set-point.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum ShaperChoice<T> {
    /// Nothing: motions as they are asked for.
    Nothing,
    /// Two impulses half a period apart (ZV): a motion lasts that much longer.
    ZeroVibration(Vibration<T>),
    /// Three impulses (ZVD): a period longer, and right where the frequency is a few percent off.
    Robust(Vibration<T>),
}

/// What vibrates after a motion.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Vibration<T> {
    /// Its frequency; 0 is that of the believed coupling between motor and load.
    #[field(symbol = "f_v", unit = "Hz", range = 0.0..=5000.0)]
    pub frequency: T,
    /// Its damping ratio.
    #[field(symbol = "ζ_v", unit = "1", range = 0.0..=0.9, default = 0.02)]
    pub damping: T,
}

/// State feedback from the believed drive: which motion is wanted, and what is believed of sensors and disturbances.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct StateFeedback<T> {
    /// How the gains come about.
    pub regulator: Regulation<T>,
    /// What estimates the states.
    pub observer: Observation<T>,
    /// The elastic arm on the carriage, carried or rendered, whose vibration is damped too.
    pub arm: DampedArm<T>,
    /// Whether the estimated load torque is compensated, instead of an integral of the deviation: one of the two.
    #[field(unit = "1", flag)]
    pub compensates_load: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State feedback within limits: what it does is nearest to what the state feedback alone would do.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PredictiveFeedback<T> {
    /// What it does where no limit is in the way.
    pub feedback: StateFeedback<T>,
    /// Largest rate of the torque.
    #[field(symbol = "dM_max", unit = "N m/s", range = 1e-3..=1e9, default = 1e4)]
    pub torque_rate_limit: T,
    /// Largest velocity of the load.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-3..=1e6, default = 100.0)]
    pub speed_limit: T,
}

/// What a state feedback knows of an elastic arm.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum DampedArm<T> {
    /// Nothing: to it the arm is a load.
    Nothing,
    /// An observer of its own, which the observed motion of the carriage drives: nothing is measured at the arm, and the
    /// observer of the drive does not know it.
    Elastic(ArmDamping<T>),
}

/// An arm that is believed, and what its twist is worth.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ArmDamping<T> {
    /// The arm.
    pub believed: ElasticArm<T>,
    /// Twist of the arm that is worth the whole torque; only with the least sum of squares.
    #[field(symbol = "q_t", unit = "rad", range = 1e-6..=1e3, default = 0.05)]
    pub twist: T,
}

/// How the gains of a state feedback come about.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Regulation<T> {
    /// The least sum of squares (LQR): each deviation below is worth the whole torque.
    Quadratic(Quadratic<T>),
    /// The poles of the controlled drive, as they are wanted.
    Poles(Poles<T>),
}

/// What a deviation is worth: the smaller, the harder it is fought.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Quadratic<T> {
    /// Deviation of the angle.
    #[field(symbol = "φ_t", unit = "rad", range = 1e-6..=1e3, default = 0.16)]
    pub angle: T,
    /// Deviation of the velocity.
    #[field(symbol = "Ω_t", unit = "rad/s", range = 1e-4..=1e6, default = 600.0)]
    pub velocity: T,
    /// Velocity of the motor against the load: vibration.
    #[field(symbol = "Ω_v", unit = "rad/s", range = 1e-4..=1e6, default = 18.0)]
    pub vibration: T,
    /// Time after which the integral of a deviation counts as much as the deviation.
    #[field(symbol = "T_i", unit = "s", range = 1e-4..=100.0, default = 0.0065)]
    pub integral_time: T,
}

/// Where the poles of the controlled drive are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Poles<T> {
    /// Natural frequency of drive and load together.
    #[field(symbol = "ω_0", unit = "rad/s", range = 0.1..=1e4, default = 60.0)]
    pub bandwidth: T,
    /// Its damping ratio.
    #[field(symbol = "ζ", unit = "1", range = 0.1..=2.0, default = 0.8)]
    pub damping: T,
    /// Damping ratio of the vibration of motor against load, at its own frequency.
    #[field(symbol = "ζ_v", unit = "1", range = 1e-3..=2.0, default = 0.3)]
    pub vibration_damping: T,
    /// How fast the integral takes up a load.
    #[field(symbol = "ω_i", unit = "1/s", range = 0.1..=1e4, default = 30.0)]
    pub integral_rate: T,
}

/// What estimates the states of the drive.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Observation<T> {
    /// A Kalman filter on encoder and tacho.
    Full(Disturbances<T>),
    /// The same with the encoder's angle taken as it is.
    Reduced(Disturbances<T>),
    /// The encoder alone: nothing is measured at the motor.
    LoadSide(Disturbances<T>),
    /// Motion and vibration by the tacho alone, the angle by the encoder: two observers that do not know each other.
    MotorSide(Disturbances<T>),
}

/// What acts on the drive besides the controller, as an observer believes.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Disturbances<T> {
    /// How fast the unknown load torque wanders: more follows it faster, less lets less noise through.
    #[field(symbol = "q_L", unit = "N m √Hz", range = 1e-6..=1e4, default = 6.0)]
    pub load_torque: T,
    /// Torque noise of the drive motor: more trusts the model of the drive less.
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
    /// The state feedback in it.
    pub fn feedback(&self) -> Option<&StateFeedback<T>> {
        match self {
            ControllerChoice::StateFeedback(it) => Some(it),
            ControllerChoice::Predictive(it) => Some(&it.feedback),
            _ => None,
        }
    }
}

impl ControllerChoice<f64> {
    /// The arm that it believes in.
    pub fn arm(&self) -> Arm<f64> {
        match self.feedback().map(|feedback| &feedback.arm) {
            Some(DampedArm::Elastic(it)) => Arm::Elastic(it.believed),
            _ => Arm::Nothing,
        }
    }
}

impl NotchChoice<f64> {
    /// Where it stands [rad/s], for a drive that is believed.
    pub fn angular_frequency(&self, drive: &TwoMass<f64>) -> f64 {
        stated_or_coupling(self.frequency, drive)
    }
}

impl ShaperChoice<f64> {
    /// The impulses for a drive that is believed, at `rate` set-points a second.
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

/// A frequency [Hz] as it is stated, or that of the coupling where it is 0 [rad/s].
fn stated_or_coupling(frequency: f64, drive: &TwoMass<f64>) -> f64 {
    if frequency > 0.0 { TAU * frequency } else { drive.vibration() }
}

impl<T> Observation<T> {
    /// What acts on the drive besides the controller.
    pub fn disturbances(&self) -> &Disturbances<T> {
        match self {
            Observation::Full(it)
            | Observation::Reduced(it)
            | Observation::LoadSide(it)
            | Observation::MotorSide(it) => it,
        }
    }

    /// The same, to be changed.
    pub fn disturbances_mut(&mut self) -> &mut Disturbances<T> {
        match self {
            Observation::Full(it)
            | Observation::Reduced(it)
            | Observation::LoadSide(it)
            | Observation::MotorSide(it) => it,
        }
    }
}
