//! The integrator of the virtual machine, and its baselines.
//!
//! The product integrates by one scheme, the well-balanced step of [`stickslip_core::plant`]; [`prepare`] refuses a
//! step above its bound. Two other schemes are baselines of the study in `docs/integrator.md`, over the same friction:
//! they call [`rate`], the core's one statement of a bristle.
//!
//! | scheme | order | in stick | stiff bristle |
//! |---|---|---|---|
//! | well balanced (WBS) | 2 | a fixed point | any speed; σ₀·h²/J + 2·σ₁·h/J ≤ 4 at rest |
//! | [`Scheme::RungeKutta`] | 4 | a fixed point | bounded by σ₀·\|Ω\|/g, so by the speed |
//! | [`Scheme::Exponential`] | 4 | a fixed point | any speed; h·√(σ₀/J) bounded at rest |

use crate::SimulateError;
use stickslip_core::drive::TwoMass;
use stickslip_core::friction::{Bristle, rate};
use stickslip_core::plant::{Machine, Plant};

use stickslip_base::Error;
use stickslip_base::stability::check_step;

/// Steps of a virtual machine in the widest vectors of the processor, with the bits of [`GlidingMachine::take`].
///
/// [`GlidingMachine::take`]: stickslip_core::plant::GlidingMachine::take
pub use stickslip_wide::take;

/// Prepares a plant for steps of `dt` [s], of which a tick has `steps`; refuses a step beyond the plant's bound.
pub fn prepare(plant: &Plant<f64>, steps: usize, dt: f64) -> Result<Machine<f64>, Error> {
    check_step(plant, dt).map_err(|law| SimulateError::StepTooLarge {
        scheme: "well-balanced",
        step: law.value,
        largest: law.bound,
        remedy: law.remedy,
    })?;
    Ok(plant.prepare(steps, dt))
}

/// A drive of two masses with one bristle on the load and viscous friction on both, under a torque on the motor.
#[derive(Clone, Copy, Debug)]
pub struct ElasticDrive<B> {
    /// Masses and coupling.
    pub mechanics: TwoMass<f64>,
    /// Viscous friction of the motor [N m s/rad].
    pub motor_viscous: f64,
    /// Viscous friction of the load [N m s/rad].
    pub load_viscous: f64,
    /// Friction of the load without its viscous part.
    pub bristle: B,
}

/// Twist of the coupling [rad], velocity of the motor [rad/s], angle of the load [rad], its velocity [rad/s],
/// deflection of the bristle [rad].
pub type DriveState = [f64; 5];

const VELOCITY: usize = 3;
const DEFLECTION: usize = 4;

/// A baseline scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// The classical explicit method of order 4.
    RungeKutta,
    /// An exponential Runge-Kutta method of order 4: Krogstad, J. Comput. Phys. 203 (2005) 72, ETDRK4-B, with the
    /// scalar rate of the bristle, after the change of state v = Ω + (σ₁/J_L)·z that takes ż out of the torque balance.
    Exponential,
}

/// Largest |λ|·h of the explicit stages: within it the left half plane is in the region of stability of RK4
/// (2.785 on the real, 2.828 on the imaginary axis, 2.61 in between), minus a margin for changes within a step.
const EXPLICIT_LIMIT: f64 = 2.5;

impl<B: Bristle<f64>> ElasticDrive<B> {
    /// Derivative of the state under a torque on the motor [N m].
    fn rates(&self, x: &DriveState, torque: f64) -> DriveState {
        let [twist, motor_velocity, _, velocity, deflection] = *x;
        let m = &self.mechanics;
        let coupling = m.coupling_stiffness * twist + m.coupling_damping * (motor_velocity - velocity);
        let (bristle_rate, bristle_torque) = rate(&self.bristle, deflection, velocity);
        [
            motor_velocity - velocity,
            (torque - coupling - self.motor_viscous * motor_velocity) / m.motor_inertia,
            velocity,
            (coupling - bristle_torque - self.load_viscous * velocity) / m.load_inertia,
            bristle_rate,
        ]
    }

    /// Rate at which the bristle slides, α·σ₀·|Ω|/g [1/s].
    fn slide(&self, x: &DriveState) -> f64 {
        let speed = x[VELOCITY].abs();
        let level = self.bristle.sliding(speed);
        self.bristle.release(x[DEFLECTION], x[VELOCITY], level).share * self.bristle.stiffness() * speed / level
    }

