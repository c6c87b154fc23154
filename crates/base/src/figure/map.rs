//! A map: one number for each pair of two values, by the depth of a colour and in digits where there is room.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::draw::{fill, pixel, short};
use super::layout::{LEFT, RIGHT, WIDTH};
use super::symbol::{self, escape};
use super::theme::{INK, Role, SURFACE, TEXT_2, TEXT_3};
use super::{Axis, legend};

/// Title above, labels below [px].
const TOP: f64 = 52.0;
const FOOT: f64 = 56.0;
/// Height of all cells together, and least height of one [px].
const CELLS: f64 = 332.0;
const LEAST: f64 = 22.0;
/// Depth of the colour of the smallest and the largest number: digits stay readable on it.
const DEPTH: [f64; 2] = [0.04, 0.6];
/// Size of digits and labels [px].
const DIGITS: f64 = 11.5;

/// Numbers over two axes; all cells have the same width, independent of the distance of their values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Map {
    title: String,
    x: Axis,
    y: Axis,
    /// Quantity of the numbers.
    value: Axis,
    columns: Vec<f64>,
    rows: Vec<f64>,
    /// Row by row, from below; `None` where there is no number.
    values: Vec<Option<f64>>,
}

impl Map {
    /// Of values of two axes and a number for each pair, the second axis changing last.
    pub fn new(
        title: impl Into<String>,
        [x, y, value]: [Axis; 3],
        [columns, rows]: [Vec<f64>; 2],
        values: Vec<Option<f64>>,
    ) -> Self {
        let values = values.into_iter().map(|value| value.filter(|value| value.is_finite())).collect();
        Self { title: title.into(), x, y, value, columns, rows, values }
    }

    fn value(&self, column: usize, row: usize) -> Option<f64> {
        *self.values.get(row * self.columns.len() + column)?
    }

