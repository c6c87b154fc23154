//! Roles of an external file in the loop: its substitute, its sampling instants, and the destination of its torque.

use crate::BenchError;
use stickslip_core::control::AxisControl;
use stickslip_core::control::compensation::Hold;
use stickslip_core::drive::Arm;
use stickslip_core::friction::{Bristles, Decay, Model as Contact, Stribeck};
use stickslip_core::render::{Correction, Law};
use stickslip_core::tick::Tick;
use stickslip_software::cycle::{ExternalTorques, Parameters, Sample};
use stickslip_software::supervise::Role;

use stickslip_base::Error;
use stickslip_base::preset::{
    CompensationChoice, ControllerChoice, ControllerMatrices, FilterChoice, LawChoice, Model, Residual, Settings,
};
use stickslip_design as design;

/// Torque limit of the substitute for a controller [N m]: the smallest permitted value.
const NO_TORQUE: f64 = 1e-6;

/// Practically no friction: the smallest permitted values of a characteristic.
const NO_FRICTION: Stribeck<f64> = Stribeck {
    breakaway_torque: 1e-6,
    kinetic_torque: 1e-6,
    stribeck_velocity: 1.0,
    viscous_friction: 0.0,
    decay: Decay::Exponential,
};

/// Substitute for an external file: while it is active, the file is in the loop.
pub(super) enum Substitute {
    /// A controller without torque.
    Control(Box<AxisControl<f64>>),
    /// A rendering law for a load without friction.
    Frictionless,
    /// No rendering law.
    Off,
}

/// Meaning of a tick for an external file.
pub(super) struct Turn {
    /// The file is in the loop.
    pub(super) acts: bool,
    /// A sample starts.
    pub(super) begins: bool,
    /// The sample ends: the computed torque becomes active.
    pub(super) ends: bool,
}

impl Substitute {
    pub(super) fn new(role: Role, model: &Model<f64>, settings: &Settings<f64>) -> Result<Self, Error> {
        Ok(match role {
            Role::Controller => Substitute::Control(Box::new(design::axis_control(model, &without(role, settings))?)),
            Role::Friction => Substitute::Frictionless,
            Role::Law => Substitute::Off,
        })
    }

    /// A torque requested in every tick is active from the start of the next one.
    pub(super) fn turn(&self, sample: &Sample, tick: &Tick<f64>) -> Turn {
        let every = |acts: bool| Turn { acts: acts && sample.renders, begins: true, ends: false };
        match self {
            Substitute::Control(control) => {
                Turn { acts: sample.controls && tick.control == **control, begins: sample.begins, ends: sample.ends }
            }
            Substitute::Frictionless => every(desired(&tick.law) == Some(&NO_FRICTION)),
            Substitute::Off => every(tick.law == Law::Off),
        }
    }
}

/// The characteristic that a law renders.
fn desired(law: &Law<f64>) -> Option<&Stribeck<f64>> {
    let friction = match law {
        Law::Off => return None,
        Law::Paper(law) => return Some(&law.desired),
        Law::Smooth(law) => return Some(&law.desired),
        Law::Karnopp(law) => return Some(&law.desired),
        Law::Bristle(law) => &law.desired,
        Law::Admittance(law) => &law.desired,
    };
    match &friction.model {
        Contact::ElastoPlastic(model) => Some(&model.lugre.sliding),
        _ => None,
    }
}

/// Settings with the substitute for a role.
pub(crate) fn without(role: Role, settings: &Settings<f64>) -> Settings<f64> {
    match role {
        Role::Controller => {
            let sampling_time = settings.control_period();
            let nothing =
                ControllerMatrices { sampling_time, torque_limit: NO_TORQUE, ..ControllerMatrices::default() };
            Settings {
                controller: ControllerChoice::Linear(nothing),
                compensation: CompensationChoice::Nothing,
                filter: FilterChoice::Nothing,
                hold: Hold::Nothing,
                ..*settings
            }
        }
        Role::Friction => {
            // The automatic choice would be made for a friction that is not rendered here.
            let law = match settings.law {
                LawChoice::Auto => LawChoice::Residual(Residual::default()),
                law => law,
            };
            let desired_bristles = Bristles { damping: 0.0, ..settings.desired_bristles };
            Settings { desired: NO_FRICTION, desired_bristles, law, ..*settings }
        }
        Role::Law => Settings { arm: Arm::Nothing, ..*settings },
    }
}

