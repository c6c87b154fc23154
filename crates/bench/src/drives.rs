//! The virtual machine between two drives that take torques, as servo drives on a fieldbus do.

use std::f64::consts::TAU;

use stickslip_base::noise::Normals;
use stickslip_base::{Error, Preset};
use stickslip_core::plant::{GlidingMachine, PlantInput, PlantState};
use stickslip_simulate::integrator;

/// Longest period with constant torques [s].
const PERIOD: f64 = 100e-6;
/// Steps of the virtual machine in which the current control of the load drive corrects a deviation.
const CURRENT_STEPS: f64 = 4.0;
/// Torque of a drive at its limit, in multiples of the rated torque.
const OVERLOAD: f64 = 3.0;

/// The virtual machine with a drive on the motor's side of the coupling and one on the screw.
///
/// The servo amplifier of the drive motor has its current control already; that of the load motor is added here, since
/// its amplifier takes a voltage. Encoders count from power-on.
#[derive(Clone, Debug)]
pub struct MachineWithDrives {
    machine: GlidingMachine<f64>,
    state: PlantState<f64>,
    normals: Normals,
    steps: usize,
    /// Step of the virtual machine [s].
    step: f64,
    periods: u64,
    start: f64,
}

/// Signals of a drive, in the positive direction of the screw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriveSignals {
    /// Angle since power-on [rad].
    pub angle: f64,
    /// Velocity [rad/s].
    pub velocity: f64,
    /// Torque [N m].
    pub torque: f64,
    /// Angle of an index pulse within the period [rad].
    pub index: Option<f64>,
}

/// Rating of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rating {
    /// Rated torque [N m], a whole number of mN m.
    pub torque: f64,
    /// Rated current [A].
    pub current: f64,
}

impl MachineWithDrives {
    /// The machine of a preset, at rest.
    ///
    /// # Errors
    /// A step too long for the virtual machine; a delay of its amplifiers.
    pub fn new(preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        let plant = &preset.plant;
        for (name, value) in [
            ("plant.servo.delay", plant.servo.delay),
            ("plant.load_motor.amplifier.delay", plant.load_motor.amplifier.delay),
        ] {
            if value > 0.0 {
                let remedy = "Emulated drives have a delay of their own: use plant --torque-delay.";
                return Err(Error::OutOfRange { name, value, unit: "s", minimum: 0.0, maximum: 0.0, remedy });
            }
        }
        let steps = (PERIOD / preset.bench.plant_step - 1e-9).ceil().max(1.0);
        let step = PERIOD / steps;
        let steps = steps as usize;
        let machine = GlidingMachine::in_short_steps(integrator::prepare(&preset.plant, steps, step)?, step);
        let mut state = PlantState::default();
        state.machine.angle = preset.plant.start_angle;
        machine.take(steps, &mut state, PlantInput::default(), step);
        let start = preset.plant.start_angle;
        Ok(MachineWithDrives { machine, state, normals: Normals::new(seed), steps, step, periods: 0, start })
    }

    /// Period of [`exchange`](Self::exchange) [s].
    pub fn period(&self) -> f64 {
        PERIOD
    }

    /// Ratings of both drives, as of their amplifiers.
    pub fn ratings(&self) -> [Rating; 2] {
        let plant = &self.machine.short.parts.plant;
        let rating = |torque: f64, constant: f64| {
            let torque = (torque / OVERLOAD * 1e3).round().max(1.0) * 1e-3;
            Rating { torque, current: if constant > 0.0 { torque / constant } else { 0.0 } }
        };
        let load = &plant.load_motor;
        let limit = load.winding.torque_constant * load.amplifier.current_limit;
        [rating(plant.servo.torque_limit, plant.motor.torque_constant), rating(limit, load.winding.torque_constant)]
    }

