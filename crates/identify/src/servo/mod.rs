//! Identification of a geared hobby servo with a pendulum from its logs: angle and reference, no current, no torque.
//!
//! The weight of the pendulum is the only known torque, to which all others are referred. Each model is fitted to some
//! runs in the simulated closed loop and validated on the others, and compared with published models of the same servo.

mod fit;
mod limits;
mod model;
mod report;
mod results;

pub use fit::{Fitted, PARAMETERS, fields, fit, values};
pub use model::{Kind, Servo};
pub use report::report;
pub use results::{result_name, summary, write};
use stickslip_core::fields::Fields;

use crate::machine::{Machine, Run};
use stickslip_base::{Error, Watch};
use stickslip_recording::Recording;

/// Result of the identification of a servo.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoIdentification {
    /// The runs.
    pub runs: Vec<Run>,
    /// Models of rising richness.
    pub candidates: Vec<Candidate>,
    /// The one with the smallest error on the runs that were held out.
    pub best: usize,
}

/// A fitted model and its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The fit.
    pub fitted: Fitted,
    /// rms(q − q̂) over the runs that were fitted [rad].
    pub fit_rms: f64,
    /// The same over those held out.
    pub held_out_rms: f64,
    /// Published model of this kind, and its error on the runs held out [rad].
    pub published: Option<(Servo<f64>, f64)>,
}

/// Identifies a servo from a recording of several runs.
///
/// # Errors
/// As [`Machine::runs`]; [`Error::Cancelled`].
pub fn identify_servo(recording: &Recording, machine: &Machine, watch: &Watch) -> Result<ServoIdentification, Error> {
    watch.stage("runs", 0.0)?;
    identify_runs(machine.runs(recording)?, &Kind::ALL, machine, watch)
}

fn identify_runs(
    runs: Vec<Run>,
    kinds: &[Kind],
    machine: &Machine,
    watch: &Watch,
) -> Result<ServoIdentification, Error> {
    let [fitted_runs, held_out]: [Vec<&Run>; 2] =
        [false, true].map(|held_out| runs.iter().filter(|run| run.held_out == held_out).collect());
    let mut candidates: Vec<Candidate> = Vec::new();
    for (done, kind) in kinds.iter().copied().enumerate() {
        watch.stage("fit models in the closed loop", done as f64 / kinds.len() as f64)?;
        let simpler: Vec<&Fitted> = candidates.iter().map(|c| &c.fitted).filter(|f| f.kind.is_within(kind)).collect();
        let fitted = fit(kind, &fitted_runs, &simpler, watch)?;
        let published =
            published(kind, machine).map(|servo| Ok::<_, Error>((servo, rms(kind, &servo, &held_out, watch)?)));
        candidates.push(Candidate {
            fit_rms: rms(kind, &fitted.servo, &fitted_runs, watch)?,
            held_out_rms: rms(kind, &fitted.servo, &held_out, watch)?,
            published: published.transpose()?,
            fitted,
        });
    }
    let error = |i: &usize| candidates[*i].held_out_rms;
    let best = (0..candidates.len()).min_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(0);
    Ok(ServoIdentification { runs, candidates, best })
}

/// rms(q − q̂) over all samples of some runs [rad].
fn rms(kind: Kind, servo: &Servo<f64>, runs: &[&Run], watch: &Watch) -> Result<f64, Error> {
    let (mut square, mut samples) = (0.0, 0usize);
    for run in runs {
        let positions = servo.simulate(kind, run, watch)?;
        square += positions.iter().zip(&run.position).map(|(q, measured)| (q - measured).powi(2)).sum::<f64>();
        samples += positions.len();
    }
    Ok((square / samples as f64).sqrt())
}

/// The parameters of `published.KIND` in a machine file; missing ones are 0.
pub fn published(kind: Kind, machine: &Machine) -> Option<Servo<f64>> {
    let table = machine.published.get(kind.name())?;
    let mut names = fields().iter().map(|field| field.name);
    let value = |name: &str| table.get(name)?.first().copied();
    Some(Servo::<f64>::default().map(&mut |_: f64| names.next().and_then(value).unwrap_or(0.0)))
}

impl ServoIdentification {
    /// The model to use.
    pub fn best(&self) -> &Candidate {
        &self.candidates[self.best]
    }

    /// The runs that no fit used.
    pub fn held_out(&self) -> impl Iterator<Item = &Run> {
        self.runs.iter().filter(|run| run.held_out)
    }
}

#[cfg(test)]
mod tests;
