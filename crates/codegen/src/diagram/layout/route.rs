//! The wires in the channels between the layers.

use super::place::separate;
use super::{Layers, Layout, Pin, Segment, Shape};

/// Distance of wires that run side by side \[px\].
const PITCH: f64 = 10.0;
/// Room for an arrow head.
const ARROW: f64 = 16.0;
/// Horizontal pieces closer than this would look like one wire.
const SAME: f64 = 5.0;
/// Cost of an overlap of two wires, in crossings.
const OVERLAP: usize = 1000;
const REPAIRS: usize = 24;

/// The part of a wire in one channel.
struct Bundle {
    wire: (usize, usize),
    /// Heights of its pins on the left, on the right.
    sides: [Vec<f64>; 2],
    /// Its vertical line; `None` if it is straight.
    track: Option<usize>,
}

impl Bundle {
    fn ends(&self) -> (f64, f64) {
        let all = || self.sides.iter().flatten();
        (all().copied().fold(f64::INFINITY, f64::min), all().copied().fold(f64::NEG_INFINITY, f64::max))
    }

    /// Cost if this vertical line is left of the other's: crossings and overlaps.
    fn cost_left_of(&self, other: &Bundle) -> usize {
        let within = |(low, high): (f64, f64), y: &&f64| **y > low - SAME && **y < high + SAME;
        // The right ends of this one cross the other's vertical line, the left ends of the other cross this one's.
        let crossings = self.sides[1].iter().filter(|y| within(other.ends(), y)).count()
            + other.sides[0].iter().filter(|y| within(self.ends(), y)).count();
        let same = |y: &f64| other.sides[0].iter().any(|other| (other - y).abs() < SAME);
        crossings + OVERLAP * self.sides[1].iter().filter(|y| same(y)).count()
    }
}

/// Routes all channels and computes all positions.
pub(super) fn route(layers: &mut Layers, shapes: &[Shape]) -> Layout {
    let depth = layers.layers.len();
    let mut channels = Vec::new();
    for channel in 0..=depth {
        let mut bundles = routed(layers, channel);
        for _ in 0..REPAIRS {
            // If two wires would overlap at the same height, one of them moves down a little.
            let Some((wire, y)) = overlap(&bundles) else { break };
            let overlaps = |pin: &&Pin| pin.wire == wire && !pin.left && layers.items[pin.item].y + pin.offset == y;
            let Some(pin) = layers.channels[channel].iter().find(overlaps) else { break };
            layers.items[pin.item].y += SAME + 1.0;
            separate(layers, channel);
            bundles = routed(layers, channel);
        }
        channels.push(bundles);
    }
    let top = layers.items.iter().map(|item| item.y).fold(f64::INFINITY, f64::min);
    if top.is_finite() {
        layers.items.iter_mut().for_each(|item| item.y -= top);
        channels.iter_mut().flatten().flat_map(|b| &mut b.sides).flatten().for_each(|y| *y -= top);
    }

    let mut out = Layout { boxes: vec![[0.0; 4]; shapes.len()], ..Layout::default() };
    let mut left = vec![0.0; layers.items.len()];
    let mut x = 0.0;
    for (channel, bundles) in channels.iter().enumerate() {
        let tracks = bundles.iter().filter_map(|b| b.track).max().map_or(0, |last| last + 1);
        let begin = x;
        let outside = channel == 0 || channel == depth;
        x += if tracks == 0 && outside { 0.0 } else { PITCH * (tracks.max(1) as f64 + 0.5) + ARROW };
        let column = layers.layers.get(channel).map_or(&[][..], Vec::as_slice);
        let width = column.iter().map(|item| layers.items[*item].width).fold(0.0, f64::max);
        for item in column {
            left[*item] =
                if layers.items[*item].passage { x } else { x + ((width - layers.items[*item].width) / 2.0).round() };
            if layers.items[*item].passage {
                layers.items[*item].width = width;
            }
        }
        for bundle in bundles {
            let pins = layers.channels[channel].iter().filter(|pin| pin.wire == bundle.wire);
            let end = |pin: &Pin| {
                let item = &layers.items[pin.item];
                [left[pin.item] + if pin.left { item.width } else { 0.0 }, item.y + pin.offset]
            };
            let ends: Vec<[f64; 2]> = pins.map(end).collect();
            draw(&mut out.segments, bundle, &ends, begin + PITCH);
        }
        for item in column.iter().filter(|item| layers.items[**item].passage && width > 0.0) {
            let y = layers.items[*item].y;
            let wire = layers.channels.iter().flatten().find(|pin| pin.item == *item).map(|pin| pin.wire);
            let wire = wire.expect("a passage was made for a wire");
            out.segments.push(Segment { wire, from: [x, y], to: [x + width, y] });
        }
        x += width;
    }
    for (number, shape) in shapes.iter().enumerate() {
        let (x, y) = (left[number], layers.items[number].y);
        out.boxes[number] = [x, y, x + shape.width, y + shape.height];
        let at = |x: f64, offsets: &[f64]| offsets.iter().map(|offset| [x, y + offset]).collect();
        out.ports.push([at(x, &shape.inputs), at(x + shape.width, &shape.outputs)]);
    }
    let edge = |side: usize| {
        let boxes = out.boxes.iter().map(move |b| b[2 + side]);
        boxes.chain(out.segments.iter().map(move |s| s.to[side].max(s.from[side]))).fold(0.0, f64::max)
    };
    out.size = [edge(0), edge(1)];
    out
}

