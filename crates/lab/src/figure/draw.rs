//! From a figure to the text of an SVG.

use std::fmt::Write as _;

use super::axis::{Axis, Scale};
use super::series::{Data, Series, can_be_shown};
use super::theme::{AXIS, Colour, GRID, INK, INTERVAL, SURFACE, TEXT_2, TEXT_3};
use super::{Figure, Interval, legend, thin};

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 440.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = WIDTH - 16.0;
const BOTTOM: f64 = HEIGHT - 56.0;
/// Title and legend stand above this, in one line; in two lines where they need it.
const TOP: f64 = 52.0;
const LINE: f64 = 24.0;

pub(super) fn svg(figure: &Figure) -> String {
    let legend = legend::width(&figure.series);
    let beside = LEFT + legend::text_width(&figure.title, 14.0) + 2.0 * LINE + legend <= RIGHT;
    let (top, legend_line) = if beside { (TOP, 26.0) } else { (TOP + LINE, 26.0 + LINE) };
    let values: Vec<[f64; 2]> = figure.series.iter().flat_map(Series::values).collect();
    let x = figure.x.scale(values.iter().map(|value| value[0]), LEFT, RIGHT);
    let y = figure.y.scale(values.iter().map(|value| value[1]), BOTTOM, top);

    let mut text = String::new();
    put!(
        text,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" font-family=\"Inter, system-ui, sans-serif\" font-size=\"12\" \
         style=\"font-feature-settings:'tnum','calt','ss03','cv05'\">"
    );
    put!(text, "<title>{}</title>", escape(&figure.title));
    put!(text, "<desc>{}</desc>", escape(&summary(figure, &x, &y)));
    put!(text, "<rect {} width=\"{WIDTH}\" height=\"{HEIGHT}\"/>", fill(SURFACE));
    put!(
        text,
        "<text {} x=\"{LEFT}\" y=\"26\" font-size=\"14\" font-weight=\"600\">{}</text>",
        fill(INK),
        escape(&figure.title)
    );
    for interval in &figure.intervals {
        draw_interval(&mut text, interval, &x, top);
    }
    draw_axes(&mut text, figure, &x, &y, top);
    // A window of its own clips what lies beyond a given range.
    let (plot_width, plot_height) = (RIGHT - LEFT, BOTTOM - top);
    put!(
        text,
        "<svg x=\"{LEFT}\" y=\"{top}\" width=\"{plot_width}\" height=\"{plot_height}\" \
         viewBox=\"{LEFT} {top} {plot_width} {plot_height}\" overflow=\"hidden\">"
    );
    let layer = |series: &&Series| match series.data {
        Data::Points(_) => 0,
        Data::Band(_) => 1,
        Data::Line(_) => 2,
    };
    let mut layers: Vec<&Series> = figure.series.iter().collect();
    layers.sort_by_key(layer);
    for series in layers {
        draw_series(&mut text, series, &x, &y);
    }
    put!(text, "</svg>");
    if values.is_empty() {
        let (across, down) = ((LEFT + RIGHT) / 2.0, (top + BOTTOM) / 2.0);
        put!(text, "<text {} x=\"{across}\" y=\"{down}\" text-anchor=\"middle\">no data</text>", fill(TEXT_3));
    }
    for interval in &figure.intervals {
        name_interval(&mut text, interval, &x);
    }
    legend::draw(&mut text, &figure.series, RIGHT - legend, legend_line);
    put!(text, "</svg>");
    text
}

fn draw_interval(text: &mut String, interval: &Interval, x: &Scale, top: f64) {
    let within = |value: f64| x.place(value).clamp(LEFT, RIGHT);
    let (from, to) = (within(interval.from), within(interval.to));
    put!(
        text,
        "<rect {} x=\"{}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>",
        fill(INTERVAL),
        pixel(from),
        pixel(to - from),
        pixel(BOTTOM - top)
    );
}

/// The name of an interval, with a rim that keeps the grid off.
fn name_interval(text: &mut String, interval: &Interval, x: &Scale) {
    // At the foot, where a friction curve leaves room on the side of positive speed.
    put!(
        text,
        "<text class=\"{} rim\" fill=\"{}\" stroke=\"{}\" stroke-width=\"4\" paint-order=\"stroke\" x=\"{}\" y=\"{}\" \
         font-size=\"11.5\">{}</text>",
        TEXT_3.class,
        TEXT_3.light,
        SURFACE.light,
        pixel(x.place(interval.to).clamp(LEFT, RIGHT) + 6.0),
        pixel(BOTTOM - 8.0),
        escape(&interval.name)
    );
}