    /// The largest step [s] of a scheme at a velocity of the load [rad/s].
    ///
    /// Of the linearised drive no eigenvalue is larger than the sum of its damping rates or, where it oscillates, than
    /// the root of the sum of its stiffnesses, each per inertia. RK4 meets all of them, the sliding of the bristle too;
    /// the exponential scheme excludes the bristle's rows.
    pub fn largest_step(&self, scheme: Scheme, velocity: f64) -> f64 {
        let m = &self.mechanics;
        let (stiffness, speed) = (self.bristle.stiffness(), velocity.abs());
        let square = (stiffness + m.coupling_stiffness) / m.load_inertia + m.coupling_stiffness / m.motor_inertia;
        let drive = (self.load_viscous + m.coupling_damping) / m.load_inertia
            + (self.motor_viscous + m.coupling_damping) / m.motor_inertia;
        let bristle = self.bristle.damping(velocity) / m.load_inertia + stiffness * speed / self.bristle.sliding(speed);
        let damping = match scheme {
            Scheme::RungeKutta => drive + bristle,
            Scheme::Exponential => drive,
        };
        let frequency = square.sqrt();
        // Not `max`: NaN must remain NaN, so that the step is refused.
        EXPLICIT_LIMIT / if damping < frequency { frequency } else { damping }
    }

    /// One step of `dt` [s]; `torque` on the motor [N m] at the start, the middle and the end.
    ///
    /// Refused above the scheme's bound at this velocity, where the result would be wrong without a warning.
    pub fn step(&self, scheme: Scheme, x: &DriveState, torque: [f64; 3], dt: f64) -> Result<DriveState, Error> {
        let largest = self.largest_step(scheme, x[VELOCITY]);
        if dt > largest || dt.is_nan() || largest.is_nan() {
            let (scheme, remedy) = match scheme {
                Scheme::RungeKutta => (
                    "Runge-Kutta",
                    "The bristle is too stiff at this speed: use the well-balanced step, or a smaller one.",
                ),
                Scheme::Exponential => {
                    ("exponential", "The vibration is too fast: use the well-balanced step, or a smaller one.")
                }
            };
            return Err(SimulateError::StepTooLarge { scheme, step: dt, largest, remedy }.into());
        }
        Ok(match scheme {
            Scheme::RungeKutta => self.runge_kutta(x, torque, dt),
            Scheme::Exponential => self.exponential(x, torque, dt),
        })
    }

