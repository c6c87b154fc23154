//! Experiments give the same results if commands are ahead of their frames, as in real time.

use std::collections::VecDeque;

use stickslip::bench::{Bench, Change, Command, Frame, Parameters, VirtualBench};
use stickslip::experiment::{
    BreakawayPlan, FrictionPlan, PreslidingPlan, home, measure_breakaway, measure_friction, measure_presliding,
    sweep_through_standstill,
};
use stickslip::{Error, Model, Preset, Settings, Watch, parameters};
use stickslip_core::friction::Stribeck;
use stickslip_software::supervise::SafetyState;

/// A bench with frames delayed by a number of ticks.
struct Ahead {
    bench: VirtualBench,
    ticks: usize,
    frames: VecDeque<Frame>,
}

impl Bench for Ahead {
    fn model(&self) -> &Model<f64> {
        self.bench.model()
    }

    fn settings(&self) -> &Settings<f64> {
        self.bench.settings()
    }

    fn hand_over(&mut self, command: Command) -> Result<Option<Frame>, Error> {
        self.frames.extend(self.bench.hand_over(command)?);
        Ok(if self.frames.len() > self.ticks { self.frames.pop_front() } else { None })
    }

    fn outstanding(&mut self) -> Result<Option<Frame>, Error> {
        Ok(self.frames.pop_front())
    }

    fn come_to_rest(&mut self) -> Result<(), Error> {
        self.bench.come_to_rest()
    }

    fn change(&mut self, change: Change) -> Result<(), Error> {
        self.bench.change(change)
    }

    fn parameters(&self) -> &Parameters<f64> {
        self.bench.parameters()
    }

    fn safety(&self) -> SafetyState {
        self.bench.safety()
    }

    fn zero(&self) -> Option<f64> {
        self.bench.zero()
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.bench.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.bench.preload()
    }

    fn learn_own(&mut self, own: Stribeck<f64>) {
        self.bench.learn_own(own);
    }
}

/// Homed in lockstep, so that both start alike.
fn ahead(ticks: usize) -> Result<Ahead, Error> {
    let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    let mut bench = VirtualBench::new(&preset, 1)?;
    home(&mut bench, &Watch::silent())?;
    Ok(Ahead { bench, ticks, frames: VecDeque::new() })
}

fn both<R: PartialEq>(experiment: impl Fn(&mut dyn Bench) -> R) {
    let [now, late] = [0, 200].map(|ticks| experiment(&mut ahead(ticks).expect("a bench that homes")));
    assert!(now == late, "the measurement depends on when its frames arrive");
}

#[test]
fn friction_at_constant_speeds_is_the_same_bit_for_bit() {
    let plan = FrictionPlan { slowest: 1.0, speeds: 4.0, ..FrictionPlan::quick() };
    both(|bench| measure_friction(&plan, bench, false, &Watch::silent()).unwrap().plateaus);
}

#[test]
fn presliding_and_a_sweep_are_the_same_bit_for_bit() {
    both(|bench| measure_presliding(&PreslidingPlan::default(), bench, &Watch::silent()).unwrap().loops);
    both(|bench| sweep_through_standstill(bench, 2.0, 4.0, &Watch::silent()).unwrap());
}

#[test]
fn searches_on_the_machine_give_the_same_results() {
    // The index 50 ms later, the drive torque 50 ms longer on its ramp: within the resolution of either.
    let preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
    let [now, late] = [0, 200].map(|ticks| {
        let bench = VirtualBench::new(&preset, 1).unwrap();
        let mut bench = Ahead { bench, ticks, frames: VecDeque::new() };
        home(&mut bench, &Watch::silent()).unwrap();
        let zero = bench.zero().unwrap();
        let plan = BreakawayPlan { angles: 2.0, repetitions: 1.0, ..BreakawayPlan::default() };
        (zero, measure_breakaway(&plan, &mut bench, &Watch::silent()).unwrap())
    });
    assert_eq!(now.0, late.0, "the latched counter has the place of the index");
    let torques = |breakaway: &stickslip::experiment::Breakaway| -> Vec<f64> {
        breakaway.ramps.iter().map(|ramp| ramp.torque.expect("it breaks away")).collect()
    };
    for (now, late) in torques(&now.1).into_iter().zip(torques(&late.1)) {
        assert!((now / late - 1.0).abs() < 0.02, "{now} and {late} N m");
    }
}
