//! What an identification leaves behind: the model as TOML, and a feedforward table.

use std::fmt::Write;

use stickslip_core::friction::Stribeck;

use super::Identification;
use super::axis::AxisModel;
use crate::machine::{Axis, Machine};

/// `model.toml`: the best model, SI units.
pub fn model_toml(identification: &Identification, machine: &Machine) -> String {
    let AxisModel { inertia, positive, negative, offset, lag, bristles } = &identification.best().model;
    let (mass, force, viscous, speed) = match identification.axis {
        Axis::Linear => ("kg", "N", "N s/m", "m/s"),
        Axis::Rotary => ("kg m²", "N m", "N m s/rad", "rad/s"),
    };
    let mut text = format!("# Identified by stickslip {}. SI units.\n", env!("CARGO_PKG_VERSION"));
    let mut line = |arguments: std::fmt::Arguments<'_>| writeln!(text, "{arguments}").expect("a string takes all");
    line(format_args!("machine = {:?}", machine.name));
    line(format_args!("kind = {:?}", identification.best().kind.name()));
    line(format_args!("inertia = {inertia} # {mass}"));
    line(format_args!("offset = {offset} # {force}, against positive motion"));
    line(format_args!("lag = {lag} # s, of the drive"));
    for (name, side) in [("positive", positive), ("negative", negative)] {
        let Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, .. } = side;
        line(format_args!("\n[{name}]"));
        line(format_args!("breakaway = {breakaway_torque} # {force}"));
        line(format_args!("coulomb = {kinetic_torque} # {force}"));
        line(format_args!("stribeck_velocity = {stribeck_velocity} # {speed}"));
        line(format_args!("viscous = {viscous_friction} # {viscous}"));
    }
    if let Some(bristles) = bristles {
        line(format_args!("\n[bristles]"));
        line(format_args!("stiffness = {} # {force}/{}", bristles.stiffness, speed.trim_end_matches("/s")));
        line(format_args!("damping = {} # {viscous}", bristles.damping));
        line(format_args!("damping_velocity = {} # {speed}", bristles.damping_velocity));
    }
    text
}

/// `feedforward.csv`: force and command that keep a speed up, in both directions up to the fastest recorded speed.
pub fn feedforward_csv(identification: &Identification, machine: &Machine) -> String {
    const STEPS: i32 = 50;
    let (speed, force) = match identification.axis {
        Axis::Linear => ("m/s", "N"),
        Axis::Rotary => ("rad/s", "N m"),
    };
    let fastest = identification.motion.velocity.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut text = format!("velocity [{speed}],force [{force}],command [V]\n");
    for step in -STEPS..=STEPS {
        // Finer towards rest, where the curve bends.
        let share = f64::from(step) / f64::from(STEPS);
        let velocity = fastest * share * share.abs();
        let needed = identification.best().model.steady_force(velocity);
        writeln!(text, "{velocity:.9e},{needed:.9e},{:.9e}", needed / machine.gain).expect("a string takes all");
    }
    text
}
