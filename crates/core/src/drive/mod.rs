//! The drive: two masses with a compliant coupling, motors and their amplifiers.
//!
//! Torques refer to the screw side, angles are in rad. The same structs hold the values of the virtual machine and
//! those of the software's model: the equations are the same, the values are independent.

mod arm;
mod delay;
mod flow;
mod linear;

use core::f64::consts::TAU;

pub use arm::{Arm, ElasticArm};
pub use delay::{Delay, LONGEST_DELAY};
pub use flow::flow;
pub(crate) use linear::{INPUTS, STATES, advance, half_flow};

use crate::Fields;
use crate::scalar::{Mask, Scalar};

/// Motor, coupling, ball screw and carriage.
///
/// ```text
/// J_M·φ̈_M = M_M − M_C − M_R,M      M_C = c·(φ_M − φ) + d·(φ̇_M − φ̇)
/// J_L·φ̈   = M_C − M_R − M_W − M_L + M_ext
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct TwoMass<T> {
    /// Inertia on the motor's side of the coupling.
    #[field(symbol = "J_M", unit = "kg m^2", range = 1e-7..=1.0, default = 4.1e-4)]
    pub motor_inertia: T,
    /// Inertia on the screw's side: screw, friction wheel, rotor of the load motor, and the carriage by m·(h/2π)².
    #[field(symbol = "J_L", unit = "kg m^2", range = 1e-7..=1.0, default = 6.0e-4)]
    pub load_inertia: T,
    /// Stiffness of the coupling.
    #[field(symbol = "c", unit = "N m/rad", range = 1.0..=5000.0, default = 60.0)]
    pub coupling_stiffness: T,
    /// Damping of the coupling.
    #[field(symbol = "d", unit = "N m s/rad", range = 0.0..=0.1, default = 9.6e-3)]
    pub coupling_damping: T,
    /// Travel of the carriage per revolution of the screw.
    #[field(symbol = "h", unit = "m", range = 1e-3..=4e-2, default = 5e-3)]
    pub screw_lead: T,
}

impl<T: Scalar> TwoMass<T> {
    /// h/2π: travel of the carriage per angle of the screw [m/rad].
    #[inline(always)]
    pub fn carriage_ratio(&self) -> T {
        self.screw_lead * T::of(1.0 / TAU)
    }

    /// J_M + J_L [kg m²].
    #[inline(always)]
    pub fn inertia(&self) -> T {
        self.motor_inertia + self.load_inertia
    }
}

impl TwoMass<f64> {
    /// Angular frequency of motor and load on the coupling, without damping [rad/s].
    pub fn vibration(&self) -> f64 {
        libm::sqrt(self.coupling_stiffness * self.inertia() / (self.motor_inertia * self.load_inertia))
    }
}

/// A brushed or commutated motor.
///
/// For the load motor, whose torque M_L = K·i counts against positive Ω: `L·di/dt = u − R·i + K·Ω`.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Winding<T> {
    /// Torque per current, and back-EMF per speed. 0: no motor is mounted.
    #[field(symbol = "K", unit = "N m/A", range = 0.0..=0.5, default = 0.0934)]
    pub torque_constant: T,
    /// Resistance.
    #[field(symbol = "R", unit = "Ω", range = 0.05..=20.0, default = 0.61)]
    pub resistance: T,
    /// Inductance.
    #[field(symbol = "L", unit = "H", range = 2e-5..=2e-2, default = 0.42e-3)]
    pub inductance: T,
}

/// Servo amplifier of the drive motor, with its own current control.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Servo<T> {
    /// Motor torque per input voltage.
    #[field(symbol = "k_u", unit = "N m/V", range = 1e-4..=100.0, default = 0.14)]
    pub torque_per_volt: T,
    /// Largest input voltage.
    #[field(symbol = "u_max", unit = "V", range = 0.1..=100.0, default = 10.0)]
    pub input_limit: T,
    /// Lag of the current control, first order.
    #[field(symbol = "τ", unit = "s", range = 2e-5..=2e-2, default = 0.32e-3)]
    pub lag: T,
    /// Delay between command and torque, without the software's tick. At most 8 ticks.
    #[field(symbol = "T_t", unit = "s", range = 0.0..=20e-3)]
    pub delay: T,
    /// Largest torque, by the current limit.
    #[field(symbol = "M_max", unit = "N m", range = 1e-4..=1000.0, default = 1.4)]
    pub torque_limit: T,
    /// Supply voltage. Reduced by the back-EMF, it limits the current.
    #[field(symbol = "U", unit = "V", range = 1.0..=800.0, default = 48.0)]
    pub supply_voltage: T,
}

