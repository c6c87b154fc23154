//! Test beds, with and without their friction wheel.

use stickslip_core::friction::{Model, Stribeck};
use stickslip_core::plant::Plant;
use stickslip_core::render::Law;

use super::corrected::correction;
use super::{Cell, Mismatch, sliding_mut};
use stickslip_base::parameters::presets;
use stickslip_base::preset::ObserverChoice;
use stickslip_base::{Error, Preset};

/// Friction of the preset `prototype` without its wheel: in the preset, the wheel is part of the single friction of the
/// load side.
const PROTOTYPE_RELEASED: (&str, [f64; 4]) = ("prototype", [0.20, 0.12, 1.5, 2e-3]);

/// A preset that is set up with and without its friction wheel.
#[derive(Clone, Debug)]
pub struct TestBed {
    /// Name of the preset.
    pub name: String,
    preset: Preset<f64>,
}

impl TestBed {
    /// The bed of a preset, by its name or the path of its file.
    ///
    /// # Errors
    /// As reading the preset; [`Error::NothingToRender`] where no load motor is mounted.
    pub fn find(name_or_path: &str) -> Result<Self, Error> {
        let preset: Preset<f64> = presets::find(name_or_path)?.read()?;
        if preset.plant.load_motor.winding.torque_constant <= 0.0 {
            return Err(Error::NothingToRender { preset: name_or_path.into() });
        }
        Ok(TestBed { name: name_or_path.into(), preset })
    }

    /// Whether the bed has a wheel that can be released.
    pub fn has_wheel(&self) -> bool {
        self.preset.plant.wheel.preload > 0.0 || self.name == PROTOTYPE_RELEASED.0
    }

    /// The observer of the preset.
    pub fn observer(&self) -> ObserverChoice<f64> {
        self.preset.bench.observer
    }

    /// The bench at rest at angle 0, its wheel pressed on as in the preset or released, at this tick rate [Hz], the
    /// position controller at 1 kHz. The model has the friction of the machine, but not the mismatch. Nothing is
    /// rendered yet.
    pub fn cell(&self, wheel: bool, tick_rate: f64, mismatch: Mismatch) -> Cell {
        let mut preset = self.preset;
        preset.plant.start_angle = 0.0;
        preset.bench.tick_rate = tick_rate;
        preset.bench.control_divider = 0.0;
        if !wheel {
            self.release(&mut preset);
        }
        let desired = preset.bench.desired_bristles.under(preset.bench.desired);
        Cell { preset, desired, mismatch, law: Law::Off, correct: Some(correction) }
    }

    /// Releases the friction wheel in the machine and in the model.
    fn release(&self, preset: &mut Preset<f64>) {
        let Plant { wheel, screw_friction, .. } = &mut preset.plant;
        let Some(sliding) = sliding_mut(screw_friction) else { return };
        if wheel.preload > 0.0 {
            wheel.preload = 0.0;
        } else if self.name == PROTOTYPE_RELEASED.0 {
            let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = PROTOTYPE_RELEASED.1;
            *sliding = Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, ..*sliding };
        } else {
            return;
        }
        preset.model.own = *sliding;
        if let Model::ElastoPlastic(contact) = screw_friction.model {
            preset.model.own_bristles = contact.into();
        }
    }
}
