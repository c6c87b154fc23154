//! Positions of all parts of a figure, and the values that are distinct at its resolution.

use super::axis::Scale;
use super::series::{Data, Series, can_be_shown};
use super::{Figure, legend, thin};

pub(super) const WIDTH: f64 = 760.0;
pub(super) const LEFT: f64 = 72.0;
pub(super) const RIGHT: f64 = WIDTH - 16.0;
/// A line of the title or the legend.
pub(super) const LINE: f64 = 24.0;
/// Title and legend are above the plot, in one line where they fit.
const TOP: f64 = 52.0;
/// Height of a plot of its own, and of one in a column of panels.
pub(super) const PLOT: f64 = 332.0;
pub(super) const PANEL: f64 = 170.0;
const FOOT: f64 = 56.0;

/// Title and legend, scales and the window that data is drawn in.
pub(super) struct Layout {
    pub(super) x: Scale,
    pub(super) y: Scale,
    pub(super) top: f64,
    pub(super) bottom: f64,
    pub(super) height: f64,
    /// Entries of each line of the legend.
    pub(super) legend: Vec<Vec<usize>>,
    /// Baseline of the first line [px].
    pub(super) legend_line: f64,
}

impl Layout {
    /// The layout with a plot of this height [px].
    pub(super) fn of(figure: &Figure, plot: f64) -> Self {
        let space = RIGHT - LEFT;
        let beside = space - legend::text_width(&figure.title, 14.0) - 2.0 * LINE;
        let (legend, legend_line) = match legend::lines(&figure.series, beside) {
            one if one.len() <= 1 => (one, 26.0),
            _ => (legend::lines(&figure.series, space), 26.0 + LINE),
        };
        let top = TOP + legend_line - 26.0 + LINE * legend.len().saturating_sub(1) as f64;
        let bottom = top + plot;
        let values: Vec<[f64; 2]> = figure.series.iter().flat_map(Series::values).collect();
        let x = figure.x.scale(values.iter().map(|value| value[0]), LEFT, RIGHT);
        let y = figure.y.scale(values.iter().map(|value| value[1]), bottom, top);
        Layout { x, y, top, bottom, height: bottom + FOOT, legend, legend_line }
    }

    pub(super) fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x.place(x), self.y.place(y)]
    }

    /// Whether both axes have a position for a row, whose first number is that of the x-axis.
    fn holds(&self, row: &[f64]) -> bool {
        let has_place = |&y: &f64| self.y.place(y).is_finite();
        can_be_shown(row) && self.x.place(row[0]).is_finite() && row[1..].iter().all(has_place)
    }

    /// The rows of a series that are drawn, in continuous pieces; rows that cannot be drawn or are not visible are
    /// omitted.
    pub(super) fn pieces<'a>(&self, series: &'a Series) -> Vec<Vec<&'a [f64]>> {
        let thinned = |rows: Vec<&'a [f64]>, thin: &dyn Fn(&[[f64; 2]]) -> Vec<usize>| {
            let places: Vec<_> = rows.iter().map(|row| self.place([row[0], row[1]])).collect();
            thin(&places).into_iter().map(|index| rows[index]).collect::<Vec<_>>()
        };
        fn shown<'a, const N: usize>(layout: &Layout, rows: &'a [[f64; N]]) -> Vec<&'a [f64]> {
            rows.iter().map(<[f64; N]>::as_slice).filter(|row| layout.holds(&row[..2])).collect()
        }
        fn unbroken<'a, const N: usize>(layout: &Layout, rows: &'a [[f64; N]]) -> impl Iterator<Item = Vec<&'a [f64]>> {
            rows.split(|row| !layout.holds(row)).map(|piece| piece.iter().map(<[f64; N]>::as_slice).collect())
        }
        let pieces: Vec<_> = match &series.data {
            Data::Points(pairs) => vec![thinned(shown(self, pairs), &thin::points)],
            Data::Bars(bars) => vec![shown(self, bars)],
            Data::Line(pairs) => unbroken(self, pairs).map(|piece| thinned(piece, &thin::line)).collect(),
            Data::Band(edges) => unbroken(self, edges)
                .map(|piece| {
                    // Rows that either edge requires.
                    let [mut indices, upper] = [1, 2].map(|column| {
                        let places: Vec<_> = piece.iter().map(|row| self.place([row[0], row[column]])).collect();
                        thin::line(&places)
                    });
                    indices.extend(upper);
                    indices.sort_unstable();
                    indices.dedup();
                    indices.into_iter().map(|index| piece[index]).collect()
                })
                .collect(),
        };
        pieces.into_iter().filter(|piece| !piece.is_empty()).collect()
    }
}