/// The rendering law of these settings, with an external file in this role if there is one.
///
/// # Errors
/// Errors of the design of the law; [`BenchError::FollowsNoFriction`] for a law that compensates the external friction.
pub(crate) fn law(role: Option<Role>, model: &Model<f64>, settings: &Settings<f64>) -> Result<Law<f64>, Error> {
    match (role, settings.law) {
        (Some(Role::Law), _) => Ok(Law::Off),
        (Some(Role::Friction), LawChoice::Admittance(_)) => Err(BenchError::FollowsNoFriction.into()),
        (Some(role), _) => stickslip_simulate::rendering_law(model, &without(role, settings)),
        (None, _) => stickslip_simulate::rendering_law(model, settings),
    }
}

/// Sets the parameters of the substitute if the role is `external`, otherwise those of the settings.
///
/// # Errors
/// Errors of the design of the bench; as [`law`].
pub(crate) fn enter(
    role: Role,
    external: bool,
    parameters: &mut Parameters<f64>,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> Result<(), Error> {
    let tick = &mut parameters.tick;
    let active = if external { without(role, settings) } else { *settings };
    if role == Role::Controller {
        tick.control = design::axis_control(model, &active)?;
        tick.control_period = active.control_period();
    } else {
        tick.law = law(external.then_some(role), model, settings)?;
        tick.current = design::load_current_control(&tick.law, model, &active)?;
        tick.arm = design::arm_rendering(model, &active)?;
        tick.correction = Correction::Nothing;
    }
    Ok(())
}

/// Sampling time [s].
pub fn period(role: Role, settings: &Settings<f64>) -> f64 {
    match role {
        Role::Controller => settings.control_period(),
        Role::Friction | Role::Law => settings.tick_time(),
    }
}

/// Maximum torque of its motor [N m].
pub fn torque_limit(role: Role, model: &Model<f64>, settings: &Settings<f64>) -> f64 {
    match role {
        Role::Controller => settings.controller.torque_limit(),
        Role::Friction | Role::Law => model.load_amplifier.current_limit * model.load_motor.torque_constant,
    }
}

/// Its torque [N m] at its destination.
pub(crate) fn torques(role: Role, torque: f64) -> ExternalTorques {
    match role {
        Role::Controller => ExternalTorques { torque, ..ExternalTorques::default() },
        Role::Friction | Role::Law => ExternalTorques { load_torque: torque, ..ExternalTorques::default() },
    }
}

#[cfg(test)]
mod tests {
    use stickslip_base::Preset;
    use stickslip_base::parameters::presets::find;
    use stickslip_base::preset::Residual;
    use stickslip_core::friction::{Model as Friction, Stribeck};

    use super::*;

    #[test]
    fn the_substitute_is_practically_without_friction() {
        let mut preset: Preset<f64> = find("clm-bench").unwrap().read().unwrap();
        preset.bench.law = LawChoice::Residual(Residual::default());
        let substitute = law(Some(Role::Friction), &preset.model, &preset.bench).unwrap();
        let stickslip_core::render::Law::Bristle(rendered) = substitute else { panic!("{substitute:?}") };
        let Friction::ElastoPlastic(desired) = rendered.desired.model else { panic!("{:?}", rendered.desired) };
        let Stribeck { breakaway_torque, viscous_friction, .. } = desired.lugre.sliding;
        assert!(breakaway_torque <= 1e-6 && viscous_friction == 0.0 && desired.lugre.bristle_damping == 0.0);
        let off = law(Some(Role::Law), &preset.model, &preset.bench).unwrap();
        assert_eq!(off, stickslip_core::render::Law::Off);
        let controller = law(Some(Role::Controller), &preset.model, &preset.bench).unwrap();
        assert_eq!(controller, stickslip_simulate::rendering_law(&preset.model, &preset.bench).unwrap());
    }
}
