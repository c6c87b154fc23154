//! Axes of a study: the parameters that change, and their values.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF as _, Normal};

use super::design::Place;
use stickslip_base::parameters::change;
use stickslip_base::preset::Preset;

/// An axis of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Name of the column.
    pub name: String,
    /// Paths of the parameters that change together: of the machine (`plant`), of the model (`model`), or of both.
    pub paths: Vec<String>,
    /// Whether the values multiply the parameters instead of replacing them.
    pub factor: bool,
    /// SI unit of the values.
    pub unit: String,
    /// Distribution of the values.
    pub spread: Spread,
}

/// The values of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Spread {
    /// Listed values, equally likely.
    Values(Vec<f64>),
    /// A uniform distribution between two values.
    Range {
        /// Smallest.
        low: f64,
        /// Largest.
        high: f64,
        /// Whether the values are uniform in the logarithm.
        logarithmic: bool,
    },
    /// A normal distribution.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sd: f64,
    },
    /// A normal distribution of the logarithm.
    LogNormal {
        /// Median, above 0.
        median: f64,
        /// Standard deviation of the logarithm: 0.01 is 1 %.
        sd: f64,
    },
}

impl Spread {
    /// Evenly spaced values from the first to the last.
    pub(super) fn evenly(low: f64, high: f64, points: usize, logarithmic: bool) -> Self {
        let range = Spread::Range { low, high, logarithmic };
        let last = points.saturating_sub(1).max(1) as f64;
        let value = |k: usize| match k as f64 / last {
            // The ends are exactly those of the file.
            0.0 => low,
            1.0 => high,
            place => range.at(place),
        };
        Spread::Values((0..points).map(value).collect())
    }

    /// The value at a place within 0 … 1.
    fn at(&self, place: f64) -> f64 {
        match self {
            Spread::Values(values) => values[((place * values.len() as f64) as usize).min(values.len() - 1)],
            Spread::Range { low, high, logarithmic: false } => low + place * (high - low),
            Spread::Range { low, high, logarithmic: true } => low * libm::pow(high / low, place),
            Spread::Normal { .. } | Spread::LogNormal { .. } => self.off(Normal::standard().inverse_cdf(place)),
        }
    }

    /// The value at a distance from the mean in standard deviations; NaN for distributions without a standard
    /// deviation.
    fn off(&self, off: f64) -> f64 {
        match self {
            Spread::Normal { mean, sd } => mean + sd * off,
            Spread::LogNormal { median, sd } => median * libm::exp(sd * off),
            Spread::Values(_) | Spread::Range { .. } => f64::NAN,
        }
    }

    /// Share of the values outside an interval; 0 for lists and ranges, whose ends are checked separately.
    pub(super) fn outside(&self, minimum: f64, maximum: f64) -> f64 {
        let (low, high) = match self {
            Spread::Normal { mean, sd } => ((minimum - mean) / sd, (maximum - mean) / sd),
            // The logarithm of 0 and less is taken as −∞.
            Spread::LogNormal { median, sd } => {
                (libm::log(minimum.max(0.0) / median) / sd, libm::log(maximum.max(0.0) / median) / sd)
            }
            Spread::Values(_) | Spread::Range { .. } => return 0.0,
        };
        Normal::standard().cdf(low) + Normal::standard().cdf(-high)
    }

    /// Listed values, if the axis has a list.
    pub(super) fn listed(&self) -> Option<&[f64]> {
        if let Spread::Values(values) = self { Some(values) } else { None }
    }

    /// Values that must be allowed: all of a list, the ends of a range, a mean.
    pub(super) fn extremes(&self) -> Vec<f64> {
        match self {
            Spread::Values(values) => values.clone(),
            Spread::Range { low, high, .. } => vec![*low, *high],
            Spread::Normal { mean: value, .. } | Spread::LogNormal { median: value, .. } => vec![*value],
        }
    }
}

impl Axis {
    /// Number of values on a grid; 0 if the values are not a list.
    pub(super) fn levels(&self) -> usize {
        if let Spread::Values(values) = &self.spread { values.len() } else { 0 }
    }

    /// Value at a place within 0 … 1.
    pub(super) fn value(&self, place: f64) -> f64 {
        self.spread.at(place)
    }

