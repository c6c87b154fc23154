//! Means over seeds, with confidence intervals.

/// Number of bootstrap samples.
const DRAWS: usize = 2000;

/// Arithmetic mean.
pub fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// 95 % interval of a statistic over `count` seeds by the percentile bootstrap (Efron 1979). `statistic` gets the drawn
/// indices. The draws are the same in every run.
pub fn bootstrap(count: usize, statistic: impl Fn(&[usize]) -> f64) -> [f64; 2] {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut drawn = vec![0; count];
    let mut values: Vec<f64> = (0..DRAWS)
        .map(|_| {
            for index in &mut drawn {
                *index = (splitmix(&mut state) % count as u64) as usize;
            }
            statistic(&drawn)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    [values[DRAWS / 40], values[DRAWS - 1 - DRAWS / 40]]
}

/// Steele, Lea, Flood: Fast splittable pseudorandom number generators (OOPSLA 2014).
pub fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
