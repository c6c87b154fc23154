//! The virtual machine in this process, faster than real time.

use stickslip_core::block::Block as _;
use stickslip_core::plant::{GlidingMachine, InputDelays, InputDelaysState, Machine, Plant, PlantInput, PlantState};
use stickslip_core::snapshot::{StateVisitor, count, fields};
use stickslip_core::tick::Measurement;

use super::io::{Io, check_preload};
use super::lockstep::LockstepBench;
use super::remote::LinkFault;
use stickslip_base::noise::{Normals, Ticks};
use stickslip_base::{Error, Preset};
use stickslip_simulate::integrator;
use stickslip_software::cycle::Voltages;

/// The virtual machine with noise from a seed.
#[derive(Clone, Debug)]
pub struct InProcess {
    machine: GlidingMachine<f64>,
    state: PlantState<f64>,
    delays: InputDelays<f64>,
    waiting: InputDelaysState<f64>,
    normals: Normals,
    ticks: Ticks,
    /// Step of the virtual machine [s].
    step: f64,
    /// Ticks since it was switched on.
    cycle: u64,
}

impl InProcess {
    /// The machine of a preset, at rest, with its first readings. In steady sliding it takes long steps.
    ///
    /// # Errors
    /// A step too long for the virtual machine; a delay of more than 8 ticks.
    pub fn new(preset: &Preset<f64>, seed: u64) -> Result<(Self, Measurement<f64>), Error> {
        Self::of(preset, seed, GlidingMachine::new)
    }

    fn of(
        preset: &Preset<f64>,
        seed: u64,
        machine: fn(Machine<f64>, f64) -> GlidingMachine<f64>,
    ) -> Result<(Self, Measurement<f64>), Error> {
        let (steps, step) = preset.bench.plant_steps();
        let machine =
            machine(integrator::prepare(&preset.bench.plant_with_amplifier(&preset.plant), steps, step)?, step);
        let delays = preset.bench.input_delays(&preset.plant)?;
        let waiting = InputDelaysState::default();
        let ticks = Ticks::new(steps, step, preset.plant.tick_jitter);
        let mut state = PlantState::default();
        state.machine.angle = preset.plant.start_angle;
        // One tick at rest fills the pickups and gives the first readings.
        let readings = machine.take(steps, &mut state, PlantInput::default(), step);
        let normals = Normals::new(seed);
        Ok((InProcess { machine, state, delays, waiting, normals, ticks, step, cycle: 0 }, readings))
    }
}

impl Io for InProcess {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        let acting = PlantInput {
            servo_voltage: voltages.servo_voltage,
            amplifier_voltage: voltages.amplifier_voltage,
            external_torque: 0.0,
            noise: self.normals.of_tick(self.cycle),
        };
        let acting = self.delays.step(&mut self.waiting, acting, 0.0);
        let steps = self.ticks.steps(&self.normals, self.cycle);
        self.cycle += 1;
        Ok(integrator::take(&self.machine, steps, &mut self.state, &acting, self.step))
    }

    fn waits(&self) -> bool {
        true
    }

    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        // Its parts and the seed are given by the preset and the run.
        let InProcess { machine, state, delays: _, waiting, normals: _, ticks: _, step: _, cycle } = self;
        let mut preload = machine.short.parts.plant.wheel.preload;
        keep.number(&mut preload);
        machine.set_preload(preload);
        fields(keep, state);
        fields(keep, waiting);
        count(keep, cycle);
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        check_preload(preload)?;
        self.machine.set_preload(preload);
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.machine.short.parts.plant.wheel.preload
    }
}

/// The virtual machine behind the software of the bench.
pub type VirtualBench = LockstepBench<InProcess>;

impl VirtualBench {
    /// The bench of a preset, switched on and at rest.
    ///
    /// # Errors
    /// A step too long for the virtual machine; errors of the design of observer and current control.
    pub fn new(preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        let (machine, readings) = InProcess::new(preset, seed)?;
        Self::over(&preset.model, &preset.bench, machine, readings)
    }

    /// The same bench whose machine never takes long steps, for committed studies: the results differ by the
    /// integrator's error.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn in_short_steps(preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        let (machine, readings) = InProcess::of(preset, seed, GlidingMachine::in_short_steps)?;
        Self::over(&preset.model, &preset.bench, machine, readings)
    }

    /// True parameters of the virtual machine. Measurements must not use them.
    pub fn true_plant(&self) -> &Plant<f64> {
        &self.machine.machine.short.parts.plant
    }
}
