//! W1 and W2: one trajectory, and a thousand variants, of an ideal axis under control, at equal error.
//!
//! Processor time of one core. Each peer takes the smallest number of substeps that meets the bound, with a reference in
//! hand: the classical Runge-Kutta method with 8,000 substeps a millisecond (W1) or 500 (W2). Of a thousand variants
//! `c_rk4` takes the steps that the worst one needs for all, as who has no reference must at least; `c_rk4_each` has for
//! each variant those that it needs alone. `…_known` gives the rungs of a sweep the same help; without it a sweep finds its
//! steps itself, variant by variant, and what it runs to judge its error is in its time.

mod drive;
mod peers;

use std::error::Error;
use std::path::Path;

use drive::{Bristles, Constant, cpu_seconds, elasto_plastic, plan, variants};
use peers::{Case, Rk4, Server};
use stickslip_core::control::Cascade;
use stickslip_sweep::{Arithmetic, Course, RUNGS, SweptFriction, Variant, on_rung, sweep};

/// Samples of the motion: 10 s.
const SAMPLES: usize = 10_001;
/// Substeps of the references.
const FINE: [usize; 2] = [8000, 500];
/// Substeps that a peer may take.
const SUBSTEPS: [usize; 24] =
    [8, 12, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 30, 32, 36, 40, 50, 64, 100, 160, 250];

/// Names, as `cargo xtask bench` takes them.
pub(crate) const NAMES: [&str; 4] = ["w1_1e-4", "w1_1e-6", "w2_1e-4", "w2_1e-6"];

/// Runs what is wanted and prints its lines.
pub(crate) fn run(wanted: &dyn Fn(&str) -> bool, rounds: usize) -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("stickslip-w2-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let outcome = contest(wanted, &folder, rounds);
    std::fs::remove_dir_all(&folder)?;
    outcome
}

fn contest(wanted: &dyn Fn(&str) -> bool, folder: &Path, rounds: usize) -> Result<(), Box<dyn Error>> {
    let bristles: [Bristles; 2] = [Bristles::Constant, Bristles::ElastoPlastic];
    for (part, (one, fine)) in [(true, FINE[0]), (false, FINE[1])].into_iter().enumerate() {
        let names = &NAMES[2 * part..2 * part + 2];
        if !names.iter().any(|name| wanted(name)) {
            continue;
        }
        for kind in bristles {
            let rk4 = Rk4::compile(folder, kind)?;
            let cases = drive::cases(one);
            let reference = rk4.vectors(&with(&cases, |_| fine), SAMPLES)?.1;
            for (name, bound) in names.iter().zip([1e-4, 1e-6]).filter(|(name, _)| wanted(name)) {
                let job = Job { name, bound, kind, cases: &cases, reference: &reference, rounds };
                match kind {
                    Bristles::Constant => job.run(&variants(&cases, |lugre| Constant { lugre }), &rk4)?,
                    Bristles::ElastoPlastic => job.run(&variants(&cases, elasto_plastic), &rk4)?,
                }
            }
        }
    }
    Ok(())
}

fn with(cases: &[Case], substeps: impl Fn(usize) -> usize) -> Vec<Case> {
    cases.iter().enumerate().map(|(index, case)| Case { substeps: substeps(index), ..*case }).collect()
}

/// One bound of one workload.
struct Job<'a> {
    name: &'a str,
    bound: f64,
    kind: Bristles,
    cases: &'a [Case],
    /// Angle and deflection of each case.
    reference: &'a [[Vec<f64>; 2]],
    rounds: usize,
}

/// Errors of angle and deflection over their largest magnitudes.
type Errors = [f64; 2];

fn worst(errors: &[Errors]) -> Errors {
    errors.iter().fold([0.0; 2], |worst, error| [0, 1].map(|i| if error[i] <= worst[i] { worst[i] } else { error[i] }))
}

