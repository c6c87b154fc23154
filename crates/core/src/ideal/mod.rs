//! An ideal axis: two masses, one contact with bristles, a torque that is held from sample to sample.
//!
//! For questions to friction and control alone, asked a thousand times: no currents, no sensors, no noise. The scheme is
//! of fourth order away from a reversal, so that a sample needs one or two steps where the virtual machine
//! ([`plant`](crate::plant)) takes dozens; where play, an arm, several contacts or instruments count, take that one.
//!
//! # Scheme
//!
//! Over a step the deflection is a parabola through its start, middle and end, and so is the bristle torque
//! σ₀·z + σ₁·ż. Under it the masses flow exactly. The bristles relax exponentially with the rate that they have in the
//! middle; what is left of their own equation, N, is a parabola as well (z = `deflection`, r = `decay`):
//!
//! ```text
//! ẏ = A·y + B·M + D·(σ₀·z + σ₁·ż),   y = (δ, Ω_M, Ω, φ)
//! ż = −r·z + N,   N = Ω − α·σ₀·|Ω|·z/g + r·z,   r = σ₁/J_L + ∂(α·σ₀·|Ω|·z/g)/∂z in the middle
//! ```
//!
//! Each pass computes first the middle, then the end, from what the pass before has left: two evaluations of the
//! friction. One pass follows a simple predictor, three leave the error of the parabola alone (exponential collocation
//! at Lobatto's points, by Gauss-Seidel; Hochbruck & Ostermann, Acta Numerica 19 (2010) 209). r counts the velocity that
//! a bristle gives up when it bends, which takes ż out of the balance of torques.
//!
//! Rest is a fixed point: with Ω = 0 both rows reproduce what holds, so that a load below breakaway does not creep.

mod phi;
#[cfg(test)]
mod tests;

use phi::Phi;

use crate::Fields;
use crate::drive::{TwoMass, flow};
use crate::friction::Bristle;
use crate::scalar::{Mask, Scalar};

/// Two masses with a contact on the load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdealAxis<T, B> {
    /// Masses and coupling.
    pub mechanics: TwoMass<T>,
    /// Viscous friction of the motor [N m s/rad].
    pub motor_viscous: T,
    /// Viscous friction of the load [N m s/rad].
    pub load_viscous: T,
    /// Friction of the load without its viscous part.
    pub bristle: B,
}

/// What a velocity makes of the contact.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Contact<T> {
    /// Sliding level.
    #[field(symbol = "g", unit = "N m")]
    pub level: T,
    /// Bristles that a way drags along: what they lose per angle.
    #[field(symbol = "σ₀/g", unit = "1/rad")]
    pub pull: T,
    /// Damping of the bristles.
    #[field(symbol = "σ₁", unit = "N m s/rad")]
    pub damping: T,
}

/// How fast bristles slide.
#[derive(Clone, Copy, Debug)]
struct Slide<T> {
    /// Rate at which they are dragged along, α·σ₀·|Ω|/g [1/s].
    rate: T,
    /// Rate at which a deviation of their deflection decays, ∂(α·z)/∂z·σ₀·|Ω|/g [1/s].
    decay: T,
}

/// What an axis remembers.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AxisState<T> {
    /// Twist of the coupling, φ_M − φ.
    #[field(symbol = "δ", unit = "rad")]
    pub twist: T,
    /// Velocity of the motor.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
    /// Velocity of the load.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Angle of the load.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Deflection of the bristles.
    #[field(symbol = "z", unit = "rad")]
    pub deflection: T,
    /// The contact at the velocity that the last pass has left.
    pub contact: Contact<T>,
}

impl<T: Scalar> AxisState<T> {
    /// At rest at angle 0 with nothing bent.
    #[inline(always)]
    pub fn at_rest(bristle: &impl Bristle<T>) -> Self {
        let zero = T::of(0.0);
        let contact = Contact::of(bristle, zero);
        AxisState { twist: zero, motor_velocity: zero, velocity: zero, angle: zero, deflection: zero, contact }
    }

    /// Angle of the motor [rad].
    #[inline(always)]
    pub fn motor_angle(&self) -> T {
        self.angle + self.twist
    }

    /// Rate at which the bristles are dragged along [1/s].
    #[inline(always)]
    pub fn slide(&self, bristle: &impl Bristle<T>) -> T {
        self.contact.slide(bristle, self.deflection, self.velocity).rate
    }

