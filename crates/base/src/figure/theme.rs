//! Colours by meaning. A figure contains the light ones; a page may set the dark ones by class.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A colour with a meaning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Colour {
    /// Class of its elements.
    pub(crate) class: &'static str,
    /// On a light surface.
    pub(crate) light: &'static str,
    /// On a dark surface.
    pub(crate) dark: &'static str,
}

const fn colour(class: &'static str, light: &'static str, dark: &'static str) -> Colour {
    Colour { class, light, dark }
}

pub(crate) const SURFACE: Colour = colour("surface", "#FFFFFF", "#13171E");
pub(crate) const INK: Colour = colour("ink", "#171C26", "#E9EDF3");
pub(crate) const TEXT_2: Colour = colour("text-2", "#434C5B", "#B7C0CD");
pub(crate) const TEXT_3: Colour = colour("text-3", "#5C6573", "#95A0B0");
pub(crate) const AXIS: Colour = colour("axis", "#9AA2AE", "#4A5464");
pub(crate) const GRID: Colour = colour("grid", "#E9ECF0", "#1D232D");
pub(crate) const INTERVAL: Colour = colour("interval", "#EEF0F3", "#202733");

const MEASURED: Colour = colour("measured", "#818795", "#8B919C");
const FITTED: Colour = colour("fitted", "#195AD7", "#3F8BFF");
const DESIRED: Colour = colour("desired", "#D95D0E", "#F5830F");
const OWN: Colour = colour("own", "#6A037F", "#C7A4F9");
const RENDERED: Colour = colour("rendered", "#0F6548", "#65D8A3");
const REFERENCE: Colour = colour("reference", "#1B2330", "#F1F4F8");
const TRACES: [Colour; 3] = [
    colour("trace-1", "#0B7A9F", "#56C2E6"),
    colour("trace-2", "#A8246F", "#F08BC1"),
    colour("trace-3", "#75670A", "#D6C24A"),
];

/// All of them, for a style sheet.
pub(crate) const COLOURS: [Colour; 16] = [
    SURFACE, INK, TEXT_2, TEXT_3, AXIS, GRID, INTERVAL, MEASURED, FITTED, DESIRED, OWN, RENDERED, REFERENCE, TRACES[0],
    TRACES[1], TRACES[2],
];

/// Meaning of a series: it has the same colour in every figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Measured values.
    Measured,
    /// A model fitted to them.
    Fitted,
    /// The desired characteristic.
    Desired,
    /// The machine's own characteristic.
    Own,
    /// Measured values while the desired characteristic is rendered.
    Rendered,
    /// Points, set points, other runs.
    Reference,
    /// Any other signal; three colours, which repeat.
    Trace(usize),
}

impl Role {
    pub(super) fn colour(self) -> Colour {
        match self {
            Role::Measured => MEASURED,
            Role::Fitted => FITTED,
            Role::Desired => DESIRED,
            Role::Own => OWN,
            Role::Rendered => RENDERED,
            Role::Reference => REFERENCE,
            Role::Trace(index) => TRACES[index % TRACES.len()],
        }
    }

    /// Width of a line [px] and its dashes. They differ as the colours do, for grey prints.
    pub(super) fn line(self) -> (f64, Option<&'static str>) {
        match self {
            Role::Desired => (2.6, None),
            Role::Fitted | Role::Rendered => (2.0, None),
            Role::Own => (1.8, Some("9 4 2 4")),
            Role::Reference => (1.3, Some("4 4")),
            Role::Measured | Role::Trace(_) => (1.5, None),
        }
    }
}
