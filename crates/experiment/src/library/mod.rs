//! The friction library: friction that was identified on real machines, by name.
//!
//! An entry is a file of `data/friction`, or one of the same form: what it is and where it comes from under `[about]`,
//! then parameters as in any other file. All of it is rotary; what moves in a line is referred to its motor's shaft.

mod report;
#[cfg(test)]
mod tests;

use crate::ExperimentError;
use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use stickslip_core::Fields;
use stickslip_core::fields::{Field, Fields as _, Relation, Walk, at_most};
use stickslip_core::friction::{Bristles, Dahl, ElastoPlastic, Friction, Model, Rest, Stribeck, Temperature};
use stickslip_core::scalar::Scalar;

use stickslip_base::parameters::{self, describe};
use stickslip_base::{Error, Preset};

/// Entries that the program brings along: name and text.
const ENTRIES: &[(&str, &str)] = &[
    ("emps", include_str!("../../../../data/friction/emps.toml")),
    ("dc-servo", include_str!("../../../../data/friction/dc-servo.toml")),
    ("torque-motor", include_str!("../../../../data/friction/torque-motor.toml")),
    ("robot-joint-1", include_str!("../../../../data/friction/robot-joint-1.toml")),
    ("robot-joint-2", include_str!("../../../../data/friction/robot-joint-2.toml")),
    ("panda-joint-1", include_str!("../../../../data/friction/panda-joint-1.toml")),
    ("geared-servo", include_str!("../../../../data/friction/geared-servo.toml")),
];

/// The part of a file that is about it, and no parameter.
const ABOUT: &str = "about";

/// Where an entry comes from.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// What it is, in a line.
    pub title: String,
    /// Who measured and identified it, and how.
    pub source: String,
    /// On what terms it may be used.
    pub licence: String,
    /// What it does not tell.
    #[serde(default)]
    pub lacks: Vec<String>,
    /// Standard deviations by the paths of parameters, in their units; those that the source tells.
    #[serde(default)]
    pub deviations: BTreeMap<String, f64>,
}

/// The numbers of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Identified<T> {
    /// Where it was identified.
    pub range: IdentifiedRange<T>,
    /// The friction.
    pub friction: Friction<T>,
}

/// Where a friction was identified. What is 0 is not known.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = IdentifiedRange::law)]
pub struct IdentifiedRange<T> {
    /// Inertia that the friction was identified with.
    #[field(symbol = "J", unit = "kg m^2", range = 0.0..=1e4)]
    pub inertia: T,
    /// Lowest speed at which something was measured.
    #[field(unit = "rad/s", range = 0.0..=1e4)]
    pub slowest: T,
    /// Highest.
    #[field(unit = "rad/s", range = 0.0..=1e4)]
    pub fastest: T,
}

impl<T: Scalar> IdentifiedRange<T> {
    fn law(&self) -> [Relation<T>; 1] {
        [at_most("slowest", self.slowest, self.fastest, "The lowest speed is above the highest: exchange them.")]
    }
}

/// Friction that was identified on a real machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its name, or the file that it comes from.
    pub name: String,
    /// Where it comes from.
    pub about: About,
    /// Its numbers.
    pub identified: Identified<f64>,
}

/// Names of all entries.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|(name, _)| *name)
}

/// The entry of that name, or else the file at that path.
///
/// # Errors
/// [`Error::NothingToCompare`] with those that there are; what is wrong with a file.
pub fn find(name_or_path: &str) -> Result<Entry, Error> {
    if let Some((name, text)) = ENTRIES.iter().find(|(name, _)| *name == name_or_path) {
        return read(name, text, &format!("data/friction/{name}.toml"));
    }
    if !name_or_path.ends_with(".toml") {
        let known = names().collect();
        return Err(Error::NothingToCompare { what: "friction of the library", name: name_or_path.into(), known });
    }
    let path = Path::new(name_or_path);
    let text = std::fs::read_to_string(path).map_err(|source| Error::file(path, "read", source))?;
    read(name_or_path, &text, name_or_path)
}

