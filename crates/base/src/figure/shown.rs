//! The drawn values of a figure as numbers: for its table, its read-out and CSV.

use serde::Serialize;

use super::layout::{Layout, PLOT};
use super::series::Data;
use super::{Figure, draw};

/// Significant digits: more than a figure shows, fewer than would fill the page.
const DIGITS: usize = 5;
/// Largest number of points of a cloud whose values are on the page.
const CLOUD: usize = 2000;

/// The drawn values of a figure: all that are distinct at its resolution.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Shown {
    /// Quantity and printed unit of each axis.
    pub(crate) x: [String; 2],
    pub(crate) y: [String; 2],
    pub(crate) series: Vec<ShownSeries>,
}

/// One series.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ShownSeries {
    pub(crate) name: String,
    /// Class of its colour.
    pub(crate) class: &'static str,
    /// `points`, `bars`, `line` or `band`: the meaning of the numbers of a row.
    pub(crate) kind: &'static str,
    /// Horizontal and vertical position [px], then the values.
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Figure {
    /// Its drawn values.
    pub(crate) fn shown(&self) -> Shown {
        let layout = Layout::of(self, PLOT);
        let series = self.series.iter().map(|series| {
            let row = |row: &[f64]| {
                let height = if matches!(series.data, Data::Band(_)) { 0.5 * (row[1] + row[2]) } else { row[1] };
                let place = layout.place([row[0], height]).map(|place| (10.0 * place).round() / 10.0);
                place.into_iter().chain(row.iter().map(|&value| rounded(value))).collect()
            };
            let kind = match series.data {
                Data::Points(_) => "points",
                Data::Bars(_) => "bars",
                Data::Line(_) => "line",
                Data::Band(_) => "band",
            };
            let drawn: Vec<&[f64]> = layout.pieces(series).into_iter().flatten().collect();
            // Of a dense cloud every n-th point is enough; the saved document has all values.
            let step = if kind == "points" { drawn.len().div_ceil(CLOUD).max(1) } else { 1 };
            let rows = drawn.into_iter().step_by(step).map(row).collect();
            ShownSeries { name: series.name.clone(), class: draw::class(series), kind, rows }
        });
        Shown { x: self.x.head(), y: self.y.head(), series: series.collect() }
    }
}

fn rounded(value: f64) -> f64 {
    // Adding zero takes the sign off a negative zero.
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value) + 0.0
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Role, Series};
    use super::*;

    #[test]
    fn a_dense_cloud_is_thinned_and_a_line_is_not() {
        let values = || (0..5000).map(|k| (f64::from(k % 600), f64::from(k % 217)));
        let figure = Figure::new("Dense").series(Series::points(Role::Measured, "cloud", values()));
        let count = figure.shown().series[0].rows.len();
        assert!((1000..=CLOUD).contains(&count), "{count}");
        let zigzag = (0..5000).map(|k| (f64::from(k), f64::from(7 * k % 11)));
        let line = Figure::new("Line").series(Series::line(Role::Fitted, "line", zigzag));
        assert!(line.shown().series[0].rows.len() > CLOUD);
    }

    #[test]
    fn shown_values_have_the_positions_and_numbers_of_the_drawing() {
        let figure = Figure::new("Shown")
            .x(Axis::new("speed Ω", "rad/s"))
            .y(Axis::new("torque", "N m"))
            .series(Series::line(Role::Fitted, "fit", [(0.0, 0.0), (0.5, f64::NAN), (1.0, 1.0 / 3.0)]))
            .series(Series::bars(Role::Measured, "measured", [(0.5, 0.2, 0.01)]))
            .series(Series::band(Role::Fitted, "95 %", [(0.0, 0.0, 0.1)]));
        let shown = figure.shown();
        assert_eq!((shown.x[1].as_str(), shown.y[1].as_str()), ("rad/s", "N·m"));
        assert_eq!(shown.series[0].rows.len(), 2, "{shown:?}");
        assert_eq!(shown.series[0].rows[1][2..], [1.0, 0.333_33]);
        assert_eq!(shown.series[1].rows[0][2..], [0.5, 0.2, 0.01]);
        assert_eq!(shown.series[2].rows[0][2..], [0.0, 0.0, 0.1]);
        let [across, down] = [0, 1].map(|k| shown.series[1].rows[0][k]);
        assert!(figure.svg().contains(&format!("M{across:.1},{down:.1}h0")));
    }
}
