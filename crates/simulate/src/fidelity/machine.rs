//! The three machines of the comparison.

use stickslip_core::drive::Arm;
use stickslip_core::friction::Friction;
use stickslip_core::plant::Plant;

use super::Cell;

/// The machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A: has the desired friction and the arm physically, without torque of the load motor.
    Desired,
    /// A0: its own friction, without torque of the load motor.
    Own,
    /// B: its own friction, and the load motor renders.
    Rendered,
}

/// The virtual machine of a cell in a role.
pub fn machine(cell: &Cell, role: Role) -> Plant<f64> {
    let mut plant = cell.preset.plant;
    (cell.mismatch.machine)(&mut plant);
    if role == Role::Desired {
        plant.screw_friction = cell.desired;
        plant.wheel.preload = 0.0;
        plant.wheel.friction = Friction::default();
        if let Arm::Elastic(_) = cell.preset.bench.arm {
            plant.arm = cell.preset.bench.arm;
        }
    } else {
        (cell.mismatch.own)(&mut plant.screw_friction);
        (cell.mismatch.own)(&mut plant.wheel.friction);
    }
    if role != Role::Rendered {
        // No torque, whatever the current.
        plant.load_motor.winding.torque_constant = 0.0;
    }
    plant
}
