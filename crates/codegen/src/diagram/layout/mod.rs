//! Positions of boxes and wires: in layers from left to right (Sugiyama), wires at right angles.
//!
//! Layers by longest path, with the wires that close a loop going back; order within a layer by barycentres; heights by
//! the least sum of bends, so that most wires are straight; then each channel between two layers is routed separately.
//! Existing libraries place boxes, but have no ports and route no wires.

mod order;
mod place;
mod rank;
mod route;

/// A box to be placed.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) width: f64,
    pub(super) height: f64,
    /// Heights of the ports on its left below its upper edge.
    pub(super) inputs: Vec<f64>,
    /// The same on its right.
    pub(super) outputs: Vec<f64>,
    pub(super) column: Column,
}

/// Allowed layers of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// Leftmost.
    First,
    /// Anywhere.
    Free,
    /// A delay: anywhere, and wires may come back to it.
    Delay,
    /// Rightmost.
    Last,
}

/// A wire to be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// Box and output.
    pub from: (usize, usize),
    /// Box and input.
    pub to: (usize, usize),
}

/// Positions of all elements \[px\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Left, upper, right and lower edge of each box.
    pub boxes: Vec<[f64; 4]>,
    /// Ports of each box: its inputs, its outputs.
    pub ports: Vec<[Vec<[f64; 2]>; 2]>,
    /// The links of the wires.
    pub links: Vec<Link>,
    /// Pieces of wires, horizontal or vertical; they touch others of the same wire at their ends only.
    pub segments: Vec<Segment>,
    /// Width and height.
    pub size: [f64; 2],
}

/// A straight piece of a wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Box and output at the start of the wire.
    pub wire: (usize, usize),
    /// One end.
    pub from: [f64; 2],
    /// The other.
    pub to: [f64; 2],
}

/// A box, or the passage of a wire through a layer.
struct Item {
    layer: usize,
    width: f64,
    height: f64,
    y: f64,
    passage: bool,
}

/// A wire between two items, at a height below each one's upper edge.
struct Edge {
    items: [usize; 2],
    offsets: [f64; 2],
}

/// Point where a wire enters the channel on the left of a layer.
#[derive(Clone, Copy, PartialEq)]
struct Pin {
    wire: (usize, usize),
    item: usize,
    offset: f64,
    /// Whether the item is on the left of the channel.
    left: bool,
}

/// Items in layers, edges between them.
#[derive(Default)]
struct Layers {
    items: Vec<Item>,
    /// The items of each layer, from top to bottom.
    layers: Vec<Vec<usize>>,
    edges: Vec<Edge>,
    /// The pins of each channel; channel `i` is left of layer `i`.
    channels: Vec<Vec<Pin>>,
}

/// Places boxes and wires.
pub(super) fn layout(shapes: &[Shape], links: &[Link]) -> Layout {
    let (ranks, back) = rank::ranks(shapes, links);
    let mut layers = Layers::of(shapes, links, &ranks, &back);
    order::order(&mut layers);
    place::place(&mut layers);
    Layout { links: links.to_vec(), ..route::route(&mut layers, shapes) }
}

impl Layers {
    fn of(shapes: &[Shape], links: &[Link], ranks: &[usize], back: &[bool]) -> Layers {
        let depth = ranks.iter().max().map_or(0, |last| last + 1);
        let mut out =
            Layers { layers: vec![Vec::new(); depth], channels: vec![Vec::new(); depth + 1], ..Layers::default() };
        for (shape, layer) in shapes.iter().zip(ranks) {
            out.item(*layer, shape.width, shape.height, false);
        }
        let mut wires: Vec<(usize, usize)> = links.iter().map(|link| link.from).collect();
        wires.sort_unstable();
        wires.dedup();
        for wire in wires {
            let of = |going_back: bool| {
                let selected = move |(link, back): &(&Link, &bool)| link.from == wire && **back == going_back;
                links.iter().zip(back).filter(selected).map(|(link, _)| link.to).collect::<Vec<_>>()
            };
            let source = (wire.0, shapes[wire.0].outputs[wire.1]);
            let target = |(node, port): (usize, usize)| (node, shapes[node].inputs[port]);
            out.forward(wire, source, &of(false).into_iter().map(target).collect::<Vec<_>>());
            out.backward(wire, source, &of(true).into_iter().map(target).collect::<Vec<_>>());
        }
        out
    }

    fn item(&mut self, layer: usize, width: f64, height: f64, passage: bool) -> usize {
        self.items.push(Item { layer, width, height, y: 0.0, passage });
        self.layers[layer].push(self.items.len() - 1);
        self.items.len() - 1
    }

    fn pin(&mut self, channel: usize, wire: (usize, usize), (item, offset): (usize, f64), left: bool) {
        let pin = Pin { wire, item, offset, left };
        if !self.channels[channel].contains(&pin) {
            self.channels[channel].push(pin);
        }
    }

    fn edge(&mut self, a: (usize, f64), b: (usize, f64)) {
        self.edges.push(Edge { items: [a.0, b.0], offsets: [a.1, b.1] });
    }

    fn forward(&mut self, wire: (usize, usize), source: (usize, f64), targets: &[(usize, f64)]) {
        let Some(last) = targets.iter().map(|target| self.items[target.0].layer).max() else { return };
        let mut from = source;
        for layer in self.items[source.0].layer + 1..=last {
            self.pin(layer, wire, from, true);
            for target in
                targets.iter().filter(|target| self.items[target.0].layer == layer).copied().collect::<Vec<_>>()
            {
                self.pin(layer, wire, target, false);
                self.edge(from, target);
            }
            if layer < last {
                let passage = (self.item(layer, 0.0, 0.0, true), 0.0);
                self.pin(layer, wire, passage, false);
                self.edge(from, passage);
                from = passage;
            }
        }
    }

    /// Out on the right of the source, back through passages, and in on the left of the targets.
    fn backward(&mut self, wire: (usize, usize), source: (usize, f64), targets: &[(usize, f64)]) {
        let Some(first) = targets.iter().map(|target| self.items[target.0].layer).min() else { return };
        let mut layer = self.items[source.0].layer;
        let mut passage = (self.item(layer, 0.0, 0.0, true), 0.0);
        self.pin(layer + 1, wire, source, true);
        self.pin(layer + 1, wire, passage, true);
        self.edge(source, passage);
        loop {
            self.pin(layer, wire, passage, false);
            for target in
                targets.iter().filter(|target| self.items[target.0].layer == layer).copied().collect::<Vec<_>>()
            {
                self.pin(layer, wire, target, false);
                self.edge(passage, target);
            }
            if layer == first {
                return;
            }
            layer -= 1;
            let next = (self.item(layer, 0.0, 0.0, true), 0.0);
            self.pin(layer + 1, wire, next, true);
            self.edge(passage, next);
            passage = next;
        }
    }
}