    /// `self` where the mask is true, `other` elsewhere.
    #[inline(always)]
    #[must_use]
    pub fn where_else(&self, mask: T::Mask, other: &Self) -> Self {
        AxisState {
            twist: mask.select(self.twist, other.twist),
            motor_velocity: mask.select(self.motor_velocity, other.motor_velocity),
            velocity: mask.select(self.velocity, other.velocity),
            angle: mask.select(self.angle, other.angle),
            deflection: mask.select(self.deflection, other.deflection),
            contact: Contact {
                level: mask.select(self.contact.level, other.contact.level),
                pull: mask.select(self.contact.pull, other.contact.pull),
                damping: mask.select(self.contact.damping, other.contact.damping),
            },
        }
    }
}

impl<T: Scalar> Contact<T> {
    #[inline(always)]
    fn of(bristle: &impl Bristle<T>, velocity: T) -> Self {
        let level = bristle.sliding(velocity.abs());
        Contact { level, pull: bristle.stiffness() / level, damping: bristle.damping(velocity) }
    }

    #[inline(always)]
    fn slide(&self, bristle: &impl Bristle<T>, deflection: T, velocity: T) -> Slide<T> {
        let release = bristle.release(deflection, velocity, self.level);
        let quick = self.pull * velocity.abs();
        Slide { rate: release.share * quick, decay: (release.share + release.slope) * quick }
    }
}

/// Rows of what flows: twist, motor velocity, velocity, angle.
const ROWS: usize = 4;
const TWIST: usize = 0;
const MOTOR: usize = 1;
const LOAD: usize = 2;
const ANGLE: usize = 3;
/// Columns: twist, motor velocity, velocity, motor torque, and the bristle torque at start, middle and end.
const COLUMNS: usize = 7;

/// The exact flow of the masses over a step, prepared.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AxisFlow<T> {
    /// The step.
    #[field(symbol = "h", unit = "s")]
    pub dt: T,
    /// Its inverse.
    #[field(unit = "1/s")]
    per_dt: T,
    /// Velocity that a bend of the bristles costs the load, per damping.
    #[field(symbol = "1/J_L", unit = "1/(kg m^2)")]
    per_load: T,
    /// Velocity of the load in the middle of the step.
    #[field(unit = "1")]
    middle: [T; COLUMNS],
    /// All rows at its end.
    #[field(unit = "1")]
    end: [[T; COLUMNS]; ROWS],
}

impl<T: Scalar, B> IdealAxis<T, B> {
    /// Prepares the flow for steps of `dt` [s].
    pub fn prepare(&self, dt: T) -> AxisFlow<T> {
        // A parabola f + g·τ + k·τ²/2 in τ = t/h as states of its own (Van Loan 1978).
        const F: usize = ROWS;
        const TORQUE: usize = ROWS + 3;
        const N: usize = ROWS + 4;
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let m = &self.mechanics;
        let (per_motor, per_load, per_dt) = (one / m.motor_inertia, one / m.load_inertia, one / dt);
        let mut a = [[zero; N]; N];
        a[TWIST][MOTOR] = one;
        a[TWIST][LOAD] = -one;
        a[MOTOR][TWIST] = -m.coupling_stiffness * per_motor;
        a[MOTOR][MOTOR] = -(m.coupling_damping + self.motor_viscous) * per_motor;
        a[MOTOR][LOAD] = m.coupling_damping * per_motor;
        a[MOTOR][TORQUE] = per_motor;
        a[LOAD][TWIST] = m.coupling_stiffness * per_load;
        a[LOAD][MOTOR] = m.coupling_damping * per_load;
        a[LOAD][LOAD] = -(m.coupling_damping + self.load_viscous) * per_load;
        a[LOAD][F] = -per_load;
        a[ANGLE][LOAD] = one;
        a[F][F + 1] = per_dt;
        a[F + 1][F + 2] = per_dt;
        let columns = |row: &[T; N]| {
            // f, g and k by the values at start, middle and end.
            let [f, g, k] = [row[F], row[F + 1], row[F + 2]];
            let start = f - T::of(3.0) * g + T::of(4.0) * k;
            let middle = T::of(4.0) * g - T::of(8.0) * k;
            let end = T::of(4.0) * k - g;
            [row[TWIST], row[MOTOR], row[LOAD], row[TORQUE], start, middle, end]
        };
        let half = flow(&a, T::of(0.5) * dt);
        let whole = flow(&a, dt);
        AxisFlow {
            dt,
            per_dt,
            per_load,
            middle: columns(&half[LOAD]),
            end: [TWIST, MOTOR, LOAD, ANGLE].map(|row| columns(&whole[row])),
        }
    }
}