    /// Sets the parameters that `takes` admits.
    pub(super) fn apply(&self, value: f64, preset: &mut Preset<f64>, takes: impl Fn(&str) -> bool) {
        for path in self.paths.iter().filter(|path| takes(path)) {
            change(preset, path, |old| if self.factor { old * value } else { value });
        }
    }
}

/// The values of all axes at a place.
pub(super) fn values(axes: &[Axis], place: &Place) -> Vec<f64> {
    match place {
        Place::Within(places) => axes.iter().zip(places).map(|(axis, place)| axis.value(*place)).collect(),
        // The check of the plan guarantees that each axis has a standard deviation.
        Place::Normal(offs) => axes.iter().zip(offs).map(|(axis, off)| axis.spread.off(*off)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters::presets;

    #[test]
    fn values_are_evenly_spaced_with_both_ends() {
        assert_eq!(Spread::evenly(0.1, 0.3, 3, false).extremes(), [0.1, 0.1 + 0.5 * (0.3 - 0.1), 0.3]);
        let Spread::Values(decades) = Spread::evenly(1e-3, 10.0, 5, true) else { panic!("values") };
        for (value, expected) in decades.iter().zip([1e-3, 1e-2, 0.1, 1.0, 10.0]) {
            assert!((value / expected - 1.0).abs() < 1e-14, "{decades:?}");
        }
        assert_eq!(Spread::evenly(2.0, 3.0, 1, false).extremes(), [2.0]);
    }

    #[test]
    fn places_become_values() {
        let values = Spread::Values(vec![3.0, 5.0]);
        assert_eq!([0.0, 0.49, 0.5, 1.0].map(|place| values.at(place)), [3.0, 3.0, 5.0, 5.0]);
        let normal = Spread::Normal { mean: 2.0, sd: 0.5 };
        assert!((normal.at(0.975) - 2.0 - 0.5 * 1.959_963_984_540_054).abs() < 1e-9);
        assert_eq!(normal.at(0.5), 2.0);
        let share = Spread::LogNormal { median: 2.0, sd: 0.5 };
        assert!((libm::log(share.at(0.975) / 2.0) - 0.5 * 1.959_963_984_540_054).abs() < 1e-9);
    }

    #[test]
    fn the_share_outside_an_interval_is_that_of_the_tails() {
        // 1 − Φ(2) = 0.022750131948179 on one side, 1 − Φ(1) = 0.158655253931457 on the other.
        let tails = 0.022_750_131_948_179 + 0.158_655_253_931_457;
        assert!((Spread::Normal { mean: 2.0, sd: 0.5 }.outside(1.0, 2.5) - tails).abs() < 1e-9);
        let logarithmic = Spread::LogNormal { median: 2.0, sd: 0.5 };
        assert!((logarithmic.outside(2.0 / libm::exp(1.0), 2.0 * libm::exp(0.5)) - tails).abs() < 1e-9);
        assert_eq!(logarithmic.outside(0.0, f64::INFINITY), 0.0);
        assert_eq!(Spread::Values(vec![3.0]).outside(0.0, 1.0), 0.0);
    }

    #[test]
    fn a_factor_multiplies_each_of_its_parameters_and_a_value_replaces_them() {
        let preset: Preset<f64> = presets::find("prototype").unwrap().read().unwrap();
        let paths = ["model.own.breakaway_torque", "model.own.kinetic_torque"].map(String::from).to_vec();
        let spread = Spread::Values(vec![0.7]);
        let mut axis = Axis { name: "belief".into(), paths, factor: true, unit: "1".into(), spread };
        let mut changed = preset;
        axis.apply(0.7, &mut changed, |_| true);
        assert_eq!(changed.model.own.breakaway_torque, preset.model.own.breakaway_torque * 0.7);
        assert_eq!(changed.model.own.kinetic_torque, preset.model.own.kinetic_torque * 0.7);
        axis.factor = false;
        axis.apply(0.2, &mut changed, |path| path.ends_with("kinetic_torque"));
        assert_eq!(changed.model.own.kinetic_torque, 0.2);
        assert_eq!(changed.model.own.breakaway_torque, preset.model.own.breakaway_torque * 0.7);
    }
}
