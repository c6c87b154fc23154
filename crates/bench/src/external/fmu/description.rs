//! The description of an FMU: the parts of `modelDescription.xml` (FMI 2.0.4 and 3.0.1) that a controller requires.

use std::collections::BTreeMap;

use roxmltree::{Document, Node, ParsingOptions};
use stickslip_rt::FmiVersion;

use super::units::{BASES, Unit};

/// Maximum number of elements and texts, without attributes.
const NODES: u32 = 1_000_000;
/// Maximum length of a name [characters].
const LONGEST_NAME: usize = 500;
/// Maximum length of a stored explanation [characters].
const LONGEST_TEXT: usize = 300;

/// An FMU for co-simulation.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub(super) version: FmiVersion,
    pub(super) name: String,
    /// Name of its library.
    pub(super) identifier: String,
    /// Its GUID, or instantiation token.
    pub(super) token: String,
    /// Tool that generated it, if stated.
    pub(super) tool: Option<String>,
    /// Internal or default step [s].
    pub(super) step: Option<f64>,
    pub(super) variables: Vec<Variable>,
    pub(super) units: BTreeMap<String, Option<Unit>>,
}

/// A variable.
#[derive(Clone, Debug)]
pub(super) struct Variable {
    pub(super) name: String,
    pub(super) reference: u32,
    /// `Real` or `Float64` for a number in double precision.
    pub(super) kind: String,
    pub(super) causality: String,
    pub(super) variability: String,
    pub(super) scalar: bool,
    pub(super) unit: Option<String>,
    pub(super) minimum: Option<f64>,
    pub(super) maximum: Option<f64>,
    pub(super) start: Option<f64>,
    pub(super) help: String,
}

impl Variable {
    /// Whether it is one number in double precision.
    pub(super) fn number(&self) -> bool {
        self.scalar && matches!(self.kind.as_str(), "Real" | "Float64")
    }
}

/// Reads a description; an unsupported FMU is refused with a remedy.
pub(super) fn read(text: &str) -> Result<Model, String> {
    let options = ParsingOptions { nodes_limit: NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| format!("its modelDescription.xml cannot be read ({error}). Export it again"))?;
    let root = document.root_element();
    if root.tag_name().name() != "fmiModelDescription" {
        return Err(format!(
            "its modelDescription.xml begins with {} instead of fmiModelDescription",
            root.tag_name().name()
        ));
    }
    let version = match required(root, "fmiVersion")? {
        "2.0" => FmiVersion::Two,
        version if version.starts_with("3.") => FmiVersion::Three,
        other => {
            return Err(format!("it has FMI version {other}; 2.0 and 3.0 are supported. Export it with one of them"));
        }
    };
    let Some(simulation) = child(root, "CoSimulation") else {
        let has: Vec<&str> =
            ["ModelExchange", "ScheduledExecution"].into_iter().filter(|name| child(root, name).is_some()).collect();
        let has = if has.is_empty() { "no other interface".into() } else { format!("{} only", has.join(" and ")) };
        return Err(format!(
            "it does not support co-simulation: it has {has}. Export it for co-simulation (CS), including a solver"
        ));
    };
    if simulation.attribute("needsExecutionTool").is_some_and(|needs| ["true", "1"].contains(&needs)) {
        return Err("it requires its tool while it runs (needsExecutionTool). Export it as a stand-alone FMU".into());
    }
    let types = types(root, version);
    let identifier = required(simulation, "modelIdentifier")?;
    // It names a file.
    if identifier.is_empty() || identifier.contains(['/', '\\', '\0']) || identifier.len() > LONGEST_NAME {
        return Err(format!("its modelIdentifier {identifier:?} is not a valid library name"));
    }
    let token = required(root, if version == FmiVersion::Two { "guid" } else { "instantiationToken" })?;
    let step = number(simulation, "fixedInternalStepSize")
        .or_else(|| number(child(root, "DefaultExperiment")?, "stepSize"))
        .filter(|step| *step > 0.0);
    let name = root.attribute("modelName").map(str::trim).filter(|name| !name.is_empty()).unwrap_or(identifier);
    Ok(Model {
        version,
        name: cut(name),
        identifier: identifier.into(),
        token: token.into(),
        tool: root.attribute("generationTool").map(cut).filter(|tool| !tool.is_empty()),
        step,
        variables: variables(root, version, &types)?,
        units: units(root),
    })
}

