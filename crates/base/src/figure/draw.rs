//! From a figure to the text of an SVG.

use std::fmt::Write as _;

use super::axis::{Axis, LABEL, Scale};
use super::layout::{LEFT, Layout, PLOT, RIGHT, WIDTH};
use super::series::{Data, Series, interval};
use super::symbol::{self, escape};
use super::theme::{AXIS, Colour, GRID, INK, INTERVAL, SURFACE, TEXT_2, TEXT_3};
use super::{Figure, Interval, legend};

/// A figure as a whole file.
pub(super) fn svg(figure: &Figure) -> String {
    let layout = Layout::of(figure, PLOT);
    let mut text = head(layout.height, "");
    draw(&mut text, figure, &layout);
    put!(text, "</svg>");
    text
}

/// The start of an SVG of the usual width; `more` are further attributes.
pub(super) fn head(height: f64, more: &str) -> String {
    let mut text = String::new();
    put!(
        text,
        "<svg xmlns=\"http://www.w3.org/2000/svg\"{more} width=\"{WIDTH}\" height=\"{height}\" \
         viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" font-family=\"Inter, system-ui, sans-serif\" font-size=\"12\" \
         style=\"font-feature-settings:'tnum','calt','ss03','cv05'\">"
    );
    text
}

/// All parts of a figure.
pub(super) fn draw(text: &mut String, figure: &Figure, layout: &Layout) {
    let Layout { x, y, top, bottom, height, .. } = layout;
    put!(text, "<title>{}</title>", escape(&figure.title));
    put!(text, "<desc>{}</desc>", escape(&summary(figure, x, y)));
    put!(text, "<rect {} width=\"{WIDTH}\" height=\"{height}\"/>", fill(SURFACE));
    put!(
        text,
        "<text {} x=\"{LEFT}\" y=\"26\" font-size=\"14\" font-weight=\"600\">{}</text>",
        fill(INK),
        symbol::svg(&figure.title)
    );
    for interval in &figure.intervals {
        draw_interval(text, interval, layout);
    }
    draw_axes(text, figure, layout);
    // A separate window clips values outside a fixed range.
    let (plot_width, plot_height) = (RIGHT - LEFT, bottom - top);
    put!(
        text,
        "<svg x=\"{LEFT}\" y=\"{top}\" width=\"{plot_width}\" height=\"{plot_height}\" \
         viewBox=\"{LEFT} {top} {plot_width} {plot_height}\" overflow=\"hidden\">"
    );
    let layer = |series: &&Series| match series.data {
        Data::Points(_) => 0,
        Data::Band(_) => 1,
        Data::Line(_) => 2,
        Data::Bars(_) => 3,
    };
    let mut layers: Vec<&Series> = figure.series.iter().collect();
    layers.sort_by_key(layer);
    for series in layers {
        draw_series(text, series, layout);
    }
    put!(text, "</svg>");
    if figure.series.iter().all(|series| series.values().is_empty()) {
        let (across, down) = ((LEFT + RIGHT) / 2.0, (top + bottom) / 2.0);
        put!(text, "<text {} x=\"{across}\" y=\"{down}\" text-anchor=\"middle\">no data</text>", fill(TEXT_3));
    }
    for interval in &figure.intervals {
        name_interval(text, interval, layout);
    }
    legend::draw(text, &figure.series, layout);
}

fn draw_interval(text: &mut String, interval: &Interval, Layout { x, top, bottom, .. }: &Layout) {
    let within = |value: f64| x.place(value).clamp(LEFT, RIGHT);
    let (from, to) = (within(interval.from), within(interval.to));
    put!(
        text,
        "<rect {} x=\"{}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>",
        fill(INTERVAL),
        pixel(from),
        pixel(to - from),
        pixel(bottom - top)
    );
}

/// The name of an interval, with a rim that keeps the grid off.
fn name_interval(text: &mut String, interval: &Interval, Layout { x, bottom, .. }: &Layout) {
    // At the bottom, where a friction curve leaves room on the side of positive speed.
    put!(
        text,
        "<text class=\"{} rim\" fill=\"{}\" stroke=\"{}\" stroke-width=\"4\" paint-order=\"stroke\" x=\"{}\" y=\"{}\" \
         font-size=\"{LABEL}\">{}</text>",
        TEXT_3.class,
        TEXT_3.light,
        SURFACE.light,
        pixel(x.place(interval.to).clamp(LEFT, RIGHT) + 6.0),
        pixel(bottom - 8.0),
        symbol::svg(&interval.name)
    );
}

