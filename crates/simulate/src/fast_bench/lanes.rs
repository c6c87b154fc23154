//! Machines in vector lanes.

use stickslip_core::fields::{Field, Fields, Variant, Walk};
use stickslip_core::plant::Glide;
use stickslip_core::scalar::Scalar;
use stickslip_core::tick::{BenchInput, BenchState, TickOutput, VirtualBench};
pub use stickslip_wide::LANES;
use stickslip_wide::Wide;

use super::FastBench;

/// A number of one run, or of several runs in lanes.
pub trait LaneNumber: Scalar {
    /// The number of one lane.
    fn lane(self, lane: usize) -> f64;

    /// The same with another number in one lane.
    #[must_use]
    fn with_lane(self, lane: usize, value: f64) -> Self;

    /// A tick of the bench; see [`VirtualBench::tick_of`].
    fn tick(
        bench: &VirtualBench<Self>,
        steps: (usize, &Glide<Self>),
        state: &mut BenchState<Self>,
        input: &BenchInput<Self>,
        dt: Self,
    ) -> TickOutput<Self>;
}

impl LaneNumber for f64 {
    fn lane(self, _: usize) -> f64 {
        self
    }

    fn with_lane(self, _: usize, value: f64) -> Self {
        value
    }

    fn tick(
        bench: &VirtualBench<f64>,
        steps: (usize, &Glide<f64>),
        state: &mut BenchState<f64>,
        input: &BenchInput<f64>,
        dt: f64,
    ) -> TickOutput<f64> {
        stickslip_wide::tick_alone(bench, steps, state, input, dt)
    }
}

impl LaneNumber for Wide {
    fn lane(self, lane: usize) -> f64 {
        self.0[lane]
    }

    fn with_lane(mut self, lane: usize, value: f64) -> Self {
        self.0[lane] = value;
        self
    }

    fn tick(
        bench: &VirtualBench<Self>,
        steps: (usize, &Glide<Self>),
        state: &mut BenchState<Self>,
        input: &BenchInput<Self>,
        dt: Self,
    ) -> TickOutput<Self> {
        stickslip_wide::tick(bench, steps, state, input, dt)
    }
}

impl FastBench {
    /// Machines in lanes, each [`beside`](FastBench::beside) the first; unused lanes repeat the last. `None` without a
    /// machine, or with more machines than lanes.
    pub fn in_lanes(machines: &[&FastBench]) -> Option<FastBench<Wide>> {
        let (first, last) = (machines.first()?, machines.last()?);
        if machines.len() > LANES {
            return None;
        }
        let of = |lane: usize| machines.get(lane).unwrap_or(last);
        Some(FastBench {
            bench: gather(|lane| of(lane).bench),
            glide: gather(|lane| of(lane).glide),
            state: gather(|lane| of(lane).state),
            normals: std::array::from_fn(|lane| of(lane).normals[0]),
            ticks: first.ticks,
            dt: first.dt,
            divider: first.divider,
            cycle: first.cycle,
        })
    }

    /// Whether both may share a vector: they differ in numbers only. Noise that varies the steps of a tick is the same.
    pub fn beside(&self, other: &FastBench) -> bool {
        let schedule = |it: &FastBench| (it.ticks, it.dt.to_bits(), it.divider, it.cycle);
        schedule(self) == schedule(other)
            && (self.ticks.are_equal() || self.normals == other.normals)
            && configuration(self.bench) == configuration(other.bench)
            && configuration(self.glide) == configuration(other.glide)
            && configuration(self.state) == configuration(other.state)
    }
}

/// With fewer lanes, one machine after the other is faster.
const WORTH_LANES: usize = 3;

/// The machines in vectors of at most `most`, each machine by its index with those [`beside`](FastBench::beside) it;
/// alone where lanes are slower.
pub fn vectors(machines: &[&FastBench], most: usize) -> Vec<Vec<usize>> {
    let mut vectors: Vec<Vec<usize>> = Vec::new();
    for (index, machine) in machines.iter().enumerate() {
        let fits = |vector: &&mut Vec<usize>| vector.len() < most.min(LANES) && machine.beside(machines[vector[0]]);
        match vectors.iter_mut().find(fits) {
            Some(vector) => vector.push(index),
            None => vectors.push(vec![index]),
        }
    }
    let split = |vector: Vec<usize>| -> Vec<Vec<usize>> {
        if vector.len() < WORTH_LANES { vector.into_iter().map(|index| vec![index]).collect() } else { vec![vector] }
    };
    vectors.into_iter().flat_map(split).collect()
}

/// One struct of many: number by number, one machine for each lane.
fn gather<P: Fields<f64>>(lane: impl Fn(usize) -> P) -> P::With<Wide> {
    let mut all = lane(0).map(&mut Wide::of);
    let mut numbers = Numbers(Vec::new());
    for index in 1..LANES {
        numbers.0.clear();
        lane(index).contents(&mut numbers);
        all.contents(&mut Put { numbers: numbers.0.iter(), lane: index });
    }
    all
}

/// Numbers into one lane, in the order of declaration.
struct Put<'a> {
    numbers: std::slice::Iter<'a, f64>,
    lane: usize,
}

impl Walk<Wide> for Put<'_> {
    fn number(&mut self, _: &'static Field, value: &mut Wide) {
        value.0[self.lane] = *self.numbers.next().expect("a struct has the same numbers over any number type");
    }
}

/// The numbers of a struct, in the order of declaration.
struct Numbers(Vec<f64>);

impl Walk<f64> for Numbers {
    fn number(&mut self, _: &'static Field, value: &mut f64) {
        self.0.push(*value);
    }
}

/// Choices and fixed counts of a struct, which lanes share, in the order of declaration.
struct Configuration(Vec<usize>);

impl Walk<f64> for Configuration {
    fn number(&mut self, _: &'static Field, _: &mut f64) {}

    fn choice(&mut self, _: &'static str, _: &'static [Variant], current: usize) -> usize {
        self.0.push(current);
        current
    }

    fn fixed(&mut self, count: &mut usize) {
        self.0.push(*count);
    }
}

fn configuration(mut of: impl Fields<f64>) -> Vec<usize> {
    let mut configuration = Configuration(Vec::new());
    of.contents(&mut configuration);
    configuration.0
}