impl<T: Scalar> Servo<T> {
    /// Torque reference of the current control [N m] for an input voltage [V] at a motor velocity [rad/s]; 0 for NaN.
    #[inline(always)]
    pub fn torque(&self, voltage: T, winding: &Winding<T>, velocity: T) -> T {
        let voltage = voltage.clamp(-self.input_limit, self.input_limit);
        let asked = (voltage * self.torque_per_volt).clamp(-self.torque_limit, self.torque_limit);
        // Limits: torque of the steady current at full voltage against the back-EMF. Above the no-load speed only
        // braking torque is possible.
        let constant = winding.torque_constant;
        let per_volt = constant / winding.resistance;
        let emf = constant * velocity;
        let zero = T::of(0.0);
        let high = (per_volt * (self.supply_voltage - emf)).max(zero);
        let low = (per_volt * (-self.supply_voltage - emf)).min(zero);
        nan_to_zero(asked.clamp(low, high))
    }
}

/// Amplifier of the load motor: a voltage, limited by supply and current.
///
/// If it takes a torque instead (`bench.torque_amplifier`), its own current control replaces that of the software.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LoadAmplifier<T> {
    /// Output per input voltage.
    #[field(symbol = "V_amp", unit = "1", range = 0.1..=100.0, default = 4.8)]
    pub gain: T,
    /// Supply voltage, the largest output.
    #[field(symbol = "U", unit = "V", range = 1.0..=800.0, default = 48.0)]
    pub supply_voltage: T,
    /// Largest current: beyond it the amplifier only holds the current.
    #[field(symbol = "i_max", unit = "A", range = 0.1..=200.0, default = 15.0)]
    pub current_limit: T,
    /// Lag of its own current control, first order, if it takes a torque.
    #[field(symbol = "τ_L", unit = "s", range = 2e-5..=2e-2, default = 0.32e-3)]
    pub lag: T,
    /// Delay between command and output, without the software's tick. At most 8 ticks.
    #[field(symbol = "T_t,L", unit = "s", range = 0.0..=20e-3)]
    pub delay: T,
}

/// Resistance of the equivalent winding behind an amplifier that takes a torque [Ω]: its back-EMF has no effect.
const DIRECT: f64 = 1e6;

impl<T: Scalar> LoadAmplifier<T> {
    /// An amplifier that takes a torque, and its motor: the current follows an input of 1 V for 1 A with the lag of the
    /// amplifier.
    pub fn with_current_control(&self, winding: &Winding<T>) -> (Self, Winding<T>) {
        let resistance = T::of(DIRECT);
        let amplifier = LoadAmplifier { gain: resistance, supply_voltage: resistance * self.current_limit, ..*self };
        (amplifier, Winding { resistance, inductance: resistance * self.lag, ..*winding })
    }

    /// Voltage at the winding [V] for an input voltage [V], at a current [A] and a velocity [rad/s]; 0 for NaN.
    #[inline(always)]
    pub fn voltage(&self, input: T, winding: &Winding<T>, current: T, velocity: T) -> T {
        let asked = nan_to_zero(input * self.gain);
        // Voltage that keeps the current: L·di/dt = u − R·i + K·Ω = 0.
        let hold = winding.resistance * current - winding.torque_constant * velocity;
        let held = current.gt(self.current_limit).select(asked.min(hold), asked);
        let held = current.lt(-self.current_limit).select(held.max(hold), held);
        held.clamp(-self.supply_voltage, self.supply_voltage)
    }
}

/// This value; 0 for NaN.
#[inline(always)]
pub fn nan_to_zero<T: Scalar>(value: T) -> T {
    value.le(value).select(value, T::of(0.0))
}
