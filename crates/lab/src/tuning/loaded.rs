//! A controller that was loaded from a file, as parameters beside those of the preset: who controls, and its numbers.
//!
//! They are in no parameter file, since they belong to the controller's; changed, undone, listed and given addresses they
//! are like all others.

use std::collections::BTreeMap;

use stickslip_core::fields::{Field, Kind, Shape, Variant};

use crate::foreign::{Description, Foreign};
use crate::parameters::schema::nearest;
use crate::parameters::{Entry, Fault, ParameterProblems, Problem, Value};
use crate::{Error, parameters};

/// Who controls the position.
const WHO: &str = "position_controller";
/// Where the numbers of the controller stand.
const GROUP: &str = "loaded";
const PRESET: &str = "preset";

static WHOSE: Field = Field {
    name: WHO,
    symbol: "",
    unit: "",
    minimum: f64::NEG_INFINITY,
    maximum: f64::INFINITY,
    default: 1.0,
    help: "Who controls the position.",
    kind: Kind::Real,
    shape: Shape::Choice {
        tag: WHO,
        variants: &[
            Variant {
                name: PRESET,
                help: "The controller of the parameters, bench.controller.",
                shape: Shape::Group(&[]),
            },
            Variant { name: GROUP, help: "The controller that was loaded from a file.", shape: Shape::Group(&[]) },
        ],
    },
};

/// A controller that was loaded: its parameters, and what it was begun with.
#[derive(Clone, Debug)]
pub struct Loaded {
    fields: Vec<(&'static Field, bool)>,
    begun: Chosen,
    /// Time from sample to sample [s].
    period: f64,
}

/// What is chosen of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chosen {
    /// Whether it controls.
    pub(super) controls: bool,
    values: BTreeMap<&'static str, f64>,
}

impl Loaded {
    /// With the values that it has, for samples of so many seconds. Its texts stay until the program ends, as those of
    /// all fields do.
    pub fn new(foreign: &Foreign, period: f64) -> Self {
        let Description { parameters, .. } = foreign.description();
        let leaked = |text: &str| -> &'static str { Box::leak(text.to_owned().into_boxed_str()) };
        let field = |parameter: &crate::foreign::ModuleParameter| Field {
            name: leaked(&parameter.name),
            symbol: "",
            unit: leaked(&parameter.unit),
            minimum: parameter.minimum,
            maximum: parameter.maximum,
            default: parameter.initial,
            help: leaked(&parameter.help),
            kind: Kind::Real,
            shape: Shape::Number,
        };
        let fields: Vec<(&'static Field, bool)> =
            parameters.iter().map(|parameter| (&*Box::leak(Box::new(field(parameter))), parameter.fixed)).collect();
        let values = fields.iter().zip(foreign.values()).map(|((field, _), value)| (field.name, *value)).collect();
        Loaded { fields, begun: Chosen { controls: true, values }, period }
    }

    /// What it was begun with.
    pub(super) fn begun(&self) -> Chosen {
        self.begun.clone()
    }

    /// The same of another file, as far as this has such numbers and admits them.
    pub(super) fn taken_over(&self, from: &Chosen) -> Chosen {
        let kept = |field: &&'static Field| {
            let value = from.values.get(field.name).copied();
            value
                .filter(|value| (field.minimum..=field.maximum).contains(value))
                .unwrap_or(self.begun.values[field.name])
        };
        let values = self.fields.iter().map(|(field, _)| (field.name, kept(field))).collect();
        Chosen { controls: from.controls, values }
    }

    /// The numbers in the order of its parameters.
    pub(super) fn values(&self, chosen: &Chosen) -> Vec<f64> {
        self.fields.iter().map(|(field, _)| chosen.values[field.name]).collect()
    }

    /// As parameters.
    pub(super) fn entries(&self, chosen: &Chosen) -> Vec<Entry> {
        let who = if chosen.controls { GROUP } else { PRESET };
        let entry = |(field, _): &(&'static Field, bool)| Entry {
            path: format!("{GROUP}.{}", field.name),
            field,
            value: Value::Number(chosen.values[field.name]),
        };
        let first = Entry { path: WHO.into(), field: &WHOSE, value: Value::Variant(who) };
        std::iter::once(first).chain(self.fields.iter().map(entry)).collect()
    }

    /// The same with these changes: paths and values.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`] with all that is wrong.
    pub(super) fn with<'a>(
        &self,
        chosen: &Chosen,
        changes: impl Iterator<Item = (&'a str, &'a str)>,
    ) -> Result<Chosen, Error> {
        let (mut chosen, mut problems) = (chosen.clone(), Vec::new());
        for (path, value) in changes {
            let value = value.trim();
            let fault = if path == WHO {
                chosen.controls = value == GROUP;
                let known = [PRESET, GROUP];
                (!known.contains(&value)).then(|| Fault::UnknownVariant { value: value.into(), variants: known.into() })
            } else {
                let name = path.strip_prefix(GROUP).and_then(|rest| rest.strip_prefix('.')).unwrap_or_default();
                let Some((field, _)) = self.fields.iter().find(|(field, _)| field.name == name) else {
                    let names = self.fields.iter().map(|(field, _)| field.name);
                    let nearest = nearest(name, names).map(|name| format!("{GROUP}.{name}"));
                    return Err(Error::UnknownParameter { path: path.into(), nearest });
                };
                match value.parse::<f64>() {
                    Ok(number) => {
                        chosen.values.insert(field.name, number);
                        Fault::of_number(number, field)
                    }
                    Err(_) => Some(Fault::WrongType { expected: "a number".into(), got: format!("{value:?}") }),
                }
            };
            problems.extend(fault.map(|fault| Problem { line: None, path: path.into(), fault }));
        }
        if problems.is_empty() {
            return Ok(chosen);
        }
        Err(ParameterProblems { file: "the loaded controller".into(), problems }.into())
    }

    /// Why it cannot become `after` while the bench runs, with samples of so many seconds.
    pub(super) fn fixed(&self, before: &Chosen, after: &Chosen, period: f64) -> Result<(), Error> {
        if !after.controls {
            return Ok(());
        }
        let refused = |path: String, remedy| Err(Error::NotWhileRunning { path, remedy });
        if period.to_bits() != self.period.to_bits() {
            let remedy = "The loaded controller was opened for other samples: let that of the preset control \
                          (position_controller = preset), change them, and open the loaded one again.";
            return refused("bench.control_divider".into(), remedy);
        }
        let changed =
            |name: &str| before.values.get(name).map(|value| value.to_bits()) != Some(after.values[name].to_bits());
        let fixed = self.fields.iter().find(|(field, fixed)| *fixed && before.controls && changed(field.name));
        fixed.map_or(Ok(()), |(field, _)| {
            let remedy = "The loaded controller takes it when it begins: let that of the preset control meanwhile \
                          (position_controller = preset).";
            refused(format!("{GROUP}.{}", field.name), remedy)
        })
    }
}

/// Whether a path is one of a loaded controller.
pub(crate) fn is_of_it(path: &str) -> bool {
    path == WHO || parameters::within(path, GROUP)
}
