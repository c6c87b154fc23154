//! Current control of the load motor.

use super::{finite_or, may_integrate, measurable};
use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// PI control of the load motor's current with compensation of its back-EMF.
///
///   L·di/dt = u − R·i + K_L·Ω,   M_L = K_L·i against positive Ω
///   u = K_p·(i_ref − i) + R·i + I − K_L·Ω_est,   İ = K_i·(i_ref − i)
///
/// The reference is limited to the motor's current, the voltage to what amplifier and D/A converter give; at the limit
/// the integrator moves only back (conditional integration). K_p = L/(3·T_s) and K_i = R/(3·T_s) cancel the motor's
/// pole and leave a loop for 1.5 T_s of delay (magnitude optimum): `stickslip::design::current_control`. With a current
/// that is predicted for the time when the voltage acts, and its voltage drop fed forward, one sample is enough:
/// `stickslip::design::predictive_current_control`.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurrentControl<T> {
    /// Voltage per deviation of the current.
    #[field(symbol = "K_p", unit = "V/A", range = 0.0..=1e3, default = 0.56)]
    pub proportional_gain: T,
    /// Voltage per deviation and time.
    #[field(symbol = "K_i", unit = "V/(A s)", range = 0.0..=1e7, default = 813.3333333333334)]
    pub integral_gain: T,
    /// Resistance whose voltage drop is fed forward at the present current; 0 leaves it to the integrator.
    #[field(symbol = "R", unit = "Ω", range = 0.0..=20.0)]
    pub resistance: T,
    /// Torque per current, and back-EMF per velocity; 0 switches its compensation off.
    #[field(symbol = "K_L", unit = "N m/A", range = 0.0..=10.0, default = 0.0934)]
    pub torque_constant: T,
    /// Largest current reference.
    #[field(symbol = "i_max", unit = "A", range = 0.01..=1e3, default = 15.0)]
    pub current_limit: T,
    /// Largest voltage of the amplifier.
    #[field(symbol = "u_max", unit = "V", range = 1.0..=1e3, default = 48.0)]
    pub voltage_limit: T,
    /// Voltage at the motor per voltage at the amplifier's input.
    #[field(symbol = "V_amp", unit = "1", range = 0.01..=1e3, default = 4.8)]
    pub amplifier_gain: T,
    /// Largest voltage of the D/A converter.
    #[field(symbol = "u_DA", unit = "V", range = 0.1..=100.0, default = 10.0)]
    pub converter_limit: T,
}

/// State of the current control.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurrentControlState<T> {
    /// Integral part of the voltage; at rest the drop over the motor's resistance.
    #[field(symbol = "I", unit = "V")]
    pub integral: T,
}

/// Inputs of the current control.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurrentControlInput<T> {
    /// Current reference.
    #[field(symbol = "i_ref", unit = "A")]
    pub reference_current: T,
    /// Measured current.
    #[field(symbol = "i", unit = "A")]
    pub measured_current: T,
    /// Estimated velocity of the screw.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub estimated_velocity: T,
}

/// Outputs of the current control.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurrentControlOutput<T> {
    /// Voltage for the motor.
    #[field(symbol = "u", unit = "V")]
    pub voltage: T,
    /// The same at the input of the amplifier: output of the D/A converter.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_input: T,
}

impl<T: Scalar> CurrentControl<T> {
    /// Largest voltage of amplifier and D/A converter [V].
    #[inline(always)]
    pub fn largest_voltage(&self) -> T {
        self.voltage_limit.min(self.amplifier_gain * self.converter_limit)
    }
}

impl<T: Scalar> Block<T> for CurrentControl<T> {
    type State = CurrentControlState<T>;
    type Input = CurrentControlInput<T>;
    type Output = CurrentControlOutput<T>;

    /// A non-finite reference counts as 0 A. Without a valid current the integrator is reset and the voltage is that of
    /// the back-EMF alone, which drives the current to zero.
    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let zero = T::of(0.0);
        let reference = finite_or(input.reference_current, zero).clamp(-self.current_limit, self.current_limit);
        let sensed = measurable(input.measured_current);
        let current = finite_or(input.measured_current, zero);
        let deviation = sensed.select(reference - current, zero);
        let held = sensed.select(state.integral, zero);

        let back_emf = self.torque_constant * finite_or(input.estimated_velocity, zero);
        let demand = self.proportional_gain * deviation + self.resistance * current + held - back_emf;
        let limit = self.largest_voltage();
        let voltage = demand.clamp(-limit, limit);

        let increment = self.integral_gain * deviation * dt;
        state.integral = held + may_integrate(demand, increment, limit).select(increment, zero);
        CurrentControlOutput { voltage, amplifier_input: voltage / self.amplifier_gain }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const DT: f64 = 250e-6;
    const RESISTANCE: f64 = 0.61;
    const INDUCTANCE: f64 = 0.42e-3;

    /// The motor behind 1.5 T_s of delay: one sample of computation, and half a period on average of the held voltage.
    #[derive(Default)]
    struct Motor {
        current: f64,
        waiting: f64,
    }

