//! The legend: mark and name of each series, in as few lines as possible.

use std::fmt::Write as _;

use super::draw::{bars, curve, dots, fill, pixel, role};
use super::layout::{LINE, Layout, RIGHT};
use super::series::{Data, Series};
use super::symbol;
use super::theme::TEXT_2;

/// Space for the mark of an entry of the legend.
const MARK: f64 = 31.0;
/// Space between entries.
const GAP: f64 = 16.0;

/// Draws the entries, to the right.
pub(super) fn draw(text: &mut String, series: &[Series], layout: &Layout) {
    for (count, line) in layout.legend.iter().enumerate() {
        let entries = line.iter().map(|&index| &series[index]);
        let width: f64 = entries.clone().map(entry_width).sum();
        let mut left = RIGHT - width + GAP;
        for entry in entries {
            draw_entry(text, entry, left, layout.legend_line + LINE * count as f64);
            left += entry_width(entry);
        }
    }
}

fn draw_entry(text: &mut String, entry: &Series, left: f64, line: f64) {
    let middle = line - 4.0;
    match entry.data {
        Data::Points(_) => {
            // Large dots would overlap.
            let step = if entry.dot() > 4.0 { 2 } else { 1 };
            let wave = [[2.0, 2.0], [7.0, -2.5], [12.0, 1.5], [17.0, -2.0], [22.0, 1.0]];
            let wave = wave.into_iter().step_by(step).map(|[across, down]| [left + across, middle + down]);
            dots(text, entry, &wave.collect::<Vec<_>>());
        }
        Data::Bars(_) => {
            let across = left + 12.0;
            bars(text, entry, &[[[across, middle + 6.0], [across, middle - 6.0]]]);
            dots(text, entry, &[[across, middle]]);
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
    put!(text, "<text {} x=\"{}\" y=\"{line}\">{}</text>", fill(TEXT_2), pixel(left + MARK), symbol::svg(&entry.name));
}

/// The entries of each line of this width [px]; a line has at least one.
pub(super) fn lines(series: &[Series], width: f64) -> Vec<Vec<usize>> {
    let mut lines: Vec<Vec<usize>> = Vec::new();
    let mut left = 0.0;
    for (index, entry) in series.iter().enumerate() {
        let needed = entry_width(entry);
        match lines.last_mut() {
            Some(line) if left + needed - GAP <= width => line.push(index),
            _ => {
                lines.push(vec![index]);
                left = 0.0;
            }
        }
        left += needed;
    }
    lines
}

/// Mark, name and the space behind it.
fn entry_width(entry: &Series) -> f64 {
    MARK + text_width(&entry.name, 12.0) + GAP
}

/// About how wide a text is [px]: the font depends on the viewer.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let wide = |letter: char| match letter {
        'i' | 'j' | 'l' | 'f' | 't' | 'r' | ' ' | '.' | ',' | '\'' | '(' | ')' => 0.34,
        'm' | 'w' | 'M' | 'W' | '±' | '−' => 0.88,
        letter if letter.is_uppercase() || letter.is_ascii_digit() => 0.68,
        _ => 0.6,
    };
    text.chars().map(wide).sum::<f64>() * size
}