/// The variables, in their order.
fn variables(
    root: Node<'_, '_>,
    version: FmiVersion,
    types: &BTreeMap<&str, Node<'_, '_>>,
) -> Result<Vec<Variable>, String> {
    let Some(all) = child(root, "ModelVariables") else { return Ok(Vec::new()) };
    all.children().filter(Node::is_element).map(|variable| one(variable, version, types)).collect()
}

fn one(variable: Node<'_, '_>, version: FmiVersion, types: &BTreeMap<&str, Node<'_, '_>>) -> Result<Variable, String> {
    let name = required(variable, "name")?;
    if name.chars().count() > LONGEST_NAME {
        return Err(format!("a variable has a name of {} characters: {} …", name.chars().count(), cut(name)));
    }
    let reference = required(variable, "valueReference")?;
    let reference = reference.parse().map_err(|_| {
        format!("its variable {name} has the value reference {reference:?}, which is not an unsigned 32-bit integer")
    })?;
    // In FMI 2.0 the attributes of the type are in a separate element.
    let typed = match version {
        FmiVersion::Two => variable.children().find(Node::is_element),
        FmiVersion::Three => Some(variable),
    };
    let kind = typed.map_or("nothing", |typed| typed.tag_name().name());
    let declared = typed.and_then(|typed| types.get(typed.attribute("declaredType")?));
    let attribute = |what: &str| {
        typed.and_then(|typed| typed.attribute(what)).or_else(|| declared.and_then(|declared| declared.attribute(what)))
    };
    let finite = |what: &str| {
        attribute(what).and_then(|text| text.trim().parse().ok()).filter(|number: &f64| number.is_finite())
    };
    Ok(Variable {
        name: name.into(),
        reference,
        kind: kind.into(),
        causality: variable.attribute("causality").unwrap_or("local").into(),
        variability: variable.attribute("variability").unwrap_or("continuous").into(),
        scalar: child(variable, "Dimension").is_none(),
        unit: attribute("unit").map(cut).filter(|unit| !unit.is_empty()),
        minimum: finite("min"),
        maximum: finite("max"),
        start: finite("start"),
        help: cut(variable.attribute("description").unwrap_or_default()),
    })
}

/// Type definitions by their names, for attributes that a variable does not state itself.
fn types<'a, 'b>(root: Node<'a, 'b>, version: FmiVersion) -> BTreeMap<&'a str, Node<'a, 'b>> {
    let all = child(root, "TypeDefinitions").into_iter().flat_map(|all| all.children());
    let named = |definition: Node<'a, 'b>| {
        let typed = match version {
            FmiVersion::Two => definition.children().find(Node::is_element)?,
            FmiVersion::Three => definition,
        };
        Some((definition.attribute("name")?, typed))
    };
    all.filter(Node::is_element).filter_map(named).collect()
}

/// Units by their names; `None` for a unit without definition.
fn units(root: Node<'_, '_>) -> BTreeMap<String, Option<Unit>> {
    let all = child(root, "UnitDefinitions").into_iter().flat_map(|all| all.children());
    let unit = |unit: Node<'_, '_>| {
        let base = child(unit, "BaseUnit").map(|base| Unit {
            exponents: BASES
                .map(|name| base.attribute(name).and_then(|exponent| exponent.trim().parse().ok()).unwrap_or(0)),
            factor: base.attribute("factor").map_or(1.0, |factor| factor.trim().parse().unwrap_or(f64::NAN)),
            offset: base.attribute("offset").map_or(0.0, |offset| offset.trim().parse().unwrap_or(f64::NAN)),
        });
        Some((unit.attribute("name")?.to_owned(), base))
    };
    all.filter(Node::is_element).filter_map(unit).collect()
}

fn child<'a, 'b>(node: Node<'a, 'b>, name: &str) -> Option<Node<'a, 'b>> {
    node.children().find(|child| child.tag_name().name() == name)
}

fn required<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, String> {
    let element = node.tag_name().name();
    node.attribute(name).ok_or_else(|| format!("its modelDescription.xml has no {name} in {element}. Export it again"))
}

fn number(node: Node<'_, '_>, name: &str) -> Option<f64> {
    node.attribute(name)?.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// A text of limited length, in one line.
fn cut(text: &str) -> String {
    text.trim().chars().take(LONGEST_TEXT).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
