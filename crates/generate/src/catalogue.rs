//! The blocks, and their setup from a preset.

use crate::GenerateError;
use stickslip_core::control::compensation::{Compensation, Hold, StictionHold};
use stickslip_core::control::{
    AxisControl, Cascade, CurrentControl, LinearController, Pid, PositionController, Predictive, VelocityObserver,
};
use stickslip_core::fields::Fields;
use stickslip_core::friction::{
    Dahl, ElastoPlastic, Friction, FrictionElement, LuGre, MaxwellSlip, Model, Static, Stribeck,
};
use stickslip_core::plant::{InputDelays, Machine, VirtualMachine};
use stickslip_core::render::{DifferenceTorque, Law};
use stickslip_core::sensor::{Encoder, Pickups};
use stickslip_core::tick::{Decoder, Tick, VirtualBench};

use super::{Generated, Request};
use stickslip_base::parameters::schema::nearest;
use stickslip_base::{ControllerChoice, Error, Preset, StateFeedback};
use stickslip_design as design;
use stickslip_design::as_predictive;
use stickslip_simulate::integrator;

/// A block of the catalogue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// As in `stickslip generate c NAME`.
    pub name: &'static str,
    /// The first sentence of its documentation.
    pub about: String,
}

/// A preset, prepared for its rates.
pub(super) struct Setup {
    preset: Preset<f64>,
    /// The software, with the law of the paper active.
    tick: Tick<f64>,
    law: DifferenceTorque<f64>,
    machine: VirtualMachine<f64>,
    delays: InputDelays<f64>,
    /// Tick [s].
    time: f64,
    /// Step of the virtual machine [s].
    plant_step: f64,
}

impl Setup {
    pub(super) fn new(preset: &Preset<f64>) -> Result<Self, Error> {
        let settings = &preset.bench;
        let (steps, plant_step) = settings.plant_steps();
        let law = design::difference_torque(&settings.desired, &preset.model, settings);
        Ok(Setup {
            preset: *preset,
            tick: Tick { law: Law::Paper(law), ..design::software(&preset.model, settings)? },
            law,
            machine: VirtualMachine {
                parts: integrator::prepare(&settings.plant_with_amplifier(&preset.plant), steps, plant_step)?,
            },
            delays: settings.input_delays(&preset.plant)?,
            time: settings.tick_time(),
            plant_step,
        })
    }

    /// The friction of the screw with this model if the preset has it, else with the default of the model.
    fn friction(&self, model: Model<f64>) -> FrictionElement<f64> {
        let own = self.preset.plant.screw_friction;
        let same_model = std::mem::discriminant(&own.model) == std::mem::discriminant(&model);
        FrictionElement { friction: if same_model { own } else { Friction { model, ..own } } }
    }

    /// The observer with accelerometer, also if the preset uses the other one.
    fn observer(&self) -> Result<VelocityObserver<f64>, Error> {
        design::velocity_observer(self.preset.bench.observer_poles, self.preset.model.drive.screw_lead, self.time)
    }

    fn pid(&self) -> Pid<f64> {
        if let PositionController::Pid(pid) = self.tick.control.controller { pid } else { Pid::default() }
    }

    /// The state feedback of the preset, or the default one if the preset has another controller.
    fn linear(&self) -> Result<LinearController<f64>, Error> {
        if let PositionController::Linear(linear) = self.tick.control.controller {
            return Ok(linear);
        }
        let torque_limit = self.preset.bench.controller.torque_limit();
        let choice = StateFeedback { torque_limit, ..StateFeedback::default() };
        design::state_feedback(&choice, &self.preset.model, self.tick.control_period)
    }

    /// The predictive controller of the preset, or its state feedback within the default limits.
    fn predictive(&self) -> Result<Predictive<f64>, Error> {
        if let PositionController::Predictive(predictive) = self.tick.control.controller {
            return Ok(predictive);
        }
        let ControllerChoice::Predictive(choice) = as_predictive(&self.preset.bench.controller) else {
            return Err(Error::NotSolvable { what: "a predictive controller", remedy: "Choose one in the preset." });
        };
        design::predictive(&choice, &self.preset.model, self.tick.control_period)
    }

    fn stiction_hold(&self) -> StictionHold<f64> {
        if let Hold::Stiction(hold) = self.tick.control.hold { hold } else { StictionHold::default() }
    }

    fn cascade(&self) -> Cascade<f64> {
        if let PositionController::Cascade(cascade) = self.tick.control.controller {
            cascade
        } else {
            Cascade::default()
        }
    }
}

