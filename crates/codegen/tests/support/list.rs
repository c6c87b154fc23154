// Every block, for the including test, which defines `agree!` of a name, a type and its parameters.

use stickslip_core::control::compensation::{
    AdaptiveStribeck, Compensation, CurveFeedforward, DisturbanceObserver, FriedlandPark, FrictionObserver, FrictionFeedforward, Network, NetworkFeedforward, StictionHold,
};
use stickslip_core::control::{
    AxisControl, Cascade, CurrentControl, LimitStep, LimitSteps, LinearController, Notch, Pid, PositionController, Predictive,
    STATES, VelocityObserver,
};
use stickslip_core::drive::{Delay, ElasticArm, TwoMass, Winding};
use stickslip_core::estimate::{AccelerationSensor, DriveModel, DriveObserver, MotionObserver, ObserverGains};
use stickslip_core::friction::{
    Bristles, Dahl, Decay, ElastoPlastic, Exponent, Fading, Friction, FrictionElement, LuGre, MaxwellSlip, Model, Position, Rest, Ripple, Rising,
    Static, Stribeck, Temperature, Warming,
};
use stickslip_core::plant::{Backlash, Gap, InputDelays, Machine, Plant};
use stickslip_core::render::{Admittance, ArmRendering, RenderedArm, BristleDifference, Karnopp, SmoothDifference, CorrectionTable, DifferenceTorque, Law};
use stickslip_core::sensor::{Accelerometer, Encoder, EncoderFault, Pickups, Tacho};
use stickslip_core::tick::{Decoder, Tick};
use crate::support::blocks::{Holder, Lag, Nested, SlidingFriction};

const DT: f64 = 250e-6;

fn machine(model: Model<f64>) -> Machine<f64> {
    let mut plant = Plant::default();
    plant.screw_friction.model = model;
    plant.wheel.preload = 0.5;
    plant.prepare(10, 25e-6)
}

fn slack() -> Machine<f64> {
    let plant = Plant { backlash: Backlash::Gap(Gap { half_width: 1e-3 }), ..Plant::default() };
    plant.prepare(10, 25e-6)
}

fn modelled_drive() -> DriveModel<f64> {
    let own = Bristles::default().under(Stribeck::default());
    DriveModel::new(TwoMass::default(), Winding::default(), 0.32e-3, Friction::default(), own, 125e-6)
}

fn rendered() -> Friction<f64> {
    Bristles::default().under(Stribeck { kinetic_torque: 0.12, ..Stribeck::default() })
}

fn arm(by_acceleration: f64) -> ArmRendering<f64> {
    let arm = ElasticArm::default();
    ArmRendering { by_acceleration, low_pass: 0.4, flow: arm.flow(DT), ..ArmRendering::default() }
}

/// A stable controller that uses every number.
fn linear() -> LinearController<f64> {
    let some = |i: usize, j: usize| 0.02 * ((3 * i + 5 * j) % 7) as f64 - 0.06;
    LinearController {
        system: std::array::from_fn(|j| std::array::from_fn(|i| if i == j { 0.6 } else { some(i, j) })),
        input: std::array::from_fn(|j| std::array::from_fn(|i| some(i, j))),
        output: std::array::from_fn(|i| some(i, 2)),
        direct: [-5.0, -0.15, 2.0, 0.15, 1e-3, -0.1, 0.2, -0.3],
        settled: std::array::from_fn(|j| std::array::from_fn(|i| some(i, j))),
        integral_gain: 45.0,
        ..LinearController::default()
    }
}

/// A controller at its limits.
fn held_back() -> LimitStep<f64> {
    // Small compared with that of the limits, or the iteration would not converge.
    let near = |i: usize, j: usize| 0.02 / (1.0 + 10.0 * i.abs_diff(j) as f64).powi(2);
    LimitStep {
        resolvent: std::array::from_fn(|j| std::array::from_fn(|i| near(i, j))),
        answer: std::array::from_fn(|k| 0.4 + 0.01 * k as f64),
    }
}

fn foreseeing() -> Predictive<f64> {
    let some = |i: usize, j: usize| 0.02 * ((3 * i + 5 * j) % 7) as f64 - 0.05;
    let free = |j: usize, i: usize| if j == STATES + 1 { dying_out(i) } else { some(i, j) };
    Predictive {
        linear: linear(),
        free_torque: std::array::from_fn(|j| std::array::from_fn(|i| free(j, i))),
        free_velocity: std::array::from_fn(|j| std::array::from_fn(|i| some(j, i))),
        steps: LimitSteps { step: held_back() },
        velocity_weight: 0.2,
        torque_rate_limit: 200.0,
        speed_limit: 2.0,
    }
}

