//! Voltages and readings of a bench whose motors have servo drives, which take torques.
//!
//! The software has the voltages and scalings of its preset; here they become torques, and the signals of the drives
//! become readings. Both drives count positive in the positive direction of the screw.

use stickslip_base::{Error, Preset};
use stickslip_core::tick::{Measurement, Scaling};
use stickslip_software::cycle::Voltages;

use crate::BenchError;

/// Scaling between the voltages of a bench and its servo drives.
#[derive(Clone, Debug)]
pub struct ServoScaling {
    scaling: Scaling<f64>,
    /// Torque constant of the load motor [N m/A], and its largest current [A].
    torque_constant: f64,
    current_limit: f64,
    counter_range: f64,
}

/// Signals of both drives at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoSignals {
    /// Counter of the drive on the screw [counts].
    pub count: i64,
    /// Counter at the last index pulse [counts].
    pub latch: i64,
    /// Whether the index pulse came since the last tick.
    pub index: bool,
    /// Velocity of the drive motor [rad/s].
    pub velocity: f64,
    /// Torque of the load motor [N m].
    pub load_torque: f64,
    /// Voltage of the accelerometer [V]; 0 without one.
    pub accelerometer: f64,
}

impl ServoScaling {
    /// The scaling of a preset.
    ///
    /// # Errors
    /// [`BenchError::VoltageAmplifier`] if the preset has an amplifier that takes a voltage.
    pub fn new(preset: &Preset<f64>) -> Result<Self, Error> {
        let Preset { model, bench, .. } = preset;
        if bench.torque_amplifier < 0.5 {
            return Err(BenchError::VoltageAmplifier.into());
        }
        Ok(ServoScaling {
            scaling: model.scaling,
            torque_constant: model.load_motor.torque_constant,
            current_limit: model.load_amplifier.current_limit,
            counter_range: model.encoder.counter_range,
        })
    }

    /// Torques of drive motor and load motor for these voltages [N m].
    pub fn torques(&self, voltages: Voltages<f64>) -> [f64; 2] {
        // 1 V for 1 A, by the design of the bench's current control. The load motor counts against positive motion.
        let load = -voltages.amplifier_voltage * self.torque_constant;
        [voltages.servo_voltage * self.scaling.torque_per_volt, load]
    }

    /// Largest torques that the software may request [N m].
    pub fn torque_limits(&self) -> [f64; 2] {
        let servo = self.scaling.servo_limit * self.scaling.torque_per_volt;
        [servo, self.current_limit * self.torque_constant]
    }

    /// Readings of the software for these signals.
    pub fn readings(&self, signals: ServoSignals) -> Measurement<f64> {
        let wrapped = |count: i64| (count as f64).rem_euclid(self.counter_range);
        let current = -signals.load_torque / self.torque_constant;
        Measurement {
            count: wrapped(signals.count),
            index: f64::from(u8::from(signals.index)),
            latch: wrapped(signals.latch),
            tacho_voltage: signals.velocity * self.scaling.tacho,
            accelerometer_voltage: signals.accelerometer,
            current_voltage: current * self.scaling.current_sensor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters;
    use stickslip_core::block::Block as _;
    use stickslip_core::control::{CurrentControlInput, CurrentControlState};
    use stickslip_design as design;

    fn preset() -> Preset<f64> {
        let mut preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
        preset.bench.torque_amplifier = 1.0;
        preset
    }

    #[test]
    fn the_torque_of_a_law_reaches_the_drive_without_current_control_of_the_bench() {
        let preset = preset();
        let servo = ServoScaling::new(&preset).unwrap();
        let control = design::parameters(&preset.model, &preset.bench).unwrap().tick.current;
        let mut state = CurrentControlState::default();
        for torque in [0.3, -0.7, 1e3] {
            let input = CurrentControlInput {
                reference_current: torque / control.torque_constant,
                measured_current: -2.0,
                estimated_velocity: 90.0,
            };
            let amplifier_voltage = control.step(&mut state, input, 1e-3).amplifier_input;
            let [motor, load] = servo.torques(Voltages { servo_voltage: 2.0, amplifier_voltage });
            let due = torque.min(servo.torque_limits()[1]);
            // Of the back-EMF of 8.4 V a millionth is left.
            assert!((load + due).abs() < 1e-6, "{load} for {torque}: against positive motion");
            assert!((motor - 2.0 * preset.model.scaling.torque_per_volt).abs() < 1e-12);
        }
        assert_eq!(state.integral, 0.0);
    }

    #[test]
    fn readings_have_the_signs_of_the_screw() {
        let servo = ServoScaling::new(&preset()).unwrap();
        let readings = servo.readings(ServoSignals { count: -1, load_torque: -0.0934, ..ServoSignals::default() });
        assert_eq!(readings.count, 65_535.0);
        assert!(readings.current_voltage > 0.0, "a torque against positive motion is a positive current");
    }

    #[test]
    fn a_bench_with_an_amplifier_for_voltages_is_refused_and_names_the_setting() {
        let preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
        let refusal = ServoScaling::new(&preset).unwrap_err().to_string();
        assert!(refusal.contains("--set bench.torque_amplifier=true"), "{refusal}");
    }
}
