//! Lanes become vector instructions, without a call, and keep their bits under every instruction set.

#[path = "../../codegen/tests/support/bench.rs"]
#[allow(missing_docs, unreachable_pub, reason = "support of tests")]
mod bench;

use std::collections::{BTreeSet, HashMap};
use std::process::Command;

use bench::{STEPS, TICK, bench};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::friction::{ElastoPlastic, Model};
use stickslip_core::plant::{Glide, GlidingMachine};
use stickslip_core::scalar::{Lanes, Scalar};
use stickslip_core::tick::{BenchInput, BenchState, TickOutput, VirtualBench};
use stickslip_wide::{LANES, Wide, lane_by_lane, take, tick, tick_alone};

/// Instructions of a function.
#[derive(Debug, Default)]
struct Mix {
    packed: usize,
    scalar: usize,
    /// Packed arithmetic on four numbers.
    full: usize,
    /// Calls, without those that copy a struct.
    calls: Vec<String>,
    /// Calls of memcpy and similar functions: structs of lanes, passed by value, are large.
    copies: usize,
    instructions: usize,
}

impl Mix {
    /// The functions that are called.
    fn called(&self) -> BTreeSet<&str> {
        self.calls.iter().map(|call| call.rsplit_once(['#', '\t']).map_or(call.as_str(), |(_, it)| it.trim())).collect()
    }

    /// Share of packed arithmetic in all arithmetic on doubles.
    fn share(&self) -> f64 {
        self.packed as f64 / (self.packed + self.scalar).max(1) as f64
    }
}

