//! Parameters of a controller, friction or law loaded from a file, in addition to those of the preset: whether it is in
//! the loop, and its values.
//!
//! They are not part of a parameter file, since they belong to the loaded file. Otherwise they are changed, undone,
//! listed and addressed like all parameters.

use crate::BenchError;
use std::collections::BTreeMap;

use stickslip_core::fields::{Field, Kind, Shape, Variant};

use crate::external::{Description, External, Role, role};
use stickslip_base::parameters::schema::nearest;
use stickslip_base::parameters::{Entry, Fault, ParameterProblems, Problem, Value};
use stickslip_base::preset::Settings;
use stickslip_base::{Error, parameters};

/// Group of its parameters.
const GROUP: &str = "loaded";
const PRESET: &str = "preset";

/// The parameter that selects between preset and loaded file for a role.
pub fn selector(role: Role) -> &'static str {
    match role {
        Role::Controller => "position_controller",
        Role::Friction => "rendered_friction",
        Role::Law => "rendering_law",
    }
}

/// The selecting parameter as a field.
fn choice(role: Role) -> Field {
    let (help, preset, loaded) = match role {
        Role::Controller => (
            "Active position controller.",
            "Controller of the preset, bench.controller.",
            "Controller loaded from a file.",
        ),
        Role::Friction => {
            ("Rendered friction.", "Friction of the preset, bench.desired.", "Friction loaded from a file.")
        }
        Role::Law => (
            "Active rendering law.",
            "Law of the preset, bench.law.",
            "Law loaded from a file; its torque is the whole torque of the load motor.",
        ),
    };
    let variants =
        [(PRESET, preset), (GROUP, loaded)].map(|(name, help)| Variant { name, help, shape: Shape::Group(&[]) });
    let name = selector(role);
    Field {
        name,
        symbol: "",
        unit: "",
        minimum: f64::NEG_INFINITY,
        maximum: f64::INFINITY,
        default: 1.0,
        help,
        kind: Kind::Real,
        shape: Shape::Choice { tag: name, variants: Box::leak(Box::new(variants)) },
    }
}

/// A loaded file: its parameters and initial values.
#[derive(Clone, Debug)]
pub struct Loaded {
    choice: &'static Field,
    fields: Vec<(&'static Field, bool)>,
    initial: Chosen,
    /// Sampling time [s].
    period: f64,
}

/// Selection and values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chosen {
    role: Role,
    /// Whether it is in the loop.
    acts: bool,
    values: BTreeMap<&'static str, f64>,
}

impl Loaded {
    /// With its present values, on a bench with these settings. Its texts are kept until the program ends, as those of
    /// all fields.
    pub fn new(external: &External, settings: &Settings<f64>) -> Self {
        let (Description { parameters, .. }, role) = (external.description(), external.role());
        let leaked = |text: &str| -> &'static str { Box::leak(text.to_owned().into_boxed_str()) };
        let field = |parameter: &crate::external::ModuleParameter| Field {
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
        let values = fields.iter().zip(external.values()).map(|((field, _), value)| (field.name, *value)).collect();
        let choice = Box::leak(Box::new(choice(role)));
        Loaded { choice, fields, initial: Chosen { role, acts: true, values }, period: role::period(role, settings) }
    }

    /// Its initial values.
    pub(super) fn initial(&self) -> Chosen {
        self.initial.clone()
    }

    /// Adopts the values of another file, as far as they exist here and are within their ranges.
    pub(super) fn adopt(&self, from: &Chosen) -> Chosen {
        let value = |field: &&'static Field| {
            let value = from.values.get(field.name).copied();
            value
                .filter(|value| (field.minimum..=field.maximum).contains(value))
                .unwrap_or(self.initial.values[field.name])
        };
        let values = self.fields.iter().map(|(field, _)| (field.name, value(field))).collect();
        Chosen { values, ..*from }
    }

    /// Values in the order of its parameters.
    pub(super) fn values(&self, chosen: &Chosen) -> Vec<f64> {
        self.fields.iter().map(|(field, _)| chosen.values[field.name]).collect()
    }

    /// Entries of the parameter list.
    pub(super) fn entries(&self, chosen: &Chosen) -> Vec<Entry> {
        let variant = if chosen.acts { GROUP } else { PRESET };
        let entry = |(field, _): &(&'static Field, bool)| Entry {
            path: format!("{GROUP}.{}", field.name),
            field,
            value: Value::Number(chosen.values[field.name]),
        };
        let first = Entry { path: self.choice.name.into(), field: self.choice, value: Value::Variant(variant) };
        std::iter::once(first).chain(self.fields.iter().map(entry)).collect()
    }

    /// The same with these changes: paths and values.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`] with all problems.
    pub(super) fn with<'a>(
        &self,
        chosen: &Chosen,
        changes: impl Iterator<Item = (&'a str, &'a str)>,
    ) -> Result<Chosen, Error> {
        let (mut chosen, mut problems) = (chosen.clone(), Vec::new());
        for (path, value) in changes {
            let value = value.trim();
            let fault = if path == self.choice.name {
                chosen.acts = value == GROUP;
                let variants = [PRESET, GROUP];
                (!variants.contains(&value))
                    .then(|| Fault::UnknownVariant { value: value.into(), variants: variants.into() })
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
        Err(ParameterProblems { file: format!("the loaded {}", chosen.role), problems }.into())
    }

    /// Refuses changes that are impossible while a bench with these settings runs.
    pub(super) fn fixed(&self, before: &Chosen, after: &Chosen, settings: &Settings<f64>) -> Result<(), Error> {
        let Some(role) = after.acting() else { return Ok(()) };
        let refused = |path: String, reason: &str, then: &str| {
            let way = format!("activate that of the preset first ({} = {PRESET})", self.choice.name);
            Err(BenchError::NotWhileRunning { path, remedy: format!("The loaded {role} {reason}: {way}{then}.") }
                .into())
        };
        if role::period(role, settings).to_bits() != self.period.to_bits() {
            let then = ", change the setting, and reopen the file";
            return refused("bench.control_divider".into(), "was opened for another sampling time", then);
        }
        let changed =
            |name: &str| before.values.get(name).map(|value| value.to_bits()) != Some(after.values[name].to_bits());
        let fixed = self.fields.iter().find(|(field, fixed)| *fixed && before.acts && changed(field.name));
        fixed.map_or(Ok(()), |(field, _)| {
            refused(format!("{GROUP}.{}", field.name), "reads it only when it starts", ", then change the value")
        })
    }
}

impl Chosen {
    /// Its role if it is in the loop.
    pub(super) fn acting(&self) -> Option<Role> {
        self.acts.then_some(self.role)
    }
}

/// Whether a path is a parameter of a loaded file.
pub fn is_of_it(path: &str) -> bool {
    Role::ALL.into_iter().any(|role| path == selector(role)) || parameters::within(path, GROUP)
}
