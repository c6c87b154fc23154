//! The XML of an FMU: `modelDescription.xml` and `buildDescription.xml`, and its page.

use std::fmt::Write as _;

use super::{Role, Service, Variable, Version, units};
use crate::c::plain;
use crate::record::Step;

pub(super) const HEAD: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
pub(super) const TOOL: &str = concat!("stickslip ", env!("CARGO_PKG_VERSION"));

/// Default number of steps of an experiment.
const STEPS: f64 = 1000.0;

/// Attributes and their values; empty ones are omitted.
pub(super) fn attributes(all: &[(&str, String)]) -> String {
    let mut out = String::new();
    for (name, value) in all.iter().filter(|(_, value)| !value.is_empty()) {
        write!(out, " {name}=\"{}\"", escape(value)).expect("writing to a String cannot fail");
    }
    out
}

pub(super) fn escape(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    // A line break within an attribute is read as a space.
    text.replace('\n', " ")
}

fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { String::new() }
}

/// A description in one paragraph.
fn about(help: &str) -> String {
    plain(help).into_iter().next().unwrap_or_default()
}

/// `modelDescription.xml`.
pub(super) fn model(
    top: &Step,
    name: &str,
    token: &str,
    step: f64,
    version: Version,
    variables: &[Variable],
    service: Option<&Service>,
) -> String {
    let is_two = version == Version::Two;
    let either = |two: &str, three: &str| (if is_two { two } else { three }).to_owned();
    let text = |text: &str| text.to_owned();
    let root = attributes(&[
        ("fmiVersion", either("2.0", "3.0")),
        ("modelName", text(name)),
        (if is_two { "guid" } else { "instantiationToken" }, text(token)),
        ("description", about(top.help)),
        ("generationTool", text(TOOL)),
        ("variableNamingConvention", text("structured")),
        ("numberOfEventIndicators", either("0", "")),
    ]);
    let can = |two: &'static str, three: &'static str| if is_two { two } else { three };
    let simulation = attributes(&[
        ("modelIdentifier", text(name)),
        ("canHandleVariableCommunicationStepSize", text("true")),
        (can("canGetAndSetFMUstate", "canGetAndSetFMUState"), text("true")),
        (can("canSerializeFMUstate", "canSerializeFMUState"), text("true")),
        (can("providesDirectionalDerivative", "providesDirectionalDerivatives"), text("true")),
        ("providesAdjointDerivatives", either("", "true")),
        ("canNotUseMemoryManagementFunctions", either("true", "")),
        ("fixedInternalStepSize", if is_two { String::new() } else { number(step) }),
    ]);
    let sources = match version {
        Version::Two => format!(
            "  <CoSimulation{simulation}>\n    <SourceFiles>\n      <File name=\"fmi2.c\"/>\n    </SourceFiles>\n  \
             </CoSimulation>\n"
        ),
        Version::Three => format!("  <CoSimulation{simulation}/>\n"),
    };
    let experiment =
        attributes(&[("startTime", text("0")), ("stopTime", number(STEPS * step)), ("stepSize", number(step))]);
    let all: String =
        variables.iter().zip(1..).map(|(variable, reference)| entry(variable, reference, version)).collect();
    let service = service.map_or_else(String::new, |service| service.variables(variables.len() + 1, version));
    let time = match version {
        Version::Two => "",
        Version::Three => {
            "    <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\" \
             description=\"The end of the last step.\" unit=\"s\"/>\n"
        }
    };
    format!(
        "{HEAD}<fmiModelDescription{root}>\n{sources}  <UnitDefinitions>\n{}  </UnitDefinitions>\n  \
         <DefaultExperiment{experiment}/>\n  <ModelVariables>\n{time}{all}{service}  </ModelVariables>\n  \
         <ModelStructure>\n{}  \
         </ModelStructure>\n</fmiModelDescription>\n",
        unit_definitions(variables),
        structure(variables, version)
    )
}