impl Job<'_> {
    /// Whether the angle is within the bound; what is no number is not.
    fn meets(&self, errors: &Errors) -> bool {
        errors[0] <= self.bound
    }

    fn errors(&self, case: usize, angle: &[f64], deflection: &[f64]) -> Errors {
        let of = |course: &[f64], exact: &[f64]| {
            let size = exact.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
            let error = course.iter().zip(exact).map(|(a, b)| (a - b).abs());
            error.fold(0.0, |worst, error| if error <= worst { worst } else { error }) / size
        };
        [of(angle, &self.reference[case][0]), of(deflection, &self.reference[case][1])]
    }

    /// For each case the smallest number of substeps that meets the bound, and the errors with it.
    fn substeps(&self, rk4: &Rk4) -> Result<(Vec<Case>, Vec<Errors>), Box<dyn Error>> {
        let mut found: Vec<(Case, Errors)> = self.cases.iter().map(|case| (*case, [f64::INFINITY; 2])).collect();
        for substeps in SUBSTEPS {
            let open: Vec<usize> = (0..found.len()).filter(|case| !self.meets(&found[*case].1)).collect();
            if open.is_empty() {
                break;
            }
            let tried: Vec<Case> = open.iter().map(|case| Case { substeps, ..self.cases[*case] }).collect();
            let (_, courses) = rk4.vectors(&tried, SAMPLES)?;
            for ((case, tried), [angle, deflection]) in open.into_iter().zip(tried).zip(courses) {
                found[case] = (tried, self.errors(case, &angle, &deflection));
            }
        }
        Ok(found.into_iter().unzip())
    }

    fn run<B: SweptFriction>(&self, variants: &[Variant<B, Cascade<f64>>], rk4: &Rk4) -> Result<(), Box<dyn Error>> {
        let (mut cases, errors) = self.substeps(rk4)?;
        let peer_errors = worst(&errors);
        let total: usize = cases.iter().map(|case| case.substeps).sum();
        // Vectors take those together that ask for the same.
        cases.sort_by_key(|case| case.substeps);
        // A part is enough for what runs one after the other; its time is scaled by the substeps.
        let few: Vec<Case> = cases.iter().copied().step_by(cases.len().div_ceil(16)).collect();
        let part = |cases: &[Case]| total as f64 / cases.iter().map(|case| case.substeps).sum::<usize>() as f64;

        // What each variant needs, with the reference in hand.
        let mut known: Vec<(usize, Errors)> = vec![(0, [f64::INFINITY; 2]); variants.len()];
        let double = plan(SAMPLES, self.bound, Arithmetic::Double);
        for (rung, of) in RUNGS.iter().enumerate() {
            let open: Vec<usize> = (0..known.len()).filter(|case| !self.meets(&known[*case].1)).collect();
            let tried: Vec<_> = open.iter().map(|case| variants[*case]).collect();
            let courses = on_rung(&tried, &double, *of, |course| (course.angle.clone(), course.deflection.clone()))?;
            for (case, (angle, deflection)) in open.into_iter().zip(courses) {
                known[case] = (rung, self.errors(case, &angle, &deflection));
            }
        }
        let on: Vec<Vec<_>> = (0..RUNGS.len())
            .map(|rung| variants.iter().zip(&known).filter(|(_, known)| known.0 == rung).map(|it| *it.0).collect())
            .collect();
        let known_errors = worst(&known.iter().map(|known| known.1).collect::<Vec<_>>());

        let one = variants.len() == 1;
        let python = self.kind == Bristles::Constant && self.bound == 1e-4;
        let mut servers: Vec<Server> = Vec::new();
        if python {
            let kinds: &[&str] = if one { &["numba", "scipy"] } else { &["numba", "jax"] };
            // One number for all that JAX maps over.
            let same: Vec<Case> = with(&cases, |_| cases[cases.len() / 2].substeps);
            for kind in kinds {
                let cases = if *kind == "jax" { &same } else { &few };
                match Server::start(rk4.folder(), kind, cases) {
                    Ok(server) => servers.push(server),
                    Err(reason) => println!("{}/{kind} skipped: {reason}", self.name),
                }
            }
        }
        let never = f64::INFINITY;
        let most = cases.iter().map(|case| case.substeps).max().unwrap_or(1);
        let alike = with(&cases, |_| most);
        let few_alike = with(&few, |_| most);
        let (mut scalar_alike, mut vector_alike) = (never, never);
        let (mut scalar, mut vector, mut ours, mut ours_known, mut single) = (never, never, never, never, never);
        let (mut stated, mut true_errors, mut single_errors) = (0.0_f64, [0.0; 2], [0.0; 2]);
        let mut refused = 0;
        for _ in 0..self.rounds {
            scalar = scalar.min(rk4.one_by_one(&few, SAMPLES)? * part(&few));
            if !one {
                vector = vector.min(rk4.time_vectors(&cases, SAMPLES)?);
                let share = cases.len() as f64 / few.len() as f64;
                scalar_alike = scalar_alike.min(rk4.one_by_one(&few_alike, SAMPLES)? * share);
                vector_alike = vector_alike.min(rk4.time_vectors(&alike, SAMPLES)?);
            }
            for server in &mut servers {
                server.round(&cases, total)?;
            }
            // Long enough for a clock that goes by the scheduler's ticks.
            let times = if one { 50 } else { 1 };
            let mut judged = |arithmetic, best: &mut f64, errors: &mut Errors| -> Result<(), Box<dyn Error>> {
                let plan = plan(SAMPLES, self.bound, arithmetic);
                let begin = cpu_seconds()?;
                let mut courses = Vec::new();
                for _ in 0..times {
                    courses = sweep(variants, &plan, Course::clone)?;
                }
                *best = best.min((cpu_seconds()? - begin) / f64::from(times));
                let mut all = Vec::new();
                refused = 0;
                for (case, course) in courses.into_iter().enumerate() {
                    match course {
                        Ok(course) => {
                            stated = stated.max(course.error);
                            all.push(self.errors(case, &course.angle, &course.deflection));
                        }
                        Err(_) => refused += 1,
                    }
                }
                *errors = worst(&all);
                Ok(())
            };
            if self.bound >= 1e-5 {
                judged(Arithmetic::Single, &mut single, &mut single_errors)?;
            }
            judged(Arithmetic::Double, &mut ours, &mut true_errors)?;
            let begin = cpu_seconds()?;
            let mut last = 0.0;
            for _ in 0..times {
                for (variants, rung) in on.iter().zip(RUNGS).filter(|(variants, _)| !variants.is_empty()) {
                    last += on_rung(variants, &double, rung, |course| course.angle[SAMPLES - 1])?.iter().sum::<f64>();
                }
            }
            std::hint::black_box(last);
            ours_known = ours_known.min((cpu_seconds()? - begin) / f64::from(times));
        }

        let name =
            format!("{}{}", self.name, if self.kind == Bristles::ElastoPlastic { "_elasto-plastic" } else { "" });
        let line = |what: &str, time: f64, errors: Errors, peer: &str, peer_time: f64, more: &str| {
            println!(
                "{name}{what}/{peer} {time:.4} {peer_time:.4} {:.1} (error {:.1e}, bristle {:.1e}{more})",
                peer_time / time,
                errors[0],
                errors[1]
            );
        };
        let mean = total as f64 / cases.len() as f64;
        let peers = if one {
            vec![("c_rk4", scalar, mean)]
        } else {
            vec![
                ("c_rk4", scalar_alike, most as f64),
                ("c_rk4_each", scalar, mean),
                ("c_avx512", vector_alike, most as f64),
                ("c_avx512_each", vector, mean),
            ]
        };
        for (peer, time, substeps) in peers {
            let lanes = if peer.starts_with("c_avx512") { format!("; {} lanes", rk4.widest()) } else { String::new() };
            let [angle, bristle] = peer_errors;
            let rk4_says = format!("{lanes}; {substeps:.0} substeps, at most {angle:.1e}, {bristle:.1e}");
            let says = format!("; stated {stated:.1e}, {refused} refused{rk4_says}");
            line("", ours, true_errors, peer, time, &says);
            line("_known", ours_known, known_errors, peer, time, &rk4_says);
            if self.bound >= 1e-5 {
                line("_single", single, single_errors, peer, time, &says);
            }
        }
        for server in servers {
            let more = format!("; {}", server.says);
            line("", ours, true_errors, &server.kind, server.best, &more);
            line("_known", ours_known, known_errors, &server.kind, server.best, &more);
        }
        Ok(())
    }
}
