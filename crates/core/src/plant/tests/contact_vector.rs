//! Contacts side by side have the bits of contacts one after the other.

use super::*;
use crate::drive::ElasticArm;
use crate::friction::{
    Decay, Direction, ElastoPlastic, Fading, Load, Model, Position, Rest, Ripple, Rising, Static, Temperature, Warming,
};
use crate::snapshot::{StateVisitor, fields};
use std::vec::Vec;

const STEP: f64 = 25e-6;
const STEPS: usize = 10;

/// Three elasto-plastic contacts with different numbers.
fn plant() -> Plant<f64> {
    let mut plant = Plant::<f64>::default();
    let contacts = [&mut plant.motor_friction, &mut plant.screw_friction, &mut plant.wheel.friction];
    for (contact, share) in contacts.into_iter().zip([0.04, 0.2, 0.8]) {
        let mut model = ElastoPlastic::<f64>::default();
        let lugre = &mut model.lugre;
        lugre.sliding.breakaway_torque *= share;
        lugre.sliding.kinetic_torque *= 1.1 * share;
        lugre.sliding.stribeck_velocity += share;
        lugre.bristle_stiffness *= share;
        lugre.bristle_damping *= share;
        contact.model = Model::ElastoPlastic(model);
    }
    plant.wheel.preload = 0.6;
    plant
}

/// All numbers of a state.
struct Numbers(Vec<u64>);

impl StateVisitor for Numbers {
    fn number(&mut self, value: &mut f64) {
        self.0.push(value.to_bits());
    }
}

fn bits(mut state: MachineState<f64>) -> Vec<u64> {
    let mut numbers = Numbers(Vec::new());
    fields(&mut numbers, &mut state);
    numbers.0
}

/// Whether the contacts are side by side; the motion is the same, from rest over breakaway to reversals.
fn compared(name: &str, plant: &Plant<f64>) -> bool {
    let machine = VirtualMachine { parts: plant.prepare(STEPS, STEP) };
    let (mut state, mut apart) = (PlantState::default(), MachineState::default());
    let mut fastest: f64 = 0.0;
    for tick in 0..800 {
        let time = f64::from(tick) * STEP * STEPS as f64;
        let voltage = 4.0 * libm::sin(40.0 * time) * time / 0.1;
        let input = PlantInput { servo_voltage: voltage, external_torque: 0.01, ..PlantInput::default() };
        machine.take(STEPS, &mut state, input, STEP);
        let servo_voltage = plant.outputs.write(voltage);
        for _ in 0..STEPS {
            let input = MachineInput { servo_voltage, external_torque: 0.01, ..MachineInput::default() };
            machine.parts.step(&mut apart, input, STEP);
        }
        assert_eq!(bits(state.machine), bits(apart), "{name}, tick {tick}");
        fastest = fastest.max(apart.velocity.abs());
    }
    assert!(fastest > 3.0, "{name} slides: {fastest}");
    machine.parts.contact_vector().is_some()
}

#[test]
fn contacts_side_by_side_have_the_bits_of_contacts_one_after_the_other() {
    let beside = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));
    assert_eq!(compared("plain", &plant()), beside);

    let mut dependent = plant();
    let direction = Direction { asymmetry: 0.1, viscous_asymmetry: -0.2, offset: 0.004 };
    for contact in [&mut dependent.motor_friction, &mut dependent.screw_friction, &mut dependent.wheel.friction] {
        contact.direction = direction;
    }
    dependent.screw_friction.position = Position::Ripple(Ripple::default());
    dependent.screw_friction.load = Load { sensitivity: 0.5 };
    dependent.arm = Arm::Elastic(ElasticArm::default());
    dependent.backlash = Backlash::Gap(Gap::default());
    assert_eq!(compared("with dependences, arm and play", &dependent), beside);

    let mut rational = plant();
    for contact in [&mut rational.motor_friction, &mut rational.screw_friction, &mut rational.wheel.friction] {
        let Model::ElastoPlastic(model) = &mut contact.model else { panic!("the model of `plant`") };
        model.lugre.fading = Fading::Rational(Default::default());
    }
    assert_eq!(compared("rational fading", &rational), beside);
}

#[test]
fn contacts_of_other_kinds_are_computed_one_after_the_other() {
    let mut sticking = plant();
    sticking.motor_friction.model = Model::Static(Static::default());
    assert!(!compared("static brushes", &sticking));
    let mut mixed = plant();
    let Model::ElastoPlastic(model) = &mut mixed.screw_friction.model else { panic!("the model of `plant`") };
    model.lugre.fading = Fading::Rational(Default::default());
    assert!(!compared("two forms of fading", &mixed));
    let mut gaussian = plant();
    let Model::ElastoPlastic(model) = &mut gaussian.screw_friction.model else { panic!("the model of `plant`") };
    model.lugre.sliding.decay = Decay::Gaussian;
    assert!(!compared("a Gaussian curve", &gaussian));
    let mut ageing = plant();
    ageing.wheel.friction.rest = Rest::Rising(Rising::default());
    assert!(!compared("ageing linings", &ageing));
    let mut warm = plant();
    warm.wheel.friction.temperature = Temperature::Exponential(Warming::default());
    assert!(!compared("warm linings", &warm));
}
