//! Sobol's sequence: points that fill a cube evenly, computed by their number.
//!
//! I. M. Sobol (1967), with the direction numbers of Joe and Kuo (2008) and the order of Antonov and Saleev (1979), as
//! `scipy.stats.qmc.Sobol` has it without scrambling. No crate is used: `sobol` gives no point by its number, and
//! `sobol_burley` gives only scrambled points.

use std::sync::LazyLock;

/// Bits of a coordinate; there are 2^32 points.
const BITS: usize = 32;

/// Direction numbers of each dimension.
static DIRECTIONS: LazyLock<Vec<[u32; BITS]>> = LazyLock::new(|| {
    let rows = include_str!("joe_kuo.txt").lines().filter(|line| !line.starts_with('#'));
    let first = std::array::from_fn(|bit| 1 << (BITS - 1 - bit));
    std::iter::once(first).chain(rows.map(directions)).collect()
});

/// Direction numbers of a row: dimension, degree, coefficients, initial numbers.
fn directions(row: &str) -> [u32; BITS] {
    let numbers: Vec<u32> = row.split(' ').map(|word| word.parse().expect("the table holds numbers")).collect();
    let (degree, coefficients, initial) = (numbers[1] as usize, numbers[2], &numbers[3..]);
    let mut all = [0; BITS];
    for bit in 0..BITS {
        all[bit] = match bit.checked_sub(degree) {
            None => initial[bit] << (BITS - 1 - bit),
            Some(before) => {
                let start = all[before] ^ (all[before] >> degree);
                (1..degree)
                    .filter(|k| coefficients >> (degree - 1 - k) & 1 == 1)
                    .fold(start, |number, k| number ^ all[bit - k])
            }
        };
    }
    all
}

/// Number of dimensions.
pub(super) fn dimensions() -> usize {
    DIRECTIONS.len()
}

/// A coordinate of a point as an integer of 32 bits.
fn integer(index: u32, dimension: usize) -> u32 {
    let gray = index ^ (index >> 1);
    (0..BITS).filter(|bit| gray >> bit & 1 == 1).fold(0, |x, bit| x ^ DIRECTIONS[dimension][bit])
}

/// A coordinate of the point `index`, in the middle of its interval of 2^-32: never 0 and never 1, so that each
/// distribution has a value there.
pub(super) fn coordinate(index: u32, dimension: usize) -> f64 {
    (f64::from(integer(index, dimension)) + 0.5) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_are_those_of_scipy() {
        let rows = include_str!("../../../tests/reference/study/sobol.csv").lines();
        let mut count = 0;
        for row in rows {
            let numbers: Vec<u32> = row.split(',').map(|number| number.parse().unwrap()).collect();
            let ours: Vec<u32> = (0..dimensions()).map(|dimension| integer(numbers[0], dimension)).collect();
            assert_eq!(ours, numbers[1..], "point {}", numbers[0]);
            count += 1;
        }
        assert_eq!((count, dimensions()), (14, 64));
    }

    #[test]
    fn no_coordinate_is_at_an_end() {
        for index in [0, 1, 77, u32::MAX] {
            assert!((0..dimensions()).all(|d| coordinate(index, d) > 0.0 && coordinate(index, d) < 1.0));
        }
    }
}
