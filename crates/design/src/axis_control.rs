//! Position control from its settings and the model of the machine.

use stickslip_core::control::compensation::{
    AdaptiveStribeck, Compensation, CurveFeedforward, DisturbanceObserver, FrictionFeedforward, FrictionObserver,
    FriedlandPark, NetworkFeedforward, SetpointFeatures,
};
use stickslip_core::control::{AxisControl, Notch, PositionController, TorqueFilter};
use stickslip_core::friction::{Bristles, Stribeck};

use super::drive_observer::{Trust, unloaded_drive};
use super::{linear_controller, predictive, state_feedback};
use stickslip_base::Error;
use stickslip_base::preset::{AssumedFriction, CompensationChoice, ControllerChoice, FilterChoice, Model, Settings};

/// Least speed for an estimate of the curve [rad/s], for any noise of the tacho: below it the bristles act.
const SLOWEST_LEARNT: f64 = 0.3;

/// This speed over the standard deviation of the velocity: occasional wrong signs would distort the estimate.
const LEARNT_PER_NOISE: f64 = 10.0;

/// Controller, compensation and holding for the model of the machine and the settings of the bench.
///
/// # Errors
/// As [`position_controller`].
pub fn axis_control(model: &Model<f64>, settings: &Settings<f64>) -> Result<AxisControl<f64>, Error> {
    Ok(AxisControl {
        controller: position_controller(&settings.controller, model, settings)?,
        filter: torque_filter(model, settings),
        compensation: compensation(model, settings)?,
        hold: settings.hold,
    })
}

