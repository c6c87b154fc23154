//! The C projects of all kinds of blocks, as folders.

use stickslip_codegen::c::{self, Project};
use stickslip_codegen::record::{Precision, Recorded};
use stickslip_core::block::Block;
use stickslip_core::control::{Cascade, CurrentControl, Pid, PositionController, VelocityObserver};
use stickslip_core::fields::Fields;
use stickslip_core::friction::{LuGre, Model};
use stickslip_core::plant::Plant;
use stickslip_core::render::{DifferenceTorque, Law};
use stickslip_core::sensor::{Accelerometer, Encoder, Pickups, Tacho};
use stickslip_core::tick::{Decoder, Tick};
use tempfile::TempDir;

use super::bench::{STEPS, TICK, bench};
use super::blocks::{Lag, Nested, SlidingFriction};

const DT: f64 = 250e-6;

/// A project in a temporary folder.
pub struct Written {
    pub name: &'static str,
    pub project: Project,
    pub folder: TempDir,
}

/// Writes a project into a folder.
pub fn write(name: &'static str, project: Project) -> Written {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for (file, text) in &project.files {
        std::fs::write(folder.path().join(file), text).expect("a small file can be written");
    }
    Written { name, project, folder }
}

/// The project of a block in a precision.
pub fn project<F: Precision, B: Fields<f64>>(name: &'static str, block: &B, dt: f64) -> Written
where
    B::With<F>: Block<F, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    write(name, c::project::<B, F>(block, name, dt).expect("a good name"))
}

/// One of each kind, in double precision, and some in single.
pub fn all() -> Vec<Written> {
    let plant_step = TICK / STEPS as f64;
    let mut plant = Plant::<f64>::default();
    plant.screw_friction.model = Model::Lugre(LuGre::default());
    let machine = plant.prepare(STEPS, plant_step);
    let mut law = DifferenceTorque::<f64>::default();
    law.desired.breakaway_torque = 0.5;
    let pickups = Pickups::new(Tacho::default(), Accelerometer::default(), plant_step);
    let tick = Tick::<f64> { law: Law::Paper(law), ..Tick::default() };
    vec![
        project::<f64, _>("sliding", &SlidingFriction::<f64>::default(), DT),
        project::<f64, _>("lag", &Lag::<f64>::default(), DT),
        project::<f64, _>("nested", &Nested::<f64>::default(), DT),
        project::<f64, _>("cascade", &Cascade::<f64>::default(), DT),
        project::<f64, _>("current", &CurrentControl::<f64>::default(), DT),
        project::<f64, _>("pid", &Pid::<f64>::default(), DT),
        project::<f64, _>("position", &PositionController::<f64>::Pid(Pid::default()), DT),
        project::<f64, _>("decoder", &Decoder::<f64>::default(), DT),
        project::<f64, _>("difference", &law, DT),
        project::<f64, _>("observer", &VelocityObserver::<f64>::default(), DT),
        project::<f64, _>("encoder", &Encoder::<f64>::default(), DT),
        project::<f64, _>("pickups", &pickups, plant_step),
        project::<f64, _>("machine", &machine, plant_step),
        project::<f64, _>("tick", &tick, DT),
        project::<f64, _>("bench", &bench(), TICK),
        project::<f32, _>("difference_single", &law, DT),
        project::<f32, _>("tick_single", &tick, DT),
    ]
}
