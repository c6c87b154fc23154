//! The order within the layers, with few crossings.

use super::Layers;

const SWEEPS: usize = 32;

/// Orders each layer by the barycentres of its neighbours, in alternating directions; keeps the best order.
pub(super) fn order(layers: &mut Layers) {
    let mut best = (crossings(layers), layers.layers.clone());
    let depth = layers.layers.len();
    for sweep in 0..SWEEPS {
        for step in 0..depth {
            let layer = if sweep.is_multiple_of(2) { step } else { depth - 1 - step };
            let places = places(layers);
            let mut keyed: Vec<(f64, usize)> =
                layers.layers[layer].iter().map(|item| (barycentre(layers, &places, *item, sweep), *item)).collect();
            keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
            layers.layers[layer] = keyed.into_iter().map(|(_, item)| item).collect();
        }
        let now = crossings(layers);
        if now < best.0 {
            best = (now, layers.layers.clone());
        }
    }
    layers.layers = best.1;
}

/// The place of each item in its layer.
fn places(layers: &Layers) -> Vec<f64> {
    let mut out = vec![0.0; layers.items.len()];
    for layer in &layers.layers {
        layer.iter().enumerate().for_each(|(place, item)| out[*item] = place as f64);
    }
    out
}

/// The end of an edge: the place of the item, and within it the height of the port.
fn end(layers: &Layers, places: &[f64], item: usize, offset: f64) -> f64 {
    places[item] + 0.9 * (offset / layers.items[item].height.max(1.0) - 0.5)
}

/// The mean place of the neighbours: on the left in even sweeps, on the right in odd ones, on both sides in the end.
fn barycentre(layers: &Layers, places: &[f64], item: usize, sweep: usize) -> f64 {
    let own = layers.items[item].layer;
    let (mut sum, mut count) = (0.0, 0.0);
    for edge in &layers.edges {
        for (side, other) in [(0, 1), (1, 0)] {
            let neighbour = edge.items[other];
            let layer = layers.items[neighbour].layer;
            let counts = layer == own || (layer < own) == sweep.is_multiple_of(2) || sweep + 8 > SWEEPS;
            if edge.items[side] == item && counts {
                // Layers differ in their number of items: compare by the share of the way down.
                let share = |layer: usize| (layers.layers[layer].len() as f64).max(1.0);
                sum += end(layers, places, neighbour, edge.offsets[other]) * share(own) / share(layer);
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { places[item] }
}

fn crossings(layers: &Layers) -> usize {
    let places = places(layers);
    let mut channels: Vec<Vec<(f64, f64)>> = vec![Vec::new(); layers.layers.len()];
    for edge in &layers.edges {
        let [a, b] = edge.items.map(|item| layers.items[item].layer);
        let ends = [0, 1].map(|side| end(layers, &places, edge.items[side], edge.offsets[side]));
        if a != b {
            channels[a.max(b)].push(if a < b { (ends[0], ends[1]) } else { (ends[1], ends[0]) });
        }
    }
    let count = |edges: &Vec<(f64, f64)>| {
        let crossing = |a: &(f64, f64), b: &(f64, f64)| (a.0 - b.0) * (a.1 - b.1) < 0.0;
        edges.iter().enumerate().map(|(i, a)| edges[..i].iter().filter(|b| crossing(a, b)).count()).sum::<usize>()
    };
    channels.iter().map(count).sum()
}