    impl Motor {
        /// Exact flow over one period; returns the current at its end.
        fn period(&mut self, commanded: f64, torque_constant: f64, velocity: f64) -> f64 {
            let steady = (self.waiting + torque_constant * velocity) / RESISTANCE;
            self.current = steady + (self.current - steady) * Scalar::exp(-RESISTANCE / INDUCTANCE * DT);
            self.waiting = commanded;
            self.current
        }
    }

    /// The current over a number of periods, at a reference and a velocity that depend on time.
    fn run(control: &CurrentControl<f64>, periods: u32, demand: impl Fn(f64) -> (f64, f64)) -> Vec<f64> {
        let (mut motor, mut state) = (Motor::default(), CurrentControlState::default());
        let mut currents = Vec::new();
        for k in 0..periods {
            let (reference_current, estimated_velocity) = demand(f64::from(k) * DT);
            let measured_current = motor.current;
            let input = CurrentControlInput { reference_current, measured_current, estimated_velocity };
            let out = control.step(&mut state, input, DT);
            currents.push(motor.period(out.voltage, 0.0934, estimated_velocity));
        }
        currents
    }

    #[test]
    fn a_step_reaches_the_reference_with_little_overshoot() {
        let currents = run(&CurrentControl::default(), 80, |_| (2.0, 0.0));
        let peak = currents.iter().fold(0.0f64, |a, &b| a.max(b));
        // The magnitude optimum overshoots by 4.3 % in theory; sampling adds a little.
        assert!(peak < 2.0 * 1.08, "{peak}");
        assert!(currents[8] > 0.9 * 2.0, "nine periods: {}", currents[8]);
        assert!((currents[79] - 2.0).abs() < 1e-3);
    }

    #[test]
    fn the_back_emf_of_a_running_screw_is_fed_forward() {
        // 100 rad/s at no current: 9.3 V that would otherwise drive 15 A.
        let demand = |t: f64| (0.0, if t < 0.05 { 2e3 * t } else { 100.0 });
        let with = run(&CurrentControl::default(), 400, demand);
        let without = CurrentControl { torque_constant: 0.0, ..CurrentControl::default() };
        let without = run(&without, 400, demand);
        let worst = |currents: &[f64]| currents.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        // On the ramp of 187 V/s a delay of 1.5 periods leaves 70 mV: 0.12 A at K_p = 0.56 V/A, until the integral takes it.
        assert!(worst(&with) < 0.13, "{}", worst(&with));
        assert!(worst(&without) > 2.0 * worst(&with), "{}", worst(&without));
    }

    #[test]
    fn a_saturated_voltage_does_not_wind_up() {
        // At 500 rad/s the back-EMF takes 46.7 V of 48 V: 8 A against it cannot flow.
        let demand = |t: f64| (if t < 0.05 { 8.0 } else { -8.0 }, -500.0);
        let control = CurrentControl::default();
        let currents = run(&control, 400, demand);
        let reached = |currents: &[f64]| currents.iter().position(|&i| (i + 8.0).abs() < 0.4);
        let saturated = &currents[..200];
        assert!(saturated.iter().all(|&i| i < 7.0), "the voltage is enough, the test is void");
        let recovery = reached(&currents[200..]);
        assert!(recovery.is_some_and(|k| k < 20), "{recovery:?} periods");
    }

    #[test]
    fn reference_voltage_and_converter_are_limited() {
        let control = CurrentControl::<f64>::default();
        let mut state = CurrentControlState::default();
        let input = |reference_current, measured_current| CurrentControlInput {
            reference_current,
            measured_current,
            estimated_velocity: 0.0,
        };
        let high = control.step(&mut state, input(1e9, 0.0), DT);
        assert!((high.voltage - 0.56 * 15.0).abs() < 1e-12, "the reference is limited to 15 A: {}", high.voltage);
        let full = control.step(&mut state, input(0.0, -1e6), DT);
        assert_eq!((full.voltage, full.amplifier_input), (48.0, 10.0));
        let weak = CurrentControl { converter_limit: 5.0, ..control };
        assert_eq!(weak.step(&mut state, input(0.0, 1e6), DT).voltage, -24.0);
    }

    #[test]
    fn a_non_finite_input_gives_a_finite_voltage_and_leaves_no_trace() {
        let control = CurrentControl::<f64>::default();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut state = CurrentControlState { integral: 3.0 };
            let input =
                CurrentControlInput { reference_current: 2.0, measured_current: bad, estimated_velocity: 100.0 };
            let out = control.step(&mut state, input, DT);
            assert!((out.voltage + 9.34).abs() < 1e-12, "only the back-EMF: {}", out.voltage);
            assert_eq!(state.integral, 0.0);
            let all = CurrentControlInput { reference_current: bad, measured_current: bad, estimated_velocity: bad };
            assert_eq!(control.step(&mut state, all, DT).voltage, 0.0);
            let reference =
                CurrentControlInput { reference_current: bad, measured_current: 0.0, estimated_velocity: 0.0 };
            assert_eq!(control.step(&mut state, reference, DT).voltage, 0.0);
        }
    }
}
