//! The height of each item: the order is kept, and the sum of all bends is small.

use super::{Item, Layers};

const SWEEPS: usize = 120;
/// Largest offset \[px\] at which a wire is made straight.
const NEARLY: f64 = 16.0;

/// Least distance between the edges of two neighbours in a layer.
fn gap(a: &Item, b: &Item) -> f64 {
    match (a.passage, b.passage) {
        (true, true) => 14.0,
        (false, false) => 30.0,
        _ => 22.0,
    }
}

/// Sets the heights.
pub(super) fn place(layers: &mut Layers) {
    for layer in 0..layers.layers.len() {
        separate(layers, layer);
    }
    // Each layer in turn gets the heights that are best for the present heights of its neighbours. A weight by the
    // inverse of the bend makes the sum of the magnitudes small rather than of the squares: few bends instead of many
    // small ones.
    for sweep in 0..SWEEPS {
        let depth = layers.layers.len();
        for step in 0..depth {
            let layer = if sweep.is_multiple_of(2) { step } else { depth - 1 - step };
            let targets: Vec<(f64, f64)> = layers.layers[layer].iter().map(|item| target(layers, *item)).collect();
            settle(layers, layer, &targets);
        }
    }
    layers.items.iter_mut().for_each(|item| item.y = item.y.round());
    for layer in 0..layers.layers.len() {
        separate(layers, layer);
    }
    straighten(layers);
}

/// The height that is best for an item's edges, and its weight.
fn target(layers: &Layers, item: usize) -> (f64, f64) {
    let (mut sum, mut total) = (0.0, 1e-6);
    let own = layers.items[item].y;
    for edge in &layers.edges {
        for (side, other) in [(0, 1), (1, 0)] {
            if edge.items[side] != item || edge.items[other] == item {
                continue;
            }
            let neighbour = &layers.items[edge.items[other]];
            let passages = [item, edge.items[other]].iter().filter(|item| layers.items[**item].passage).count();
            let importance = [1.0, 2.0, 6.0][passages];
            let best = neighbour.y + edge.offsets[other] - edge.offsets[side];
            // Within the same layer the weight is that of a near neighbour.
            let near = if neighbour.layer == layers.items[item].layer { 0.2 } else { 1.0 };
            let weight = near * importance / (best - own).abs().max(1.0);
            sum += weight * best;
            total += weight;
        }
    }
    if total > 1e-5 { (sum / total, total) } else { (own, 1e-3) }
}

/// The heights of a layer nearest to the targets, with minimum distances: an isotonic regression, solved by pooling.
fn settle(layers: &mut Layers, layer: usize, targets: &[(f64, f64)]) {
    let items = layers.layers[layer].clone();
    // Heights above those of the tightest packing must not fall from one item to the next.
    let mut packed = Vec::with_capacity(items.len());
    for (place, item) in items.iter().enumerate() {
        let above = place.checked_sub(1).map_or(0.0, |before| {
            let [a, b] = [items[before], *item].map(|item| &layers.items[item]);
            packed[before] + a.height + gap(a, b)
        });
        packed.push(above);
    }
    let mut pools: Vec<(f64, f64, usize)> = Vec::new();
    for (place, (target, weight)) in targets.iter().enumerate() {
        pools.push((target - packed[place], *weight, 1));
        while let [.., (a, a_weight, a_count), (b, b_weight, b_count)] = pools[..]
            && a > b
        {
            pools.truncate(pools.len() - 2);
            let weight = a_weight + b_weight;
            pools.push(((a * a_weight + b * b_weight) / weight, weight, a_count + b_count));
        }
    }
    let free = pools.into_iter().flat_map(|(height, _, count)| std::iter::repeat_n(height, count));
    for ((item, packed), free) in items.iter().zip(packed).zip(free) {
        layers.items[*item].y = packed + free;
    }
}

/// Moves items down that are too close.
pub(super) fn separate(layers: &mut Layers, layer: usize) {
    for pair in layers.layers[layer].clone().windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|item| &layers.items[item]);
        let least = a.y + a.height + gap(a, b);
        layers.items[pair[1]].y = layers.items[pair[1]].y.max(least);
    }
}

/// Removes small steps from the wires: items connected by straight wires move together, if there is room.
fn straighten(layers: &mut Layers) {
    loop {
        let mut bends: Vec<(f64, usize, usize)> = Vec::new();
        for edge in &layers.edges {
            let [a, b] = edge.items;
            let step = layers.items[b].y + edge.offsets[1] - layers.items[a].y - edge.offsets[0];
            if layers.items[a].layer != layers.items[b].layer && step != 0.0 && step.abs() < NEARLY {
                bends.extend([(step, a, b), (-step, b, a)]);
            }
        }
        bends.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let candidate = bends.into_iter().find_map(|(step, from, other)| {
            let together = together(layers, from);
            (!together[other] && has_room(layers, &together, step)).then_some((together, step))
        });
        let Some((together, step)) = candidate else { return };
        let items = layers.items.iter_mut().zip(together);
        items.filter(|(_, moves)| *moves).for_each(|(item, _)| item.y += step);
    }
}

/// The items connected to an item by straight wires.
fn together(layers: &Layers, item: usize) -> Vec<bool> {
    let mut out = vec![false; layers.items.len()];
    let mut open = vec![item];
    while let Some(next) = open.pop() {
        if std::mem::replace(&mut out[next], true) {
            continue;
        }
        for edge in layers.edges.iter().filter(|edge| edge.items.contains(&next)) {
            let [a, b] = edge.items.map(|item| &layers.items[item]);
            if a.layer != b.layer && a.y + edge.offsets[0] == b.y + edge.offsets[1] {
                open.extend(edge.items);
            }
        }
    }
    out
}

/// Whether the items keep their distances, or two thirds of them, when they move by a step.
fn has_room(layers: &Layers, moving: &[bool], step: f64) -> bool {
    layers.layers.iter().flat_map(|layer| layer.windows(2)).all(|pair| {
        let by = [pair[0], pair[1]].map(|item| if moving[item] { step } else { 0.0 });
        let [a, b] = [pair[0], pair[1]].map(|item| &layers.items[item]);
        by[0] == by[1] || b.y + by[1] - (a.y + a.height + by[0]) >= (gap(a, b) / 1.5).ceil()
    })
}
