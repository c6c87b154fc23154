//! A reference that follows the position: two columns that are swapped, or one that is late.

/// Largest shift that is tried, in rows.
const FARTHEST: usize = 200;
/// Squared distance at the best shift, as a share of that without one.
const CLEARLY: f64 = 0.25;

/// Rows by which a reference comes after the position; `None` where it comes before it or the distance is as small
/// without a shift.
pub fn lag_of_reference(reference: &[f64], position: &[f64]) -> Option<usize> {
    let rows = reference.len().min(position.len());
    if rows < 4 * FARTHEST {
        return None;
    }
    let distance = |shift: isize| {
        let pairs = (FARTHEST..rows - FARTHEST).map(|row| reference[row.wrapping_add_signed(shift)] - position[row]);
        let (mut count, mut mean, mut square) = (0.0, 0.0, 0.0);
        for difference in pairs {
            count += 1.0;
            let step = difference - mean;
            mean += step / count;
            square += step * (difference - mean);
        }
        square
    };
    // Coarse steps first: the distance is a smooth function of the shift.
    let far = FARTHEST as isize;
    let best = |shifts: &mut dyn Iterator<Item = isize>| {
        shifts.map(|shift| (shift, distance(shift))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(shift, _)| shift)
    };
    let coarse = best(&mut (-far..=far).step_by(10));
    let fine = best(&mut ((coarse - 10).max(-far)..=(coarse + 10).min(far)));
    (fine > 1 && distance(fine) < CLEARLY * distance(0)).then_some(fine as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_behind_the_position_is_found_and_one_before_it_is_not() {
        let wave: Vec<f64> = (0..3000).map(|i| libm::sin(f64::from(i) * 0.01) + 1e-3 * f64::from(i % 7)).collect();
        let (late, early) = (&wave[..2980], &wave[20..]);
        assert_eq!(lag_of_reference(late, early), Some(20));
        assert_eq!(lag_of_reference(early, late), None);
        assert_eq!(lag_of_reference(&wave, &wave), None);
    }
}
