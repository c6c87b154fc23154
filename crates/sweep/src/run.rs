//! A team of variants, sample after sample, in the widest vectors that the processor has.

use multiversion::multiversion;
use stickslip_core::block::Block as _;
use stickslip_core::control::ControllerInput;
use stickslip_core::fields::Fields as _;
use stickslip_core::friction::Bristle;
use stickslip_core::ideal::{AxisFlow, AxisState, IdealAxis};
use stickslip_core::scalar::Scalar;

use super::kind::{SweptFriction, SweptLaw, numbers, put};
use super::ladder::{FORGETS, Rung, share};
use super::number::Number;
use super::{Plan, Variant};

/// Variants that run side by side.
pub(super) struct Team<'a, B, C> {
    members: &'a [Variant<B, C>],
    sample_time: f64,
    reference: &'a [f64],
}

/// Angle and deflection at each sample.
pub(super) struct Samples<T>(Vec<[T; 2]>);

impl<T> Default for Samples<T> {
    fn default() -> Self {
        Samples(Vec::new())
    }
}

/// Samples that are turned at once: as many of all lanes stay in the nearest memory.
const BLOCK: usize = 64;

impl<T: Number> Samples<T> {
    /// Angle and deflection of each of so many lanes.
    pub(super) fn courses(&self, lanes: usize) -> Vec<[Vec<f64>; 2]> {
        let blank = || Vec::with_capacity(self.0.len());
        let mut courses: Vec<_> = (0..lanes).map(|_| [blank(), blank()]).collect();
        for block in self.0.chunks(BLOCK) {
            for (lane, [angle, deflection]) in courses.iter_mut().enumerate() {
                angle.extend(block.iter().map(|[angle, _]| angle.lane(lane)));
                deflection.extend(block.iter().map(|[_, deflection]| deflection.lane(lane)));
            }
        }
        courses
    }

    /// Largest difference of the angles from finer ones over their largest magnitude, of each of so many lanes; NaN
    /// where one is no number.
    pub(super) fn apart(&self, finer: &Samples<T>, lanes: usize) -> Vec<f64> {
        let zero = T::of(0.0);
        let (mut difference, mut size, mut sum) = (zero, zero, zero);
        for ([coarse, _], [fine, _]) in self.0.iter().zip(&finer.0) {
            let deviation = (*coarse - *fine).abs();
            difference = difference.max(deviation);
            size = size.max(fine.abs());
            // The larger of two passes over NaN, their sum does not.
            sum += deviation;
        }
        (0..lanes)
            .map(
                |lane| {
                    if sum.lane(lane).is_finite() { share(difference.lane(lane), size.lane(lane)) } else { f64::NAN }
                },
            )
            .collect()
    }
}

impl<'a, B: SweptFriction, C: SweptLaw> Team<'a, B, C> {
    pub(super) fn new(members: &'a [Variant<B, C>], plan: &'a Plan) -> Self {
        Team { members, sample_time: plan.sample_time, reference: &plan.reference }
    }

    /// Runs the team on a rung. Lanes that are left repeat the last member.
    pub(super) fn run<T: Number>(&self, rung: Rung, samples: &mut Samples<T>) {
        let of = |lane: usize| &self.members[lane.min(self.members.len() - 1)];
        let zero = T::of(0.0);
        samples.0.resize(self.reference.len(), [zero; 2]);
        let mut bristle = of(0).axis.bristle.over::<T>();
        let mut law = of(0).law.over::<T>();
        let flow = |axis: &IdealAxis<f64, B>, steps: usize| axis.prepare(self.sample_time / steps as f64);
        let steps = [rung.sliding, rung.presliding];
        let mut flows = steps.map(|steps| flow(&of(0).axis, steps).map(&mut T::of));
        for lane in 1..T::LANES {
            put(&numbers(&of(lane).axis.bristle.over::<f64>()), lane, &mut bristle);
            put(&numbers(&of(lane).law.over::<f64>()), lane, &mut law);
            let axis = &of(lane).axis;
            // Most sweeps leave the masses as they are: their flow is there already.
            if !same_masses(axis, &of(0).axis) {
                for (flows, steps) in flows.iter_mut().zip(steps) {
                    put(&numbers(&flow(axis, steps)), lane, flows);
                }
            }
        }
        let prepared = Prepared { bristle, law, flows, rung, sample_time: self.sample_time };
        vectors::<T, B, C>(&prepared, self.reference, &mut samples.0);
    }
}

fn same_masses<B>(one: &IdealAxis<f64, B>, other: &IdealAxis<f64, B>) -> bool {
    one.mechanics == other.mechanics
        && one.motor_viscous == other.motor_viscous
        && one.load_viscous == other.load_viscous
}

/// A team, ready to run.
struct Prepared<T: Scalar, B: SweptFriction, C: SweptLaw> {
    bristle: B::Over<T>,
    law: C::Over<T>,
    /// Of a sliding step and of a presliding one.
    flows: [AxisFlow<T>; 2],
    rung: Rung,
    sample_time: f64,
}

/// Chosen at run time by what the processor can do; the bits are the same in all of them.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn vectors<T: Number, B: SweptFriction, C: SweptLaw>(
    team: &Prepared<T, B, C>,
    reference: &[f64],
    samples: &mut [[T; 2]],
) {
    let mut state = AxisState::at_rest(&team.bristle);
    let mut memory = Default::default();
    let sample_time = T::of(team.sample_time);
    let forgets = T::of(FORGETS / team.sample_time);
    let [sliding, presliding] = &team.flows;
    for (sample, wanted) in samples.iter_mut().zip(reference) {
        *sample = [state.angle, state.deflection];
        let input = ControllerInput {
            reference_position: T::of(*wanted),
            measured_angle: state.motor_angle(),
            measured_velocity: state.motor_velocity,
            ..ControllerInput::default()
        };
        let torque = team.law.step(&mut memory, input, sample_time).torque;
        // Each lane goes its own way; a way that none goes is not gone.
        let slides = state.slide(&team.bristle).ge(forgets);
        let count = T::count(slides);
        let start = state;
        if count > 0 {
            state = steps(sliding, &team.bristle, start, torque, team.rung.sliding, team.rung.passes);
        }
        if count < T::LANES {
            let other = steps(presliding, &team.bristle, start, torque, team.rung.presliding, team.rung.passes);
            state = if count > 0 { state.where_else(slides, &other) } else { other };
        }
    }
}

#[inline(always)]
fn steps<T: Scalar>(
    flow: &AxisFlow<T>,
    bristle: &impl Bristle<T>,
    mut state: AxisState<T>,
    torque: T,
    steps: usize,
    passes: usize,
) -> AxisState<T> {
    for _ in 0..steps {
        flow.step(bristle, &mut state, torque, passes);
    }
    state
}