/// Decay of a torque.
fn dying_out(samples: usize) -> f64 {
    0.8f64.powi(samples as i32)
}

/// A network that uses every number, trained for half of the range of the inputs.
fn network() -> NetworkFeedforward<f64> {
    let some = |i: usize, j: usize| 0.1 * ((3 * i + 5 * j) % 7) as f64 - 0.25;
    let network = Network {
        offset: std::array::from_fn(|k| 0.1 * k as f64),
        scale: [2.0, 5.0, 1.0, 1.0, 1.0, 1.0],
        smallest: [-1.0; 6],
        largest: [1.0; 6],
        margin: 1.0,
        first: std::array::from_fn(|j| std::array::from_fn(|i| some(i, j))),
        first_bias: std::array::from_fn(|i| some(i, 1)),
        second: std::array::from_fn(|j| std::array::from_fn(|i| some(i, j))),
        second_bias: std::array::from_fn(|i| some(i, 2)),
        output: std::array::from_fn(|i| some(i, 3)),
        output_bias: 0.05,
        ..Network::default()
    };
    NetworkFeedforward { network, fallback: FrictionFeedforward { friction: rendered(), ..FrictionFeedforward::default() } }
}

/// Delays of 2.4 ticks and of one tick.
fn late() -> [Delay<f64>; 2] {
    [2.4, 1.0].map(|samples| Delay::new(samples, 1.0).expect("a delay that can be stored"))
}

/// Gains of a stationary Kalman filter at this tick.
fn observer() -> DriveObserver<f64> {
    let gains = ObserverGains {
        angle: [0.1, 4e-5, 3e-6],
        twist: [-0.028, 4e-6, 1.3e-5],
        motor_velocity: [15.0, 0.029, 4e-3],
        velocity: [23.0, 0.011, 5e-3],
        torque: [-2.1, -2e-3, -1e-3],
        offset: [-0.011, -6e-6, 2e-4],
        tacho: [13.0, 0.028, 5e-3],
        acceleration: [0.024, 8e-5, 0.97],
        acceleration_rate: [745.0, 5.8, 961.0],
        ..ObserverGains::default()
    };
    let accelerometer = AccelerationSensor { flow: [[0.79, 6.8e-5, 0.21], [-2.7e3, 0.19, 2.7e3]], ..AccelerationSensor::default() };
    let fast_gains = ObserverGains { tacho: [20.0, 1e-3, 6e-3], ..gains };
    let [motor_delay, load_delay] = late();
    DriveObserver {
        model: modelled_drive(),
        steps: 2,
        motor_delay,
        load_delay,
        tacho_share: 0.2,
        accelerometer,
        gains,
        fast_gains,
        ripple_velocity: 2.0,
    }
}

fn element(model: Model<f64>) -> FrictionElement<f64> {
    let position = Position::Ripple(Ripple::default());
    FrictionElement { friction: Friction { model, position, ..Friction::default() } }
}

fn warm_and_rested(model: Model<f64>) -> FrictionElement<f64> {
    let mut element = element(model);
    element.friction.rest = Rest::Rising(Rising { rise: 0.4, time: 0.01, way: 0.01 });
    element.friction.temperature = Temperature::Exponential(Warming::default());
    element
}

// Parts of blocks.
agree!(no_state, SlidingFriction, SlidingFriction::default());
agree!(one_state, Lag, Lag::default());
agree!(
    nested,
    Nested,
    Nested::default(),
    Nested { holder: Holder::Sliding(SlidingFriction::default()), ..Nested::default() }
);

