//! Assignment of boxes to layers.

use super::{Column, Link, Shape};
use crate::distinct::distinct;

/// The layer of each box, and whether each link goes back.
pub(super) fn ranks(shapes: &[Shape], links: &[Link]) -> (Vec<usize>, Vec<bool>) {
    let back = back(shapes, links);
    let ahead: Vec<Link> = links.iter().zip(&back).filter(|(_, back)| !**back).map(|(link, _)| *link).collect();
    let mut ranks = vec![0usize; shapes.len()];
    // Longest path: as many passes as the longest path has links.
    while ahead.iter().fold(false, |changed, link| {
        let next_rank = ranks[link.from.0] + 1;
        let late = ranks[link.to.0] < next_rank;
        if late {
            ranks[link.to.0] = next_rank;
        }
        changed || late
    }) {}
    let last = ranks.iter().max().copied().unwrap_or(0);
    for (rank, shape) in ranks.iter_mut().zip(shapes) {
        if shape.column == Column::Last {
            *rank = last;
        }
    }
    // Boxes with fewer wires in than out are placed close to their readers.
    while (0..shapes.len()).fold(false, |changed, node| {
        let to: Vec<&Link> = ahead.iter().filter(|link| link.from.0 == node).collect();
        let ports = distinct(to.iter().map(|link| link.from.1)).len();
        let into = ahead.iter().filter(|link| link.to.0 == node).count();
        let close = to.iter().map(|link| ranks[link.to.0] - 1).min().unwrap_or(ranks[node]);
        let movable = shapes[node].column != Column::First && shapes[node].column != Column::Last;
        let moves = movable && ports > into && close > ranks[node];
        if moves {
            ranks[node] = close;
        }
        changed || moves
    }) {}
    let first = ranks.iter().min().copied().unwrap_or(0);
    (ranks.iter().map(|rank| rank - first).collect(), back)
}

/// Links into delays that would close a loop.
fn back(shapes: &[Shape], links: &[Link]) -> Vec<bool> {
    let mut next: Vec<Vec<usize>> = vec![Vec::new(); shapes.len()];
    let is_free = |link: &Link| shapes[link.to.0].column == Column::Delay;
    links.iter().filter(|link| !is_free(link)).for_each(|link| next[link.from.0].push(link.to.0));
    let mut out = vec![false; links.len()];
    for (number, link) in links.iter().enumerate().filter(|(_, link)| is_free(link)) {
        let (mut visited, mut open) = (vec![false; shapes.len()], vec![link.to.0]);
        while let Some(node) = open.pop() {
            if !std::mem::replace(&mut visited[node], true) {
                open.extend(&next[node]);
            }
        }
        out[number] = visited[link.from.0];
        if !out[number] {
            next[link.from.0].push(link.to.0);
        }
    }
    out
}