    /// One period under these torques of drive motor and load motor [N m], both in the positive direction of the screw.
    /// Returns the signals of both, and that of the accelerometer as a share of the converter's range.
    pub fn exchange(&mut self, [motor, load]: [f64; 2]) -> ([DriveSignals; 2], f64) {
        let plant = self.machine.short.parts.plant;
        let noise = self.normals.of_tick(self.periods);
        self.periods += 1;
        let before = self.angles();
        let mut accelerometer = 0.0;
        for _ in 0..self.steps {
            let input = PlantInput {
                servo_voltage: motor / plant.servo.torque_per_volt,
                amplifier_voltage: self.load_voltage(load),
                external_torque: 0.0,
                noise,
            };
            let readings = integrator::take(&self.machine, 1, &mut self.state, &input, self.step);
            accelerometer = readings.accelerometer_voltage;
        }
        let state = &self.state.machine;
        let velocities = [state.motor_velocity, state.velocity];
        let torques = [state.motor_torque, -plant.load_motor.winding.torque_constant * state.load_current];
        let after = self.angles();
        let signals = std::array::from_fn(|at| DriveSignals {
            angle: after[at] - self.start,
            velocity: velocities[at],
            torque: torques[at],
            index: self.index(before[at], after[at]),
        });
        (signals, accelerometer / plant.inputs.range)
    }

    /// Angles of motor and screw [rad].
    fn angles(&self) -> [f64; 2] {
        let state = &self.state.machine;
        [state.angle + state.twist, state.angle]
    }

    /// Angle of the index between two angles, from power-on.
    fn index(&self, before: f64, after: f64) -> Option<f64> {
        let zero = self.machine.short.parts.plant.encoder.index_angle;
        let [before, after] = [before, after].map(|angle| ((angle - zero) / TAU).floor());
        (before != after).then(|| before.max(after) * TAU + zero - self.start)
    }

    /// Input of the load amplifier for a torque. The load motor's torque constant counts against the screw.
    fn load_voltage(&self, torque: f64) -> f64 {
        let load = &self.machine.short.parts.plant.load_motor;
        let winding = &load.winding;
        if winding.torque_constant <= 0.0 {
            return 0.0;
        }
        let state = &self.state.machine;
        let reference = -torque / winding.torque_constant;
        let gain = winding.inductance / (CURRENT_STEPS * self.step);
        let voltage = gain * (reference - state.load_current) + winding.resistance * state.load_current
            - winding.torque_constant * state.velocity;
        voltage / load.amplifier.gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters;

    fn machine() -> MachineWithDrives {
        let preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
        MachineWithDrives::new(&preset, 1).unwrap()
    }

    /// Signals after a time under constant torques.
    fn after(machine: &mut MachineWithDrives, periods: usize, torques: [f64; 2]) -> [DriveSignals; 2] {
        (0..periods).map(|_| machine.exchange(torques).0).last().unwrap()
    }

    #[test]
    fn below_the_breakaway_torque_the_shaft_sticks_and_above_it_turns() {
        let mut machine = machine();
        let [motor, load] = after(&mut machine, 5000, [0.25, 0.0]);
        assert!(load.velocity.abs() < 1e-6 && (motor.torque - 0.25).abs() < 1e-3, "{motor:?} {load:?}");
        let [_, load] = after(&mut machine, 5000, [0.35, 0.0]);
        assert!(load.velocity > 10.0, "{load:?}");
    }

    #[test]
    fn the_load_drive_holds_its_torque_against_the_drive_motor() {
        let mut machine = machine();
        let [motor, load] = after(&mut machine, 5000, [0.5, -0.3]);
        assert!((load.torque + 0.3).abs() < 1e-3 && (motor.torque - 0.5).abs() < 1e-3, "{motor:?} {load:?}");
        assert!(load.velocity.abs() < 1e-6, "the difference is below the breakaway torque: {load:?}");
    }

    #[test]
    fn a_delay_of_the_amplifiers_is_refused_since_the_drives_have_their_own() {
        let mut preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
        preset.plant.load_motor.amplifier.delay = 1e-3;
        let refused = MachineWithDrives::new(&preset, 1).unwrap_err().to_string();
        assert!(
            refused.contains("plant.load_motor.amplifier.delay") && refused.contains("--torque-delay"),
            "{refused}"
        );
    }

    #[test]
    fn each_revolution_has_one_index() {
        let mut machine = machine();
        let mut indices = Vec::new();
        for _ in 0..10_000 {
            let [_, load] = machine.exchange([0.4, 0.0]).0;
            indices.extend(load.index);
        }
        assert!(indices.len() > 3 && indices.windows(2).all(|pair| (pair[1] - pair[0] - TAU).abs() < 1e-9));
        // From power-on at −1.3 rad to the index at 2 rad.
        assert!((indices[0] - 3.3).abs() < 1e-9);
    }
}