// The blocks of the product.
agree!(cascade, Cascade, Cascade::default());
agree!(current_control, CurrentControl, CurrentControl::default());
agree!(pid, Pid, Pid::default(), Pid { use_tacho: 0.0, ..Pid::default() });
agree!(linear_controller, LinearController, linear());
agree!(limit_step, LimitStep, held_back());
agree!(limit_steps, LimitSteps, LimitSteps { step: held_back() });
agree!(predictive, Predictive, foreseeing());
agree!(
    position_controller,
    PositionController,
    PositionController::Pid(Pid::default()),
    PositionController::Cascade(Cascade::default()),
    PositionController::Linear(linear())
);
agree!(
    notch,
    Notch,
    Notch { numerator: [0.85, -1.49, 0.85], denominator: [-1.49, 0.7], torque_limit: 1.4 }
);
agree!(compensation, Compensation, Compensation::Curve(CurveFeedforward::default()));
agree!(curve_feedforward, CurveFeedforward, CurveFeedforward::default());
agree!(
    friction_feedforward,
    FrictionFeedforward,
    FrictionFeedforward { friction: rendered(), ..FrictionFeedforward::default() }
);
agree!(adaptive_stribeck, AdaptiveStribeck, AdaptiveStribeck::default());
agree!(friedland_park, FriedlandPark, FriedlandPark::default());
agree!(
    friction_observer,
    FrictionObserver,
    FrictionObserver { observer: observer(), ..FrictionObserver::default() }
);
agree!(disturbance_observer, DisturbanceObserver, DisturbanceObserver::default());
agree!(network_feedforward, NetworkFeedforward, network());
agree!(
    stiction_hold,
    StictionHold,
    StictionHold { dead_zone: 1e-3, knock_torque: 0.3, dither_torque: 0.1, ..StictionHold::default() }
);
agree!(
    axis_control,
    AxisControl,
    AxisControl { compensation: Compensation::Curve(CurveFeedforward::default()), ..AxisControl::default() }
);
agree!(decoder, Decoder, Decoder::default());
agree!(correction, CorrectionTable, CorrectionTable { torque: std::array::from_fn(|k| 1e-3 * (k as f64 - 7.0)), ..CorrectionTable::default() });
agree!(difference_torque, DifferenceTorque, DifferenceTorque::default());
agree!(
    tick,
    Tick,
    Tick { law: Law::Paper(DifferenceTorque::default()), ..Tick::default() },
    Tick { law: Law::Smooth(SmoothDifference::default()), ..Tick::default() },
    Tick { law: Law::Karnopp(Karnopp::default()), ..Tick::default() },
    Tick { arm: RenderedArm::Elastic(arm(0.0)), ..Tick::default() },
    Tick { observer: MotionObserver::Model(observer()), ..Tick::default() },
    Tick {
        observer: MotionObserver::Model(observer()),
        law: Law::Bristle(BristleDifference { observer: observer(), desired: rendered(), ahead: (0, 3), torque_limit: 1.0 }),
        ..Tick::default()
    },
);
agree!(arm_rendering, ArmRendering, arm(0.0), arm(1.0));
agree!(smooth_difference, SmoothDifference, SmoothDifference::default());
agree!(karnopp, Karnopp, Karnopp::default());
agree!(drive_model, DriveModel, modelled_drive());
agree!(input_delays, InputDelays, InputDelays { servo: late()[0], amplifier: late()[1] });
agree!(drive_observer, DriveObserver, observer());
agree!(
    bristle_difference,
    BristleDifference,
    BristleDifference { observer: observer(), desired: rendered(), ahead: (0, 3), torque_limit: 1.0 }
);
agree!(
    admittance,
    Admittance,
    Admittance { observer: observer(), desired: rendered(), bandwidth: 250.0, ahead: (0, 3), torque_limit: 1.0 }
);
agree!(
    stribeck,
    Stribeck,
    Stribeck::default(),
    Stribeck { decay: Decay::Gaussian, ..Stribeck::default() },
    Stribeck { decay: Decay::Power(Exponent { exponent: 0.7 }), ..Stribeck::default() },
);
agree!(
    friction_element_with_each_model,
    FrictionElement,
    element(Model::Static(Static::default())),
    element(Model::Dahl(Dahl::default())),
    element(Model::Lugre(LuGre::default())),
    element(Model::ElastoPlastic(ElastoPlastic::default())),
    element(Model::MaxwellSlip(MaxwellSlip::default())),
    warm_and_rested(Model::Static(Static::default())),
    warm_and_rested(Model::ElastoPlastic(ElastoPlastic::default())),
    warm_and_rested(Model::MaxwellSlip(MaxwellSlip::default())),
);
agree!(friction_step, Friction, element(Model::ElastoPlastic(ElastoPlastic::default())).friction);
agree!(velocity_observer, VelocityObserver, VelocityObserver::default());
agree!(encoder, Encoder, Encoder::default(), Encoder { fault: EncoderFault::Frozen, ..Encoder::default() });
agree!(pickups, Pickups, Pickups::new(Tacho::default(), Accelerometer::default(), DT));
agree!(
    machine_with_each_friction,
    Machine,
    machine(Model::Nothing),
    machine(Model::Static(Static::default())),
    machine(Model::Dahl(Dahl::default())),
    machine(Model::Lugre(LuGre { fading: Fading::Rational(Default::default()), ..LuGre::default() })),
    machine(Model::ElastoPlastic(ElastoPlastic::default())),
    machine(Model::MaxwellSlip(MaxwellSlip::default())),
    slack(),
);