/// For each block: its name, its documented type, the block itself and its step [s].
macro_rules! catalogue {
    ($($name:literal: $Documented:ident, |$setup:ident| $block:expr, $step:expr;)+) => {
        /// All blocks of the catalogue.
        pub fn blocks() -> Vec<Entry> {
            vec![$(Entry { name: $name, about: first_sentence(<$Documented<f64> as Fields<f64>>::HELP) }),+]
        }

        /// The files of a block.
        pub(super) fn make(name: &str, setup: &Setup, request: &Request<'_>) -> Result<Generated, Error> {
            match name {
                $($name => {
                    let $setup = setup;
                    request.files(&$block, $step)
                })+
                _ => Err(unknown(name)),
            }
        }
    };
}

catalogue! {
    "pid": Pid, |s| s.pid(), s.tick.control_period;
    "cascade": Cascade, |s| s.cascade(), s.tick.control_period;
    "linear_controller": LinearController, |s| s.linear()?, s.tick.control_period;
    "predictive_controller": Predictive, |s| s.predictive()?, s.tick.control_period;
    "position_controller": PositionController, |s| s.tick.control.controller, s.tick.control_period;
    "compensation": Compensation, |s| s.tick.control.compensation, s.tick.control_period;
    "stiction_hold": StictionHold, |s| s.stiction_hold(), s.tick.control_period;
    "axis_control": AxisControl, |s| s.tick.control, s.tick.control_period;
    "velocity_observer": VelocityObserver, |s| s.observer()?, s.time;
    "current_control": CurrentControl, |s| s.tick.current, s.time;
    "decoder": Decoder, |s| s.tick.decoder, s.time;
    "difference_torque": DifferenceTorque, |s| s.law, s.time;
    "tick": Tick, |s| s.tick, s.time;
    "stribeck": Stribeck, |s| s.preset.model.own, s.time;
    "friction": FrictionElement, |s| s.friction(s.preset.plant.screw_friction.model), s.plant_step;
    "friction_static": Static, |s| s.friction(Model::Static(Static::default())), s.plant_step;
    "friction_dahl": Dahl, |s| s.friction(Model::Dahl(Dahl::default())), s.plant_step;
    "friction_lugre": LuGre, |s| s.friction(Model::Lugre(LuGre::default())), s.plant_step;
    "friction_elasto_plastic": ElastoPlastic, |s| s.friction(Model::ElastoPlastic(ElastoPlastic::default())), s.plant_step;
    "friction_maxwell_slip": MaxwellSlip, |s| s.friction(Model::MaxwellSlip(MaxwellSlip::default())), s.plant_step;
    "encoder": Encoder, |s| s.preset.plant.encoder, s.time;
    "pickups": Pickups, |s| s.machine.parts.pickups, s.plant_step;
    "machine": Machine, |s| s.machine.parts, s.plant_step;
    "plant": VirtualMachine, |s| s.machine, s.time;
    "bench": VirtualBench, |s| VirtualBench { machine: s.machine, delays: s.delays, tick: s.tick }, s.time;
}

/// The block's name as the catalogue has it.
pub(super) fn find(name: &str) -> Result<&'static str, Error> {
    blocks().into_iter().find(|entry| entry.name == name).map(|entry| entry.name).ok_or_else(|| unknown(name))
}

fn unknown(name: &str) -> Error {
    let known: Vec<&str> = blocks().into_iter().map(|entry| entry.name).collect();
    GenerateError::UnknownBlock { name: name.into(), nearest: nearest(name, known.into_iter()).map(String::from) }
        .into()
}

/// The first sentence of a documentation, without its marks.
fn first_sentence(help: &str) -> String {
    let paragraph = help.split("\n\n").next().unwrap_or_default().replace('\n', " ");
    let sentence = paragraph.split(". ").next().unwrap_or_default();
    let plain: String = sentence.chars().filter(|c| !"[]`".contains(*c)).collect();
    format!("{}.", plain.trim_end_matches(['.', ':', ',']))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_block_has_a_description_of_one_line() {
        for Entry { name, about } in blocks() {
            assert!((10..=110).contains(&about.chars().count()), "{name}: {about}");
            assert!(about.ends_with('.') && !about.contains("``"), "{name}: {about}");
        }
    }

    #[test]
    fn a_misspelt_block_gets_the_nearest_name() {
        let refused = find("velocity_obsever").map_err(|error| error.to_string());
        assert_eq!(refused, Err("unknown block velocity_obsever. Did you mean velocity_observer?".into()));
        assert!(find("zzz").is_err_and(|error| error.to_string().contains("stickslip generate --list")));
    }
}
