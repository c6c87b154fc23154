//! From a placed page to the text of an SVG.

/// Writes to the text; writing to a `String` cannot fail.
macro_rules! put {
    ($text:expr, $($what:tt)*) => { write!($text, $($what)*).expect("a String takes everything") };
}

mod pen;

use std::collections::HashMap;
use std::fmt::Write as _;

use super::picture::{Picture, port_name};
use super::{Diagram, End, Kind, Node, Page, text};
use pen::Pen;

const MARGIN: f64 = 24.0;
const HEAD: f64 = 76.0;
/// Radius of a bend.
const BEND: f64 = 5.0;
/// Largest scale of a page of few blocks.
const LEAST: f64 = 480.0;

/// Style of the elements: as in the figures of the laboratory, with names for the colours.
const STYLE: &str = "rect.surface{fill:$surface}rect.port{fill:$surface;stroke:$text;stroke-width:1.2}\
.box{fill:$box;stroke:$text;stroke-width:1.2}.call{fill:$tint;stroke:$inside;stroke-width:1.4}\
a:hover .call{stroke-width:2.4}.wire{fill:none;stroke:$text;stroke-width:1.2}.bus{stroke-width:3}\
.mask{stroke-dasharray:4 3}.tip{fill:$text}.dot{fill:$text}.icon{fill:none;stroke:$ink;stroke-width:1.4}\
.axis{fill:none;stroke:$quiet;stroke-width:.7}text{fill:$ink}.name{fill:$inside}.what{fill:$text}\
.quiet{fill:$quiet;font-size:10.5px}";

/// Name, on light and on dark.
const COLOURS: [(&str, &str, &str); 7] = [
    ("$surface", "#FFFFFF", "#13171E"),
    ("$ink", "#171C26", "#E9EDF3"),
    ("$text", "#434C5B", "#B7C0CD"),
    ("$quiet", "#5C6573", "#95A0B0"),
    ("$box", "#F7F8FA", "#1D232D"),
    ("$inside", "#195AD7", "#3F8BFF"),
    ("$tint", "#EDF3FE", "#16233B"),
];

/// The style sheet: light, and dark on request of the viewer. No variables: programs for typesetting do not support
/// them.
fn style() -> String {
    let with = |dark: bool| {
        let colour = |style: String, (name, light, night): &(&str, &str, &str)| {
            style.replace(name, if dark { night } else { light })
        };
        // A page around the picture has other elements: the rules are limited to this one.
        let own: String = STYLE.split_inclusive('}').map(|rule| format!(".signal-flow {rule}")).collect();
        COLOURS.iter().fold(own, colour)
    };
    format!("<style>{}@media screen and (prefers-color-scheme:dark){{{}}}</style>", with(false), with(true))
}

pub(super) fn svg(diagram: &Diagram, number: usize, picture: &Picture) -> String {
    let page = &diagram.pages[number];
    let title = text::words(page.step.name);
    let foot = if picture.coefficients.is_empty() { 0.0 } else { 18.0 + 18.0 * picture.coefficients.len() as f64 };
    let footnote = picture.coefficients.iter().map(|(_, what)| text::width(what) + 60.0).fold(0.0, f64::max);
    let head = 6.4 * text::first_sentence(page.step.help).chars().count() as f64;
    let width = (picture.layout.size[0].max(footnote).max(head) + 2.0 * MARGIN).max(LEAST).ceil();
    let height = (picture.layout.size[1] + HEAD + foot + MARGIN).ceil();
    let mut out = String::new();
    put!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"signal-flow\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" font-family=\"Inter, system-ui, sans-serif\" font-size=\"12\">\n"
    );
    put!(out, "<title>{}</title>\n{}\n", text::escape(&title), style());
    put!(out, "<rect class=\"surface\" width=\"{width}\" height=\"{height}\"/>\n");
    put!(out, "<text x=\"{MARGIN}\" y=\"30\" font-size=\"14\" font-weight=\"600\">{}</text>\n", text::escape(&title));
    let help = text::first_sentence(page.step.help);
    if !help.is_empty() {
        put!(out, "<text class=\"what\" x=\"{MARGIN}\" y=\"48\">{}</text>\n", text::escape(&help));
    }
    put!(out, "<g transform=\"translate({MARGIN} {HEAD})\">\n");
    wires(&mut out, page, picture);
    for (number, element) in picture.elements.iter().enumerate() {
        let [x, y, _, _] = picture.layout.boxes[number];
        put!(out, "<g transform=\"translate({} {})\">", pixel(x), pixel(y));
        let link = match page.nodes[element.nodes[0]].kind {
            Kind::Call { page, .. } => Some(diagram.file(page)),
            _ => None,
        };
        if let Some(file) = &link {
            put!(out, "<a href=\"{}\">", text::escape(file));
        }
        Pen { out: &mut out, page, element }.draw();
        if link.is_some() {
            out += "</a>";
        }
        out += "</g>\n";
    }
    out += "</g>\n";
    for (row, (name, what)) in picture.coefficients.iter().enumerate() {
        let y = HEAD + picture.layout.size[1] + 34.0 + 18.0 * row as f64;
        put!(
            out,
            "<text class=\"what\" x=\"{MARGIN}\" y=\"{}\">{}</text>\n",
            pixel(y),
            text::svg(&format!("{name} = {what}"))
        );
    }
    out += "</svg>\n";
    out
}

