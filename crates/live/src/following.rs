//! Set-points that the axis follows in slices: a reference, or a jog.

use std::sync::Arc;

use stickslip_core::control::reference::{Generator, Reference, Setpoint, Shaped};

use super::Shared;
use super::jog::Jog;
use super::motion::MOVING;
use stickslip_base::Error;
use stickslip_bench::{Bench, ClockedBench, Command};

/// Bench time of the commands between two polls of the jobs [s].
const SLICE: f64 = 0.005;

/// A motion of the axis.
pub(super) struct Following {
    name: String,
    source: Source,
    render: bool,
}

/// Source of the set-points.
enum Source {
    Reference { generator: Box<Shaped<'static>>, ticks: u64 },
    Jog(Jog),
}

impl Following {
    /// Follows a reference from the present position.
    pub(super) fn reference(
        bench: &ClockedBench,
        shared: &Shared,
        name: String,
        reference: &Reference<f64>,
        render: bool,
    ) -> Self {
        let rate = bench.settings().tick_rate;
        let shaper = bench.settings().shaper.shaper(&bench.model().drive, rate);
        let ticks = ((reference.duration() * rate).min(u64::MAX as f64) as u64).saturating_add(shaper.delay());
        let generator = Generator::new(*reference, rate).with_origin(shared.acquisition.held_angle());
        let generator = Box::new(Shaped::new(generator, shaper));
        Following { name, source: Source::Reference { generator, ticks }, render }
    }

    /// Follows the held button.
    pub(super) fn jog(shared: &Shared, render: bool) -> Self {
        let jog = Jog::new(shared.acquisition.held_angle(), &shared.parameters.preset());
        let name = String::from("jog");
        shared.motion.progress(&name, MOVING, 0.0);
        Following { name, source: Source::Jog(jog), render }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// A slice of the motion; whether it continues.
    pub(super) fn slice(&mut self, bench: &mut ClockedBench, shared: &Arc<Shared>) -> Result<bool, Error> {
        // After a fault or a stop, a button that is still held does not start the axis again.
        self.follow(bench, shared).inspect_err(|_| shared.motion.jog.release())
    }

    fn follow(&mut self, bench: &mut ClockedBench, shared: &Shared) -> Result<bool, Error> {
        for _ in 0..(SLICE * bench.settings().tick_rate) as u64 + 1 {
            if shared.motion.is_halted() {
                bench.come_to_rest()?;
                return Err(Error::Cancelled);
            }
            let setpoint = match self.next(shared) {
                Ok(Some(setpoint)) => setpoint,
                ended => {
                    bench.come_to_rest()?;
                    return ended.map(|_| false);
                }
            };
            let command = Command { setpoint, control: true, render: self.render, ..Command::default() };
            let frame = bench.hand_over(command)?;
            // The operator disabled the torque: the axis does not follow.
            if frame.is_some_and(|frame| !frame.safety.allows_torque()) {
                bench.drain(&mut |_| {})?;
                return Err(Error::Cancelled);
            }
        }
        if let Source::Reference { generator, ticks } = &self.source
            && *ticks < u64::MAX
        {
            shared.motion.progress(&self.name, MOVING, generator.cycle() as f64 / *ticks as f64);
        }
        Ok(true)
    }

    /// The next set-point; `None` at the end.
    fn next(&mut self, shared: &Shared) -> Result<Option<Setpoint<f64>>, Error> {
        match &mut self.source {
            Source::Reference { generator, ticks } => Ok((generator.cycle() < *ticks).then(|| generator.next())),
            Source::Jog(jog) => jog.next(&shared.motion.jog),
        }
    }
}
