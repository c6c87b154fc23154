//! Signal-flow diagram of the bench's software: its blocks, and the signals between them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_codegen::diagram::{Diagram, Kind};

use super::page::words;
use stickslip_base::Preset;
use stickslip_base::parameters::{self, Difference, Value, within};
use stickslip_bench::tuning::fixed;
use stickslip_generate::Generated;

/// Signal-flow diagram of the running software. Positions in units of the picture, from its upper left corner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Flow {
    /// Width and height.
    pub size: [f64; 2],
    /// The blocks, in the order of the signal flow.
    pub blocks: Vec<FlowBlock>,
    /// The wires between the blocks.
    pub wires: Vec<FlowWire>,
    /// All pages of the generated diagram, the overview first.
    pub pages: Vec<FlowPage>,
}

/// A block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FlowBlock {
    /// Identifier.
    pub id: String,
    /// Name.
    pub name: String,
    /// The chosen kind; empty if there is no choice.
    pub choice: String,
    /// Function of the block.
    pub about: String,
    /// Left, upper edge, width, height.
    pub at: [f64; 4],
    /// Groups of its parameters.
    pub groups: Vec<FlowGroup>,
    /// Paths of parameters that differ from those at the start of the run.
    pub changed: Vec<String>,
    /// Diagram page of its interior.
    pub page: Option<String>,
    /// Page of the guide.
    pub guide: Option<String>,
}

/// A group of parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FlowGroup {
    /// Common prefix of their paths.
    pub path: String,
    /// Why they cannot be changed on a running bench, with a remedy.
    pub fixed: Option<String>,
}

/// A wire.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FlowWire {
    /// The block that it leaves.
    pub from: String,
    /// The block that it enters.
    pub to: String,
    /// Its corners; the arrow is at the last.
    pub points: Vec<[f64; 2]>,
    /// The signal that it carries.
    pub signal: String,
    /// Position of the value; `null` on a branch of a wire that shows it already.
    pub label: Option<[f64; 2]>,
}

/// A page of the generated diagram.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FlowPage {
    /// Its file, as in links between pages.
    pub page: String,
    /// Name of the shown block.
    pub name: String,
}

/// A block of the picture: name, what it does, place, parameters, part of the tick, page of the guide.
struct Drawn {
    id: &'static str,
    name: &'static str,
    about: &'static str,
    at: [f64; 4],
    groups: &'static [&'static str],
    inside: Option<&'static str>,
    guide: &'static str,
}

/// Columns: left edge and width; the machine fills the last. Rows: upper edge.
const COLUMNS: [[f64; 2]; 4] = [[8.0, 128.0], [262.0, 144.0], [534.0, 144.0], [812.0, 120.0]];
const ROWS: [f64; 4] = [8.0, 118.0, 228.0, 338.0];
const HEIGHT: f64 = 62.0;

const fn at(column: usize, row: usize) -> [f64; 4] {
    [COLUMNS[column][0], ROWS[row], COLUMNS[column][1], HEIGHT]
}

