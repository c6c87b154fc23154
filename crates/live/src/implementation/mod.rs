//! The software on the target: blocks and wires, code, execution times, and settings granted by the system.

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
pub use target::{SettingResult, Target, TargetFile};
pub use timing::{LateCycle, TimedPart, Timing};

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use stickslip_core::render::Correction;

use super::lock;
use super::protocol::Answer;
use build::Builder;
use stickslip_base::{Error, Preset};
use stickslip_bench::tuning::Tuning;
use stickslip_generate::{self as generate, Generated};

/// The implementation of the software: the program, its code, and builds of it.
pub(super) struct Implementation {
    /// Folder of builds.
    folder: PathBuf,
    target: Target,
    builder: Mutex<Builder>,
    /// The last generated code and diagram with their preset: generation takes seconds with bristles.
    generated: Mutex<Option<(Preset<f64>, Arc<Generated>)>>,
}

impl Implementation {
    pub(super) fn new(folder: &Path, target: Target) -> Self {
        Implementation { folder: folder.into(), target, builder: Mutex::default(), generated: Mutex::default() }
    }

    /// The active software as code and diagram.
    fn generated(&self, tuning: &Tuning) -> Result<Arc<Generated>, Error> {
        // Other clients wait meanwhile and get the same code.
        let mut cache = lock(&self.generated);
        if let Some((of, generated)) = &*cache
            && of == tuning.preset()
        {
            return Ok(generated.clone());
        }
        // A proposal without a change is the active software.
        let proposal = tuning.set(&[])?;
        let tick = proposal.parameters(Correction::Nothing)?.tick;
        let generated = Arc::new(generate::software(&tick, proposal.preset().bench.tick_time())?);
        *cache = Some((*tuning.preset(), generated.clone()));
        Ok(generated)
    }

    pub(super) fn flow(&self, tuning: &Tuning, virtual_machine: bool) -> Result<Answer, Error> {
        let generated = self.generated(tuning)?;
        Ok(Answer::Flow(Box::new(Flow::of(&generated, tuning.preset(), &tuning.differences(), virtual_machine))))
    }

    pub(super) fn diagram_page(&self, tuning: &Tuning, page: &str) -> Result<Answer, Error> {
        Ok(Answer::DiagramPage(Box::new(DiagramPage::of(&*self.generated(tuning)?, page)?)))
    }

    /// The program at a tick rate.
    pub(super) fn target(&self, rate: f64) -> Answer {
        Answer::Target(Box::new(Target { rate, ..self.target.clone() }))
    }

    /// Starts to build the active software, unless a build is running.
    pub(super) fn build(&self, tuning: &Tuning) -> Result<Answer, Error> {
        let generated = self.generated(tuning)?;
        lock(&self.builder).begin(generated, &self.folder)?;
        Ok(Answer::Done {})
    }

    pub(super) fn built(&self) -> Answer {
        Answer::Built(Box::new(lock(&self.builder).progress()))
    }

    pub(super) fn end_build(&self) -> Answer {
        lock(&self.builder).cancel();
        Answer::Done {}
    }
}
