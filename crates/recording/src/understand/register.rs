//! Signed numbers in unsigned registers.

use super::Finding;

/// Numbers of values of usual registers.
const SIZES: [f64; 3] = [256.0, 65_536.0, 4_294_967_296.0];

/// Makes values from half of the register on negative. Without a stated size, a register is recognised by whole numbers
/// at both of its ends and none between.
pub fn signed(values: &mut [f64], wraps: Option<f64>) -> Option<Finding> {
    let size = wraps.or_else(|| SIZES.into_iter().find(|size| is_unsigned(values, *size)))?;
    let rows: Vec<_> = (0..values.len()).filter(|row| values[*row] >= 0.5 * size).collect();
    let first = *rows.first()?;
    for row in &rows {
        values[*row] -= size;
    }
    let text = format!(
        "The values are those of an unsigned register of {size} values: {} of them, from half of it on, are negative.",
        rows.len()
    );
    Some(Finding { text, rows: std::iter::once(first..first + 1).collect() })
}

fn is_unsigned(values: &[f64], size: f64) -> bool {
    let mut ends = [false; 2];
    for value in values {
        if value.fract() != 0.0 || !(0.0..size).contains(value) || (0.3 * size..0.7 * size).contains(value) {
            return false;
        }
        ends[usize::from(*value >= 0.5 * size)] = true;
    }
    let crosses = values.windows(2).any(|w| (w[1] - w[0]).abs() > 0.9 * size);
    ends == [true; 2] && crosses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_register_is_signed_where_its_size_is_stated_or_certain() {
        let true_values: Vec<f64> = (0..200).map(|i| (500.0 * libm::sin(f64::from(i) * 0.1)).round()).collect();
        for (size, stated) in
            [(65_536.0, None), (65_536.0, Some(65_536.0)), (4_294_967_296.0, None), (2048.0, Some(2048.0))]
        {
            let mut values: Vec<f64> = true_values.iter().map(|v| v.rem_euclid(size)).collect();
            let finding = signed(&mut values, stated).unwrap();
            assert_eq!(values, true_values);
            assert!(finding.text.contains("negative") && finding.rows.len() == 1);
        }
    }

    #[test]
    fn other_columns_stay_as_they_are() {
        for column in
            [vec![0.0, 30_000.0, 60_000.0, 65_535.0], vec![0.0, 1.5, 65_535.0], vec![-1.0, 65_535.0], vec![1.0, 2.0]]
        {
            let mut values = column.clone();
            assert!(signed(&mut values, None).is_none() && values == column);
        }
    }
}
