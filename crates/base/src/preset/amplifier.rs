//! What the amplifiers take, a voltage or a torque, and how late they act.

use super::{Model, Preset, Settings};
use crate::Error;
use stickslip_core::drive::{Delay, LONGEST_DELAY};
use stickslip_core::fields::{ParameterError, at_most};
use stickslip_core::plant::{InputDelays, Plant};

/// Remedy for a delay that is too long.
const REMEDY: &str = "The bench stores the commands of 8 ticks: reduce the delay, or bench.tick_rate.";

/// A delay [s] in samples of `sample` [s].
///
/// # Errors
/// [`Error::OutOfRange`] beyond [`LONGEST_DELAY`] samples.
pub fn delay(name: &'static str, time: f64, sample: f64) -> Result<Delay<f64>, Error> {
    let maximum = LONGEST_DELAY as f64 * sample;
    let error = Error::OutOfRange { name, value: time, unit: "s", minimum: 0.0, maximum, remedy: REMEDY };
    Delay::new(time, sample).ok_or(error)
}

impl Settings<f64> {
    /// The virtual machine with a load amplifier that takes what this bench sends.
    #[must_use]
    pub fn plant_with_amplifier(&self, plant: &Plant<f64>) -> Plant<f64> {
        let mut plant = *plant;
        if self.torque_amplifier > 0.5 {
            let load = &mut plant.load_motor;
            (load.amplifier, load.winding) = load.amplifier.with_current_control(&load.winding);
            // Fieldbuses have no converter: 1 V for 1 A must not limit the current.
            plant.outputs.range = plant.outputs.range.max(load.amplifier.current_limit);
        }
        plant
    }

    /// The model with a load amplifier that takes what this bench sends.
    #[must_use]
    pub fn model_with_amplifier(&self, model: &Model<f64>) -> Model<f64> {
        let mut model = *model;
        if self.torque_amplifier > 0.5 {
            (model.load_amplifier, model.load_motor) = model.load_amplifier.with_current_control(&model.load_motor);
        }
        model
    }

    /// Delays of the virtual machine's amplifiers.
    ///
    /// # Errors
    /// As [`delay`].
    pub fn input_delays(&self, plant: &Plant<f64>) -> Result<InputDelays<f64>, Error> {
        let tick = self.tick_time();
        let [servo, amplifier] = [
            ("delay of the servo amplifier", plant.servo.delay),
            ("delay of the load amplifier", plant.load_motor.amplifier.delay),
        ]
        .map(|(name, time)| delay(name, time, tick));
        Ok(InputDelays { servo: servo?, amplifier: amplifier? })
    }
}

impl Model<f64> {
    /// Lag from the command of the drive motor's torque to the tacho, for a velocity loop [s].
    pub fn loop_lag(&self) -> f64 {
        self.drive_lag + self.servo_delay
    }
}

impl Preset<f64> {
    /// Delays must be within the commands that the bench stores.
    pub(super) fn check_delays(&self) -> Result<(), ParameterError> {
        let longest = LONGEST_DELAY as f64 * self.bench.tick_time() * (1.0 + 1e-9);
        let delays = [
            ("plant.servo.delay", self.plant.servo.delay),
            ("plant.load_motor.amplifier.delay", self.plant.load_motor.amplifier.delay),
            ("model.servo_delay", self.model.servo_delay),
            ("model.load_amplifier.delay", self.model.load_amplifier.delay),
        ];
        delays.into_iter().try_for_each(|(name, time)| at_most(name, time, longest, REMEDY).check())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_of_more_than_eight_ticks_is_refused() {
        let mut preset = Preset::<f64>::default();
        preset.plant.servo.delay = 8.0 * preset.bench.tick_time();
        assert_eq!(preset.check_delays(), Ok(()));
        preset.model.load_amplifier.delay = 8.1 * preset.bench.tick_time();
        assert_eq!(preset.check_delays().unwrap_err().field, "model.load_amplifier.delay");
        assert!(delay("the delay", 8.1e-3, 1e-3).unwrap_err().to_string().contains("bench.tick_rate"));
    }

    #[test]
    fn behind_an_amplifier_that_takes_a_torque_the_current_follows_one_volt_an_ampere() {
        let mut preset = Preset::<f64>::default();
        assert_eq!(preset.bench.plant_with_amplifier(&preset.plant), preset.plant);
        preset.bench.torque_amplifier = 1.0;
        let load = preset.bench.plant_with_amplifier(&preset.plant).load_motor;
        let current = 3.0;
        let voltage = load.amplifier.voltage(current, &load.winding, 0.0, 0.0);
        assert!((voltage / load.winding.resistance - current).abs() < 1e-12);
        assert!((load.winding.inductance / load.winding.resistance - load.amplifier.lag).abs() < 1e-15);
    }
}
