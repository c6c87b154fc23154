//! A whole experiment on the virtual bench, with all inputs of the software in each tick.

use stickslip::bench::{Bench, Change, Command, Frame, Parameters, VirtualBench};
use stickslip::experiment::{FrictionPlan, home, measure_friction};
use stickslip::{Error, Model, Preset, Settings, Watch, parameters};
use stickslip_core::block::Block as _;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{DifferenceTorque, Law};
use stickslip_core::tick::{Tick, TickState};
use stickslip_software::supervise::SafetyState;

use super::run::{Record, Run, numbers};

/// A bench that stores the inputs of its software.
struct Recording {
    bench: VirtualBench,
    run: Run,
    /// Active parameters and the expected state after the last tick.
    previous: Option<(Tick<f64>, TickState<f64>)>,
}

impl Bench for Recording {
    fn hand_over(&mut self, command: Command) -> Result<Option<Frame>, Error> {
        let (tick, mut state, input) = self.bench.next_tick(&command);
        if self.previous.is_none_or(|previous| previous.0 != tick) {
            self.run.records.push(Record::Parameters(numbers(&tick)));
        }
        if self.previous.is_none_or(|previous| previous.1 != state) {
            self.run.records.push(Record::State(numbers(&state)));
        }
        self.run.records.push(Record::Step(numbers(&input)));
        let frame = self.bench.step(command)?;
        let output = tick.step(&mut state, input, self.run.dt);
        assert_eq!(output, frame.signals, "the recorded inputs are those of the bench");
        self.previous = Some((tick, state));
        Ok(Some(frame))
    }

    fn outstanding(&mut self) -> Result<Option<Frame>, Error> {
        self.bench.outstanding()
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

    fn model(&self) -> &Model<f64> {
        self.bench.model()
    }

    fn settings(&self) -> &Settings<f64> {
        self.bench.settings()
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

/// Homing, the quick friction measurement, then three seconds of a sine with the paper's law: its software and all
/// of its inputs.
pub fn experiment() -> (Tick<f64>, Run) {
    let source = parameters::presets::find("clm-bench").expect("a preset of that name");
    let preset: Preset<f64> = source.read().expect("a preset that reads");
    let dt = preset.bench.tick_time();
    let bench = VirtualBench::new(&preset, 1).expect("a preset that can be prepared");
    let mut bench = Recording { bench, run: Run { records: Vec::new(), dt }, previous: None };
    let law = DifferenceTorque { own: preset.model.own, desired: preset.bench.desired, ..DifferenceTorque::default() };
    bench.set_law(Law::Paper(law)).expect("a current control for this motor");
    home(&mut bench, &Watch::silent()).expect("a bench that finds its index");
    measure_friction(&FrictionPlan::quick(), &mut bench, false, &Watch::silent()).expect("a measurement");
    let start = bench.step(Command::default()).expect("a bench that runs").angle;
    for tick in 0..(3.0 / dt) as usize {
        let time = tick as f64 * dt;
        let position = start + 2.0 * (1.0 - libm::cos(3.0 * time));
        let velocity = 6.0 * libm::sin(3.0 * time);
        let setpoint = Setpoint { position, velocity, ..Setpoint::default() };
        bench.step(Command { setpoint, control: true, render: true, ..Command::default() }).expect("a bench that runs");
    }
    (bench.previous.expect("it has run").0, bench.run)
}
