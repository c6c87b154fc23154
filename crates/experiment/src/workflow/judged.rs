//! Verdict on a rendered friction: met or not, at which speeds not, why, and what to change.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::render::Rendering;
use crate::Plateau;
use stickslip_base::quantity::{Estimate, NORMAL95, number};
use stickslip_design::Passage;

/// Whether a desired friction was rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// At all speeds outside the fade-out the deviation is within the tolerance.
    Met,
    /// At some speeds it is not, or the load does not slide.
    NotMet,
    /// Not all speeds were measured.
    Incomplete,
}

impl Verdict {
    const ALL: [Verdict; 3] = [Verdict::Met, Verdict::NotMet, Verdict::Incomplete];

    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Met => "Met",
            Verdict::NotMet => "Not met",
            Verdict::Incomplete => "Incomplete",
        }
    }

    /// The verdict with which a text begins.
    pub fn of_text(text: &str) -> Option<Self> {
        let (word, _) = text.split_once(':')?;
        Verdict::ALL.into_iter().find(|verdict| verdict.word() == word)
    }
}

/// What is wrong on a plateau.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Defect {
    /// The load sticks or hunts.
    Sticks,
    /// The friction is too high.
    TooHigh,
    /// The friction is too low.
    TooLow,
}

/// Neighbouring speeds with the same defect; the worst plateau deviates by `deviation` [N m].
struct Stretch<'a> {
    defect: Defect,
    speeds: [f64; 2],
    worst: &'a Plateau,
    deviation: f64,
}

impl Rendering {
    /// Verdict and reasons: sentences on the speeds that are wrong, each with cause and remedy.
    pub fn judged(&self) -> (Verdict, Vec<String>) {
        let fade = self.law.fade_velocity;
        let mut outside: Vec<&Plateau> =
            self.curve.plateaus.iter().filter(|plateau| plateau.set_velocity.abs() > fade).collect();
        outside.sort_by(|a, b| a.set_velocity.abs().total_cmp(&b.set_velocity.abs()));
        // The worse direction of each speed.
        let worse = |a: &&Plateau, b: &&Plateau| {
            let badness = |plateau: &Plateau| (plateau.dropped.is_some(), self.deviation(plateau).abs());
            badness(a).0.cmp(&badness(b).0).then(badness(a).1.total_cmp(&badness(b).1))
        };
        let speeds = outside.chunk_by(|a, b| a.set_velocity.abs() == b.set_velocity.abs());
        let worst: Vec<&Plateau> = speeds.filter_map(|both| both.iter().copied().max_by(worse)).collect();
        let planned = 2 * self.plan.speeds().filter(|speed| *speed > fade).count();
        let stretches = self.stretches(&worst);
        let mut reasons: Vec<String> = stretches.iter().map(|stretch| self.reason(stretch)).collect();
        if !self.curve.complete || outside.is_empty() {
            reasons.insert(0, format!("{} of {planned} plateaus measured.", outside.len()));
            return (Verdict::Incomplete, reasons);
        }
        if !reasons.is_empty() {
            return (Verdict::NotMet, reasons);
        }
        let largest = outside.iter().map(|plateau| self.deviation(plateau).abs()).fold(0.0, f64::max);
        let place = if fade > 0.0 { " outside the fade-out" } else { "" };
        let met = format!(
            "on all {} plateaus{place} the deviation is at most {}; permitted: {}.",
            outside.len(),
            self.over_breakaway(largest),
            self.over_breakaway(self.tolerance())
        );
        (Verdict::Met, vec![met])
    }

    /// Largest permitted deviation [N m].
    fn tolerance(&self) -> f64 {
        Passage::<f64>::default().tolerance * self.law.desired.breakaway_torque
    }

    /// Measured minus desired friction, positive for too much [N m].
    fn deviation(&self, plateau: &Plateau) -> f64 {
        plateau.velocity.signum() * (plateau.torque - self.law.desired.torque(plateau.velocity))
    }

