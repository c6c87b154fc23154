//! What a lane costs: `cargo run --release -p stickslip-codegen --example lanes`.
//!
//! Times are of one lane: exponential, step of elasto-plastic friction, tick of the whole bench (ten plant steps), the
//! best of several rounds that take turns.

#[path = "../tests/support/bench.rs"]
#[allow(missing_docs, unreachable_pub, reason = "shared with the tests")]
mod bench;
#[path = "../tests/support/kernels.rs"]
#[allow(missing_docs, unreachable_pub, reason = "shared with the tests")]
mod kernels;

use std::hint::black_box;
use std::time::Instant;

use bench::{Cycle, PLANT_STEP, bench};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::friction::ElastoPlastic;
use stickslip_core::scalar::Scalar;
use stickslip_core::tick::{BenchInput, BenchState};

const ROUNDS: usize = 15;

/// A kernel with its data, run so many times.
struct Contestant {
    name: &'static str,
    lanes: usize,
    repeat: usize,
    run: Box<dyn FnMut(usize)>,
}

/// What each runs on, over one kind of number.
struct Setting<T: Scalar> {
    model: ElastoPlastic<T>,
    bench: Cycle<T>,
    state: BenchState<T>,
    input: BenchInput<T>,
    dt: T,
}

fn setting<T: Scalar>() -> Setting<T> {
    let mut input = BenchInput::<f64>::default();
    (input.order.control, input.order.render, input.order.control_due) = (1.0, 1.0, 1.0);
    (input.order.reference.position, input.order.reference.velocity) = (0.3, 2.0);
    let convert = &mut |v: f64| T::of(black_box(v));
    Setting {
        model: ElastoPlastic::<f64>::default().map(convert),
        bench: bench().map(convert),
        state: BenchState::<f64>::default().map(convert),
        input: input.map(convert),
        dt: T::of(PLANT_STEP),
    }
}

#[inline(never)]
fn scalar_exponential(x: &mut f64) {
    *x = Scalar::exp(*x);
}

#[inline(never)]
fn scalar_elastic(model: &ElastoPlastic<f64>, deflection: &mut f64, torque: &mut f64, dt: &f64) {
    (*deflection, *torque) = kernels::elastic_step(model, *deflection, *torque, *dt);
}

fn scalar() -> Vec<Contestant> {
    let (mut deflection, mut set) = (1e-4, setting::<f64>());
    let model = set.model;
    let exponential = move |n| {
        for _ in 0..n {
            let mut x = black_box(-0.3);
            scalar_exponential(&mut x);
            black_box(x);
        }
    };
    let elastic = move |n| {
        for _ in 0..n {
            let mut velocity = black_box(0.2);
            scalar_elastic(&model, &mut deflection, &mut velocity, &PLANT_STEP);
            black_box(velocity);
        }
    };
    let cycle = move |n| {
        for _ in 0..n {
            black_box(set.bench.step(&mut set.state, set.input, set.dt));
        }
    };
    vec![
        Contestant { name: "exp", lanes: 1, repeat: 20_000, run: Box::new(exponential) },
        Contestant { name: "elastic", lanes: 1, repeat: 4_000, run: Box::new(elastic) },
        Contestant { name: "cycle", lanes: 1, repeat: 100, run: Box::new(cycle) },
    ]
}

macro_rules! wide {
    ($module:ident, $lanes:literal, $($feature:tt),+) => {{
        use kernels::$module::{self, Wide};
        if $(std::arch::is_x86_feature_detected!($feature))&&+ {
            let (mut deflection, mut set) = (Wide::of(1e-4), setting::<Wide>());
            let (model, dt) = (set.model, set.dt);
            let mut output = Default::default();
            let exponential = move |n| for _ in 0..n {
                let mut x = black_box(Wide::of(-0.3));
                #[expect(unsafe_code, reason = "the one way to call a function for other processors")]
                // SAFETY: the features were detected above.
                unsafe { $module::exponential(&mut x) };
                black_box(x);
            };
            let elastic = move |n| for _ in 0..n {
                let mut velocity = black_box(Wide::of(0.2));
                #[expect(unsafe_code, reason = "the one way to call a function for other processors")]
                // SAFETY: the features were detected above.
                unsafe { $module::elastic(&model, &mut deflection, &mut velocity, &dt) };
                black_box(velocity);
            };
            let cycle = move |n| for _ in 0..n {
                #[expect(unsafe_code, reason = "the one way to call a function for other processors")]
                // SAFETY: the features were detected above.
                unsafe { $module::cycle(&set.bench, &mut set.state, &set.input, &mut output, &set.dt) };
                black_box(&output);
            };
            vec![
                Contestant { name: "exp", lanes: $lanes, repeat: 20_000 / $lanes, run: Box::new(exponential) },
                Contestant { name: "elastic", lanes: $lanes, repeat: 8_000 / $lanes, run: Box::new(elastic) },
                Contestant { name: "cycle", lanes: $lanes, repeat: 400 / $lanes, run: Box::new(cycle) },
            ]
        } else {
            println!("{} lanes of {}: this processor lacks it", $lanes, stringify!($module));
            Vec::new()
        }
    }};
}

fn main() {
    let mut columns = [
        ("f64", scalar()),
        ("AVX2, 8", wide!(avx2_8, 8, "avx2")),
        ("AVX2, 32", wide!(avx2_32, 32, "avx2")),
        ("AVX-512, 8", wide!(avx512_8, 8, "avx512f", "avx512dq", "avx512vl")),
        ("AVX-512, 32", wide!(avx512_32, 32, "avx512f", "avx512dq", "avx512vl")),
    ];
    let mut best = [[f64::INFINITY; 3]; 5];
    for _ in 0..ROUNDS {
        for (column, best) in columns.iter_mut().zip(&mut best) {
            for (contestant, best) in column.1.iter_mut().zip(best) {
                let start = Instant::now();
                (contestant.run)(contestant.repeat);
                let lanes = (contestant.repeat * contestant.lanes) as f64;
                *best = best.min(start.elapsed().as_secs_f64() * 1e9 / lanes);
            }
        }
    }
    println!("ns a lane     exp  elastic     tick");
    for ((name, contestants), best) in columns.iter().zip(&best) {
        if contestants.iter().map(|c| c.name).eq(["exp", "elastic", "cycle"]) {
            println!("{name:11} {:>5.2} {:>8.2} {:>8.1}", best[0], best[1], best[2]);
        }
    }
}