const BLOCKS: [Drawn; 9] = [
    Drawn {
        id: "reference",
        name: "Reference",
        about: "Set-point of the running motion or measurement; otherwise constant.",
        at: at(0, 0),
        groups: &[],
        inside: None,
        guide: "live",
    },
    Drawn {
        id: "supervision",
        name: "Supervision",
        about: "Enables the controller and the law, monitors limits, homes and brakes.",
        at: at(0, 2),
        groups: &["bench.safety", "bench.homing"],
        inside: None,
        guide: "safety",
    },
    Drawn {
        id: "controller",
        name: "Position control",
        about: "Controller under test, friction compensation, and hold against stiction.",
        at: at(1, 0),
        groups: &["bench.controller", "bench.control_divider", "bench.compensation", "bench.hold"],
        inside: Some("control"),
        guide: "theory-drive",
    },
    Drawn {
        id: "drive",
        name: "Drive output",
        about: "Converts the torque into the voltage of the servo amplifier, within its limits.",
        at: at(2, 0),
        groups: &["model.scaling"],
        inside: None,
        guide: "theory-drive",
    },
    Drawn {
        id: "decoder",
        name: "Encoder",
        about: "Unwraps the counter and converts counts into an angle.",
        at: at(2, 1),
        groups: &["model.encoder"],
        inside: Some("decoder"),
        guide: "theory-drive",
    },
    Drawn {
        id: "observer",
        name: "Velocity observer",
        about: "Estimates the velocity from the angle and the acceleration, or from the angle and a model of the drive.",
        at: at(1, 2),
        groups: &["bench.observer", "bench.observer_poles"],
        inside: Some("observer"),
        guide: "theory-drive",
    },
    Drawn {
        id: "law",
        name: "Rendering law",
        about: "Computes the torque that turns the machine's own friction into the desired one.",
        at: at(1, 3),
        groups: &[
            "bench.law",
            "bench.fade_velocity",
            "bench.desired",
            "bench.desired_bristles",
            "model.own",
            "model.own_bristles",
        ],
        inside: Some("law"),
        guide: "theory-rendering",
    },
    Drawn {
        id: "current",
        name: "Current control",
        about: "Controls the load motor's current against its back-EMF.",
        at: at(2, 3),
        groups: &["model.load_motor", "model.load_amplifier", "bench.torque_amplifier"],
        inside: Some("current"),
        guide: "theory-rendering",
    },
    Drawn {
        id: "machine",
        name: "Machine",
        about: "Drive motor, coupling, screw and load motor, with their converters and instruments.",
        at: [COLUMNS[3][0], ROWS[0], COLUMNS[3][1], ROWS[3] + HEIGHT - ROWS[0]],
        groups: &[],
        inside: None,
        guide: "theory-drive",
    },
];

/// From, to, corners, signal, place of the value.
type Route = (&'static str, &'static str, &'static [[f64; 2]], &'static str, Option<[f64; 2]>);

const WIRES: [Route; 15] = [
    ("reference", "controller", &[[136.0, 24.0], [262.0, 24.0]], "setpoint.position", Some([197.0, 18.0])),
    ("reference", "controller", &[[136.0, 46.0], [262.0, 46.0]], "setpoint.velocity", Some([197.0, 40.0])),
    (
        "supervision",
        "controller",
        &[[136.0, 245.0], [232.0, 245.0], [232.0, 62.0], [262.0, 62.0]],
        "control",
        Some([184.0, 239.0]),
    ),
    (
        "supervision",
        "law",
        &[[136.0, 273.0], [232.0, 273.0], [232.0, 369.0], [262.0, 369.0]],
        "render",
        Some([184.0, 287.0]),
    ),
    ("controller", "drive", &[[406.0, 39.0], [534.0, 39.0]], "software.commanded_torque", Some([467.0, 33.0])),
    ("drive", "machine", &[[678.0, 39.0], [812.0, 39.0]], "software.servo_voltage", Some([742.0, 33.0])),
    (
        "machine",
        "controller",
        &[[812.0, 94.0], [376.0, 94.0], [376.0, 70.0]],
        "measurement.tacho_voltage",
        Some([742.0, 88.0]),
    ),
    ("machine", "decoder", &[[812.0, 149.0], [678.0, 149.0]], "measurement.count", Some([742.0, 143.0])),
    (
        "decoder",
        "controller",
        &[[534.0, 149.0], [320.0, 149.0], [320.0, 70.0]],
        "software.measured_angle",
        Some([467.0, 143.0]),
    ),
    ("decoder", "observer", &[[320.0, 149.0], [320.0, 228.0]], "software.measured_angle", None),
    (
        "machine",
        "observer",
        &[[812.0, 259.0], [406.0, 259.0]],
        "measurement.accelerometer_voltage",
        Some([742.0, 253.0]),
    ),
    ("observer", "law", &[[320.0, 290.0], [320.0, 338.0]], "software.estimated_velocity", Some([390.0, 319.0])),
    ("law", "current", &[[406.0, 369.0], [534.0, 369.0]], "software.difference_torque", Some([467.0, 363.0])),
    (
        "machine",
        "current",
        &[[812.0, 308.0], [606.0, 308.0], [606.0, 338.0]],
        "measurement.current_voltage",
        Some([742.0, 302.0]),
    ),
    ("current", "machine", &[[678.0, 369.0], [812.0, 369.0]], "software.amplifier_voltage", Some([742.0, 363.0])),
];