fn output_of(tool: &str, arguments: &[&str]) -> String {
    let executable = std::env::current_exe().expect("a running test has a file");
    let out = Command::new(tool).args(arguments).arg(executable).output();
    let out = out.unwrap_or_else(|error| panic!("cannot start {tool} ({error}). Install it: apt-get install binutils"));
    assert!(out.status.success(), "{tool} failed: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).expect("binutils print UTF-8")
}

/// Arithmetic, comparison and logic on doubles: `vaddpd`, `vcmpltpd`, `mulsd`.
fn is_arithmetic(instruction: &str, suffix: &str) -> bool {
    let name = instruction.strip_prefix('v').unwrap_or(instruction);
    let kinds = ["add", "sub", "mul", "div", "min", "max", "cmp", "and", "or", "xor", "ucomi", "comi", "sqrt"];
    name.ends_with(suffix) && kinds.iter().any(|kind| name.starts_with(kind))
}

/// Disassembles the function of this executable whose symbol contains `name`.
fn mix(name: &str) -> Mix {
    let symbols = output_of("nm", &["-S"]);
    let line = symbols.lines().find(|line| line.contains(name)).unwrap_or_else(|| panic!("no symbol {name}"));
    let number = |n: usize| {
        let text = line.split_whitespace().nth(n).unwrap_or_default();
        u64::from_str_radix(text, 16).expect("nm -S prints address and size first")
    };
    let (start, stop) = (format!("{:#x}", number(0)), format!("{:#x}", number(0) + number(1)));
    let flags = ["-d", "--no-show-raw-insn", "--start-address", &start, "--stop-address", &stop];
    let mut out = Mix::default();
    // Last symbol loaded to each register: frequent functions are called through a register.
    let mut loaded = HashMap::new();
    for line in output_of("objdump", &flags).lines() {
        let Some(instruction) = line.split('\t').nth(1) else { continue };
        let name = instruction.split_whitespace().next().unwrap_or_default();
        out.instructions += 1;
        out.packed += usize::from(is_arithmetic(name, "pd"));
        out.scalar += usize::from(is_arithmetic(name, "sd"));
        out.full += usize::from(is_arithmetic(name, "pd") && instruction.contains("%ymm"));
        if let (true, Some((_, register)), Some((_, symbol))) =
            (name == "mov", instruction.rsplit_once(",%"), line.split_once('#'))
        {
            let register = register.split_whitespace().next().unwrap_or_default();
            loaded.insert(register.to_string(), symbol.to_string());
        }
        // … or from another register.
        if let (true, Some((from, to))) = (name == "mov", instruction.rsplit_once(",%")) {
            let from = from.split_whitespace().last().and_then(|from| from.strip_prefix('%'));
            if let Some(symbol) = from.and_then(|from| loaded.get(from)).cloned() {
                loaded.insert(to.trim().to_string(), symbol);
            }
        }
        if name.starts_with("call") {
            let register = instruction.split_once("*%").map(|(_, register)| register.trim());
            let target = register.and_then(|r| loaded.get(r)).map_or(line, String::as_str);
            if ["<memcpy@", "<memset@", "<memmove@"].iter().any(|copy| target.contains(copy)) {
                out.copies += 1;
            } else {
                out.calls.push(target.into());
            }
        }
    }
    out
}

#[test]
fn a_tick_is_vector_instructions_with_few_calls() {
    // The symbols exist only if something refers to them.
    std::hint::black_box(tick as fn(&_, _, &mut _, &_, _) -> _);
    for version in ["17tick_avx2_version", "tick_avx512"] {
        let mix = mix(version);
        println!(
            "{version}: {} instructions, {} packed, {} scalar ({:.1} % packed), {} calls, {} copies",
            mix.instructions,
            mix.packed,
            mix.scalar,
            100.0 * mix.share(),
            mix.calls.len(),
            mix.copies
        );
        assert!(mix.packed > 20, "{version}: no vector code: {mix:?}");
        // Rendering law, compensation with its start, predictive control and the observer with a model are out of line. The
        // compiler may call one of them at two places, for lanes that agree and for lanes that differ.
        assert!(mix.called().len() <= 5, "{version} calls: {mix:?}");
        assert!(mix.share() > 0.95, "{version}: {mix:?}");
    }
}

/// The contacts of one machine are computed side by side in 256-bit vectors.
#[test]
fn the_contacts_of_one_machine_are_one_vector() {
    std::hint::black_box(take as fn(&_, _, &mut _, &_, _) -> _);
    let mix = mix("17take_avx2_version");
    println!("{} packed, {} scalar, {} of full width", mix.packed, mix.scalar, mix.full);
    // Predictor and corrector of three contacts, for both forms of fading; in vectors of two numbers none is full.
    assert!(mix.full > 600, "{mix:?}");
}

/// Over lanes, contacts are computed one after the other.
#[test]
fn contacts_side_by_side_have_the_bits_of_contacts_one_after_the_other() {
    let mut alone = bench();
    alone.machine.parts.plant.motor_friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    alone.machine.parts.plant.wheel.preload = 0.7;
    let lanes = alone.map(&mut |v: f64| Wide::of(v));
    let [short, _] = glides(&alone);
    let wide = short.map(&mut |v: f64| Wide::of(v));
    let (mut state, mut states) = (BenchState::default(), BenchState::default());
    let mut way: f64 = 0.0;
    for cycle in 0..CYCLES {
        let output = tick_alone(&alone, (STEPS, &short), &mut state, &input(0, cycle), TICK);
        let inputs = side_by_side::<_, LANES>([input(0, cycle); LANES]);
        let outputs = tick(&lanes, (STEPS, &wide), &mut states, &inputs, Wide::of(TICK));
        for (one, all) in numbers(&output).iter().zip(numbers(&outputs)) {
            assert_eq!(one.to_bits(), all.0[0].to_bits(), "in cycle {cycle}");
        }
        way = way.max(output.measured_angle.abs());
    }
    assert!(way > 0.2, "it moves: {way}");
}

/// The counter itself: scalar code counts as scalar, a call as a call.
#[test]
fn scalar_and_vector_code_are_distinguished() {
    #[inline(never)]
    fn deliberately_scalar(x: f64, y: f64) -> f64 {
        (x * y + 1.0).sqrt() / (x - y)
    }
    std::hint::black_box(deliberately_scalar(std::hint::black_box(1.0), std::hint::black_box(2.0)));
    let scalar = mix("19deliberately_scalar");
    assert!(scalar.scalar >= 4 && scalar.share() < 0.5, "{scalar:?}");
    #[inline(never)]
    fn deliberately_calling(x: f64) -> f64 {
        deliberately_scalar(x, 1.0) + deliberately_scalar(1.0, x)
    }
    std::hint::black_box(deliberately_calling(std::hint::black_box(2.0)));
    let caller = mix("20deliberately_calling");
    assert_eq!(caller.calls.len(), 2, "{caller:?}");
}

/// Inputs of a lane at a tick: a drive back and forth with noise.
fn input(lane: usize, cycle: usize) -> BenchInput<f64> {
    let phase = 0.002 * cycle as f64 + lane as f64;
    let mut input = BenchInput::default();
    input.order.reference.position = phase.sin();
    input.order.reference.velocity = 8.0 * phase.cos();
    input.order.control = 1.0;
    input.order.render = 1.0;
    input.order.control_due = f64::from(u8::from(cycle.is_multiple_of(4)));
    input.order.control_release = f64::from(u8::from(cycle % 4 == 3));
    input.noise.acceleration = (370.0 * phase).sin();
    input.noise.tacho = (910.0 * phase).cos();
    input
}

/// The numbers of a value.
fn numbers<T: Scalar>(value: &impl Fields<T>) -> Vec<T> {
    let mut out = Vec::new();
    value.map(&mut |v: T| {
        out.push(v);
        v
    });
    out
}

/// A struct of lanes from one struct per lane.
fn side_by_side<V: Fields<f64>, const N: usize>(lanes: [V; N]) -> V::With<Lanes<f64, N>> {
    let rows = lanes.map(|lane| numbers(&lane));
    let mut field = 0;
    lanes[0].map(&mut |_| {
        field += 1;
        Lanes(std::array::from_fn(|lane| rows[lane][field - 1]))
    })
}

const CYCLES: usize = 400;

/// Without and with long steps.
fn glides(bench: &VirtualBench<f64>) -> [Glide<f64>; 2] {
    let parts = bench.machine.parts;
    [GlidingMachine::in_short_steps, GlidingMachine::new].map(|of| of(parts, TICK / STEPS as f64).glide)
}

/// Outputs of one lane's trajectory, computed alone.
fn alone(lane: usize, glide: &Glide<f64>) -> Vec<u64> {
    let (bench, mut state, mut out) = (bench(), BenchState::default(), Vec::new());
    for cycle in 0..CYCLES {
        let output = bench.tick_of((STEPS, glide), &mut state, input(lane, cycle), TICK);
        out.extend(numbers(&output).into_iter().map(f64::to_bits));
    }
    out
}

/// The same as a block.
fn as_block(lane: usize) -> Vec<u64> {
    let (bench, mut state) = (bench(), BenchState::default());
    let outputs = (0..CYCLES).map(|cycle| bench.step(&mut state, input(lane, cycle), TICK));
    outputs.flat_map(|output| numbers(&output)).map(f64::to_bits).collect()
}

/// With the vectors of this processor, and without vectors.
#[test]
fn lanes_have_the_bits_of_f64() {
    let glides = glides(&bench());
    let [short, long]: [[Vec<u64>; LANES]; 2] =
        glides.each_ref().map(|glide| std::array::from_fn(|lane| alone(lane, glide)));
    assert!(short == std::array::from_fn(as_block), "short steps are those of the block");
    let gliding = short.iter().zip(&long).filter(|(short, long)| short != long).count();
    assert!(gliding > 2, "{gliding} lanes take long steps");
    let bench: VirtualBench<Wide> = bench().map(&mut |v: f64| Wide::of(v));
    type Ticked = fn(
        &VirtualBench<Wide>,
        (usize, &Glide<Wide>),
        &mut BenchState<Wide>,
        &BenchInput<Wide>,
        Wide,
    ) -> TickOutput<Wide>;
    let ways: [(&str, Ticked); 2] = [("tick", tick), ("lane_by_lane", lane_by_lane)];
    for ((name, tick), (alone, glide)) in
        ways.into_iter().flat_map(|way| [(way, (&short, &glides[0])), (way, (&long, &glides[1]))])
    {
        let glide = glide.map(&mut |v: f64| Wide::of(v));
        let mut state = BenchState::default();
        let mut lanes: [Vec<u64>; LANES] = std::array::from_fn(|_| Vec::new());
        for cycle in 0..CYCLES {
            let input = side_by_side::<_, LANES>(std::array::from_fn(|lane| input(lane, cycle)));
            let output = tick(&bench, (STEPS, &glide), &mut state, &input, Wide::of(TICK));
            for number in numbers(&output) {
                lanes.iter_mut().zip(number.0).for_each(|(lane, v)| lane.push(v.to_bits()));
            }
        }
        for (lane, (bits, alone)) in lanes.iter().zip(alone).enumerate() {
            assert!(bits == alone, "{name}: lane {lane} differs");
        }
    }
}
