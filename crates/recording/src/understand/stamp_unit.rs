//! Units that time stamps can have, by their size and step.

use super::quantile;

/// What the numbers of a time column can be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StampUnit {
    /// Only one unit is possible.
    Certain(&'static str),
    /// Units that give a sampling rate of 10 Hz to 100 kHz; empty if there is none.
    Possible(Vec<&'static str>),
    /// The numbers count rows: 0, 1, 2, …
    RowNumber,
}

/// Sizes of absolute stamps from the year 2000 to 2060: lower end, upper end, unit, steps of at most [s].
const ABSOLUTE: [(f64, f64, &str, f64); 7] = [
    // Ticks of 100 ns since 1601: FILETIME, TwinCAT.
    (1.26e17, 1.45e17, "100 ns", 1e-7),
    // Since 1970.
    (9.46e17, 2.85e18, "ns", 1e-9),
    (9.46e14, 2.85e15, "us", 1e-6),
    (9.46e11, 2.85e12, "ms", 1e-3),
    (9.46e8, 2.85e9, "s", 1.0),
    // Since 1904: LabVIEW.
    (3.02e9, 4.93e9, "s", 1.0),
    // Since the year 0: MATLAB's datenum.
    (730_485.0, 752_500.0, "d", 86400.0),
];
/// Units of relative stamps and of days since 1900, with their factor to seconds.
const RELATIVE: [(&str, f64); 6] =
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("100 ns", 1e-7), ("ns", 1e-9), ("d", 86400.0)];
/// Range of sampling periods of a drive, with room for clocks that differ [s].
const PERIODS: [f64; 2] = [0.9e-5, 0.11];

/// The units that stamps can have. `origin` is added to all values.
pub fn stamp_unit(origin: f64, values: &[f64]) -> StampUnit {
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let counts_rows =
        steps.iter().all(|step| *step == 1.0) && matches!(values.first(), Some(0.0 | 1.0)) && origin == 0.0;
    if counts_rows {
        return StampUnit::RowNumber;
    }
    // The mean of the positive steps: stamps may be repeated or fall back.
    let rising: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    let longest = quantile(rising.clone(), 0.5);
    let mean = {
        let most = 100.0 * longest;
        rising.iter().filter(|step| **step <= most).sum::<f64>() / steps.len().max(1) as f64
    };
    let plausible = |seconds: f64| (PERIODS[0]..=PERIODS[1]).contains(&(mean * seconds));
    let first = origin + values.first().copied().unwrap_or(0.0);
    let absolute =
        ABSOLUTE.iter().find(|(low, high, _, seconds)| (*low..=*high).contains(&first) && plausible(*seconds));
    if let Some((_, _, unit, _)) = absolute {
        return StampUnit::Certain(unit);
    }
    let possible: Vec<&str> =
        RELATIVE.iter().filter(|(_, seconds)| plausible(*seconds)).map(|(unit, _)| *unit).collect();
    // Ticks of 100 ns and days are as rare as relative stamps as their names: only where nothing else fits.
    let usual: Vec<&str> = possible.iter().copied().filter(|unit| !["100 ns", "d"].contains(unit)).collect();
    StampUnit::Possible(if usual.is_empty() { possible } else { usual })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(origin: f64, step: f64) -> StampUnit {
        let values: Vec<f64> = (0..100).map(|i| step * f64::from(i)).collect();
        stamp_unit(origin, &values)
    }

    #[test]
    fn absolute_stamps_have_one_unit() {
        for (origin, step, expected) in [
            (133_546_915_600_040_000.0, 1e4, "100 ns"),
            (1_709_632_360_004_000_000.0, 250_000.0, "ns"),
            (1_709_632_360_004_000.0, 250.0, "us"),
            (1_709_632_360_004.0, 1.0, "ms"),
            (1_709_632_360.0, 1e-3, "s"),
            (3_790_000_000.0, 1e-3, "s"),
            (739_000.5, 1e-3 / 86400.0, "d"),
        ] {
            assert_eq!(unit(origin, step), StampUnit::Certain(expected), "{origin}");
        }
    }

    #[test]
    fn relative_stamps_are_judged_by_the_sampling_rate() {
        for (step, expected) in [
            (1e-3, &["s"][..]),
            (0.25, &["ms"]),
            (250.0, &["us"]),
            (250_000.0, &["ns"]),
            // 10 ms or 10 µs.
            (10.0, &["ms", "us"]),
            (1e-12, &[]),
        ] {
            assert_eq!(unit(0.0, step), StampUnit::Possible(expected.to_vec()), "{step}");
        }
        // 43,200.001 s is a time of day.
        assert_eq!(unit(43_200.0, 1e-3), StampUnit::Possible(vec!["s"]));
    }

    #[test]
    fn a_row_number_is_recognised() {
        assert_eq!(unit(0.0, 1.0), StampUnit::RowNumber);
        // From 17 on it may be milliseconds.
        assert_eq!(stamp_unit(0.0, &[17.0, 18.0, 19.0]), StampUnit::Possible(vec!["ms"]));
    }

    #[test]
    fn repeated_stamps_and_one_that_falls_back_change_nothing() {
        let rounded: Vec<f64> = (0..400).map(|i| f64::from(i / 4) * 1e-3).collect();
        assert_eq!(stamp_unit(0.0, &rounded), StampUnit::Possible(vec!["s"]));
        let wraps: Vec<f64> =
            (0..400).map(|i| f64::from(i) * 1000.0 + if i < 200 { 4.29e9 } else { -200_000.0 }).collect();
        assert_eq!(stamp_unit(0.0, &wraps), StampUnit::Possible(vec!["us"]));
    }
}