impl Flow {
    pub(super) fn of(
        generated: &Generated,
        preset: &Preset<f64>,
        changes: &[Difference],
        virtual_machine: bool,
    ) -> Self {
        let diagram = Diagram::of(&generated.program, &generated.prefix);
        let top = diagram.pages.len() - 1;
        let entries = parameters::flatten(preset);
        let choice = |path: &str| {
            let entry = entries.iter().find(|entry| entry.path == path)?;
            if let Value::Variant(name) = entry.value { Some(name.to_owned()) } else { None }
        };
        let inside = |part: &str| {
            diagram.pages[top].nodes.iter().find_map(|node| match node.kind {
                Kind::Call { page, .. } if within(&node.name, part) => Some(diagram.file(page)),
                _ => None,
            })
        };
        let block = |drawn: &Drawn| {
            let mut groups: Vec<String> = drawn.groups.iter().map(|path| (*path).into()).collect();
            if drawn.id == "machine" {
                groups = if virtual_machine {
                    parts(&entries, "plant")
                } else {
                    vec!["model.drive".into(), "model.motor".into()]
                };
            }
            let belongs = |path: &str| groups.iter().any(|group| within(path, group));
            let changed = changes.iter().map(|change| &change.path).filter(|path| belongs(path)).cloned().collect();
            let chosen = match drawn.id {
                "controller" => choice("bench.controller.kind"),
                "law" => choice("bench.law.kind"),
                "machine" => Some(if virtual_machine { "virtual" } else { "hardware" }.into()),
                _ => None,
            };
            FlowBlock {
                id: drawn.id.into(),
                name: drawn.name.into(),
                choice: chosen.unwrap_or_default(),
                about: drawn.about.into(),
                at: drawn.at,
                changed,
                page: match (drawn.inside, drawn.id) {
                    (Some(part), _) => Some(inside(part).unwrap_or_else(|| diagram.file(top))),
                    // Too small for its own function: shown on the overview page.
                    (None, "drive") => Some(diagram.file(top)),
                    _ => None,
                },
                guide: Some(drawn.guide.into()),
                groups: groups
                    .into_iter()
                    .map(|path| FlowGroup { fixed: fixed(&path).map(str::to_owned), path })
                    .collect(),
            }
        };
        let wire = |&(from, to, points, signal, label): &Route| FlowWire {
            from: from.into(),
            to: to.into(),
            points: points.to_vec(),
            signal: signal.into(),
            label,
        };
        let page =
            |number: usize| FlowPage { page: diagram.file(number), name: words(diagram.pages[number].step.name) };
        Flow {
            size: [940.0, ROWS[3] + HEIGHT + 8.0],
            blocks: BLOCKS.iter().map(block).collect(),
            wires: WIRES.iter().map(wire).collect(),
            pages: (0..=top).rev().map(page).collect(),
        }
    }
}

/// The parts of a group, in their order.
fn parts(entries: &[parameters::Entry], group: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for entry in entries.iter().filter(|entry| within(&entry.path, group)) {
        let part: Vec<&str> = entry.path.split('.').take(2).collect();
        let part = part.join(".");
        if !parts.contains(&part) {
            parts.push(part);
        }
    }
    parts
}
