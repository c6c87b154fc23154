//! The friction library: friction identified on real machines, by name.
//!
//! An entry is a file of `data/friction`, or another file of this form: title and source under `[about]`, then
//! parameters as in any other file. All friction is rotary; that of linear axes is referred to the motor's shaft.

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

use stickslip_base::excerpt::parser_message;
use stickslip_base::parameters::{self, describe};
use stickslip_base::{Error, Preset, input};

/// Built-in entries: name and text.
const ENTRIES: &[(&str, &str)] = &[
    ("emps", include_str!("../../../../data/friction/emps.toml")),
    ("dc-servo", include_str!("../../../../data/friction/dc-servo.toml")),
    ("torque-motor", include_str!("../../../../data/friction/torque-motor.toml")),
    ("robot-joint-1", include_str!("../../../../data/friction/robot-joint-1.toml")),
    ("robot-joint-2", include_str!("../../../../data/friction/robot-joint-2.toml")),
    ("panda-joint-1", include_str!("../../../../data/friction/panda-joint-1.toml")),
    ("geared-servo", include_str!("../../../../data/friction/geared-servo.toml")),
];

/// Section of a file that describes it; the others have parameters.
const ABOUT: &str = "about";

/// Origin of an entry.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// Title, one line.
    pub title: String,
    /// Authors and method of measurement and identification.
    pub source: String,
    /// Licence.
    pub licence: String,
    /// Missing information.
    #[serde(default)]
    pub lacks: Vec<String>,
    /// Standard deviations stated by the source, by parameter path, in the parameter's unit.
    #[serde(default)]
    pub deviations: BTreeMap<String, f64>,
}

/// The numbers of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Identified<T> {
    /// Range of the identification.
    pub range: IdentifiedRange<T>,
    /// The friction.
    pub friction: Friction<T>,
}

/// Range of an identification; 0 for unknown values.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = IdentifiedRange::law)]
pub struct IdentifiedRange<T> {
    /// Inertia of the axis on which the friction was identified.
    #[field(symbol = "J", unit = "kg m^2", range = 0.0..=1e4)]
    pub inertia: T,
    /// Lowest measured speed.
    #[field(unit = "rad/s", range = 0.0..=1e4)]
    pub slowest: T,
    /// Highest measured speed.
    #[field(unit = "rad/s", range = 0.0..=1e4)]
    pub fastest: T,
}

impl<T: Scalar> IdentifiedRange<T> {
    fn law(&self) -> [Relation<T>; 1] {
        [at_most("slowest", self.slowest, self.fastest, "The lowest speed is above the highest: swap them.")]
    }
}

/// Friction identified on a real machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its name or file.
    pub name: String,
    /// Its origin.
    pub about: About,
    /// Its numbers.
    pub identified: Identified<f64>,
}

/// Names of all entries.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|(name, _)| *name)
}

/// The entry of this name, or the file at this path.
///
/// # Errors
/// [`Error::NothingToCompare`] with the names of all entries; errors of a file.
pub fn find(name_or_path: &str) -> Result<Entry, Error> {
    if let Some((name, text)) = ENTRIES.iter().find(|(name, _)| *name == name_or_path) {
        return read(name, text, &format!("data/friction/{name}.toml"));
    }
    if !name_or_path.ends_with(".toml") {
        let names = names().collect();
        return Err(Error::NothingToCompare {
            what: "friction of the library",
            name: name_or_path.into(),
            known: names,
        });
    }
    let path = Path::new(name_or_path);
    let text = input::text(path, input::TEXT)?;
    read(name_or_path, &text, name_or_path)
}