fn draw_axes(text: &mut String, figure: &Figure, Layout { x, y, top, bottom, .. }: &Layout) {
    let (columns, rows) = (x.columns(), y.ticks(32.0));
    let mut grid = String::new();
    for tick in columns.iter().filter(|tick| tick.value != 0.0) {
        write!(grid, "M{},{top}V{bottom}", pixel(x.place(tick.value))).expect("a String takes everything");
    }
    for tick in rows.iter().filter(|tick| tick.value != 0.0) {
        write!(grid, "M{LEFT},{}H{RIGHT}", pixel(y.place(tick.value))).expect("a String takes everything");
    }
    put!(text, "<path {} fill=\"none\" d=\"{grid}\"/>", stroke(GRID));
    let mut lines = format!("M{LEFT},{bottom}H{RIGHT}");
    if x.holds(0.0) {
        write!(lines, "M{},{top}V{bottom}", pixel(x.place(0.0))).expect("a String takes everything");
    }
    if y.holds(0.0) {
        write!(lines, "M{LEFT},{}H{RIGHT}", pixel(y.place(0.0))).expect("a String takes everything");
    }
    put!(text, "<path {} fill=\"none\" d=\"{lines}\"/>", stroke(AXIS));

    put!(text, "<g {} font-size=\"{LABEL}\" text-anchor=\"middle\">", fill(TEXT_3));
    for tick in &columns {
        put!(text, "<text x=\"{}\" y=\"{}\">{}</text>", pixel(x.place(tick.value)), bottom + 18.0, tick.label);
    }
    put!(text, "</g>");
    put!(text, "<g {} font-size=\"{LABEL}\" text-anchor=\"end\">", fill(TEXT_3));
    for tick in &rows {
        put!(text, "<text x=\"{}\" y=\"{}\">{}</text>", LEFT - 10.0, pixel(y.place(tick.value) + 4.0), tick.label);
    }
    put!(text, "</g>");
    put!(
        text,
        "<text {} x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
        fill(TEXT_2),
        (LEFT + RIGHT) / 2.0,
        bottom + 42.0,
        symbol::svg(&figure.x.title())
    );
    let middle = (top + bottom) / 2.0;
    put!(
        text,
        "<text {} transform=\"translate(20,{middle}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        fill(TEXT_2),
        symbol::svg(&figure.y.title())
    );
}

fn draw_series(text: &mut String, series: &Series, layout: &Layout) {
    let pieces = layout.pieces(series);
    let places = |piece: &[&[f64]], column: usize| -> Vec<[f64; 2]> {
        piece.iter().map(|row| layout.place([row[0], row[column]])).collect()
    };
    match &series.data {
        Data::Points(_) => dots(text, series, &pieces.first().map_or_else(Vec::new, |piece| places(piece, 1))),
        Data::Bars(_) => {
            let rows = pieces.first().map_or(&[][..], Vec::as_slice);
            let ends = rows.iter().map(|row| interval([row[0], row[1], row[2]]).map(|end| layout.place(end)));
            bars(text, series, &ends.collect::<Vec<_>>());
            dots(text, series, &places(rows, 1));
        }
        Data::Line(_) => {
            curve(text, series, &pieces.iter().map(|piece| polyline(&places(piece, 1))).collect::<String>());
        }
        Data::Band(_) => {
            let around = |piece: &Vec<&[f64]>| {
                let around: Vec<_> = places(piece, 2).into_iter().chain(places(piece, 1).into_iter().rev()).collect();
                polyline(&around) + "Z"
            };
            let path: String = pieces.iter().map(around).collect();
            put!(text, "<path {} fill=\"currentColor\" opacity=\"0.2\" d=\"{path}\"/>", role(series));
        }
    }
}

