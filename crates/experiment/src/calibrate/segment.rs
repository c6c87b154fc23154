//! Segments of the records, and the prediction of the model over one of them.

use stickslip_core::friction::Stribeck;
use stickslip_core::scalar::Scalar;

use super::delayed::Delayed;
use super::parameters::{Amplifiers, Index, PARAMETERS};
use super::response::{Acting, CHANNELS, Regime, Response, STATES};
use super::tacho_ripple::TachoRipple;

/// Own numbers of each segment: twist, both velocities and angle at its start, friction level.
pub(super) const OWN: usize = 5;
/// Index of the friction level among them.
pub(super) const LEVEL: usize = 4;
/// Ticks at the start of a segment that do not count: the states without an own number (motor torque, current,
/// instruments) settle in them; their time constants are a millisecond at most.
pub(super) const LEAD_IN: usize = 40;

/// Measured values at a tick, and the commands sent for the time from then until the next tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// For the servo amplifier [V].
    pub(super) servo_voltage: f64,
    /// For the load motor's winding [V], or the reference of its current [A].
    pub(super) load_command: f64,
    /// Of the screw, from its zero [rad].
    pub(super) angle: f64,
    /// Angle [rad] since the start of the segment, tacho [V], accelerometer [V], current [A].
    pub(super) measured: [f64; CHANNELS],
}

/// A piece of a record over which the model is assumed to be free of disturbances.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    /// State of the contacts.
    pub(super) regime: Regime,
    /// One a tick.
    pub(super) samples: Vec<Sample>,
    /// Where the search for its state starts.
    pub(super) own: [f64; OWN],
}

impl Segment {
    /// A segment at this speed of the set-point [rad/s].
    pub(super) fn new(regime: Regime, samples: Vec<Sample>, velocity: f64) -> Self {
        let mut own = [0.0; OWN];
        (own[1], own[2]) = (velocity, velocity);
        Segment { regime, samples, own }
    }

    /// Level of the load's friction by the fit [N m].
    pub(super) fn friction_level(&self) -> f64 {
        self.own[LEVEL]
    }

    /// Whether its load rests.
    pub(super) fn is_stuck(&self) -> bool {
        self.regime == Regime::Stuck
    }
}

/// Settings common to all segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Setting {
    /// Time of a tick [s].
    pub(super) dt: f64,
    /// h/2π [m/rad].
    pub(super) carriage_ratio: f64,
    /// Periods of the tacho's ripple in a revolution; 0 for none.
    pub(super) ripple_order: usize,
    /// Its amplifiers.
    pub(super) amplifiers: Amplifiers,
    /// Whether the bench has accelerometer and tacho.
    pub(super) has_instruments: bool,
    /// Friction at constant speed; only the rest of its Stribeck drop has an effect.
    pub(super) rubbed: Stribeck<f64>,
}

/// The predicted channels at each tick of a segment; `visit` gets the tick, the state and the channels.
pub(super) fn predict<T: Scalar>(
    p: &[T; PARAMETERS],
    own: &[T; OWN],
    segment: &Segment,
    setting: &Setting,
    mut visit: impl FnMut(usize, &[T; STATES], [T; CHANNELS]),
) {
    let response = Response::new(p, segment.regime, setting.amplifiers, setting.dt);
    let get = |index: Index| p[index as usize];
    let per_angle = get(Index::AccelerometerScale) * T::of(setting.carriage_ratio);
    let offset = get(Index::AccelerometerScale) * get(Index::AccelerometerOffset);
    let first = &segment.samples[0];
    let torque = get(Index::TorquePerVolt) * T::of(first.servo_voltage);
    let [twist, motor, load, angle, friction] = *own;
    let none = T::of(0.0);
    let mut state: [T; STATES] = [twist, motor, load, T::of(first.measured[3]), torque, angle, motor, none, none];
    let ripple = (setting.ripple_order > 0 && !segment.is_stuck()).then(|| TachoRipple::new(p, first.angle, setting));
    let sliding = lifted(&setting.rubbed);
    let delays = setting
        .amplifiers
        .are_late
        .then(|| [Index::ServoDelay, Index::LoadDelay].map(|index| Delayed::new(get(index) * T::of(1.0 / setting.dt))));
    for (k, sample) in segment.samples.iter().enumerate() {
        let tacho = get(Index::TachoScale) * state[6];
        let current = state[3] + get(Index::CurrentOffset);
        visit(k, &state, [state[5], tacho, per_angle * state[7] + offset, current]);
        let (mut motor_resistance, mut load_resistance) = (none, none);
        if let Regime::Sliding { level, .. } = segment.regime {
            motor_resistance = T::of(level);
            // Terms that depend on the angle are evaluated in the middle of the tick.
            let next = segment.samples.get(k + 1).map_or(sample.angle, |next| next.angle);
            let (sin, cos) = libm::sincos(0.5 * (sample.angle + next));
            let share = get(Index::RippleCosine) * T::of(cos) + get(Index::RippleSine) * T::of(sin);
            let drop = sliding.level(state[2].abs()) - sliding.kinetic_torque;
            load_resistance = friction * (T::of(1.0) + share) + drop * state[2].sign();
        }
        let [servo_voltage, load_command] = match &delays {
            None => [T::of(sample.servo_voltage), T::of(sample.load_command)],
            Some([servo, load]) => {
                let before = |late: usize| &segment.samples[k.saturating_sub(late)];
                [servo.of(|late| before(late).servo_voltage), load.of(|late| before(late).load_command)]
            }
        };
        let acting = Acting { servo_voltage, load_command, motor_resistance, load_resistance };
        let before = state;
        response.step(&mut state, acting);
        if let Some(ripple) = &ripple {
            state[6] += ripple.over_a_tick(&before, &state);
        }
    }
}

/// A curve as numbers that have slopes.
fn lifted<T: Scalar>(curve: &Stribeck<f64>) -> Stribeck<T> {
    Stribeck {
        breakaway_torque: T::of(curve.breakaway_torque),
        kinetic_torque: T::of(curve.kinetic_torque),
        stribeck_velocity: T::of(curve.stribeck_velocity),
        viscous_friction: T::of(curve.viscous_friction),
        ..Stribeck::default()
    }
}

/// Measured minus predicted, each channel in its unit.
pub(super) fn residuals(values: &[f64; PARAMETERS], segment: &Segment, setting: &Setting) -> Vec<[f64; CHANNELS]> {
    let mut out = Vec::with_capacity(segment.samples.len());
    predict(values, &segment.own, segment, setting, |k, _, predicted| {
        out.push(std::array::from_fn(|c| segment.samples[k].measured[c] - predicted[c]));
    });
    out
}