/// The configured controller, for the model of the machine and the settings of the bench.
///
/// # Errors
/// As [`state_feedback`].
pub fn position_controller(
    choice: &ControllerChoice<f64>,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> Result<PositionController<f64>, Error> {
    Ok(match choice {
        ControllerChoice::Cascade(cascade) => PositionController::Cascade(*cascade),
        ControllerChoice::Pid(pid) => PositionController::Pid(*pid),
        ControllerChoice::StateFeedback(stated) => {
            PositionController::Linear(state_feedback(stated, model, settings.control_period())?)
        }
        ControllerChoice::Predictive(stated) => {
            PositionController::Predictive(predictive(stated, model, settings.control_period())?)
        }
        ControllerChoice::Linear(matrices) => PositionController::Linear(linear_controller(matrices)),
    })
}

/// The configured filter of a controller's torque, for the model of the machine and the settings of the bench.
pub fn torque_filter(model: &Model<f64>, settings: &Settings<f64>) -> TorqueFilter<f64> {
    let FilterChoice::Notch(choice) = settings.filter else { return TorqueFilter::Nothing };
    let frequency = choice.angular_frequency(&model.drive);
    let limit = settings.controller.torque_limit();
    TorqueFilter::Notch(notch(frequency, [choice.depth, choice.width], limit, settings.control_period()))
}

/// A notch at a frequency [rad/s] with the damping ratios of its zeros and poles, sampled with `dt` [s].
pub(crate) fn notch(frequency: f64, [depth, width]: [f64; 2], torque_limit: f64, dt: f64) -> Notch<f64> {
    // Bilinear, prewarped at the frequency.
    let g = libm::tan(0.5 * frequency * dt);
    let (depth, width) = (2.0 * depth * g, 2.0 * width * g);
    let all = 1.0 + width + g * g;
    let both = 2.0 * (g * g - 1.0) / all;
    Notch {
        numerator: [(1.0 + depth + g * g) / all, both, (1.0 - depth + g * g) / all],
        denominator: [both, (1.0 - width + g * g) / all],
        torque_limit,
    }
}

/// Delay from a sample to its torque [s]: it acts in the next sample, on average in its middle, after the servo
/// amplifier.
pub fn preview(model: &Model<f64>, settings: &Settings<f64>) -> f64 {
    1.5 * settings.control_period() + model.servo_delay + model.servo_lag
}

/// Features of a set-point for a network, by the model of the machine: speeds around the Stribeck velocity, and the
/// reversal ways of bristles, and of bristles with coupling.
pub fn setpoint_features(model: &Model<f64>) -> SetpointFeatures<f64> {
    let own = &model.own;
    let bristles = own.breakaway_torque / model.own_bristles.stiffness;
    SetpointFeatures {
        slow_velocity: 0.3 * own.stribeck_velocity,
        fast_velocity: 3.0 * own.stribeck_velocity,
        short_twist: bristles,
        long_twist: bristles + own.breakaway_torque / model.drive.coupling_stiffness,
    }
}

fn compensation(model: &Model<f64>, settings: &Settings<f64>) -> Result<Compensation<f64>, Error> {
    let period = settings.control_period();
    let preview = preview(model, settings);
    let inertia = model.drive.inertia();
    let torque_limit = model.scaling.servo_limit * model.scaling.torque_per_volt;
    Ok(match settings.compensation {
        CompensationChoice::Nothing => Compensation::Nothing,
        CompensationChoice::Curve(choice) => {
            let (friction, _) = assumed_friction(&choice.belief, model, settings);
            let smoothing_velocity = choice.smoothing_velocity;
            Compensation::Curve(CurveFeedforward { friction, smoothing_velocity, preview, torque_limit })
        }
        CompensationChoice::Feedforward(choice) => {
            let (friction, bristles) = assumed_friction(&choice.belief, model, settings);
            Compensation::Feedforward(FrictionFeedforward { friction: bristles.under(friction), preview, torque_limit })
        }
        CompensationChoice::Adaptive(choice) => {
            let (friction, bristles) = assumed_friction(&choice.belief, model, settings);
            let noise = model.tacho_noise / model.scaling.tacho;
            Compensation::Adaptive(AdaptiveStribeck {
                friction,
                bristles,
                preview,
                inertia,
                filter_time: choice.filter_time,
                freeze_velocity: SLOWEST_LEARNT.max(LEARNT_PER_NOISE * noise),
                forgetting: libm::exp(-period / choice.memory).max(0.9),
                torque_limit,
                ..AdaptiveStribeck::default()
            })
        }
        CompensationChoice::FriedlandPark(choice) => {
            Compensation::FriedlandPark(FriedlandPark { inertia, rate: choice.rate, torque_limit })
        }
        CompensationChoice::FrictionObserver(choice) => {
            let (sliding, bristles) = load_friction(choice.desired > 0.5, model, settings);
            let trust = Trust { missing_torque: choice.missing_torque, ..Trust::default() };
            Compensation::FrictionObserver(FrictionObserver {
                observer: unloaded_drive(model, bristles.under(sliding), settings, &trust)?,
                preview: preview - period,
                share: choice.share * (1.0 - model.doubt.friction),
                torque_limit,
            })
        }
        CompensationChoice::DisturbanceObserver(choice) => {
            let decay = choice.bandwidth * period;
            let share = -libm::expm1(-decay);
            Compensation::DisturbanceObserver(DisturbanceObserver {
                inertia,
                velocity_gain: -libm::expm1(-2.0 * decay),
                torque_gain: share * share * inertia / period,
                torque_limit,
            })
        }
        CompensationChoice::Network(choice) => {
            let (friction, bristles) = assumed_friction(&choice.belief, model, settings);
            let fallback = FrictionFeedforward { friction: bristles.under(friction), preview, torque_limit };
            Compensation::Network(NetworkFeedforward { network: choice.network, fallback })
        }
    })
}

/// The modelled friction of the load.
fn load_friction(desired: bool, model: &Model<f64>, settings: &Settings<f64>) -> (Stribeck<f64>, Bristles<f64>) {
    if desired { (settings.desired, settings.desired_bristles) } else { (model.own, model.own_bristles) }
}

/// Assumed friction of the drive motor at constant speed, its own included, and its bristles.
fn assumed_friction(
    choice: &AssumedFriction<f64>,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> (Stribeck<f64>, Bristles<f64>) {
    let (load, bristles) = load_friction(choice.desired > 0.5, model, settings);
    // Only the motor's friction far above its Stribeck velocity is added: it is small.
    let (slow, fast) = (50.0, 100.0);
    let at = |speed| model.motor_friction.steady_torque(speed, 0.0, 0.0);
    let viscous = (at(fast) - at(slow)) / (fast - slow);
    let level = at(fast) - viscous * fast;
    let scaled = Stribeck {
        breakaway_torque: choice.share * (load.breakaway_torque + level),
        kinetic_torque: choice.share * (load.kinetic_torque + level),
        viscous_friction: choice.share * (load.viscous_friction + viscous),
        ..load
    };
    (scaled, bristles)
}

#[cfg(test)]
mod tests {
    use stickslip_core::control::compensation::CompensationInput;
    use stickslip_core::control::reference::Setpoint;

    use super::*;
    use stickslip_base::parameters::presets;
    use stickslip_base::preset::{AdaptiveChoice, DisturbanceObserverChoice, FeedforwardChoice, NotchChoice};
    use stickslip_base::{Preset, parameters};
    use stickslip_core::block::Block as _;

    fn preset() -> Preset<f64> {
        presets::find("clm-bench").unwrap().read().unwrap()
    }

    fn fed_forward(preset: &Preset<f64>, velocity: f64) -> f64 {
        let compensation = axis_control(&preset.model, &preset.bench).unwrap().compensation;
        let reference = Setpoint { velocity, ..Setpoint::default() };
        let input = CompensationInput { reference, measured_velocity: velocity, ..CompensationInput::default() };
        let mut state = Default::default();
        (0..100).map(|_| compensation.step(&mut state, input, 1e-3).torque).last().unwrap()
    }

    #[test]
    fn the_feedforward_is_the_modelled_friction_and_that_of_the_motor() {
        let mut preset = preset();
        let motor = preset.model.motor_friction.steady_torque(8.0, 0.0, 0.0);
        let (own, desired) = (preset.model.own.magnitude(8.0), preset.bench.desired.magnitude(8.0));
        assert!(motor > 0.0 && (own - desired).abs() > 0.01);
        for (assumption, expected) in [
            (AssumedFriction { desired: 0.0, share: 1.0 }, own + motor),
            (AssumedFriction { desired: 1.0, share: 1.0 }, desired + motor),
            (AssumedFriction { desired: 0.0, share: 0.5 }, 0.5 * (own + motor)),
        ] {
            preset.bench.compensation = CompensationChoice::Feedforward(FeedforwardChoice { belief: assumption });
            let torque = fed_forward(&preset, 8.0);
            // The tolerance is the rest of the motor's own Stribeck drop at 8 rad/s.
            assert!((torque - expected).abs() < 1e-3, "{assumption:?}: {torque} instead of {expected}");
        }
    }

    #[test]
    fn an_estimate_pauses_below_the_noise_of_the_tacho() {
        let mut preset = preset();
        preset.bench.compensation = CompensationChoice::Adaptive(AdaptiveChoice::default());
        let freeze = |preset: &Preset<f64>| match axis_control(&preset.model, &preset.bench).unwrap().compensation {
            Compensation::Adaptive(adaptive) => adaptive.freeze_velocity,
            other => panic!("{other:?}"),
        };
        preset.model.tacho_noise = 0.0287;
        assert!((freeze(&preset) - 10.0 * 0.0287 / preset.model.scaling.tacho).abs() < 1e-12);
        preset.model.tacho_noise = 0.0;
        assert_eq!(freeze(&preset), SLOWEST_LEARNT);
    }

    #[test]
    fn a_notch_is_at_the_resonance_of_the_coupling_by_default() {
        let mut preset = preset();
        let period = preset.bench.control_period();
        for frequency in [0.0, 120.0] {
            let choice = NotchChoice { frequency, depth: 0.0, ..NotchChoice::default() };
            preset.bench.filter = FilterChoice::Notch(choice);
            let TorqueFilter::Notch(notch) = torque_filter(&preset.model, &preset.bench) else { panic!("a notch") };
            // Its zeros are on the unit circle, at its frequency.
            let [b0, b1, b2] = notch.numerator;
            let turned = 0.5 * libm::acos(-0.5 * b1 / b0) / std::f64::consts::PI / period;
            let drive = preset.model.drive;
            let coupling =
                libm::sqrt(drive.coupling_stiffness * (1.0 / drive.motor_inertia + 1.0 / drive.load_inertia))
                    / std::f64::consts::TAU;
            let expected = if frequency > 0.0 { frequency } else { coupling };
            assert!(
                (b0 - b2).abs() < 1e-12 && (turned / expected - 1.0).abs() < 1e-9,
                "{turned} instead of {expected} Hz"
            );
        }
    }

    #[test]
    fn a_disturbance_observer_has_its_bandwidth_at_any_control_rate() {
        for divider in ["1", "8"] {
            let source = presets::find("clm-bench").unwrap();
            let text = parameters::set::<Preset<f64>>(&source.text, "t", "bench.control_divider", divider).unwrap();
            let mut preset: Preset<f64> = parameters::read(&text, "t").unwrap();
            preset.bench.compensation =
                CompensationChoice::DisturbanceObserver(DisturbanceObserverChoice { bandwidth: 80.0 });
            let control = axis_control(&preset.model, &preset.bench).unwrap();
            let Compensation::DisturbanceObserver(observer) = control.compensation else { panic!("{control:?}") };
            let period = preset.bench.control_period();
            // 1 − l_ω is the square of the pole.
            assert!((libm::log(1.0 - observer.velocity_gain) + 2.0 * 80.0 * period).abs() < 1e-12);
        }
    }
}