    fn runge_kutta(&self, x: &DriveState, torque: [f64; 3], dt: f64) -> DriveState {
        let k1 = self.rates(x, torque[0]);
        let k2 = self.rates(&along(x, 0.5 * dt, &k1), torque[1]);
        let k3 = self.rates(&along(x, 0.5 * dt, &k2), torque[1]);
        let k4 = self.rates(&along(x, dt, &k3), torque[2]);
        std::array::from_fn(|i| x[i] + dt / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    }

    fn exponential(&self, x: &DriveState, torque: [f64; 3], dt: f64) -> DriveState {
        // v = Ω + s·z with s = σ₁/J_L held over the step; ż + r·z is the rest of the bristle's row.
        let share = self.bristle.damping(x[VELOCITY]) / self.mechanics.load_inertia;
        let decay = share + self.slide(x);
        let remainder = |u: &DriveState, torque: f64| {
            let mut plain = *u;
            plain[VELOCITY] -= share * u[DEFLECTION];
            let mut rates = self.rates(&plain, torque);
            rates[VELOCITY] += share * rates[DEFLECTION];
            rates[DEFLECTION] += decay * u[DEFLECTION];
            rates
        };
        let mut u = *x;
        u[VELOCITY] += share * x[DEFLECTION];

        let (half, whole) = (Phi::of(-0.5 * decay * dt), Phi::of(-decay * dt));
        let none = Phi::of(0.0);
        let row = |i: usize, phi: Phi| if i == DEFLECTION { phi } else { none };
        let n1 = remainder(&u, torque[0]);
        let a = std::array::from_fn(|i| {
            let p = row(i, half);
            p.exp * u[i] + 0.5 * dt * p.one * n1[i]
        });
        let n2 = remainder(&a, torque[1]);
        let b = std::array::from_fn(|i| {
            let p = row(i, half);
            p.exp * u[i] + 0.5 * dt * p.one * n1[i] + dt * p.two * (n2[i] - n1[i])
        });
        let n3 = remainder(&b, torque[1]);
        let c = std::array::from_fn(|i| {
            let p = row(i, whole);
            p.exp * u[i] + dt * p.one * n1[i] + 2.0 * dt * p.two * (n3[i] - n1[i])
        });
        let n4 = remainder(&c, torque[2]);
        let mut end: DriveState = std::array::from_fn(|i| {
            let p = row(i, whole);
            p.exp * u[i]
                + dt * ((p.one - 3.0 * p.two + 4.0 * p.three) * n1[i]
                    + (2.0 * p.two - 4.0 * p.three) * (n2[i] + n3[i])
                    + (4.0 * p.three - p.two) * n4[i])
        });
        end[VELOCITY] -= share * end[DEFLECTION];
        end
    }
}

/// x + dt·k.
fn along(x: &DriveState, dt: f64, k: &DriveState) -> DriveState {
    std::array::from_fn(|i| x[i] + dt * k[i])
}

/// e^x and φ₁ = (e^x − 1)/x, φ₂ = (φ₁ − 1)/x, φ₃ = (φ₂ − 1/2)/x.
#[derive(Clone, Copy)]
struct Phi {
    exp: f64,
    one: f64,
    two: f64,
    three: f64,
}

impl Phi {
    fn of(x: f64) -> Self {
        if x.abs() < 1.0 {
            // Σ x^k/(k+3)! by Horner up to k = 15, remainder 2e-16/7; the others follow without cancellation.
            let mut three = 0.0;
            for k in (0..=15).rev() {
                three = three * x / f64::from(k + 4) + 1.0;
            }
            three /= 6.0;
            let two = 0.5 + x * three;
            let one = 1.0 + x * two;
            Phi { exp: 1.0 + x * one, one, two, three }
        } else {
            let one = libm::expm1(x) / x;
            let two = (one - 1.0) / x;
            Phi { exp: libm::exp(x), one, two, three: (two - 0.5) / x }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::friction::{ElastoPlastic, LuGre};

    fn drive() -> ElasticDrive<ElastoPlastic<f64>> {
        let lugre = LuGre { bristle_stiffness: 3000.0, ..LuGre::default() };
        ElasticDrive {
            mechanics: TwoMass::default(),
            motor_viscous: 1e-4,
            load_viscous: 2e-4,
            bristle: ElastoPlastic { lugre, ..ElastoPlastic::default() },
        }
    }

    #[test]
    fn the_phi_functions_join_where_the_series_ends() {
        for x in [-1.0, 1.0] {
            let (below, above) = (Phi::of(x * (1.0 - 1e-9)), Phi::of(x));
            for (a, b) in [(below.exp, above.exp), (below.one, above.one), (below.two, above.two)] {
                assert!((a - b).abs() <= 1e-8);
            }
            assert!((below.three - above.three).abs() <= 1e-9);
        }
        let p = Phi::of(0.0);
        assert_eq!((p.exp, p.one, p.two, p.three), (1.0, 1.0, 0.5, 1.0 / 6.0));
    }

    #[test]
    fn both_schemes_agree_with_a_finer_step_while_the_load_breaks_away() {
        let drive = drive();
        let run = |scheme, dt: f64| {
            let mut x = DriveState::default();
            for step in 0..(0.1 / dt).round() as u64 {
                let at = |part: f64| 6.0 * (step as f64 + part) * dt;
                x = drive.step(scheme, &x, [at(0.0), at(0.5), at(1.0)], dt).expect("within the bound");
            }
            x
        };
        let exact = run(Scheme::RungeKutta, 2.5e-7);
        assert!(exact[VELOCITY] > 10.0, "the load must have broken away");
        for scheme in [Scheme::RungeKutta, Scheme::Exponential] {
            let error = (run(scheme, 2e-6)[VELOCITY] - exact[VELOCITY]).abs() / exact[VELOCITY];
            // Measured: 8e-15, rounding.
            assert!(error <= 1e-12, "{scheme:?}: {error}");
        }
    }

    #[test]
    fn an_explicit_step_beyond_the_bristle_is_refused_at_speed_only() {
        let drive = drive();
        let moving = |velocity| [0.0, velocity, 0.0, velocity, 0.0];
        // σ₀·|Ω|/g = 3000·50/0.18 1/s: the bound falls with speed to 3 µs.
        assert!(drive.step(Scheme::RungeKutta, &moving(0.1), [0.0; 3], 1e-5).is_ok());
        let error = drive.step(Scheme::RungeKutta, &moving(50.0), [0.0; 3], 1e-5);
        assert!(
            matches!(error.as_ref().err().and_then(|error| error.of()), Some(SimulateError::StepTooLarge { step: 1e-5, largest, .. }) if *largest < 4e-6),
            "{error:?}"
        );
        assert!(drive.step(Scheme::Exponential, &moving(50.0), [0.0; 3], 1e-5).is_ok());
        assert!(drive.step(Scheme::Exponential, &moving(50.0), [0.0; 3], 2e-3).is_err());
        assert!(drive.step(Scheme::RungeKutta, &moving(f64::NAN), [0.0; 3], 1e-6).is_err());
    }

    #[test]
    fn a_plant_is_prepared_only_for_a_step_within_its_bound() {
        let mut plant = Plant::default();
        assert!(prepare(&plant, 10, 25e-6).is_ok());
        plant.drive.load_inertia = 1e-7;
        let Err(error) = prepare(&plant, 10, 25e-6) else { panic!("the light load would ring") };
        assert!(error.to_string().starts_with("a well-balanced step of 2.5e-5 s is above"), "{error}");
    }
}
