//! Controllers from the parameters of a machine.

use stickslip_core::control::{Cascade, CurrentControl, Pid};

use super::{sampling_time, within};
use stickslip_base::Error;

/// `base` with the gains for a motor of this resistance [Ω] and inductance [H] at the sampling time `dt` [s]:
///
///   K_p = L/(3·T_s),   K_i = R/(3·T_s)
///
/// The controller's zero cancels the motor's pole; the rest, 1/(3·T_s·s) with 1.5·T_s of delay, is the magnitude
/// optimum with a damping of 1/√2.
pub fn current_control(
    base: CurrentControl<f64>,
    resistance: f64,
    inductance: f64,
    dt: f64,
) -> Result<CurrentControl<f64>, Error> {
    sampling_time(dt)?;
    within("the motor's resistance", resistance, "Ω", (1e-3, 1e4), "Use that of the winding, terminal to terminal.")?;
    within("the motor's inductance", inductance, "H", (1e-7, 10.0), "Use that of the winding, terminal to terminal.")?;
    Ok(CurrentControl { proportional_gain: inductance / (3.0 * dt), integral_gain: resistance / (3.0 * dt), ..base })
}

/// `base` for a current predicted to the next sample, when the voltage starts to act: `share` of the deviation at that
/// time is corrected within the following sampling time `dt` [s].
///
///   i⁺ = a·i + (u + K_L·Ω)·(1 − a)/R,   a = e^(−R·T/L)   ⇒   u = share·R/(1 − a)·(i_ref − i) + R·i − K_L·Ω
///
/// A share of 1 is dead beat and oscillates with an inductance that is 10 % off; 0.7 tolerates 40 %. The slow integral
/// (a tenth of the winding's own rate) corrects the errors of the amplifier.
pub fn predictive_current_control(
    base: CurrentControl<f64>,
    resistance: f64,
    inductance: f64,
    share: f64,
    dt: f64,
) -> Result<CurrentControl<f64>, Error> {
    let base = current_control(base, resistance, inductance, dt)?;
    within("the share corrected in a sample", share, "1", (0.01, 1.0), "0.7 is a good start.")?;
    let decay = -libm::expm1(-resistance * dt / inductance);
    Ok(CurrentControl {
        proportional_gain: share * resistance / decay,
        integral_gain: 0.1 * resistance * resistance / inductance,
        resistance,
        ..base
    })
}

/// `base` with a triple pole at this bandwidth [rad/s] on a rigid, frictionless inertia [kg m²]:
///
///   K_p = 3·J·ω²,   K_i = J·ω³,   K_d = 3·J·ω
///
/// Soft and safe: the start of a tuning.
pub fn pid_by_bandwidth(base: Pid<f64>, inertia: f64, bandwidth: f64) -> Result<Pid<f64>, Error> {
    within("the inertia", inertia, "kg m^2", (1e-9, 10.0), "Use the sum of motor and load side, on the screw.")?;
    within("the bandwidth", bandwidth, "rad/s", (1e-3, 1e4), "Stay well below the first resonance.")?;
    Ok(Pid {
        proportional_gain: 3.0 * inertia * bandwidth * bandwidth,
        integral_gain: inertia * bandwidth * bandwidth * bandwidth,
        derivative_gain: 3.0 * inertia * bandwidth,
        ..base
    })
}

/// PID controller with the tacho that is nearly the same controller as this cascade without its inertia feedforward:
/// K_p = K_v·K_pos + K_i, K_i' = K_i·K_pos, K_d = K_v. They differ where the coupling twists, since the cascade's
/// integral uses the tacho on the motor. A ranking of the two would rank their tunings.
pub fn cascade_as_pid(cascade: &Cascade<f64>) -> Pid<f64> {
    Pid {
        proportional_gain: cascade.velocity_gain * cascade.position_gain + cascade.integral_gain,
        integral_gain: cascade.integral_gain * cascade.position_gain,
        derivative_gain: cascade.velocity_gain,
        use_tacho: 1.0,
        torque_limit: cascade.torque_limit,
        ..Pid::default()
    }
}
