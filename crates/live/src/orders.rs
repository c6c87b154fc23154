//! Commands that change the bench: motions, measurements, parameters, injected faults.

use std::collections::BTreeMap;

use stickslip_core::control::reference::Reference;
use stickslip_core::render::Correction;
use stickslip_software::cycle::Change;

use super::axis::{self, Job};
use super::breakaway::BreakawayProgress;
use super::measurements::Measurements;
use super::protocol::{Answer, Changed, MarkKind, Quantity};
use super::{Live, Shared, form};
use stickslip_base::{Error, Preset};
use stickslip_bench::tuning::{Proposal, Tuning};
use stickslip_bench::{BenchError, Injection};
use stickslip_experiment::workflow::measure::Plan;
use stickslip_experiment::{BreakawayPlan, FrictionPlan, PreslidingPlan};

impl Live {
    fn send(&self, job: Job) -> Result<Answer, Error> {
        let gone = |_| Error::BenchFault { cycle: 0, reason: "the bench has ended; start it again".into() };
        self.jobs.send(job).map(|()| Answer::Done {}).map_err(gone)
    }

    /// Gives the axis a job, unless it is busy.
    pub(super) fn begin(&self, what: &str, job: Job) -> Result<Answer, Error> {
        self.shared.motion.begin(what, || {
            self.shared.acquisition.mark_now(MarkKind::Begin, what.into());
            self.send(job)
        })
    }

    /// Follows a reference.
    pub(super) fn follow(&self, name: String, values: &BTreeMap<String, f64>, render: bool) -> Result<Answer, Error> {
        let reference = parse_reference(&name, values)?;
        self.renderable(render)?;
        self.begin(&name.clone(), Job::Move { name, reference: Box::new(reference), render })
    }

    /// Sets the preload of the friction wheel.
    pub(super) fn preload(&self, preload: f64) -> Result<Answer, Error> {
        stickslip_bench::io::check_preload(preload)?;
        self.begin("preload", Job::Preload(preload))?;
        self.shared.motion.set_preload(preload);
        self.shared.save_state();
        Ok(Answer::Done {})
    }

    /// Injects a fault from now on.
    pub(super) fn inject(&self, fault: &str) -> Result<Answer, Error> {
        // A time in the past means the next tick.
        let text = if fault.contains('@') { fault.to_owned() } else { format!("{fault}@0s") };
        let injection: Injection = text.parse().map_err(|error| as_entered(error, fault))?;
        if !self.shared.links.is_virtual() {
            let remedy = "Faults are injected only into the virtual machine of `stickslip serve` without --io.".into();
            return Err(BenchError::Injection { fault: fault.into(), remedy }.into());
        }
        let _activity = self.shared.motion.at_most_moving()?;
        self.send(Job::Inject(injection))
    }

    /// Starts a measurement, with or without rendering.
    pub(super) fn measure(
        &self,
        what: Quantity,
        plan: &BTreeMap<String, String>,
        render: bool,
    ) -> Result<Answer, Error> {
        match (what, render) {
            (Quantity::Friction, true) => self.measure_rendered(plan),
            (_, true) => {
                let remedy = "Only the friction curve can be measured with rendering.".into();
                Err(Error::Unknown {
                    what: "measurement with rendering",
                    name: format!("{what:?}").to_lowercase(),
                    remedy,
                })
            }
            (Quantity::Friction, false) => {
                let begins = |_: &_, _: &Preset<f64>, number| Job::begins_curve(number, None);
                self.measure_by::<FrictionPlan<f64>>(plan, begins, Measurements::curve_so_far)
            }
            (Quantity::Breakaway, false) => {
                let begins = |plan: &BreakawayPlan<f64>, preset: &Preset<f64>, _| {
                    Job::begins_at_rest(BreakawayProgress::breakaway(plan, &preset.model))
                };
                self.measure_by(plan, begins, Measurements::breakaway_so_far)
            }
            (Quantity::Presliding, false) => {
                let begins = |_: &_, _: &Preset<f64>, _| {
                    Job::begins_at_rest(BreakawayProgress::Presliding(Vec::new(), Vec::new()))
                };
                self.measure_by::<PreslidingPlan<f64>>(plan, begins, Measurements::presliding_so_far)
            }
        }
    }

