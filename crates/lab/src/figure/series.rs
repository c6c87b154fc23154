//! What is drawn: points, a line, a band.

use super::theme::Role;

/// Beyond this a number is no value of a bench, whatever its unit.
const LARGEST: f64 = 1e15;

/// Values with a role and a name. What is not finite or absurd (beyond 1e15) is left out; a line has a gap there.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub(super) role: Role,
    pub(super) name: String,
    pub(super) dashes: Option<&'static str>,
    /// Diameter of a dot [px].
    pub(super) dot: f64,
    pub(super) data: Data,
}

/// Pairs x, y, or x with the lower and the upper edge, in the units of the axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Data {
    Points(Vec<[f64; 2]>),
    Line(Vec<[f64; 2]>),
    Band(Vec<[f64; 3]>),
}

impl Series {
    /// A cloud of measured values.
    pub fn points(role: Role, name: impl Into<String>, values: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(role, name, Data::Points(values.into_iter().map(|(x, y)| [x, y]).collect()))
    }

    /// A curve or a signal; a value that is not finite breaks it, as at the jump of friction at standstill.
    pub fn line(role: Role, name: impl Into<String>, values: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(role, name, Data::Line(values.into_iter().map(|(x, y)| [x, y]).collect()))
    }

    /// The area between a lower and an upper edge: x, lower, upper.
    pub fn band(role: Role, name: impl Into<String>, values: impl IntoIterator<Item = (f64, f64, f64)>) -> Self {
        Self::new(role, name, Data::Band(values.into_iter().map(|(x, low, high)| [x, low, high]).collect()))
    }

    /// The same line dashed, whatever its role.
    pub fn dashed(self) -> Self {
        Self { dashes: Some("6 4"), ..self }
    }

    /// The same points larger: few, and each of them counts.
    pub fn large(self) -> Self {
        Self { dot: 6.0, ..self }
    }

    fn new(role: Role, name: impl Into<String>, data: Data) -> Self {
        Self { role, name: name.into(), dashes: role.line().1, dot: 2.3, data }
    }

    /// The values that can be shown: x and each y.
    pub(super) fn values(&self) -> Vec<[f64; 2]> {
        let mut values: Vec<[f64; 2]> = match &self.data {
            Data::Points(pairs) | Data::Line(pairs) => pairs.clone(),
            Data::Band(edges) => edges.iter().flat_map(|&[x, low, high]| [[x, low], [x, high]]).collect(),
        };
        values.retain(|pair| can_be_shown(pair));
        values
    }
}

/// Whether all numbers of a value have a place in a figure.
pub(super) fn can_be_shown(value: &[f64]) -> bool {
    // A NaN is not smaller than anything.
    value.iter().all(|number| number.abs() <= LARGEST)
}
