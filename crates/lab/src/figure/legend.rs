//! The legend: mark and name of each series, in one line.

use std::fmt::Write as _;

use super::draw::{curve, dots, escape, fill, pixel, role};
use super::series::{Data, Series};
use super::theme::TEXT_2;

/// Space for the mark of an entry of the legend.
const MARK: f64 = 31.0;

/// Draws the entries from `left` on; `line` is the line of their letters [px].
pub(super) fn draw(text: &mut String, series: &[Series], left: f64, line: f64) {
    let mut left = left;
    for entry in series {
        let middle = line - 4.0;
        match entry.data {
            Data::Points(_) => {
                // Large dots would run into each other.
                let step = if entry.dot > 4.0 { 2 } else { 1 };
                let wave = [[2.0, 2.0], [7.0, -2.5], [12.0, 1.5], [17.0, -2.0], [22.0, 1.0]];
                let wave = wave.into_iter().step_by(step).map(|[across, down]| [left + across, middle + down]);
                dots(text, entry, &wave.collect::<Vec<_>>());
            }
            Data::Line(_) => curve(text, entry, &format!("M{},{middle}h{}", pixel(left), MARK - 7.0)),
            Data::Band(_) => put!(
                text,
                "<rect {} fill=\"currentColor\" opacity=\"0.2\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"9\" rx=\"1.5\"/>",
                role(entry),
                pixel(left),
                middle - 4.5,
                MARK - 7.0
            ),
        }
        put!(text, "<text {} x=\"{}\" y=\"{line}\">{}</text>", fill(TEXT_2), pixel(left + MARK), escape(&entry.name));
        left += entry_width(entry);
    }
}

/// How wide all entries are together [px].
pub(super) fn width(series: &[Series]) -> f64 {
    series.iter().map(entry_width).sum::<f64>() - if series.is_empty() { 0.0 } else { 16.0 }
}

/// Mark, name and the space behind it.
fn entry_width(entry: &Series) -> f64 {
    MARK + text_width(&entry.name, 12.0) + 16.0
}

/// About how wide a text is [px]: the font is known only where it is shown.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let wide = |letter: char| match letter {
        'i' | 'j' | 'l' | 'f' | 't' | 'r' | ' ' | '.' | ',' | '\'' | '(' | ')' => 0.34,
        'm' | 'w' | 'M' | 'W' | '±' | '−' => 0.88,
        letter if letter.is_uppercase() || letter.is_ascii_digit() => 0.68,
        _ => 0.6,
    };
    text.chars().map(wide).sum::<f64>() * size
}
