//! Reduction of values without visible change: values that share a pixel are omitted, spikes never.

use std::collections::BTreeSet;

/// The visible points of a cloud [px]: one for each pixel.
pub(super) fn points(places: &[[f64; 2]]) -> Vec<usize> {
    let mut pixels = BTreeSet::new();
    (0..places.len()).filter(|&index| pixels.insert(places[index].map(|pixel| pixel.round() as i64))).collect()
}

/// A continuous line [px] by its envelope: the first, the extreme and the last values of each column of pixels.
pub(super) fn line(places: &[[f64; 2]]) -> Vec<usize> {
    let mut begin = 0;
    let columns = places.chunk_by(|one, next| one[0].floor() == next[0].floor());
    columns
        .flat_map(|column| {
            let by_height = |&one: &usize, &other: &usize| column[one][1].total_cmp(&column[other][1]);
            let extremes = [(0..column.len()).min_by(by_height), (0..column.len()).max_by(by_height)];
            let indices: BTreeSet<usize> =
                [0, column.len() - 1].into_iter().chain(extremes.into_iter().flatten()).collect();
            let first = begin;
            begin += column.len();
            indices.into_iter().map(move |index| first + index)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_within_a_million_points_is_kept() {
        let value = |index: i32| [f64::from(index) * 7e-4, if index == 654_321 { 1.0 } else { 300.0 }];
        let signal: Vec<_> = (0..1_000_000).map(value).collect();
        for thin in [line(&signal), points(&signal)] {
            assert!(thin.contains(&654_321));
            assert!(thin.len() <= 4 * 701, "{} values", thin.len());
        }
    }

    #[test]
    fn a_line_keeps_its_ends_its_order_and_its_extremes() {
        let column = [[0.1, 5.0], [0.2, 9.0], [0.3, 7.0], [0.4, 1.0], [0.5, 6.0], [0.6, 4.0], [1.2, 3.0]];
        assert_eq!(line(&column), [0, 1, 3, 5, 6]);
    }

    #[test]
    fn few_values_stay_as_they_are() {
        let few = [[0.0, 1.0], [1.5, 3.0], [1.0, 2.0], [7.0, 2.0]];
        assert_eq!(line(&few), [0, 1, 2, 3]);
        assert_eq!(points(&few), [0, 1, 2, 3]);
        assert!(line(&[]).is_empty());
    }
}