/// Intervals: a stroke with a foot at both ends.
pub(super) fn bars(text: &mut String, series: &Series, ends: &[[[f64; 2]; 2]]) {
    let bar = |[[x, low], [_, high]]: &[[f64; 2]; 2]| {
        let (left, low, high) = (pixel(x - 3.0), pixel(*low), pixel(*high));
        format!("M{left},{low}h6M{left},{high}h6M{},{low}V{high}", pixel(*x))
    };
    let path: String = ends.iter().map(bar).collect();
    put!(text, "<path {} fill=\"none\" stroke=\"currentColor\" stroke-width=\"1.3\" d=\"{path}\"/>", role(series));
}

/// A cloud: strokes of no length, whose round caps are the dots.
pub(super) fn dots(text: &mut String, series: &Series, places: &[[f64; 2]]) {
    let path: String = places.iter().map(|place| format!("M{},{}h0", pixel(place[0]), pixel(place[1]))).collect();
    put!(
        text,
        "<path {} fill=\"none\" stroke=\"currentColor\" stroke-width=\"{}\" stroke-linecap=\"round\" \
         opacity=\"0.7\" d=\"{path}\"/>",
        role(series),
        series.dot()
    );
}

pub(super) fn curve(text: &mut String, series: &Series, path: &str) {
    let (width, _) = series.role.line();
    let dashes = series.dashes().map(|dashes| format!(" stroke-dasharray=\"{dashes}\"")).unwrap_or_default();
    put!(
        text,
        "<path {} fill=\"none\" stroke=\"currentColor\" stroke-width=\"{width}\"{dashes} stroke-linejoin=\"round\" \
         d=\"{path}\"/>",
        role(series)
    );
}

fn polyline(places: &[[f64; 2]]) -> String {
    let pairs: Vec<_> = places.iter().map(|place| format!("{},{}", pixel(place[0]), pixel(place[1]))).collect();
    if pairs.is_empty() { String::new() } else { format!("M{}", pairs.join(" ")) }
}

/// Description for readers who do not see the figure.
fn summary(figure: &Figure, x: &Scale, y: &Scale) -> String {
    let axis = |axis: &Axis, scale: &Scale| {
        let (low, high) = scale.ends();
        format!("{}, from {} to {}", axis.title(), short(low), short(high))
    };
    let mut parts = vec![format!("Horizontal: {}.", axis(&figure.x, x)), format!("Vertical: {}.", axis(&figure.y, y))];
    for series in &figure.series {
        let kind = series.kind();
        let values = series.values();
        let heights = || values.iter().map(|value| value[1]);
        let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let count = match series.data {
            Data::Bars(_) | Data::Band(_) => values.len() / 2,
            Data::Points(_) | Data::Line(_) => values.len(),
        };
        let range = if values.is_empty() {
            "no data".into()
        } else {
            format!("{count} values from {} to {} {}", short(low), short(high), figure.y.unit())
        };
        parts.push(format!("{} ({kind}): {}.", series.name, range.trim_end()));
    }
    for Interval { from, to, name } in &figure.intervals {
        parts.push(format!("{name}: from {} to {} {}.", short(*from), short(*to), figure.x.unit()));
    }
    parts.join(" ")
}

/// Three digits, as in a sentence.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.2e}");
    let exponent: i32 = text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0);
    crate::quantity::number(value, (2 - exponent).clamp(0, 9).unsigned_abs() as usize)
}

/// A position [px] with one decimal, so that equal figures are equal files.
pub(super) fn pixel(value: f64) -> String {
    // Adding zero takes the sign off a negative zero.
    format!("{:.1}", (value * 10.0).round() / 10.0 + 0.0)
}

pub(super) fn fill(colour: Colour) -> String {
    format!("class=\"{}\" fill=\"{}\"", colour.class, colour.light)
}

fn stroke(colour: Colour) -> String {
    format!("class=\"{}\" stroke=\"{}\"", colour.class, colour.light)
}

pub(super) fn role(series: &Series) -> String {
    let colour = series.role.colour();
    format!("class=\"{}\" color=\"{}\"", colour.class, colour.light)
}

/// The class of a series' colour.
pub(super) fn class(series: &Series) -> &'static str {
    series.role.colour().class
}