impl<T: Scalar> AxisFlow<T> {
    /// One step under a torque on the motor [N m].
    ///
    /// The error falls with the number of passes; beyond 3 only a shorter step helps.
    #[inline(always)]
    pub fn step(&self, bristle: &impl Bristle<T>, state: &mut AxisState<T>, torque: T, passes: usize) {
        let one = T::of(1.0);
        let start = *state;
        let (dt, half) = (self.dt, T::of(0.5) * self.dt);
        let z0 = start.deflection;
        let middle_carried = carried(&self.middle, &start, torque);
        let velocity = carried(&self.end[LOAD], &start, torque);

        let slide = start.contact.slide(bristle, z0, start.velocity);
        let rate = start.velocity - slide.rate * z0;
        let decay = slide.decay + start.contact.damping * self.per_load;
        let zm = z0 + half * rate / (one + half * decay);
        let mut zm = bristle.within_reach(start.contact.level, z0, zm);
        let mut ze = T::of(2.0) * zm - z0;
        let (mut middle, mut end) = (start.contact, start.contact);
        for pass in 0..passes {
            let torques = self.torques(bristle, [z0, zm, ze], [start.contact, middle, end]);
            let omega_m = pushed(middle_carried, &self.middle, torques);
            middle = Contact::of(bristle, omega_m);
            let slide_m = middle.slide(bristle, zm, omega_m);
            let decay = slide_m.decay + middle.damping * self.per_load;
            let first = Phi::of(half * decay);
            let whole = first.doubled();
            let n0 = start.velocity + (decay - slide.rate) * z0;
            let nm = omega_m + (decay - slide_m.rate) * zm;
            if pass == 0 {
                zm = first.exp * z0 + half * (first.one * n0 + first.two * (nm - n0));
                ze = whole.exp * z0 + dt * (whole.one * n0 + T::of(2.0) * whole.two * (nm - n0));
                ze = bristle.within_reach(middle.level, z0, ze);
            }
            let torques = self.torques(bristle, [z0, zm, ze], [start.contact, middle, end]);
            let omega_e = pushed(velocity, &self.end[LOAD], torques);
            end = Contact::of(bristle, omega_e);
            let ne = omega_e + (decay - end.slide(bristle, ze, omega_e).rate) * ze;
            let bend = T::of(4.0) * (nm - n0) - (ne - n0);
            let turn = T::of(4.0) * ((ne - nm) - (nm - n0));
            zm = first.exp * z0
                + half * (first.one * n0 + T::of(0.5) * first.two * bend + T::of(0.25) * first.three * turn);
            ze = whole.exp * z0 + dt * (whole.one * n0 + whole.two * bend + whole.three * turn);
            ze = bristle.within_reach(end.level, z0, ze);
        }

        let torques = self.torques(bristle, [z0, zm, ze], [start.contact, middle, end]);
        *state = AxisState {
            twist: pushed(carried(&self.end[TWIST], &start, torque), &self.end[TWIST], torques),
            motor_velocity: pushed(carried(&self.end[MOTOR], &start, torque), &self.end[MOTOR], torques),
            velocity: pushed(velocity, &self.end[LOAD], torques),
            angle: start.angle + pushed(carried(&self.end[ANGLE], &start, torque), &self.end[ANGLE], torques),
            deflection: ze,
            contact: end,
        };
    }

    /// σ₀·z + σ₁·ż [N m] at start, middle and end of the parabola through three deflections.
    #[inline(always)]
    fn torques(&self, bristle: &impl Bristle<T>, [z0, zm, ze]: [T; 3], contacts: [Contact<T>; 3]) -> [T; 3] {
        let (half, whole) = (zm - z0, ze - z0);
        let quarter = T::of(4.0) * half;
        let rates = [quarter - whole, whole, T::of(3.0) * whole - quarter];
        let stiffness = bristle.stiffness();
        [
            stiffness * z0 + contacts[0].damping * (rates[0] * self.per_dt),
            stiffness * zm + contacts[1].damping * (rates[1] * self.per_dt),
            stiffness * ze + contacts[2].damping * (rates[2] * self.per_dt),
        ]
    }
}

/// What states and motor torque at the start become in a row.
#[inline(always)]
fn carried<T: Scalar>(row: &[T; COLUMNS], start: &AxisState<T>, torque: T) -> T {
    (row[0] * start.twist + row[1] * start.motor_velocity) + (row[2] * start.velocity + row[3] * torque)
}

/// What a row carries, and what the bristle torque adds.
#[inline(always)]
fn pushed<T: Scalar>(carried: T, row: &[T; COLUMNS], torques: [T; 3]) -> T {
    carried + (row[4] * torques[0] + (row[5] * torques[1] + row[6] * torques[2]))
}