fn read(name: &str, text: &str, file: &str) -> Result<Entry, Error> {
    #[derive(Deserialize)]
    struct Described {
        about: About,
    }
    let broken = |problem: String| ExperimentError::Library { file: file.into(), problem };
    let Described { about } = toml::from_str(text).map_err(|error| broken(error.to_string().trim().into()))?;
    // A path is worth its deviation only where the friction has it.
    for path in about.deviations.keys() {
        describe::<Identified<f64>>(path)?;
    }
    if let Some((path, deviation)) = about.deviations.iter().find(|(_, it)| !(it.is_finite() && **it >= 0.0)) {
        return Err(broken(format!("the deviation of {path} is {deviation}: write a number of at least 0")).into());
    }
    let identified = parameters::read(&without_about(text), file)?;
    Ok(Entry { name: name.into(), about, identified })
}

/// The text with all of `[about]` blank, so that lines keep their numbers.
fn without_about(text: &str) -> String {
    let mut within = false;
    let lines = text.lines().map(|line| {
        if let Some(heading) = line.trim().strip_prefix('[').filter(|_| !line.starts_with(' ')) {
            let heading = heading.trim_end_matches(']').trim();
            within = heading == ABOUT || heading.starts_with("about.");
        }
        if within { "" } else { line }
    });
    lines.collect::<Vec<_>>().join("\n")
}

