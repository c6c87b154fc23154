//! Homing by index search.

use stickslip_software::supervise::{Homing, HomingInput, HomingProgress, Request};

use crate::{Bench, Change, Command};
use stickslip_base::{Error, Watch};

/// Searches the index pulse and sets it as the zero of the screw; the bench is then running, at rest near its zero.
///
/// # Errors
/// [`Error::BenchFault`] if no index pulse occurs or supervision stops the search; [`Error::Cancelled`].
pub fn home(bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
    bench.change(Change::Request(Request::Home))?;
    // One tick without torque gives the angle of the screw.
    let first = bench.step(Command::default())?;
    let dt = bench.settings().tick_time();
    let mut search = Homing::begin(bench.settings().homing, first.angle);
    let mut input = HomingInput { angle: first.angle, index: None };
    loop {
        let (setpoint, progress) = search.step(input, dt);
        match progress {
            HomingProgress::Moving => {}
            HomingProgress::Homed { index } => {
                bench.change(Change::Homed(index))?;
                return bench.change(Change::Request(Request::Start));
            }
            HomingProgress::Failed(fault) => {
                bench.change(Change::HomingFailed(fault))?;
                return Err(Error::BenchFault { cycle: first.cycle, reason: fault.to_string() });
            }
        }
        let frame = bench.hand_over(Command { setpoint, control: true, ..Command::default() })?;
        input.index = None;
        if let Some(frame) = frame {
            let index = (frame.signals.index > 0.5).then_some(frame.signals.index_angle);
            input = HomingInput { angle: frame.angle, index };
            if frame.cycle % 4096 == 0 {
                watch.stage("homing", 0.0)?;
            }
        }
    }
}
