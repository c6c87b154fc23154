//! Figures as plain SVG: points, error bars, lines and bands over two axes.
//!
//! A figure is one text without dependencies, equal for equal data on every machine (fixed decimals), light by default
//! and dark on a page that sets the colours of its classes, as [`report`](crate::report) does. Its title and a summary
//! in words are part of it.
//!
//! ```
//! use stickslip_base::figure::{Axis, Figure, Role, Series};
//!
//! let curve = (0..=50).map(f64::from).map(|speed| (speed, 0.18 + 0.12 * (-speed / 3.0).exp()));
//! let figure = Figure::new("Friction torque over speed")
//!     .x(Axis::new("speed Ω", "rad/s").stretched())
//!     .y(Axis::new("friction torque", "N m"))
//!     .interval(0.0, 0.3, "fade-out")
//!     .series(Series::line(Role::Fitted, "fit", curve));
//! assert!(figure.svg().starts_with("<svg "));
//! ```

/// Writes into the text; writing to a `String` cannot fail.
macro_rules! put {
    ($text:expr, $($part:tt)*) => { writeln!($text, $($part)*).expect("a String takes everything") };
}

mod axis;
mod draw;
mod layout;
mod legend;
mod map;
mod panels;
mod series;
pub(crate) mod shown;
pub mod symbol;
#[cfg(test)]
mod tests;
pub(crate) mod theme;
mod thin;

pub use axis::Axis;
pub use map::Map;
pub use panels::panels;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
pub(crate) use series::Data;
pub use series::Series;
pub use theme::Role;

/// A plot. Points are drawn first, then bands, then lines, so that no cloud hides a curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Figure {
    /// The title.
    pub(crate) title: String,
    /// To the right.
    pub(crate) x: Axis,
    /// Upwards.
    pub(crate) y: Axis,
    /// The series.
    pub(crate) series: Vec<Series>,
    /// Named parts of the horizontal axis.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    intervals: Vec<Interval>,
}

/// A named part of the horizontal axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
struct Interval {
    /// Its start.
    from: f64,
    /// Its end.
    to: f64,
    /// Its name.
    name: String,
}

impl Figure {
    /// An empty figure.
    pub fn new(title: impl Into<String>) -> Self {
        let (x, y) = (Axis::new("x", "1"), Axis::new("y", "1"));
        Self { title: title.into(), x, y, series: Vec::new(), intervals: Vec::new() }
    }

    /// The horizontal axis.
    pub fn x(self, axis: Axis) -> Self {
        Self { x: axis, ..self }
    }

    /// The vertical axis.
    pub fn y(self, axis: Axis) -> Self {
        Self { y: axis, ..self }
    }

    /// One more series.
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Marks a part of the horizontal axis, in the unit of the axis: the fade-out around standstill, the time of a
    /// fault.
    pub fn interval(mut self, from: f64, to: f64, name: impl Into<String>) -> Self {
        self.intervals.push(Interval { from: from.min(to), to: from.max(to), name: name.into() });
        self
    }

    /// The same figure, empty.
    pub(crate) fn emptied(&self) -> Self {
        Self { series: Vec::new(), ..self.clone() }
    }

    /// The title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The figure as a whole SVG file.
    pub fn svg(&self) -> String {
        draw::svg(self)
    }
}