    fn stretches<'a>(&self, plateaus: &[&'a Plateau]) -> Vec<Stretch<'a>> {
        let mut stretches: Vec<Stretch<'a>> = Vec::new();
        let mut before = None;
        for &plateau in plateaus {
            let deviation = self.deviation(plateau);
            let certain = deviation.abs() - NORMAL95 * plateau.standard_error > self.tolerance();
            let defect = match deviation {
                _ if plateau.dropped.is_some() => Some(Defect::Sticks),
                deviation if certain => Some(if deviation > 0.0 { Defect::TooHigh } else { Defect::TooLow }),
                _ => None,
            };
            let speed = plateau.set_velocity.abs();
            match (defect, stretches.last_mut().filter(|last| before == Some(last.defect) && before == defect)) {
                (None, _) => {}
                (Some(_), Some(last)) => {
                    last.speeds[1] = speed;
                    if deviation.abs() > last.deviation.abs() {
                        (last.worst, last.deviation) = (plateau, deviation);
                    }
                }
                (Some(defect), None) => {
                    stretches.push(Stretch { defect, speeds: [speed; 2], worst: plateau, deviation });
                }
            }
            before = defect;
        }
        stretches
    }

    fn reason(&self, stretch: &Stretch<'_>) -> String {
        let Stretch { defect, speeds: [from, to], worst, deviation } = stretch;
        let speed = |value: f64| Estimate::new(value, "rad/s").to_string();
        let place = if from == to {
            format!("at {}", speed(*from))
        } else {
            format!("from {} to {}", speed(*from), speed(*to))
        };
        let much = match defect {
            Defect::Sticks => {
                return format!(
                    "{place} the load sticks or hunts. Reduce M_S − M_K, increase Ω_Strib, or use a stiffer velocity loop."
                );
            }
            Defect::TooHigh => "too high",
            Defect::TooLow => "too low",
        };
        let (cause, remedy) = self.cause(worst, *deviation);
        format!(
            "{place} the friction is {much}, by up to {} ({}) at {}; permitted: {} %. {cause} {remedy}",
            Estimate::new(deviation.abs(), "N m"),
            self.over_breakaway(deviation.abs()),
            speed(worst.set_velocity),
            number(100.0 * Passage::<f64>::default().tolerance, 0)
        )
    }

    /// The largest part of a deviation, and its remedy. Measured minus desired friction is the sum of three parts: the
    /// command of the law minus desired − own, the load motor's torque minus this command, own friction minus its model.
    fn cause(&self, plateau: &Plateau, deviation: f64) -> (&'static str, &'static str) {
        let mean = |value: fn(&crate::Block) -> f64| {
            plateau.blocks.iter().map(value).sum::<f64>() / plateau.blocks.len().max(1) as f64
        };
        let sign = plateau.velocity.signum();
        let command = mean(|block| block.difference_torque);
        let law = sign * (command - self.law.torque(plateau.velocity));
        let motor = sign * (mean(|block| block.load_torque) - command);
        let parts = [
            (
                law,
                "The law commands another torque than desired − own, because the estimated velocity is late or noisy.",
                "Increase Ω_Strib or reduce M_S − M_K.",
            ),
            (
                motor,
                "The torque of the load motor differs from its command.",
                "Reduce the difference to the own friction, or check current limit and supply voltage of the load motor.",
            ),
            (
                deviation - law - motor,
                "The own friction differs from its model.",
                "Measure the own friction again with the machine warm and download it.",
            ),
        ];
        let towards = |part: f64| part * deviation.signum();
        let [first, rest @ ..] = parts;
        let (_, cause, remedy) =
            rest.into_iter().fold(first, |most, part| if towards(part.0) > towards(most.0) { part } else { most });
        (cause, remedy)
    }
}

#[cfg(test)]
mod tests;
