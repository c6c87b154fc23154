//! Series of a figure: points, points with their uncertainty, a line, a band.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::theme::Role;

/// Larger numbers are invalid in any unit.
const LARGEST: f64 = 1e15;

/// Values with a role and a name. Values that are not finite or beyond 1e15 are omitted; a line has a gap there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Series {
    /// The role.
    pub(crate) role: Role,
    /// Name in the legend.
    pub(crate) name: String,
    /// A dashed line, for any role.
    #[serde(default, skip_serializing_if = "is_false")]
    dashed: bool,
    /// Larger points.
    #[serde(default, skip_serializing_if = "is_false")]
    large: bool,
    /// Its values.
    pub(crate) data: Data,
}

/// Pairs x, y; x, y and half width; or x with the lower and the upper edge, in the units of the axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", content = "values", rename_all = "lowercase")]
pub(crate) enum Data {
    /// x, y.
    Points(
        #[serde(with = "rows")]
        #[schemars(with = "Vec<[Option<f64>; 2]>")]
        Vec<[f64; 2]>,
    ),
    /// x, y, half width.
    Bars(
        #[serde(with = "rows")]
        #[schemars(with = "Vec<[Option<f64>; 3]>")]
        Vec<[f64; 3]>,
    ),
    /// x, y.
    Line(
        #[serde(with = "rows")]
        #[schemars(with = "Vec<[Option<f64>; 2]>")]
        Vec<[f64; 2]>,
    ),
    /// x, lower edge, upper edge.
    Band(
        #[serde(with = "rows")]
        #[schemars(with = "Vec<[Option<f64>; 3]>")]
        Vec<[f64; 3]>,
    ),
}

impl Series {
    /// A cloud of measured values.
    pub fn points(role: Role, name: impl Into<String>, values: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(role, name, Data::Points(values.into_iter().map(|(x, y)| [x, y]).collect()))
    }

    /// Values with half the width of their 95 % interval: x, y, half width.
    pub fn bars(role: Role, name: impl Into<String>, values: impl IntoIterator<Item = (f64, f64, f64)>) -> Self {
        Self::new(role, name, Data::Bars(values.into_iter().map(<[f64; 3]>::from).collect()))
    }

    /// A curve or a signal; a value that is not finite breaks it, as at the jump of friction at standstill.
    pub fn line(role: Role, name: impl Into<String>, values: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(role, name, Data::Line(values.into_iter().map(|(x, y)| [x, y]).collect()))
    }

    /// The area between a lower and an upper edge: x, lower, upper.
    pub fn band(role: Role, name: impl Into<String>, values: impl IntoIterator<Item = (f64, f64, f64)>) -> Self {
        Self::new(role, name, Data::Band(values.into_iter().map(<[f64; 3]>::from).collect()))
    }

    /// The same line, dashed.
    pub fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// The same points, larger: for few points.
    pub fn large(self) -> Self {
        Self { large: true, ..self }
    }

    fn new(role: Role, name: impl Into<String>, data: Data) -> Self {
        Self { role, name: name.into(), dashed: false, large: false, data }
    }

    /// The same values with another role and name.
    pub(crate) fn renamed(self, role: Role, name: String) -> Self {
        Self { role, name, ..self }
    }

    /// Dashes of a line.
    pub(super) fn dashes(&self) -> Option<&'static str> {
        if self.dashed { Some("6 4") } else { self.role.line().1 }
    }

    /// Diameter of a dot [px].
    pub(super) fn dot(&self) -> f64 {
        match self.data {
            Data::Bars(_) => 5.0,
            _ if self.large => 6.0,
            _ => 2.3,
        }
    }

    /// The kind of data, in words.
    pub(super) fn kind(&self) -> &'static str {
        match self.data {
            Data::Points(_) => "points",
            Data::Bars(_) => "points with 95 % intervals",
            Data::Line(_) => "line",
            Data::Band(_) => "band",
        }
    }

    /// The values that can be drawn: x and each y, with the ends of an interval.
    pub(super) fn values(&self) -> Vec<[f64; 2]> {
        let mut values: Vec<[f64; 2]> = match &self.data {
            Data::Points(pairs) | Data::Line(pairs) => pairs.clone(),
            Data::Bars(bars) => bars.iter().flat_map(|&bar| interval(bar)).collect(),
            Data::Band(edges) => edges.iter().flat_map(|&[x, low, high]| [[x, low], [x, high]]).collect(),
        };
        values.retain(|pair| can_be_shown(pair));
        values
    }
}

/// Both ends of a bar; an unknown interval has length 0.
pub(super) fn interval([x, y, half_width]: [f64; 3]) -> [[f64; 2]; 2] {
    let half_width = if (0.0..=LARGEST).contains(&half_width) { half_width } else { 0.0 };
    [[x, y - half_width], [x, y + half_width]]
}

/// Whether all numbers of a value can be drawn.
pub(super) fn can_be_shown(value: &[f64]) -> bool {
    // A NaN is not smaller than anything.
    value.iter().all(|number| number.abs() <= LARGEST)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde requires a reference")]
fn is_false(flag: &bool) -> bool {
    !flag
}

/// Rows of numbers in JSON, `null` is a number that is not finite.
mod rows {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer, const N: usize>(rows: &[[f64; N]], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(rows.iter().map(<[f64; N]>::as_slice))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<Vec<[f64; N]>, D::Error> {
        let rows: Vec<Vec<Option<f64>>> = Vec::deserialize(from)?;
        let row = |row: Vec<Option<f64>>| {
            let numbers: Vec<f64> = row.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect();
            let wrong = |row: Vec<f64>| D::Error::custom(format!("a row of {} numbers; {N} expected", row.len()));
            numbers.try_into().map_err(wrong)
        };
        rows.into_iter().map(row).collect()
    }
}