    fn measure_by<P: Plan + Send + 'static>(
        &self,
        values: &BTreeMap<String, String>,
        begins: impl FnOnce(&P, &Preset<f64>, u64) -> Box<axis::Begins>,
        so_far: axis::SoFar<P>,
    ) -> Result<Answer, Error> {
        let plan = form::with_values(&P::default(), values)?;
        let preset = self.shared.parameters.preset();
        let (number, folder) = self.shared.runs.folder(&format!("measure-{}", P::KIND))?;
        let begins = begins(&plan, &preset, number);
        self.begin(&format!("measure {}", P::KIND), Job::measure(plan, preset, begins, so_far, folder))
    }

    /// Activates a proposal, unless a measurement runs: a measurement sets parameters itself.
    pub(super) fn propose(&self, propose: impl FnOnce(&Tuning) -> Result<Proposal, Error>) -> Result<Answer, Error> {
        let Shared { parameters, motion, acquisition, .. } = &*self.shared;
        let _one = parameters.changing();
        let proposal = propose(&parameters.tuning())?;
        let activity = motion.at_most_moving()?;
        let cycle = self.enter(&proposal)?;
        drop(activity);
        let changed: Vec<_> = proposal.differences.iter().map(|difference| &*difference.path).collect();
        acquisition.mark(cycle, MarkKind::Change, changed.join(", "));
        let differences = Changed::all(&proposal.differences);
        let margin = proposal.margin.map(|margin| margin.to_string());
        parameters.entered(proposal);
        self.shared.save_state();
        Ok(Answer::Entered { cycle, differences, margin })
    }

    /// Activates a saved set.
    pub(super) fn load(&self, name: &str) -> Result<Answer, Error> {
        let set = self.shared.parameters.saved(name)?;
        self.propose(|tuning| tuning.load(set))
    }

    /// Activates a proposal. Returns the first cycle with it.
    pub(super) fn enter(&self, proposal: &Proposal) -> Result<u64, Error> {
        let Shared { parameters, motion, .. } = &*self.shared;
        let active = proposal.parameters(Correction::Nothing)?;
        let before = parameters.read(Tuning::loaded_values);
        proposal.loaded.as_ref().map_or(Ok(()), |values| parameters.loaded.put(values))?;
        let changed = motion.change(Change::Parameters(active));
        if let (Err(_), Some(_)) = (&changed, &proposal.loaded) {
            // All values or none; the error to report is that of the failed change.
            let _ = parameters.loaded.put(&before);
        }
        let cycle = changed?;
        // The axis may have ended.
        let _ = self.jobs.send(Job::Adopt(Box::new((proposal.preset().model, proposal.settings(), active))));
        Ok(cycle)
    }
}

/// The error about a fault, with the text as entered: without the time that [`Live::inject`] adds.
fn as_entered(error: Error, fault: &str) -> Error {
    match error.of() {
        Some(BenchError::Injection { remedy, .. }) => {
            BenchError::Injection { fault: fault.into(), remedy: remedy.clone() }.into()
        }
        _ => error,
    }
}

/// The reference of a name, with some of its values.
fn parse_reference(name: &str, values: &BTreeMap<String, f64>) -> Result<Reference<f64>, Error> {
    // The key of the top-level choice is its tag.
    let mut text = toml_edit::DocumentMut::new();
    text.insert("reference", toml_edit::value(name));
    for (name, value) in values {
        text.insert(name, toml_edit::value(*value));
    }
    Ok(stickslip_base::parameters::read(&text.to_string(), "the reference")?)
}
