//! What changes something: work for the axis, parameters, faults on purpose.

use crate::LiveError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::MutexGuard;
use std::sync::atomic::Ordering;
use stickslip_bench::BenchError;

use stickslip_core::control::reference::Reference;
use stickslip_core::cycle::Change;
use stickslip_core::render::Correction;
use stickslip_core::supervise::Request;

use super::axis::{self, Job};
use super::protocol::{Answer, Changed, Doing, MarkKind};
use super::{Live, form, lock};
use stickslip_base::{Error, Preset, output, parameters};
use stickslip_bench::Injection;
use stickslip_bench::tuning::{Proposal, Tuning};
use stickslip_experiment::workflow::measure::Plan;

impl Live {
    pub(super) fn request(&self, request: Request) -> Result<Answer, Error> {
        lock(&self.shared.urgent).change(Change::Request(request))?;
        Ok(Answer::Done {})
    }

    pub(super) fn send(&self, job: Job) -> Result<Answer, Error> {
        let gone = |_| Error::BenchFault { cycle: 0, reason: "the bench has ended; start it anew".into() };
        self.jobs.send(job).map(|()| Answer::Done {}).map_err(gone)
    }

    /// Nothing that has put parameters of its own in their place begins, or runs, as long as this is held.
    fn at_most_moving(&self) -> Result<MutexGuard<'_, Option<Doing>>, Error> {
        let doing = lock(&self.shared.doing);
        match &*doing {
            Some(running) if running.stage != axis::MOVING => {
                Err(LiveError::Busy { what: running.what.clone() }.into())
            }
            _ => Ok(doing),
        }
    }

    /// Gives the axis something to do, unless it does something.
    pub(super) fn begin(&self, what: &str, job: Job) -> Result<Answer, Error> {
        let mut doing = lock(&self.shared.doing);
        if let Some(doing) = &*doing {
            return Err(LiveError::Busy { what: doing.what.clone() }.into());
        }
        self.shared.halt.store(false, Ordering::Relaxed);
        self.shared.abandoned.store(false, Ordering::Relaxed);
        *doing = Some(Doing { what: what.into(), stage: "begin".into(), fraction: 0.0 });
        self.shared.mark_now(MarkKind::Begin, what.into());
        self.send(job)
    }

    /// Breaks something from now on.
    pub(super) fn inject(&self, fault: &str) -> Result<Answer, Error> {
        // What lies in the past begins with the next tick.
        let text = if fault.contains('@') { fault.to_owned() } else { format!("{fault}@0s") };
        let injection: Injection = text.parse()?;
        if !self.shared.faults {
            let remedy = "Faults are injected into the virtual machine of `stickslip serve`, not behind --io.".into();
            return Err(BenchError::Injection { fault: injection.to_string(), remedy }.into());
        }
        let _doing = self.at_most_moving()?;
        self.send(Job::Inject(injection))
    }

    pub(super) fn measure<P: Plan + Send + 'static>(
        &self,
        values: &BTreeMap<String, String>,
        begins: impl FnOnce(&P, &Preset<f64>, u64) -> Box<axis::Begins>,
    ) -> Result<Answer, Error> {
        let plan = form::with_values(&P::default(), values)?;
        let preset = *lock(&self.shared.tuning).preset();
        let (number, folder) = self.folder(&format!("measure-{}", P::KIND))?;
        let begins = begins(&plan, &preset, number);
        self.begin(&format!("measure {}", P::KIND), Job::measure(plan, preset, begins, folder))
    }

    /// Number and folder for results, which does not exist yet.
    pub(super) fn folder(&self, name: &str) -> Result<(u64, PathBuf), Error> {
        let runs = self.shared.project.join("runs");
        output::create_folder(&runs)?;
        loop {
            // Its number in the catalogue as well; where that cannot be written, the next one.
            let aside = self.shared.catalogue.set_aside().ok().and_then(|number| u64::try_from(number).ok());
            let number = aside.unwrap_or_else(|| self.shared.runs.fetch_add(1, Ordering::Relaxed));
            let folder = runs.join(format!("{number:04}-{name}"));
            if !taken(&runs, number) {
                return Ok((number, folder));
            }
        }
    }

    /// Puts a proposal in force, unless something runs that has put parameters of its own in their place.
    pub(super) fn propose(&self, propose: impl FnOnce(&Tuning) -> Result<Proposal, Error>) -> Result<Answer, Error> {
        let _one = lock(&self.shared.changing);
        // A design may take long: nobody waits for it who only looks.
        let tuning = lock(&self.shared.tuning).clone();
        let proposal = propose(&tuning)?;
        let doing = self.at_most_moving()?;
        let cycle = self.enter(&proposal)?;
        drop(doing);
        let changed: Vec<_> = proposal.differences.iter().map(|difference| &*difference.path).collect();
        self.shared.mark(cycle, MarkKind::Change, changed.join(", "));
        let answer = Answer::Entered {
            cycle,
            differences: Changed::all(&proposal.differences),
            margin: proposal.margin.map(|margin| margin.to_string()),
        };
        lock(&self.shared.tuning).entered(proposal);
        Ok(answer)
    }

    /// Puts a proposal in force: the first cycle with it.
    pub(super) fn enter(&self, proposal: &Proposal) -> Result<u64, Error> {
        let parameters = proposal.parameters(Correction::Nothing)?;
        let before = lock(&self.shared.tuning).loaded_values();
        proposal.loaded.as_ref().map_or(Ok(()), |values| self.tell_loaded(values))?;
        let changed = lock(&self.shared.urgent).change(Change::Parameters(parameters));
        if let (Err(_), Some(_)) = (&changed, &proposal.loaded) {
            // All of them or none; why the rest did not enter is what counts.
            let _ = self.tell_loaded(&before);
        }
        let cycle = changed?;
        // An axis that has ended needs none.
        let _ = self.jobs.send(Job::Adopt(Box::new((proposal.preset().model, proposal.settings(), parameters))));
        Ok(cycle)
    }
}

/// Whether a run of this number exists.
fn taken(runs: &Path, number: u64) -> bool {
    let begin = format!("{number:04}-");
    let Ok(entries) = std::fs::read_dir(runs) else { return false };
    entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with(&begin))
}

/// The reference of a name, with some of its values.
pub(super) fn parse_reference<'a>(
    name: &str,
    values: impl IntoIterator<Item = (&'a str, f64)>,
) -> Result<Reference<f64>, Error> {
    // A choice at the top is named by its tag.
    let mut text = toml_edit::DocumentMut::new();
    text.insert("reference", toml_edit::value(name));
    for (name, value) in values {
        text.insert(name, toml_edit::value(value));
    }
    Ok(parameters::read(&text.to_string(), "the reference")?)
}
