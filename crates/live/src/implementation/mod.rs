//! What runs on the target: its blocks and wires, its code, its time in each cycle, and what the system granted it.

mod build;
mod files;
mod flow;
mod page;
mod target;
#[cfg(test)]
mod tests;
mod timing;

pub use build::{BuildError, BuildProgress, BuildStage};
pub use flow::{Flow, FlowBlock, FlowGroup, FlowPage, FlowWire};
pub use page::{BlockSize, DiagramPage};
pub use target::{Target, TargetFile, Wished};
pub use timing::{LateCycle, TimeBin, TimedPart, Timing};

pub(super) use build::Builder;

use std::sync::Arc;

use stickslip_core::render::Correction;

use super::protocol::Answer;
use super::{Live, lock};
use stickslip_base::{Error, Preset};
use stickslip_generate::{self as generate, Generated};

/// Code and diagram that were made last, and of what: with bristles they take seconds.
pub(super) type Made = Option<(Preset<f64>, Arc<Generated>)>;

impl Live {
    /// The software in force as code and diagram.
    fn generated(&self) -> Result<Arc<Generated>, Error> {
        let tuning = lock(&self.shared.tuning).clone();
        // Whoever else asks meanwhile waits for the same.
        let mut made = lock(&self.shared.generated);
        if let Some((of, generated)) = &*made
            && of == tuning.preset()
        {
            return Ok(generated.clone());
        }
        // A proposal without a change is what is in force.
        let proposal = tuning.set(&[])?;
        let tick = proposal.parameters(Correction::Nothing)?.tick;
        let generated = Arc::new(generate::software(&tick, proposal.preset().bench.tick_time())?);
        *made = Some((*tuning.preset(), generated.clone()));
        Ok(generated)
    }

    pub(super) fn flow(&self) -> Result<Answer, Error> {
        let generated = self.generated()?;
        let tuning = lock(&self.shared.tuning).clone();
        let virtual_machine = self.shared.seed.is_some();
        Ok(Answer::Flow(Box::new(Flow::of(&generated, tuning.preset(), &tuning.differences(), virtual_machine))))
    }

    pub(super) fn diagram_page(&self, page: &str) -> Result<Answer, Error> {
        let generated = self.generated()?;
        Ok(Answer::DiagramPage(Box::new(DiagramPage::of(&generated, page)?)))
    }

    pub(super) fn timing(&self) -> Answer {
        let rate = lock(&self.shared.tuning).preset().bench.tick_rate;
        Answer::Timing(Box::new(Timing::of(&lock(&self.shared.histograms), rate)))
    }

    pub(super) fn target(&self) -> Answer {
        let rate = lock(&self.shared.tuning).preset().bench.tick_rate;
        Answer::Target(Box::new(Target { rate, ..self.shared.target.clone() }))
    }

    /// Begins to build the software in force, unless that is under way.
    pub(super) fn build(&self) -> Result<Answer, Error> {
        let generated = self.generated()?;
        lock(&self.shared.builder).begin(generated, &self.shared.project.join("build"))?;
        Ok(Answer::Done {})
    }

    pub(super) fn built(&self) -> Answer {
        Answer::Built(Box::new(lock(&self.shared.builder).seen()))
    }

    pub(super) fn end_build(&self) -> Answer {
        lock(&self.shared.builder).cancel();
        Answer::Done {}
    }
}
