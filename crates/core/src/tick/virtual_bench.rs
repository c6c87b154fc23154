//! The tick closed over the virtual machine, in lockstep.

use super::{Measurement, Order, Tick, TickInput, TickOutput, TickState};
use crate::Fields;
use crate::block::Block;
use crate::plant::{Glide, InputDelays, InputDelaysState, Noise, PlantInput, PlantState, VirtualMachine};
use crate::scalar::Scalar;

/// The whole bench, virtual machine and software: one tick.
///
/// The software computes with the readings at the start of the tick; meanwhile its outputs of the previous tick act.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct VirtualBench<T> {
    /// The virtual machine, prepared for its step.
    pub machine: VirtualMachine<T>,
    /// Delays of its amplifiers.
    pub delays: InputDelays<T>,
    /// The software, prepared for its tick.
    pub tick: Tick<T>,
}

/// State of the bench.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct BenchState<T> {
    /// Virtual machine.
    pub plant: PlantState<T>,
    /// Commands that have not acted yet.
    pub delays: InputDelaysState<T>,
    /// Software.
    pub tick: TickState<T>,
    /// Readings at the start of the tick.
    pub measurement: Measurement<T>,
    /// Voltage computed in the last tick, which the servo amplifier gets now.
    #[field(symbol = "u_servo", unit = "V")]
    pub servo_voltage: T,
    /// Voltage computed in the last tick, which the load amplifier gets now.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_voltage: T,
}

/// External inputs of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct BenchInput<T> {
    /// From supervision.
    pub order: Order<T>,
    /// External torque on the screw, in the positive direction.
    #[field(symbol = "M_ext", unit = "N m")]
    pub external_torque: T,
    /// Standard normal numbers.
    pub noise: Noise<T>,
}

impl<T: Scalar> Block<T> for VirtualBench<T> {
    type State = BenchState<T>;
    type Input = BenchInput<T>;
    type Output = TickOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut BenchState<T>, input: BenchInput<T>, dt: T) -> TickOutput<T> {
        let (output, acting) = self.software(state, input, dt);
        state.measurement = self.machine.run(&mut state.plant, acting, dt);
        output
    }
}

impl<T: Scalar> VirtualBench<T> {
    /// A tick that lasts this number of steps of the virtual machine, with these long steps in steady sliding, while the
    /// software assumes `dt` [s].
    #[inline(always)]
    pub fn tick_of(
        &self,
        (steps, glide): (usize, &Glide<T>),
        state: &mut BenchState<T>,
        input: BenchInput<T>,
        dt: T,
    ) -> TickOutput<T> {
        let (output, acting) = self.software(state, input, dt);
        let step = dt / T::of(self.machine.parts.steps as f64);
        state.measurement = glide.take(&self.machine, steps, &mut state.plant, acting, step);
        output
    }

    /// The software's part of a tick, and the inputs of the machine meanwhile, computed in the previous tick.
    #[inline(always)]
    fn software(&self, state: &mut BenchState<T>, input: BenchInput<T>, dt: T) -> (TickOutput<T>, PlantInput<T>) {
        let reads = TickInput { measurement: state.measurement, order: input.order };
        let output = self.tick.run(&mut state.tick, reads, dt);
        let acting = PlantInput {
            servo_voltage: state.servo_voltage,
            amplifier_voltage: state.amplifier_voltage,
            external_torque: input.external_torque,
            noise: input.noise,
        };
        state.servo_voltage = output.servo_voltage;
        state.amplifier_voltage = output.amplifier_voltage;
        (output, self.delays.run(&mut state.delays, acting, dt))
    }
}
