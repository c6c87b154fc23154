//! The derivative of a dual against differences of the `f64` instance.

use stickslip_codegen::tree::Tree;
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::scalar::Dual;

use super::case::{Random, Trajectory};
use super::number::{self, filled, numbers};

/// Parameters, state and input of a step, on which its results depend.
#[derive(Clone)]
struct Point {
    numbers: [Vec<f64>; 3],
    dt: f64,
}

impl Point {
    fn len(&self) -> usize {
        self.numbers.iter().map(Vec::len).sum()
    }

    fn at(&mut self, mut index: usize) -> &mut f64 {
        let mut part = 0;
        while index >= self.numbers[part].len() {
            index -= self.numbers[part].len();
            part += 1;
        }
        &mut self.numbers[part][index]
    }
}

fn step<B: Block<f64, Input: Default>>(block: &B, point: &Point) -> Vec<f64> {
    let [p, s, i] = point.numbers.clone();
    let mut state = filled(&B::State::default(), s);
    let output = number::step(&filled(block, p), &mut state, &filled(&B::Input::default(), i), point.dt);
    let mut out = numbers(&output);
    out.extend(numbers(&state));
    out
}

fn dual_step<B: Block<Dual<6>, Input: Default>>(block: &B, point: &Point, variables: [usize; 6]) -> Vec<Dual<6>> {
    let mut count = 0;
    let mut dual = |value: f64| {
        let mut out = Dual { value, gradient: [0.0; 6] };
        for (slot, variable) in variables.iter().enumerate() {
            if *variable == count {
                out.gradient[slot] = 1.0;
            }
        }
        count += 1;
        out
    };
    let [p, s, i] = point.numbers.clone().map(|part| part.into_iter().map(&mut dual).collect::<Vec<_>>());
    let mut state = filled(&B::State::default(), s);
    let dt = Dual { value: point.dt, gradient: [0.0; 6] };
    let output = number::step(&filled(block, p), &mut state, &filled(&B::Input::default(), i), dt);
    let mut out = numbers(&output);
    out.extend(numbers(&state));
    out
}

/// Compares at points along the trajectories. Where differences forwards, backwards and over half the distance
/// disagree, there is a kink or too little precision: such places count as unjudged, at most two in three.
pub fn check<B, D>(block: &B, dual: &D, trajectories: &[Trajectory])
where
    B: Block<f64, Input: Default> + Fields<f64>,
    D: Block<Dual<6>, Input: Default>,
{
    let of = |kind: &str, tree: Tree| tree.paths().into_iter().map(|path| format!("{kind} {path}")).collect::<Vec<_>>();
    let (parameters, state) = (of("parameter", Tree::of(block)), of("state", Tree::of(&B::State::default())));
    let variables_are = [parameters, state.clone(), of("input", Tree::of(&B::Input::default()))].concat();
    let mut random = Random::new(2);
    let (mut judged, mut unjudged) = (0, 0);
    for trajectory in trajectories.iter().take(super::case::GROUP) {
        let start = numbers(&B::State::default());
        let mut point = Point { numbers: [trajectory.parameters.clone(), start, Vec::new()], dt: trajectory.dt };
        for (number, input) in trajectory.inputs.iter().enumerate() {
            point.numbers[2].clone_from(input);
            if number % 16 == 15 && point.len() > 0 {
                let variables = std::array::from_fn(|_| random.below(point.len()));
                let gradients = dual_step(dual, &point, variables);
                let outputs = gradients.len() - state.len();
                let results = [(0..outputs).map(|i| format!("output {i}")).collect(), state.clone()].concat();
                for (slot, variable) in variables.into_iter().enumerate() {
                    for (row, slope) in slopes(block, &point, variable).into_iter().enumerate() {
                        let Some((slope, tolerance)) = slope else {
                            unjudged += 1;
                            continue;
                        };
                        judged += 1;
                        let got = gradients[row].gradient[slot];
                        assert!(
                            (got - slope).abs() <= tolerance,
                            "{} by {} at {}: the dual has the slope {got}, differences {slope} ± {tolerance}",
                            results[row],
                            variables_are[variable],
                            point.at(variable)
                        );
                    }
                }
            }
            let after = step(block, &point);
            let states = point.numbers[1].len();
            point.numbers[1] = after[after.len() - states..].to_vec();
        }
    }
    println!("{judged} slopes judged, {unjudged} not");
    assert!(judged * 2 >= unjudged, "only {judged} slopes could be judged, {unjudged} not");
}

/// The slope of each result and its tolerance; `None` if differences disagree.
fn slopes<B: Block<f64, Input: Default>>(block: &B, point: &Point, variable: usize) -> Vec<Option<(f64, f64)>> {
    let at = |offset: f64| {
        let mut moved = point.clone();
        *moved.at(variable) += offset;
        step(block, &moved)
    };
    let value = *point.clone().at(variable);
    let h = 1e-5 * value.abs().max(1e-2);
    let (middle, right, left) = (at(0.0), at(h), at(-h));
    let (near_right, near_left) = (at(0.5 * h), at(-0.5 * h));
    (0..middle.len())
        .map(|i| {
            let wide = (right[i] - left[i]) / (2.0 * h);
            let narrow = (near_right[i] - near_left[i]) / h;
            let (forwards, backwards) =
                ((near_right[i] - middle[i]) / (0.5 * h), (middle[i] - near_left[i]) / (0.5 * h));
            // Curvature changes the one-sided ones by h·f″; cancellation adds ε/h, many times if a step is divided by
            // its duration twice.
            let tolerance = 1e-3 * narrow.abs() + 1e5 * f64::EPSILON * middle[i].abs() / h + 1e-9;
            let smooth = [wide, forwards, backwards].iter().all(|s| (s - narrow).abs() <= tolerance);
            (smooth && narrow.is_finite()).then_some((narrow, 2.0 * tolerance))
        })
        .collect()
}
