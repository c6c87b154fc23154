//! Limits of runs of a servo, their causes and remedies.

use super::super::limits::percent;
use super::{Candidate, ServoIdentification, fields};
use crate::machine::{Machine, Run};
use stickslip_base::quantity::{Estimate, number, tied};

/// Duty that counts as full.
const FULL: f64 = 0.99;

impl ServoIdentification {
    /// Smallest and largest slope of the recorded duty over the known controller's, over all runs.
    pub(super) fn controller_slopes(&self) -> [f64; 2] {
        let slopes = || self.runs.iter().filter_map(Run::controller_slope);
        [slopes().fold(f64::INFINITY, f64::min), slopes().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Quantities that no analysis of these runs can determine, with cause and remedy; a sentence or two each.
    pub fn limits(&self, machine: &Machine) -> Vec<String> {
        let mut limits = vec![
            "Absolute torques. No current and no torque was recorded: the weight of the pendulum is the measure of all \
             of them. If mass times length is wrong by some share, or the arm itself weighs something, torque per \
             volt, friction and inertia are wrong by about as much. Weigh the arm, or record the current."
                .to_owned(),
            "Viscous friction apart from the motor's own braking: while the servo drives, both rise with speed. Only \
             the free swings after it is switched off separate them. Record more of those, from several angles."
                .to_owned(),
            "Whether the winding got warm: the models have one resistance for all runs. Record it before and after, \
             or wait between runs."
                .to_owned(),
        ];
        if let Some(grid) = machine.encoder_grid {
            limits.push(format!(
                "Presliding, and friction in creeping motion: the encoder steps by {}, which at a sample every {} is a \
                 step of {} in speed. Use a finer encoder on the output shaft.",
                tied(&Estimate::new(grid, "rad")),
                tied(&Estimate::new(machine.sampling_period, "s")),
                tied(&Estimate::new(grid / machine.sampling_period, "rad/s")),
            ));
        }
        let gain = |held_out| {
            let gains = self.runs.iter().filter(|run| run.held_out == held_out).map(|run| run.gain);
            gains.fold(0.0, f64::max)
        };
        if gain(true) > gain(false) {
            limits.push(format!(
                "Errors of the models within the fitted range: the runs held out have a position gain {} times as \
                 high as any that a fit saw. Their error is that of an extrapolation, and since the best model was \
                 selected by it, slightly too good.",
                number(gain(true) / gain(false), 1)
            ));
        }
        let best = self.best();
        let learnt = |c: &&Candidate| c.fit_rms < best.fit_rms && c.held_out_rms > best.held_out_rms;
        let richer: Vec<&str> = self.candidates.iter().filter(learnt).map(|c| c.fitted.kind.title()).collect();
        if !richer.is_empty() {
            limits.push(format!(
                "The exact dependence of friction on the load: richer models ({}) describe the runs that were fitted \
                 better and the others worse. Stick gives their fits many minima of nearly equal depth. Runs with \
                 record more gains and loads.",
                richer.join("; ")
            ));
        }
        let [full, all] = self
            .held_out()
            .flat_map(|run| &run.duty)
            .fold([0.0; 2], |[full, all], duty| [full + f64::from(u8::from(duty.abs() >= FULL)), all + 1.0]);
        if full > 0.0 {
            limits.push(format!(
                "Torque at full duty: {} of the samples held out are there, where supply, winding and \
                 firmware bound the torque together. Record the current and the voltage of the motor.",
                percent(full / all)
            ));
        }
        let fitted = &self.best().fitted;
        let fields_of_kind =
            fields().iter().zip(&fitted.ci95).filter(|(field, ci95)| fitted.kind.has(field.name) && ci95.is_none());
        let unknown: Vec<String> = fields_of_kind.map(|(field, _)| field.name.replace('_', " ")).collect();
        if !unknown.is_empty() {
            limits.push(format!(
                "The value of {}: these runs do not determine it within a factor of 20, or it ended at 0. Record runs of \
                 other kinds.",
                unknown.join(", ")
            ));
        }
        limits
    }
}