fn read(name: &str, text: &str, file: &str) -> Result<Entry, Error> {
    #[derive(Deserialize)]
    struct Described {
        about: About,
    }
    let broken = |problem: String| ExperimentError::Library { file: file.into(), problem };
    let Described { about } = toml::from_str(text).map_err(|error| broken(parser_message(error.message())))?;
    // A deviation requires a parameter of this path.
    for path in about.deviations.keys() {
        describe::<Identified<f64>>(path)?;
    }
    if let Some((path, deviation)) = about.deviations.iter().find(|(_, it)| !(it.is_finite() && **it >= 0.0)) {
        return Err(
            broken(format!("the deviation of {path} is {deviation}; a number of at least 0 is required")).into()
        );
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
    /// Limits of this kind of friction.
    pub fn limits(&self) -> Vec<&'static str> {
        let mut limits = match self.identified.friction.model {
            Model::Nothing => vec!["No friction."],
            Model::Static(_) => {
                vec!["No presliding: at rest the load is rigid, and the torque jumps at a reversal."]
            }
            Model::Dahl(_) => vec![
                "No Stribeck drop: it causes neither hunting nor stick-slip.",
                "Drifts under a vibrating load below breakaway.",
            ],
            Model::Lugre(_) => {
                vec!["Drifts under a vibrating load below breakaway: use elasto-plastic bristles instead."]
            }
            Model::ElastoPlastic(_) => vec![],
            Model::MaxwellSlip(_) => vec![
                "Viscous damping only within the elastic zone of its stiffest element.",
                "The controller's model has one elasto-plastic bristle of the same stiffness: it does not remember several \
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

    /// The step [s] that follows the bristles at rest on the inertia of the identification: a tenth of the largest
    /// stable step; the period of their vibration is off by 0.2 %. `None` without bristles or with unknown inertia.
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
        /// Multiplies torques.
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

    /// Its sliding curve; `None` without friction.
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

    /// A bench with this friction in a role. The bench renders and models one curve for both directions on
    /// elasto-plastic bristles; an entry without bristles keeps those of the bench. A Maxwell slip is modelled as one
    /// bristle with the slope of its reversals.
    ///
    /// # Errors
    /// [`Error::Parameters`] with the values that the bench does not accept; [`ExperimentError::NotAsDesired`] for a
    /// friction that the load motor cannot render: a Maxwell slip, or one that depends on time at rest or temperature.
    pub fn on(&self, preset: &Preset<f64>, role: Role) -> Result<Preset<f64>, Error> {
        let mut preset = *preset;
        let friction = self.identified.friction;
        let sliding = self.sliding().unwrap_or_default();
        let bristles = |bench: Bristles<f64>| match friction.model {
            Model::Nothing | Model::Static(_) => bench,
            Model::Dahl(model) => Bristles { stiffness: model.bristle_stiffness, damping: 0.0, ..bench },
            Model::Lugre(lugre) => Bristles {
                elastic_fraction: bench.elastic_fraction,
                ..ElastoPlastic { lugre, ..Default::default() }.into()
            },
            Model::ElastoPlastic(model) => model.into(),
            Model::MaxwellSlip(model) => Bristles { stiffness: model.stiffness(), damping: 0.0, ..bench },
        };
        let model = &mut preset.model;
        match role {
            Role::Desired => {
                self.check_renderable()?;
                preset.bench.desired_bristles = bristles(preset.bench.desired_bristles);
                preset.bench.desired = sliding;
            }
            Role::Own => {
                model.own_bristles = bristles(model.own_bristles);
                model.own = sliding;
                preset.plant.screw_friction = friction;
                preset.plant.wheel.preload = 0.0;
            }
        }
        // Values that a file cannot have are errors.
        parameters::check(&preset, &self.name)?;
        Ok(preset)
    }
}

impl Entry {
    /// `Err` unless it is one bristle on one curve; the load motor renders nothing else.
    fn check_renderable(&self) -> Result<(), Error> {
        let Friction { model, rest, temperature, .. } = &self.identified.friction;
        let refused =
            |reason, remedy| Err(ExperimentError::NotAsDesired { name: self.name.clone(), reason, remedy }.into());
        if let Model::MaxwellSlip(_) = model {
            let reason =
                "the load motor renders one bristle, but a Maxwell slip has four elements that remember every reversal";
            return refused(
                reason,
                "Use it as own friction (--as own), or an elasto-plastic friction as the desired one.",
            );
        }
        if !matches!((rest, temperature), (Rest::Constant, Temperature::Constant)) {
            let reason = "the load motor cannot render a dependence on the time at rest or on the temperature";
            return refused(reason, "Use it as own friction (--as own), or leave out its tables rest and temperature.");
        }
        Ok(())
    }
}

/// Role of a library friction on a bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The friction that the load motor shall render.
    Desired,
    /// The own friction of the machine and of its model; the wheel is lifted off.
    Own,
}