/// The wires of a channel on their vertical lines.
fn routed(layers: &Layers, channel: usize) -> Vec<Bundle> {
    let mut bundles: Vec<Bundle> = Vec::new();
    for pin in &layers.channels[channel] {
        let y = layers.items[pin.item].y + pin.offset;
        let number = bundles.iter().position(|bundle| bundle.wire == pin.wire).unwrap_or_else(|| {
            bundles.push(Bundle { wire: pin.wire, sides: [Vec::new(), Vec::new()], track: None });
            bundles.len() - 1
        });
        bundles[number].sides[usize::from(!pin.left)].push(y);
    }
    let mut order: Vec<usize> = (0..bundles.len()).filter(|b| bundles[*b].ends().0 < bundles[*b].ends().1).collect();
    let costs: Vec<Vec<usize>> = bundles.iter().map(|a| bundles.iter().map(|b| a.cost_left_of(b)).collect()).collect();
    // At first, downward wires are on the right, upward ones on the left; then wires move to the left while the cost
    // decreases. A move changes the cost of the pairs with the moved wire only.
    loop {
        let mut better = false;
        for i in 0..order.len() {
            for j in i + 1..order.len() {
                let (passed, moved) = (&order[i..j], order[j]);
                let now: usize = passed.iter().map(|other| costs[*other][moved]).sum();
                let then: usize = passed.iter().map(|other| costs[moved][*other]).sum();
                if then < now {
                    order[i..=j].rotate_right(1);
                    better = true;
                }
            }
        }
        if !better {
            break;
        }
    }
    for place in 0..order.len() {
        let (low, high) = bundles[order[place]].ends();
        let own = &bundles[order[place]];
        let before = order[..place].iter().filter(|other| {
            let (other_low, other_high) = bundles[**other].ends();
            low < other_high + PITCH && other_low < high + PITCH || own.cost_left_of(&bundles[**other]) >= OVERLAP
        });
        let track = before.filter_map(|other| bundles[*other].track).max().map_or(0, |track| track + 1);
        bundles[order[place]].track = Some(track);
    }
    bundles
}

/// A wire that overlaps another one, and its height.
fn overlap(bundles: &[Bundle]) -> Option<((usize, usize), f64)> {
    let pairs = bundles.iter().flat_map(|a| bundles.iter().map(move |b| (a, b)));
    let crossed = |(a, b): &(&Bundle, &Bundle)| a.wire != b.wire && a.track.is_some() && a.track <= b.track;
    pairs.filter(crossed).find_map(|(a, b)| {
        let same = |y: &&f64| b.sides[0].iter().any(|other| (other - **y).abs() < SAME);
        a.sides[1].iter().find(same).map(|y| (a.wire, *y))
    })
}

/// The pieces of a wire in a channel; the vertical one is cut where horizontal ones meet it.
fn draw(segments: &mut Vec<Segment>, bundle: &Bundle, ends: &[[f64; 2]], begin: f64) {
    let wire = bundle.wire;
    let mut add = |from: [f64; 2], to: [f64; 2]| {
        if from != to {
            segments.push(Segment { wire, from, to });
        }
    };
    let Some(track) = bundle.track else {
        let from = ends.iter().copied().reduce(|a, b| if a[0] < b[0] { a } else { b });
        let to = ends.iter().copied().reduce(|a, b| if a[0] > b[0] { a } else { b });
        if let (Some(from), Some(to)) = (from, to) {
            add(from, to);
        }
        return;
    };
    let x = begin + PITCH * track as f64;
    ends.iter().for_each(|end| add(*end, [x, end[1]]));
    let mut heights: Vec<f64> = ends.iter().map(|end| end[1]).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    heights.windows(2).for_each(|pair| add([x, pair[0]], [x, pair[1]]));
}
