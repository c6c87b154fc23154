use std::vec::Vec;

use super::phi::Phi;
use super::*;
use crate::fields::Fields as _;
use crate::friction::{ElastoPlastic, LuGre};
use crate::scalar::Lanes;

fn axis() -> IdealAxis<f64, ElastoPlastic<f64>> {
    let lugre = LuGre { bristle_stiffness: 3000.0, ..LuGre::default() };
    IdealAxis {
        mechanics: TwoMass::default(),
        motor_viscous: 1e-4,
        load_viscous: 2e-4,
        bristle: ElastoPlastic { lugre, ..ElastoPlastic::default() },
    }
}

/// Angle and velocity of the load after a time under a torque that rises and is held for a millisecond each.
fn angle(axis: &IdealAxis<f64, ElastoPlastic<f64>>, steps: usize, passes: usize, duration: usize) -> [f64; 2] {
    let flow = axis.prepare(1e-3 / steps as f64);
    let mut state = AxisState::at_rest(&axis.bristle);
    for millisecond in 0..duration {
        let torque = 1e-2 * millisecond as f64;
        (0..steps).for_each(|_| flow.step(&axis.bristle, &mut state, torque, passes));
    }
    [state.angle, state.velocity]
}

#[test]
fn phi_is_exact_where_it_is_asked_for_a_steady_value() {
    for x in [0.0, 1e-9, 0.3, 2.0, 40.0, 1e6] {
        for (x, phi) in [(x, Phi::of(x)), (2.0 * x, Phi::of(x).doubled())] {
            let rounding = 4.0 * f64::EPSILON;
            assert!((phi.exp + x * phi.one - 1.0).abs() <= rounding, "{x}");
            assert!((phi.one + x * phi.two - 1.0).abs() <= rounding, "{x}");
            assert!((phi.two + x * phi.three - 0.5).abs() <= rounding, "{x}");
        }
    }
}

#[test]
fn phi_is_of_fourth_order() {
    let error = |x: f64| (Phi::of(x).exp - (-x).exp()).abs();
    // x⁵/5! is the first term that the polynomial lacks.
    assert!((error(0.02) / error(0.01) - 32.0).abs() <= 1.0);
}

#[test]
fn a_constant_load_below_breakaway_is_held_without_creep() {
    let axis = axis();
    let breakaway = axis.bristle.lugre.sliding.breakaway_torque;
    for (load, dt, passes) in [(0.5, 1e-3, 1), (0.9, 1e-3, 2), (0.9, 2.5e-4, 3), (-0.9, 5e-4, 2)] {
        let flow = axis.prepare(dt);
        let mut state = AxisState::at_rest(&axis.bristle);
        let mut run = |duration: f64| {
            (0..(duration / dt) as usize).for_each(|_| flow.step(&axis.bristle, &mut state, load * breakaway, passes));
            state.angle
        };
        let settled = run(2.0);
        let creep = run(1000.0) - settled;
        // What the design allows; rounding alone is measured at 1e-13 and below.
        assert!(creep.abs() <= 1e-9, "{load} at {dt}: {creep:e} rad");
    }
}

#[test]
fn the_bristles_slide_on_their_curve() {
    let axis = axis();
    let sliding = axis.bristle.lugre.sliding;
    let flow = axis.prepare(1e-3);
    let mut state = AxisState::at_rest(&axis.bristle);
    // Above breakaway, until the lubricant takes up the rest.
    let torque = 0.4;
    (0..200_000).for_each(|_| flow.step(&axis.bristle, &mut state, torque, 1));
    let balance = sliding.level(state.velocity) + (axis.motor_viscous + axis.load_viscous) * state.velocity;
    assert!((balance - torque).abs() <= 1e-9 * torque, "{balance} instead of {torque}");
}

#[test]
fn each_pass_brings_a_breakaway_closer() {
    let axis = axis();
    let exact = angle(&axis, 400, 3, 80);
    assert!(exact[1] > 5.0, "the load must have broken away: {exact:?}");
    let error = |steps, passes| (angle(&axis, steps, passes, 80)[0] - exact[0]).abs() / exact[0];
    let errors = [error(2, 1), error(2, 2), error(2, 3), error(8, 3)];
    assert!(errors[0] <= 3e-2 && errors[3] <= 1e-4, "{errors:?}");
    assert!(errors[1] < errors[0] && errors[3] < errors[1], "{errors:?}");
}

#[test]
fn lanes_have_the_bits_of_a_step_alone() {
    const N: usize = 8;
    let axes: Vec<_> = (0..N)
        .map(|lane| {
            let mut axis = axis();
            axis.bristle.lugre.sliding.breakaway_torque += 0.01 * lane as f64;
            axis.bristle.lugre.bristle_stiffness *= 1.0 + lane as f64;
            axis.mechanics.load_inertia *= 1.0 + 0.1 * lane as f64;
            axis
        })
        .collect();
    let lanes = |of: &dyn Fn(usize) -> f64| Lanes::<f64, N>(core::array::from_fn(of));
    let bristle = ElastoPlastic {
        lugre: LuGre {
            sliding: crate::friction::Stribeck {
                breakaway_torque: lanes(&|lane| axes[lane].bristle.lugre.sliding.breakaway_torque),
                ..axes[0].bristle.lugre.sliding.map(&mut Lanes::of)
            },
            bristle_stiffness: lanes(&|lane| axes[lane].bristle.lugre.bristle_stiffness),
            ..axes[0].bristle.lugre.map(&mut Lanes::of)
        },
        ..axes[0].bristle.map(&mut Lanes::of)
    };
    let wide = IdealAxis {
        mechanics: TwoMass {
            load_inertia: lanes(&|lane| axes[lane].mechanics.load_inertia),
            ..axes[0].mechanics.map(&mut Lanes::of)
        },
        motor_viscous: Lanes::of(axes[0].motor_viscous),
        load_viscous: Lanes::of(axes[0].load_viscous),
        bristle,
    };
    let flow = wide.prepare(Lanes::of(5e-4));
    let mut together = AxisState::at_rest(&wide.bristle);
    let mut alone: Vec<_> = axes.iter().map(|axis| AxisState::at_rest(&axis.bristle)).collect();
    for step in 0..400 {
        let torque = 2e-3 * step as f64;
        flow.step(&wide.bristle, &mut together, Lanes::of(torque), 2);
        for (axis, state) in axes.iter().zip(&mut alone) {
            axis.prepare(5e-4).step(&axis.bristle, state, torque, 2);
        }
    }
    assert!(alone[0].velocity > 1.0, "some must have broken away");
    for (lane, state) in alone.iter().enumerate() {
        assert_eq!(state.angle.to_bits(), together.angle.0[lane].to_bits(), "lane {lane}");
        assert_eq!(state.deflection.to_bits(), together.deflection.0[lane].to_bits(), "lane {lane}");
    }
}
