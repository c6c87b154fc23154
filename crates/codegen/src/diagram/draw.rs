//! From a placed page to the text of an SVG.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::picture::{Element, Entry, Picture, function_names, port_name};
use super::{Diagram, End, Kind, Node, Page, text};
use crate::record::Id;

const MARGIN: f64 = 24.0;
const HEAD: f64 = 76.0;
/// Radius of a bend.
const BEND: f64 = 5.0;
/// A page of few blocks is not drawn larger than it is.
const LEAST: f64 = 480.0;

/// Colours by what they mean, as in the figures of the laboratory; the dark ones where the reader wants them.
const STYLE: &str = "<style>\
:root{--surface:#FFFFFF;--ink:#171C26;--text:#434C5B;--quiet:#5C6573;--line:#434C5B;--box:#F7F8FA;--inside:#195AD7;--tint:#EDF3FE}\
@media screen and (prefers-color-scheme:dark){:root{--surface:#13171E;--ink:#E9EDF3;--text:#B7C0CD;--quiet:#95A0B0;\
--line:#B7C0CD;--box:#1D232D;--inside:#3F8BFF;--tint:#16233B}}\
.surface{fill:var(--surface)}.box{fill:var(--box);stroke:var(--line);stroke-width:1.2}.port{fill:var(--surface);stroke:var(--line);stroke-width:1.2}\
.call{fill:var(--tint);stroke:var(--inside);stroke-width:1.4}a:hover .call{stroke-width:2.4}\
.wire{fill:none;stroke:var(--line);stroke-width:1.2}.bus{stroke-width:3}.mask{stroke-dasharray:4 3}\
.tip,.dot{fill:var(--line)}.icon{fill:none;stroke:var(--ink);stroke-width:1.4}.axis{fill:none;stroke:var(--quiet);stroke-width:.7}\
text{fill:var(--ink)}.name{fill:var(--inside)}.quiet{fill:var(--quiet);font-size:10.5px}.what{fill:var(--text)}</style>";

/// Writes to the text; a `String` takes everything.
macro_rules! put {
    ($text:expr, $($what:tt)*) => { write!($text, $($what)*).expect("a String takes everything") };
}

pub(super) fn svg(diagram: &Diagram, number: usize, picture: &Picture) -> String {
    let page = &diagram.pages[number];
    let title = words(page.step.name);
    let foot = if picture.coefficients.is_empty() { 0.0 } else { 18.0 + 18.0 * picture.coefficients.len() as f64 };
    let footnote = picture.coefficients.iter().map(|(_, what)| text::width(what) + 60.0).fold(0.0, f64::max);
    let head = 6.4 * text::first_sentence(page.step.help).chars().count() as f64;
    let width = (picture.layout.size[0].max(footnote).max(head) + 2.0 * MARGIN).max(LEAST).ceil();
    let height = (picture.layout.size[1] + HEAD + foot + MARGIN).ceil();
    let mut out = String::new();
    put!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" font-family=\"Inter, system-ui, sans-serif\" font-size=\"12\">\n"
    );
    put!(out, "<title>{}</title>\n{STYLE}\n", text::escape(&title));
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

/// With one decimal, and none where there is none to tell.
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

/// What a signal is called: by where it comes from, else by where it goes.
pub(super) fn name(page: &Page, from: End) -> String {
    let own = |node: &Node, port: &super::Port| {
        let port = port_name(port);
        match (&node.kind, port.is_empty()) {
            (Kind::Call { .. }, false) => format!("{}.{port}", node.name),
            _ if !node.symbol.is_empty() => node.symbol.clone(),
            (_, false) => port,
            _ => node.name.clone(),
        }
    };
    let node = &page.nodes[from.node];
    let known = own(node, &node.outputs[from.port]);
    if !known.is_empty() {
        return known;
    }
    let readers = page.wires.iter().filter(|wire| wire.from == from);
    let named = readers.map(|wire| own(&page.nodes[wire.to.node], &page.nodes[wire.to.node].inputs[wire.to.port]));
    named.filter(|name| !name.is_empty()).min_by_key(String::len).unwrap_or_default()
}

/// Draws one element in its own coordinates.
struct Pen<'a> {
    out: &'a mut String,
    page: &'a Page<'a>,
    element: &'a Element,
}

