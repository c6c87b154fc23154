//! Drawing of the blocks in the usual symbols.

use std::fmt::Write as _;

use super::{class, name, pixel};
use crate::diagram::picture::{Element, Entry, function_formula, function_names, port_name, short_name};
use crate::diagram::{Kind, Node, Page, text};

/// Draws one element in its own coordinates.
pub(super) struct Pen<'a> {
    pub(super) out: &'a mut String,
    pub(super) page: &'a Page<'a>,
    pub(super) element: &'a Element,
}

impl Pen<'_> {
    pub(super) fn draw(&mut self) {
        let Element { nodes, margin, shape, label, .. } = self.element;
        let node = &self.page.nodes[nodes[0]];
        let (left, right) = (*margin, shape.width);
        let middle = (left + right) / 2.0;
        put!(self.out, "<title>{}</title>", text::escape(&self.tooltip()));
        if nodes.len() > 1 {
            return self.function();
        }
        match &node.kind {
            Kind::Input | Kind::Output => {
                self.rect("port", left, right, shape.height, shape.height.min(26.0) / 2.0);
                let y = shape.height / 2.0 + 4.0;
                self.text(label, left + 13.0, y, "start", "");
                self.text(&text::unit(node.unit), right - 12.0, y, "end", "quiet");
            }
            Kind::Delay => self.delay(),
            Kind::Sum(signs) if signs.len() <= 3 => return self.sum(signs),
            Kind::Sum(_) | Kind::Product(_) => {
                self.rect("box", left, right, shape.height, 2.0);
                let signs = matches!(node.kind, Kind::Sum(_))
                    || matches!(&node.kind, Kind::Product(over) if over.contains(&true));
                self.text(label, middle + if signs { 4.0 } else { 0.0 }, shape.height / 2.0 + 5.0, "middle", "");
                self.signs(&node.kind);
            }
            Kind::Gain(_) => self.gain(),
            Kind::Saturation { .. } => return self.saturation(),
            Kind::Sign => self.sign(),
            Kind::Switch => self.switch(),
            Kind::Call { .. } => self.call(node),
            _ => {
                self.rect("box", left, right, shape.height, 2.0);
                self.text(label, middle, shape.height / 2.0 + 4.0, "middle", "");
            }
        }
        self.entries(left);
    }

    /// Several nodes as one function.
    fn function(&mut self) {
        let Element { margin, shape, label, .. } = self.element;
        let (left, right) = (*margin, shape.width);
        let middle = (left + right) / 2.0;
        self.rect("box", left, right, shape.height, 4.0);
        if self.element.is_formula() && self.element.inputs.len() == 1 {
            self.text(label, middle, shape.height / 2.0 + 4.0, "middle", "");
            return self.entries(left);
        }
        self.text(label, middle, 18.0, "middle", "");
        let inside = function_names(self.page, &self.element.inputs);
        let outside = self.element.outputs.iter().map(|end| short_name(self.page, *end));
        for (name, y) in inside.iter().zip(&self.element.rows) {
            self.text(name, left + 11.0, y + 4.0, "start", "what");
        }
        for (name, y) in outside.zip(&shape.outputs) {
            self.text(&name, right - 8.0, y + 4.0, "end", "what");
        }
        self.entries(left);
    }

    /// A delay of one step.
    fn delay(&mut self) {
        let Element { margin, shape, label, .. } = self.element;
        let (left, right) = (*margin, shape.width);
        let middle = (left + right) / 2.0;
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

    /// A gain.
    fn gain(&mut self) {
        let Element { margin, shape, label, .. } = self.element;
        let (left, right) = (*margin, shape.width);
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

    /// A saturation.
    fn saturation(&mut self) {
        let Element { margin, shape, label, .. } = self.element;
        let (left, right) = (*margin, shape.width);
        let middle = (left + right) / 2.0;
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
        self.entries(low.max(left));
    }

    /// The sign of a number.
    fn sign(&mut self) {
        let Element { margin, shape, .. } = self.element;
        let (left, right) = (*margin, shape.width);
        let middle = (left + right) / 2.0;
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

    /// A switch.
    fn switch(&mut self) {
        let Element { margin, shape, .. } = self.element;
        let (left, right) = (*margin, shape.width);
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

    /// Arrow heads at the body, and texts in place of wires.
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

    /// Sign of a term or factor, at its port.
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
            text::escape(&self.element.label)
        );
        // Name of its parameters, unless equal to the label.
        if self.element.label.to_lowercase() != node.name.replace('_', " ") {
            self.text(&node.name, (margin + shape.width) / 2.0, 35.0, "middle", "quiet");
        }
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
                format!("{} = {}", name(self.page, *end), function_formula(self.page, &self.element.inputs, result))
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
                result.map_or(String::new(), |id| function_formula(self.page, &self.element.inputs, *id))
            }
        }
    }
}