impl Entry {
    /// What no friction of this kind represents.
    pub fn limits(&self) -> Vec<&'static str> {
        let mut limits = match self.identified.friction.model {
            Model::Nothing => vec!["No friction."],
            Model::Static(_) => {
                vec!["No presliding: at rest the load is rigid, and a reversal is a jump of the torque."]
            }
            Model::Dahl(_) => vec![
                "No Stribeck drop: nothing hunts or slips by it.",
                "Drifts under a vibrating load below breakaway.",
            ],
            Model::Lugre(_) => {
                vec!["Drifts under a vibrating load below breakaway: take elasto-plastic bristles there."]
            }
            Model::ElastoPlastic(_) => vec![],
            Model::MaxwellSlip(_) => vec![
                "No damping but the viscous within the elastic zone of its stiffest element.",
                "The software believes in one elasto-plastic bristle of the same stiffness: it does not remember several \
                 reversals.",
            ],
        };
        if matches!(self.identified.friction.model, Model::Dahl(_) | Model::Lugre(_) | Model::ElastoPlastic(_)) {
            limits.push("Small loops within a large one do not close: one bristle has no memory of several reversals.");
        }
        limits.extend(match (&self.identified.friction.temperature, &self.identified.friction.rest) {
            (Temperature::Constant, Rest::Constant) => Some("Neither temperature nor the time at rest has an effect."),
            (Temperature::Constant, Rest::Rising(_)) => Some("Temperature has no effect."),
            (Temperature::Exponential(_), Rest::Constant) => Some("The time at rest has no effect."),
            (Temperature::Exponential(_), Rest::Rising(_)) => None,
        });
        limits
    }

    /// The step [s] that follows the bristles at rest on the inertia it was identified with: a tenth of the largest that is
    /// stable, at which the period of their vibration is off by 0.2 %. `None` without bristles, or where the inertia is
    /// not known.
    pub fn recommended_step(&self) -> Option<f64> {
        let Identified { friction, range } = &self.identified;
        let (stiffness, damping) = friction.stiffest();
        (stiffness > 0.0 && range.inertia > 0.0).then(|| {
            let (a, b) = (stiffness / range.inertia, damping / range.inertia);
            // The bound of the virtual machine, (σ₀/J)·h² + 2·(σ₁ + b)/J·h = 4.
            0.1 * 4.0 / (b + libm::sqrt(b * b + 4.0 * a))
        })
    }

    /// The same motion on a machine of another size: all torques and the inertia multiplied.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        /// Multiplies what is a torque.
        struct Scale(f64);
        impl Walk<f64> for Scale {
            fn number(&mut self, field: &'static Field, value: &mut f64) {
                match field.unit {
                    unit if unit.starts_with("N m") || unit == "kg m^2" => *value *= self.0,
                    "1/(N m)" => *value /= self.0,
                    _ => {}
                }
            }
        }
        let mut scaled = self.clone();
        scaled.identified.contents(&mut Scale(factor));
        scaled.about.deviations = (self.about.deviations.iter())
            .map(|(path, deviation)| {
                let field = describe::<Identified<f64>>(path).ok().and_then(|rows| rows.first()?.field);
                let scale = if field.is_some_and(|field| field.unit.starts_with("N m")) { factor } else { 1.0 };
                (path.clone(), scale * deviation)
            })
            .collect();
        scaled
    }

    /// The curve that it slides on; `None` without friction.
    pub fn sliding(&self) -> Option<Stribeck<f64>> {
        match self.identified.friction.model {
            Model::Nothing => None,
            Model::Static(model) => Some(model.sliding),
            Model::Dahl(Dahl { kinetic_torque, viscous_friction, .. }) => {
                let breakaway_torque = kinetic_torque;
                Some(Stribeck { breakaway_torque, kinetic_torque, viscous_friction, ..Stribeck::default() })
            }
            Model::Lugre(model) => Some(model.sliding),
            Model::ElastoPlastic(model) => Some(model.lugre.sliding),
            Model::MaxwellSlip(model) => Some(model.sliding),
        }
    }

    /// A bench of which this is the friction in a role. A bench renders, and believes in, one curve for both directions
    /// on elasto-plastic bristles; where the entry has none of its own, those of the bench stay. A Maxwell slip is believed as one
    /// bristle with the slope of its reversals.
    ///
    /// # Errors
    /// [`Error::Parameters`] with what such a bench could not have; [`ExperimentError::NotAsDesired`] for a friction that the
    /// load motor cannot render: a Maxwell slip, or one that depends on time at rest or temperature.
    pub fn on(&self, preset: &Preset<f64>, role: Role) -> Result<Preset<f64>, Error> {
        let mut preset = *preset;
        let friction = self.identified.friction;
        let sliding = self.sliding().unwrap_or_default();
        let bristles = |kept: Bristles<f64>| match friction.model {
            Model::Nothing | Model::Static(_) => kept,
            Model::Dahl(model) => Bristles { stiffness: model.bristle_stiffness, damping: 0.0, ..kept },
            Model::Lugre(lugre) => Bristles {
                elastic_fraction: kept.elastic_fraction,
                ..ElastoPlastic { lugre, ..Default::default() }.into()
            },
            Model::ElastoPlastic(model) => model.into(),
            Model::MaxwellSlip(model) => Bristles { stiffness: model.stiffness(), damping: 0.0, ..kept },
        };
        let believed = &mut preset.model;
        match role {
            Role::Desired => {
                self.check_renderable()?;
                preset.bench.desired_bristles = bristles(preset.bench.desired_bristles);
                preset.bench.desired = sliding;
            }
            Role::Own => {
                believed.own_bristles = bristles(believed.own_bristles);
                believed.own = sliding;
                preset.plant.screw_friction = friction;
                preset.plant.wheel.preload = 0.0;
            }
        }
        // What a file could not say is none.
        parameters::check(&preset, &self.name)?;
        Ok(preset)
    }
}

impl Entry {
    /// `Err` if it is no friction of one bristle on one curve, which is all that is rendered.
    fn check_renderable(&self) -> Result<(), Error> {
        let Friction { model, rest, temperature, .. } = &self.identified.friction;
        let refused =
            |reason, remedy| Err(ExperimentError::NotAsDesired { name: self.name.clone(), reason, remedy }.into());
        if let Model::MaxwellSlip(_) = model {
            let reason =
                "the load motor renders one bristle, a Maxwell slip has four elements that remember every reversal";
            return refused(
                reason,
                "Take it as own friction (--as own), or an elasto-plastic friction as the desired one.",
            );
        }
        if !matches!((rest, temperature), (Rest::Constant, Temperature::Constant)) {
            let reason = "the load motor renders no friction that depends on the time at rest or on the temperature";
            return refused(
                reason,
                "Take it as own friction (--as own), or leave out its tables rest and temperature.",
            );
        }
        Ok(())
    }
}

/// What a friction of the library is to be on a bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The friction that the load motor shall render.
    Desired,
    /// That of the machine itself, true and believed; the wheel is lifted off.
    Own,
}