    /// Smallest and largest number; `None` without numbers.
    fn ends(&self) -> Option<[f64; 2]> {
        let numbers = || self.values.iter().flatten().copied();
        numbers().next()?;
        Some([numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max)])
    }

    /// Depth of the colour of a number.
    fn depth(&self, value: f64) -> f64 {
        let [low, high] = self.ends().unwrap_or([value; 2]);
        let share = if high > low { (value - low) / (high - low) } else { 0.5 };
        DEPTH[0] + share * (DEPTH[1] - DEPTH[0])
    }

    /// The map as a whole SVG file.
    pub fn svg(&self) -> String {
        let (across, up) = (self.columns.len().max(1) as f64, self.rows.len().max(1) as f64);
        let [width, cell] = [(RIGHT - LEFT) / across, (CELLS / up).max(LEAST)];
        let bottom = TOP + cell * up;
        let height = bottom + FOOT;
        let colour = Role::Fitted.colour();
        let mut text = String::new();
        put!(
            text,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
             viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" font-family=\"Inter, system-ui, sans-serif\" \
             font-size=\"12\" style=\"font-feature-settings:'tnum','calt','ss03','cv05'\">"
        );
        put!(text, "<title>{}</title>", escape(&self.title));
        put!(text, "<desc>{}</desc>", escape(&self.summary()));
        put!(text, "<rect {} width=\"{WIDTH}\" height=\"{height}\"/>", fill(SURFACE));
        let title = symbol::svg(&self.title);
        put!(text, "<text {} x=\"{LEFT}\" y=\"26\" font-size=\"14\" font-weight=\"600\">{title}</text>", fill(INK));
        put!(text, "<g class=\"{}\" color=\"{}\">", colour.class, colour.light);
        let mut digits = String::new();
        for row in 0..self.rows.len() {
            for column in 0..self.columns.len() {
                let (left, top) = (LEFT + width * column as f64, bottom - cell * (row + 1) as f64);
                let value = self.value(column, row);
                if let Some(value) = value {
                    put!(
                        text,
                        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"currentColor\" \
                         fill-opacity=\"{:.3}\"/>",
                        pixel(left),
                        pixel(top),
                        pixel(width - 1.0),
                        pixel(cell - 1.0),
                        self.depth(value)
                    );
                }
                let label = value.map_or_else(|| "–".into(), short);
                if legend::text_width(&label, DIGITS) < width - 4.0 {
                    let place = [pixel(left + 0.5 * width), pixel(top + 0.5 * cell + 4.0)];
                    put!(digits, "<text x=\"{}\" y=\"{}\">{label}</text>", place[0], place[1]);
                }
            }
        }
        put!(text, "</g>");
        put!(text, "<g {} font-size=\"{DIGITS}\" text-anchor=\"middle\">\n{digits}</g>", fill(INK));
        self.draw_axes(&mut text, [width, cell], bottom);
        put!(text, "</svg>");
        text
    }

    /// Labels of as many values as have room, and the titles.
    fn draw_axes(&self, text: &mut String, [width, cell]: [f64; 2], bottom: f64) {
        let widest = self.columns.iter().map(|value| legend::text_width(&short(*value), DIGITS)).fold(0.0, f64::max);
        let every = ((widest + 8.0) / width).ceil().max(1.0) as usize;
        put!(text, "<g {} font-size=\"{DIGITS}\" text-anchor=\"middle\">", fill(TEXT_3));
        for (column, value) in self.columns.iter().enumerate().step_by(every) {
            let across = pixel(LEFT + width * (column as f64 + 0.5));
            put!(text, "<text x=\"{across}\" y=\"{}\">{}</text>", pixel(bottom + 18.0), short(*value));
        }
        put!(text, "</g>\n<g {} font-size=\"{DIGITS}\" text-anchor=\"end\">", fill(TEXT_3));
        for (row, value) in self.rows.iter().enumerate() {
            let down = pixel(bottom - cell * (row as f64 + 0.5) + 4.0);
            put!(text, "<text x=\"{}\" y=\"{down}\">{}</text>", LEFT - 8.0, short(*value));
        }
        put!(text, "</g>");
        let middle = [pixel(0.5 * (LEFT + RIGHT)), pixel(0.5 * (TOP + bottom))];
        put!(
            text,
            "<text {} x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            fill(TEXT_2),
            middle[0],
            pixel(bottom + 42.0),
            symbol::svg(&self.x.title())
        );
        put!(
            text,
            "<text {} transform=\"translate(18,{}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            fill(TEXT_2),
            middle[1],
            symbol::svg(&self.y.title())
        );
    }

    /// Description for readers who do not see the map.
    fn summary(&self) -> String {
        let range = |axis: &Axis, values: &[f64]| match (values.first(), values.last()) {
            (Some(first), Some(last)) => format!("{}, from {} to {}.", axis.title(), short(*first), short(*last)),
            _ => axis.title(),
        };
        let numbers = match self.ends() {
            Some([low, high]) => {
                format!("{}, from {} (light) to {} (dark).", self.value.title(), short(low), short(high))
            }
            None => "No data.".into(),
        };
        format!("Horizontal: {} Vertical: {} {numbers}", range(&self.x, &self.columns), range(&self.y, &self.rows))
    }

    /// Titles of the axes and of the numbers.
    pub(crate) fn titles(&self) -> [String; 3] {
        [&self.x, &self.y, &self.value].map(Axis::title)
    }

    /// The same with the units separate.
    pub(crate) fn heads(&self) -> [[String; 2]; 3] {
        [&self.x, &self.y, &self.value].map(Axis::head)
    }

    /// Values of both axes with their number, as drawn from below.
    pub(crate) fn cells(&self) -> impl Iterator<Item = [Option<f64>; 3]> + '_ {
        let columns = self.columns.len().max(1);
        self.values.iter().enumerate().map(move |(k, value)| {
            [self.columns.get(k % columns).copied(), self.rows.get(k / columns).copied(), *value]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> Map {
        let axes = [Axis::new("inertia", "kg m^2"), Axis::new("belief", "1"), Axis::new("deviation", "rad")];
        let values = [0.1, 0.2, 0.3, f64::NAN, 0.5, 0.1].map(Some).to_vec();
        Map::new("Deviation", axes, [vec![1.0, 2.0, 4.0], vec![0.7, 1.3]], values)
    }

    #[test]
    fn the_largest_number_is_the_darkest_and_a_missing_one_has_no_colour() {
        let svg = map().svg();
        assert_eq!(svg.matches("fill=\"currentColor\"").count(), 5);
        assert_eq!(
            (svg.matches("fill-opacity=\"0.600\"").count(), svg.matches("fill-opacity=\"0.040\"").count()),
            (1, 2)
        );
        assert!(svg.contains(">0.500</text>") && svg.contains(">–</text>"), "{svg}");
        assert!(svg.contains("deviation, rad, from 0.100 (light) to 0.500 (dark)."), "{svg}");
        let cells: Vec<_> = map().cells().collect();
        assert_eq!((cells[2], cells[3]), ([Some(4.0), Some(0.7), Some(0.3)], [Some(1.0), Some(1.3), None]));
    }

    #[test]
    fn many_cells_have_no_digits_and_a_map_may_be_empty() {
        let axes = || [Axis::new("a", "1"), Axis::new("b", "1"), Axis::new("c", "1")];
        let many: Vec<f64> = (0..100).map(f64::from).collect();
        let svg = Map::new("Many", axes(), [many.clone(), vec![1.0]], many.iter().copied().map(Some).collect()).svg();
        assert!(svg.matches("<text").count() < 60, "labels have room");
        assert!(Map::new("None", axes(), [Vec::new(), Vec::new()], Vec::new()).svg().contains("No data."));
    }
}