impl Pen<'_> {
    fn draw(&mut self) {
        let Element { nodes, margin, shape, label, .. } = self.element;
        let node = &self.page.nodes[nodes[0]];
        let (left, right) = (*margin, shape.width);
        let middle = (left + right) / 2.0;
        put!(self.out, "<title>{}</title>", text::escape(&self.tooltip()));
        if nodes.len() > 1 {
            self.rect("box", left, right, shape.height, 4.0);
            if self.element.is_formula() {
                self.text(label, middle, shape.height / 2.0 + 4.0, "middle", "");
                return self.entries(left);
            }
            self.text(label, middle, 18.0, "middle", "");
            let (inside, outside) = function_names(self.page, self.element);
            for (name, y) in inside.iter().zip(&self.element.rows) {
                self.text(name, left + 11.0, y + 4.0, "start", "what");
            }
            for (name, y) in outside.iter().zip(&shape.outputs) {
                self.text(name, right - 8.0, y + 4.0, "end", "what");
            }
            return self.entries(left);
        }
        match &node.kind {
            Kind::Input | Kind::Output => {
                self.rect("port", left, right, shape.height, shape.height.min(26.0) / 2.0);
                let y = shape.height / 2.0 + 4.0;
                self.text(label, left + 13.0, y, "start", "");
                self.text(&text::unit(node.unit), right - 12.0, y, "end", "quiet");
            }
            Kind::Delay => {
                self.rect("box", left, right, shape.height - 18.0, 2.0);
                put!(
                    self.out,
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\"><tspan font-style=\"italic\">z</tspan>\
                     <tspan dy=\"-4\" font-size=\"75%\">−1</tspan></text>",
                    pixel(middle),
                    pixel((shape.height - 18.0) / 2.0 + 5.0)
                );
                self.text(label, middle, shape.height - 4.0, "middle", "");
            }
            Kind::Sum(signs) if signs.len() <= 3 => return self.sum(signs),
            Kind::Sum(_) | Kind::Product(_) => {
                self.rect("box", left, right, shape.height, 2.0);
                let signs = matches!(node.kind, Kind::Sum(_))
                    || matches!(&node.kind, Kind::Product(over) if over.contains(&true));
                self.text(label, middle + if signs { 4.0 } else { 0.0 }, shape.height / 2.0 + 5.0, "middle", "");
                self.signs(&node.kind);
            }
            Kind::Gain(_) => {
                let (height, half) = (shape.height, shape.height / 2.0);
                let nose = if text::width(label) <= 30.0 { left } else { right - 14.0 };
                put!(
                    self.out,
                    "<path class=\"box\" stroke-linejoin=\"round\" d=\"M{} 0L{} 0L{} {half}L{} {height}L{} {height}Z\"/>",
                    pixel(left),
                    pixel(nose),
                    pixel(right),
                    pixel(nose),
                    pixel(left)
                );
                self.text(label, left + if nose == left { 5.0 } else { 9.0 }, half + 4.0, "start", "");
            }
            Kind::Saturation { .. } => {
                let height = shape.height - if label.is_empty() { 0.0 } else { 18.0 };
                let (low, high) = (middle - 22.0, middle + 22.0);
                if low > left {
                    self.rect("box", low, high, height, 2.0);
                    put!(
                        self.out,
                        "<path class=\"wire\" d=\"M{} {1}H{2}M{3} {1}H{4}\"/>",
                        pixel(left),
                        height / 2.0,
                        pixel(low),
                        pixel(high),
                        pixel(right)
                    );
                } else {
                    self.rect("box", left, right, height, 2.0);
                }
                let y = height / 2.0;
                put!(
                    self.out,
                    "<path class=\"axis\" d=\"M{} {y}h32M{} {}v26\"/>",
                    pixel(middle - 16.0),
                    pixel(middle),
                    y - 13.0
                );
                put!(
                    self.out,
                    "<path class=\"icon\" d=\"M{} {}h8L{} {}h8\"/>",
                    pixel(middle - 16.0),
                    y + 9.0,
                    pixel(middle + 8.0),
                    y - 9.0
                );
                self.text(label, middle, shape.height - 4.0, "middle", "");
                return self.entries(low.max(left));
            }
            Kind::Sign => {
                self.rect("box", left, right, shape.height, 2.0);
                let y = shape.height / 2.0;
                put!(
                    self.out,
                    "<path class=\"axis\" d=\"M{} {y}h26M{} {}v26\"/>",
                    pixel(middle - 13.0),
                    pixel(middle),
                    y - 13.0
                );
                put!(
                    self.out,
                    "<path class=\"icon\" d=\"M{} {}H{}V{}h12\"/>",
                    pixel(middle - 12.0),
                    y + 8.0,
                    pixel(middle),
                    y - 8.0
                );
            }
            Kind::Switch => {
                self.rect("box", left, right, shape.height, 2.0);
                let out = shape.height / 2.0;
                put!(
                    self.out,
                    "<path class=\"icon\" d=\"M{} 10h10L{} {out}H{}M{} {}h10\"/><circle class=\"dot\" cx=\"{}\" cy=\"10\" r=\"1.8\"/>\
                     <circle class=\"dot\" cx=\"{}\" cy=\"{}\" r=\"1.8\"/><circle class=\"dot\" cx=\"{}\" cy=\"{out}\" r=\"1.8\"/>",
                    pixel(left),
                    pixel(right - 10.0),
                    pixel(right),
                    pixel(left),
                    shape.height - 10.0,
                    pixel(left + 10.0),
                    pixel(left + 10.0),
                    shape.height - 10.0,
                    pixel(right - 10.0)
                );
            }
            Kind::Call { .. } => self.call(node),
            _ => {
                self.rect("box", left, right, shape.height, 2.0);
                self.text(label, middle, shape.height / 2.0 + 4.0, "middle", "");
            }
        }
        self.entries(left);
    }

    fn rect(&mut self, class: &str, left: f64, right: f64, height: f64, radius: f64) {
        put!(
            self.out,
            "<rect class=\"{class}\" x=\"{}\" y=\"0\" width=\"{}\" height=\"{}\" rx=\"{radius}\"/>",
            pixel(left),
            pixel(right - left),
            pixel(height)
        );
    }

    fn text(&mut self, label: &str, x: f64, y: f64, anchor: &str, class: &str) {
        if label.is_empty() {
            return;
        }
        let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
        let inside = if class.is_empty() || class.contains("what") { text::svg(label) } else { text::escape(label) };
        put!(self.out, "<text{class} x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\">{inside}</text>", pixel(x), pixel(y));
    }

    /// Arrow heads at the body, and what is written instead of a wire.
    fn entries(&mut self, body: f64) {
        for (entry, y) in self.element.inputs.iter().zip(&self.element.rows) {
            match entry {
                Entry::Wire(from, _) => {
                    if body > 0.0 {
                        put!(
                            self.out,
                            "<path class=\"{}\" d=\"M0 {}H{}\"/>",
                            class(self.page, *from),
                            pixel(*y),
                            pixel(body)
                        );
                    }
                    self.tip(body, *y, [7.0, 0.0]);
                }
                Entry::Text(label) => {
                    put!(self.out, "<path class=\"wire\" d=\"M{} {}h-6\"/>", pixel(body), pixel(*y));
                    self.text(label, body - 9.0, y + 4.0, "end", "what");
                }
            }
        }
    }

    /// An arrow head that points along a direction, at its tip.
    fn tip(&mut self, x: f64, y: f64, along: [f64; 2]) {
        let [dx, dy] = along;
        let (x1, y1) = (x - dx - dy * 0.45, y - dy + dx * 0.45);
        let (x2, y2) = (x - dx + dy * 0.45, y - dy - dx * 0.45);
        put!(
            self.out,
            "<path class=\"tip\" d=\"M{} {}L{} {}L{} {}Z\"/>",
            pixel(x),
            pixel(y),
            pixel(x1),
            pixel(y1),
            pixel(x2),
            pixel(y2)
        );
    }

    /// A circle that wires enter from the left, from above and from below.
    fn sum(&mut self, signs: &[bool]) {
        let (y, radius) = (24.0, 11.0);
        let Element { shape, margin, rows, inputs, .. } = self.element;
        let x = shape.width - radius - 2.0;
        put!(self.out, "<circle class=\"box\" cx=\"{}\" cy=\"{y}\" r=\"{radius}\"/>", pixel(x));
        put!(self.out, "<path class=\"wire\" d=\"M{} {y}h2\"/>", pixel(x + radius));
        for ((entry, row), minus) in inputs.iter().zip(rows).zip(signs) {
            let (begin, wire) = match entry {
                Entry::Wire(from, _) => (0.0, class(self.page, *from)),
                Entry::Text(label) => {
                    self.text(label, margin - 6.0, row + 4.0, "end", "what");
                    (margin - 3.0, "wire")
                }
            };
            let sign = if *minus { "−" } else { "+" };
            if *row == y {
                put!(self.out, "<path class=\"{wire}\" d=\"M{} {y}H{}\"/>", pixel(begin), pixel(x - radius));
                self.tip(x - radius, y, [7.0, 0.0]);
                self.text(sign, x - radius - 8.0, y - 5.0, "middle", "quiet");
            } else {
                let down = if *row < y { 1.0 } else { -1.0 };
                put!(
                    self.out,
                    "<path class=\"{wire}\" d=\"M{} {row}H{}Q{} {row} {} {}V{}\"/>",
                    pixel(begin),
                    pixel(x - 4.0),
                    pixel(x),
                    pixel(x),
                    pixel(row + 4.0 * down),
                    pixel(y - radius * down)
                );
                self.tip(x, y - radius * down, [0.0, 7.0 * down]);
                self.text(sign, x + 9.0, y - (radius + 5.0) * down + 3.0, "middle", "quiet");
            }
        }
    }

    /// What a term or factor does, at its port.
    fn signs(&mut self, kind: &Kind) {
        let (Kind::Sum(signs) | Kind::Product(signs)) = kind else { return };
        let (plain, other) = if matches!(kind, Kind::Sum(_)) { ("+", "−") } else { ("", "÷") };
        let left = self.element.margin;
        for (reversed, y) in signs.iter().zip(&self.element.rows) {
            self.text(if *reversed { other } else { plain }, left + 7.0, y + 4.0, "middle", "quiet");
        }
    }

    fn call(&mut self, node: &Node) {
        let Element { shape, margin, inputs, rows, outputs, .. } = self.element;
        self.rect("call", *margin, shape.width, shape.height, 3.0);
        put!(
            self.out,
            "<text class=\"name\" font-weight=\"600\" x=\"{}\" y=\"20\" text-anchor=\"middle\">{}</text>",
            pixel((margin + shape.width) / 2.0),
            text::escape(&words(&node.name))
        );
        let mut ports = node.inputs.iter();
        for (_, y) in inputs.iter().zip(rows) {
            if let Some(port) = ports.next() {
                self.text(&port_name(port), margin + 11.0, y + 4.0, "start", "");
            }
        }
        for (end, y) in outputs.iter().zip(&shape.outputs) {
            self.text(&port_name(&node.outputs[end.port]), shape.width - 8.0, y + 4.0, "end", "");
        }
    }

    fn tooltip(&self) -> String {
        let Element { nodes, outputs, .. } = self.element;
        let node = &self.page.nodes[nodes[0]];
        if nodes.len() > 1 {
            let outputs = outputs.iter().map(|end| {
                let result = self.page.nodes[end.node].outputs[end.port].numbers[0];
                format!("{} = {}", name(self.page, *end), self.signals(result))
            });
            return outputs.collect::<Vec<_>>().join("\n");
        }
        let unit = if node.unit.is_empty() { String::new() } else { format!(" [{}]", node.unit) };
        let help = text::first_sentence(node.help);
        let help = if help.is_empty() { help } else { format!(": {help}") };
        match &node.kind {
            Kind::Input | Kind::Output | Kind::Delay | Kind::Call { .. } => format!("{}{unit}{help}", node.name),
            _ => {
                let result = node.outputs.first().and_then(|port| port.numbers.first());
                result.map_or(String::new(), |id| self.signals(*id))
            }
        }
    }

    /// The formula of a signal by what enters the element.
    fn signals(&self, result: Id) -> String {
        let known = |id: Id| {
            self.element.inputs.iter().find_map(|entry| match entry {
                Entry::Wire(from, _) if self.page.nodes[from.node].outputs[from.port].numbers.contains(&id) => {
                    let name = name(self.page, *from);
                    Some(if name.is_empty() { format!("u{}", id.0) } else { name })
                }
                _ => None,
            })
        };
        super::formula(self.page.step, result, &known)
    }
}

/// `CurrentControl` as words.
fn words(name: &str) -> String {
    let mut out = String::new();
    let mut before = 'A';
    for c in name.chars() {
        if c.is_uppercase() && before.is_lowercase() {
            out.push(' ');
        }
        out.push(c);
        before = c;
    }
    out
}