fn draw_axes(text: &mut String, figure: &Figure, x: &Scale, y: &Scale, top: f64) {
    let (columns, rows) = (x.ticks(25.0), y.ticks(32.0));
    let mut grid = String::new();
    for tick in columns.iter().filter(|tick| tick.value != 0.0) {
        write!(grid, "M{},{top}V{BOTTOM}", pixel(x.place(tick.value))).expect("a String takes everything");
    }
    for tick in rows.iter().filter(|tick| tick.value != 0.0) {
        write!(grid, "M{LEFT},{}H{RIGHT}", pixel(y.place(tick.value))).expect("a String takes everything");
    }
    put!(text, "<path {} fill=\"none\" d=\"{grid}\"/>", stroke(GRID));
    let mut lines = format!("M{LEFT},{BOTTOM}H{RIGHT}");
    if x.holds(0.0) {
        write!(lines, "M{},{top}V{BOTTOM}", pixel(x.place(0.0))).expect("a String takes everything");
    }
    if y.holds(0.0) {
        write!(lines, "M{LEFT},{}H{RIGHT}", pixel(y.place(0.0))).expect("a String takes everything");
    }
    put!(text, "<path {} fill=\"none\" d=\"{lines}\"/>", stroke(AXIS));

    put!(text, "<g {} font-size=\"11.5\" text-anchor=\"middle\">", fill(TEXT_3));
    for tick in &columns {
        put!(text, "<text x=\"{}\" y=\"{}\">{}</text>", pixel(x.place(tick.value)), BOTTOM + 18.0, tick.label);
    }
    put!(text, "</g>");
    put!(text, "<g {} font-size=\"11.5\" text-anchor=\"end\">", fill(TEXT_3));
    for tick in &rows {
        put!(text, "<text x=\"{}\" y=\"{}\">{}</text>", LEFT - 10.0, pixel(y.place(tick.value) + 4.0), tick.label);
    }
    put!(text, "</g>");
    put!(
        text,
        "<text {} x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
        fill(TEXT_2),
        (LEFT + RIGHT) / 2.0,
        BOTTOM + 42.0,
        escape(&figure.x.title())
    );
    let middle = (top + BOTTOM) / 2.0;
    put!(
        text,
        "<text {} transform=\"translate(20,{middle}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        fill(TEXT_2),
        escape(&figure.y.title())
    );
}

fn draw_series(text: &mut String, series: &Series, x: &Scale, y: &Scale) {
    let place = |x_value: f64, y_value: f64| [x.place(x_value), y.place(y_value)];
    match &series.data {
        Data::Points(pairs) => {
            let finite = pairs.iter().filter(|pair| can_be_shown(*pair));
            dots(text, series, &thin::points(finite.map(|pair| place(pair[0], pair[1]))));
        }
        Data::Line(pairs) => {
            let mut path = String::new();
            for piece in pairs.split(|pair| !can_be_shown(pair)) {
                let places: Vec<_> = piece.iter().map(|pair| place(pair[0], pair[1])).collect();
                path += &polyline(&thin::line(&places));
            }
            curve(text, series, &path);
        }
        Data::Band(edges) => {
            let mut path = String::new();
            for piece in edges.split(|edge| !can_be_shown(edge)) {
                let upper: Vec<_> = piece.iter().map(|edge| place(edge[0], edge[2])).collect();
                let lower: Vec<_> = piece.iter().map(|edge| place(edge[0], edge[1])).collect();
                let around: Vec<_> =
                    thin::line(&upper).into_iter().chain(thin::line(&lower).into_iter().rev()).collect();
                if !around.is_empty() {
                    path += &polyline(&around);
                    path.push('Z');
                }
            }
            put!(text, "<path {} fill=\"currentColor\" opacity=\"0.2\" d=\"{path}\"/>", role(series));
        }
    }
}

/// A cloud: strokes of no length, whose round caps are the dots.
pub(super) fn dots(text: &mut String, series: &Series, places: &[[f64; 2]]) {
    let path: String = places.iter().map(|place| format!("M{},{}h0", pixel(place[0]), pixel(place[1]))).collect();
    put!(
        text,
        "<path {} fill=\"none\" stroke=\"currentColor\" stroke-width=\"{}\" stroke-linecap=\"round\" \
         opacity=\"0.7\" d=\"{path}\"/>",
        role(series),
        series.dot
    );
}

pub(super) fn curve(text: &mut String, series: &Series, path: &str) {
    let (width, _) = series.role.line();
    let dashes = series.dashes.map(|dashes| format!(" stroke-dasharray=\"{dashes}\"")).unwrap_or_default();
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

/// What a reader who does not see it should know.
fn summary(figure: &Figure, x: &Scale, y: &Scale) -> String {
    let axis = |axis: &Axis, scale: &Scale| {
        let (low, high) = scale.ends();
        format!("{}, from {} to {}", axis.title(), short(low), short(high))
    };
    let mut parts = vec![format!("Horizontal: {}.", axis(&figure.x, x)), format!("Vertical: {}.", axis(&figure.y, y))];
    for series in &figure.series {
        let kind = match series.data {
            Data::Points(_) => "points",
            Data::Line(_) => "line",
            Data::Band(_) => "band",
        };
        let values = series.values();
        let heights = || values.iter().map(|value| value[1]);
        let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let range = if values.is_empty() {
            "no data".into()
        } else {
            format!("{} values from {} to {} {}", values.len(), short(low), short(high), figure.y.unit())
        };
        parts.push(format!("{} ({kind}): {}.", series.name, range.trim_end()));
    }
    for Interval { from, to, name } in &figure.intervals {
        parts.push(format!("{name}: from {} to {} {}.", short(*from), short(*to), figure.x.unit()));
    }
    parts.join(" ")
}

/// Three digits, as in a sentence.
fn short(value: f64) -> String {
    let text = format!("{value:.2e}");
    let exponent: i32 = text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0);
    crate::quantity::number(value, (2 - exponent).clamp(0, 9).unsigned_abs() as usize)
}

/// A place [px], always with one decimal, so that equal figures are equal files.
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

/// Text between tags or in an attribute.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