/// With one decimal, and none for whole numbers.
fn pixel(value: f64) -> String {
    format!("{}", (value * 10.0).round() / 10.0 + 0.0)
}

fn wires(out: &mut String, page: &Page, picture: &Picture) {
    let segments = &picture.layout.segments;
    let key = |wire: (usize, usize), at: [f64; 2]| (wire, at.map(|v| (v * 10.0).round() as i64));
    let mut meeting: HashMap<_, Vec<usize>> = HashMap::new();
    for (number, segment) in segments.iter().enumerate() {
        for end in [segment.from, segment.to] {
            meeting.entry(key(segment.wire, end)).or_default().push(number);
        }
    }
    let mut dots = Vec::new();
    for (number, segment) in segments.iter().enumerate() {
        // Two pieces that meet at a right angle are joined by a bend, drawn with the horizontal one.
        let horizontal = segment.from[1] == segment.to[1];
        let length = (segment.to[0] - segment.from[0]).abs() + (segment.to[1] - segment.from[1]).abs();
        let bend_at = |end: [f64; 2]| {
            let met = &meeting[&key(segment.wire, end)];
            let other = met.iter().copied().find(|other| *other != number).map(|other| segments[other]);
            other.filter(|o| met.len() == 2 && (o.from[1] == o.to[1]) != horizontal).map(|other| {
                let far = if key(other.wire, other.from) == key(segment.wire, end) { other.to } else { other.from };
                let across = (far[0] - end[0]).abs() + (far[1] - end[1]).abs();
                let bend = BEND.min(length / 2.0).min(across / 2.0);
                let to =
                    [0, 1].map(|i| end[i] + (far[i] - end[i]).signum() * bend * f64::from(u8::from(far[i] != end[i])));
                (bend, to)
            })
        };
        let toward = |from: [f64; 2], to: [f64; 2], by: f64| {
            [0, 1].map(|i| if to[i] == from[i] { from[i] } else { from[i] + (to[i] - from[i]).signum() * by })
        };
        let (begin, end) = (bend_at(segment.from), bend_at(segment.to));
        let from = toward(segment.from, segment.to, begin.map_or(0.0, |b| b.0));
        let to = toward(segment.to, segment.from, end.map_or(0.0, |b| b.0));
        let mut path = String::new();
        if let (true, Some((_, corner))) = (horizontal, begin) {
            put!(
                path,
                "M{} {}Q{} {} ",
                pixel(corner[0]),
                pixel(corner[1]),
                pixel(segment.from[0]),
                pixel(segment.from[1])
            );
            put!(path, "{} {}", pixel(from[0]), pixel(from[1]));
        } else {
            put!(path, "M{} {}", pixel(from[0]), pixel(from[1]));
        }
        put!(path, "L{} {}", pixel(to[0]), pixel(to[1]));
        if let (true, Some((_, corner))) = (horizontal, end) {
            put!(path, "Q{} {} {} {}", pixel(segment.to[0]), pixel(segment.to[1]), pixel(corner[0]), pixel(corner[1]));
        }
        let begins = picture.elements[segment.wire.0].outputs[segment.wire.1];
        put!(
            out,
            "<path class=\"{}\" d=\"{path}\"><title>{}</title></path>\n",
            class(page, begins),
            text::escape(&name(page, begins))
        );
        for end in [segment.from, segment.to] {
            if meeting[&key(segment.wire, end)].len() > 2 && !dots.contains(&end) {
                dots.push(end);
            }
        }
    }
    for [x, y] in dots {
        put!(out, "<circle class=\"dot\" cx=\"{}\" cy=\"{}\" r=\"2.4\"/>\n", pixel(x), pixel(y));
    }
}

fn class(page: &Page, from: End) -> &'static str {
    let node = &page.nodes[from.node];
    if node.outputs[from.port].numbers.len() > 1 {
        "wire bus"
    } else if matches!(node.kind, Kind::Within { .. } | Kind::Compare(_) | Kind::And | Kind::Or | Kind::Not) {
        "wire mask"
    } else {
        "wire"
    }
}

/// Name of a signal: by its source, else by its target.
pub(super) fn name(page: &Page, from: End) -> String {
    let own = |node: &Node, port: &super::Port| {
        let port = port_name(port);
        match (&node.kind, port.is_empty()) {
            (Kind::Call { .. }, false) if !node.name.is_empty() => format!("{}.{port}", node.name),
            _ if !node.symbol.is_empty() => node.symbol.clone(),
            (_, false) => port,
            _ => node.name.clone(),
        }
    };
    let node = &page.nodes[from.node];
    let of_source = own(node, &node.outputs[from.port]);
    if !of_source.is_empty() {
        return of_source;
    }
    let readers = page.wires.iter().filter(|wire| wire.from == from);
    let of_targets = readers.map(|wire| own(&page.nodes[wire.to.node], &page.nodes[wire.to.node].inputs[wire.to.port]));
    of_targets.filter(|name| !name.is_empty()).min_by_key(String::len).unwrap_or_default()
}
