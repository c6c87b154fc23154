//! Parameters as items of a form: value, description and allowed values.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::fields::{Fields, Kind};

use super::protocol::Quantity;
use stickslip_base::parameters::{self, Entry, Value};
use stickslip_base::quantity::unit;
use stickslip_base::{Error, Preset};
use stickslip_experiment::workflow::measure::Plan;
use stickslip_experiment::{BreakawayPlan, FrictionPlan, PreslidingPlan};

/// A parameter with its description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Item {
    /// Its dotted path.
    pub path: String,
    /// Symbol in equations; may be empty.
    pub symbol: String,
    /// SI unit as printed; empty for a pure number and for a choice.
    pub unit: String,
    /// Description.
    pub help: String,
    /// The number; `null` for a choice. A flag is 0 or 1.
    pub value: Option<f64>,
    /// Smallest value; `null`: unlimited.
    pub minimum: Option<f64>,
    /// Largest value; `null`: unlimited.
    pub maximum: Option<f64>,
    /// Default value.
    pub default: Option<f64>,
    /// Kind of value.
    pub kind: ItemKind,
    /// The chosen option; `null` for a number.
    pub choice: Option<String>,
    /// The options of a choice.
    pub options: Vec<Choice>,
}

/// Kind of value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ItemKind {
    /// Any number.
    Real,
    /// A whole number.
    Whole,
    /// 0 or 1, `false` or `true` in a file.
    Flag,
    /// One of the options.
    Choice,
}

/// An option of a choice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Choice {
    /// Name in files.
    pub name: String,
    /// Description.
    pub help: String,
}

/// A plan of a measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanForm {
    /// Short description.
    pub about: String,
    /// Bench time [s], without homing.
    pub duration: f64,
    /// Its values.
    pub items: Vec<Item>,
}

impl Item {
    fn of(entry: Entry) -> Self {
        let field = entry.field;
        let finite = |value: f64| value.is_finite().then_some(value);
        let (value, choice) = match entry.value {
            Value::Number(value) => (finite(value), None),
            Value::Variant(name) => (None, Some(name.to_owned())),
        };
        let is_number = choice.is_none();
        let option = |v: &stickslip_core::fields::Variant| Choice { name: v.name.into(), help: v.help.into() };
        Item {
            path: entry.path,
            symbol: field.symbol.into(),
            unit: if is_number { unit(field.unit) } else { String::new() },
            help: field.help.into(),
            value,
            minimum: finite(field.minimum).filter(|_| is_number),
            maximum: finite(field.maximum).filter(|_| is_number),
            default: finite(field.default).filter(|_| is_number),
            kind: match field.kind {
                _ if !is_number => ItemKind::Choice,
                Kind::Real => ItemKind::Real,
                Kind::Whole => ItemKind::Whole,
                Kind::Flag => ItemKind::Flag,
            },
            choice,
            options: field.shape.variants().iter().map(option).collect(),
        }
    }

    /// All values of a set, in the order of declaration.
    pub(super) fn all<P: Fields<f64>>(parameters: &P) -> Vec<Item> {
        Item::list(parameters::flatten(parameters))
    }

    /// The items of entries.
    pub(super) fn list(entries: Vec<Entry>) -> Vec<Item> {
        entries.into_iter().map(Item::of).collect()
    }
}

impl PlanForm {
    /// The default plan or the thorough one, with some values changed.
    pub(super) fn of(
        what: Quantity,
        thorough: bool,
        values: &BTreeMap<String, String>,
        preset: &Preset<f64>,
    ) -> Result<Self, Error> {
        match what {
            Quantity::Friction => form::<FrictionPlan<f64>>(thorough, values, preset),
            Quantity::Breakaway => form::<BreakawayPlan<f64>>(thorough, values, preset),
            Quantity::Presliding => form::<PreslidingPlan<f64>>(thorough, values, preset),
        }
    }
}

fn form<P: Plan>(thorough: bool, values: &BTreeMap<String, String>, preset: &Preset<f64>) -> Result<PlanForm, Error> {
    let begin = if thorough { P::thorough() } else { P::default() };
    let plan = with_values(&begin, values)?;
    Ok(PlanForm { about: plan.about(), duration: plan.duration(preset), items: Item::all(&plan) })
}

/// A plan with some of its values changed, as in a file.
pub(super) fn with_values<P: Plan>(plan: &P, values: &BTreeMap<String, String>) -> Result<P, Error> {
    let text = parameters::write_commented(plan);
    let values: Vec<_> = values.iter().collect();
    let text = parameters::set_all::<P>(&text, "the plan", &values)?;
    Ok(parameters::read(&text, "the plan")?)
}