/// The units, each once.
fn unit_definitions(variables: &[Variable]) -> String {
    let mut units: Vec<&str> = vec!["s"];
    for unit in variables.iter().map(|variable| variable.field.unit) {
        if !units.contains(&unit) {
            units.push(unit);
        }
    }
    let definition = |unit: &str| {
        let name = units::name(unit)?;
        let base = units::exponents(unit).map(|exponents| {
            let of = |(base, exponent): (&&'static str, i32)| {
                (*base, if exponent == 0 { String::new() } else { exponent.to_string() })
            };
            format!("<BaseUnit{}/>", attributes(&units::BASES.iter().zip(exponents).map(of).collect::<Vec<_>>()))
        });
        let name = escape(&name);
        Some(match base {
            Some(base) => format!("    <Unit name=\"{name}\">{base}</Unit>\n"),
            None => format!("    <Unit name=\"{name}\"/>\n"),
        })
    };
    units.into_iter().filter_map(definition).collect()
}

/// A variable.
fn entry(variable: &Variable, reference: usize, version: Version) -> String {
    let Variable { role, name, field, start, .. } = variable;
    let (causality, variability, initial) = match role {
        Role::Input => ("input", "", ""),
        Role::Output => ("output", "", "calculated"),
        Role::Parameter => ("parameter", "tunable", "exact"),
        Role::State => ("local", "", "exact"),
    };
    let text = |text: &str| text.to_owned();
    let whole = [
        ("name", name.clone()),
        ("valueReference", reference.to_string()),
        ("description", about(field.help)),
        ("causality", text(causality)),
        ("variability", text(variability)),
        ("initial", text(initial)),
    ];
    // Computed parameters may exceed the range of entered values by a rounding error; signals have no range.
    let ranged = *role == Role::Parameter && (field.minimum..=field.maximum).contains(start);
    let bound = |bound: f64| if ranged { number(bound) } else { String::new() };
    let number = [
        ("unit", units::name(field.unit).unwrap_or_default()),
        ("min", bound(field.minimum)),
        ("max", bound(field.maximum)),
        ("start", if *role == Role::Output { String::new() } else { number(*start) }),
    ];
    match version {
        Version::Two => {
            format!("    <ScalarVariable{}><Real{}/></ScalarVariable>\n", attributes(&whole), attributes(&number))
        }
        Version::Three => format!("    <Float64{}{}/>\n", attributes(&whole), attributes(&number)),
    }
}

/// The outputs, which depend on all variables.
fn structure(variables: &[Variable], version: Version) -> String {
    let outputs: Vec<usize> =
        variables.iter().zip(1..).filter(|(variable, _)| variable.role == Role::Output).map(|(_, k)| k).collect();
    let each = |element: &str, attribute: &str| -> String {
        outputs.iter().map(|k| format!("    <{element} {attribute}=\"{k}\"/>\n")).collect()
    };
    match version {
        // The index of a variable, from 1, is its reference.
        Version::Two => {
            let unknowns = each("Unknown", "index");
            format!(
                "    <Outputs>\n{unknowns}    </Outputs>\n    <InitialUnknowns>\n{unknowns}    </InitialUnknowns>\n"
            )
        }
        Version::Three => each("Output", "valueReference") + &each("InitialUnknown", "valueReference"),
    }
}

/// `buildDescription.xml` of FMI 3.0.
pub(super) fn build(name: &str, sources: &[String], service: Option<&Service>) -> String {
    let files: String = sources.iter().map(|file| format!("      <SourceFile name=\"{file}\"/>\n")).collect();
    let threads = if service.is_some() { " compilerOptions=\"-pthread\"" } else { "" };
    format!(
        "{HEAD}<fmiBuildDescription fmiVersion=\"3.0\">\n  <BuildConfiguration modelIdentifier=\"{name}\">\n    \
         <SourceFileSet language=\"C99\"{threads}>\n{files}    </SourceFileSet>\n  \
         </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
}

/// The documentation page of importers.
pub(super) fn page(top: &Step, name: &str, step: f64) -> String {
    let paragraphs: String = plain(top.help).iter().map(|text| format!("<p>{}</p>\n", escape(text.trim()))).collect();
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}</title></head><body>\n\
         <h1>{name}</h1>\n{paragraphs}<p>Written by stickslip from its block {}. A step is {step:?} s; communication \
         steps may have any length: each step is computed at its end, with the inputs of that time. Parameters can be \
         set at any time, states until initialization ends; values outside their range are refused with a message, \
         and nothing is changed. All variables with their units are in <a href=\"README.md\">README.md</a>.</p>\n\
         </body></html>\n",
        top.name
    )
}
