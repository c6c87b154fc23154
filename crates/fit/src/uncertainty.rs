//! Joint distribution of several parameters: the table `[uncertainty]` of a parameter file.
//!
//!   C_ij = ρ_ij·s_i·s_j
//!
//! is the covariance of the parameters, or of their logarithms where `logarithmic = true`: then s is a share of the
//! value (0.01: 1 %), no draw is negative, and 95 % of the draws are within the intervals of the fit. The values
//! themselves are those of the file. Parameter files may have the table; the reader of parameters ignores it, and
//! `stickslip_study::read` draws from it.

use std::fmt::Write;
use std::path::Path;

use nalgebra::DMatrix;
use serde::Deserialize;

use crate::{PARAMETERS, StribeckFit};
use stickslip_base::excerpt::parser_message;
use stickslip_base::{Error, input};

use stickslip_base::parameters::UNCERTAINTY as TABLE;

/// Standard deviation of a logarithm above which the parameter itself is normal instead of its logarithm.
pub const LARGEST: f64 = 0.5;

/// Parameters with a joint normal distribution about the values of the file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointDistribution {
    /// Their paths in the file.
    pub parameters: Vec<String>,
    /// Whether their logarithms are normal instead of themselves.
    pub logarithmic: bool,
    /// Standard deviations: SI units, or shares of the values where `logarithmic`.
    pub sd: Vec<f64>,
    /// ρ, symmetric with ones on its diagonal.
    pub correlation: Vec<Vec<f64>>,
}

/// A distribution from a file, with the values about which it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Standard deviations and correlations.
    pub together: JointDistribution,
    /// Fitted values, in the order of `together`.
    pub values: Vec<f64>,
    /// L of ρ = L·Lᵀ, row by row.
    pub factor: Vec<Vec<f64>>,
}

impl JointDistribution {
    /// Joint distribution of the four parameters of a fit, in a group of the file. In their logarithms, as the fit's
    /// intervals are, unless the error of one exceeds its value.
    pub fn of_fit(fit: &StribeckFit, group: &str) -> Self {
        let errors = fit.standard_errors;
        let within = |i: usize| fit.parameters[i] > 0.0 && errors[i] <= LARGEST * fit.parameters[i];
        let logarithmic = (0..4).all(within);
        let sd = (0..4).map(|i| if logarithmic { errors[i] / fit.parameters[i] } else { errors[i] }).collect();
        // One triangle for both: two computations may differ in the last bit.
        let rho = |i: usize, j: usize| fit.covariance[i.max(j)][i.min(j)] / (errors[i] * errors[j]);
        let row = |i: usize| (0..4).map(|j| if i == j { 1.0 } else { rho(i, j) }).collect();
        let parameters = PARAMETERS.iter().map(|(key, ..)| format!("{group}.{key}")).collect();
        JointDistribution { parameters, logarithmic, sd, correlation: (0..4).map(row).collect() }
    }

    /// The table, for the end of a parameter file.
    pub fn to_toml(&self) -> String {
        let JointDistribution { parameters, logarithmic, sd, correlation } = self;
        let of = if *logarithmic { "their logarithms: 0.01 is 1 %" } else { "the parameters, in their units" };
        let mut text = format!(
            "\n# Joint distribution of these parameters, for [[fit]] of a study: standard deviations of {of}.\n[{TABLE}]\n\
             parameters = {parameters:?}\nlogarithmic = {logarithmic}\nsd = {sd:?}\ncorrelation = [\n"
        );
        for row in correlation {
            writeln!(text, "    {row:?},").expect("a string takes all");
        }
        text + "]\n"
    }

    /// L of ρ = L·Lᵀ; an error where ρ is not a correlation of these parameters.
    pub fn factor(&self) -> Result<Vec<Vec<f64>>, String> {
        let count = self.parameters.len();
        if self.correlation.len() != count || self.correlation.iter().any(|row| row.len() != count) {
            return Err(format!("correlation is not {count} × {count}"));
        }
        factor(&self.correlation).ok_or_else(|| "invalid correlation".into())
    }

    /// Fault of the table itself, or together with the values.
    pub fn fault(&self, values: &[f64]) -> Option<String> {
        let JointDistribution { parameters, logarithmic, sd, .. } = self;
        if parameters.is_empty() || sd.len() != parameters.len() {
            return Some(format!("{} parameters, but {} standard deviations", parameters.len(), sd.len()));
        }
        parameters.iter().zip(sd).zip(values).find_map(|((path, &sd), &value)| {
            if !(sd.is_finite() && sd > 0.0) {
                Some(format!("the standard deviation of {path} is {sd}"))
            } else if *logarithmic && (value.is_nan() || value <= 0.0) {
                Some(format!("{path} = {value} has no logarithm"))
            } else if *logarithmic && sd > LARGEST {
                Some(format!("the standard deviation of {path} is {:.0} %, which is too large", 100.0 * sd))
            } else {
                None
            }
        })
    }
}

/// L of a correlation L·Lᵀ, row by row: symmetric, ones on its diagonal, positive definite. `None` for anything else.
pub fn factor(correlation: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let count = correlation.len();
    if correlation.iter().any(|row| row.len() != count) {
        return None;
    }
    let matrix = DMatrix::from_fn(count, count, |i, j| correlation[i][j]);
    let is_one = (0..count).all(|i| matrix[(i, i)] == 1.0) && matrix == matrix.transpose();
    let lower = matrix.cholesky().filter(|_| is_one)?.l();
    Some(lower.row_iter().map(|row| row.iter().copied().collect()).collect())
}

/// Reads the table of a file and the values that it is about.
///
/// # Errors
/// [`Error::File`]; [`Error::Document`] for a file without the table, and for an invalid table.
pub fn read(path: &Path) -> Result<Known, Error> {
    let text = input::text(path, input::TEXT)?;
    let wrong = |reason: String, remedy| Err(Error::Document { path: path.into(), place: None, reason, remedy });
    let message = |error: toml::de::Error| parser_message(error.message());
    let mut table: toml::Table = match toml::from_str(&text) {
        Ok(table) => table,
        Err(error) => return wrong(message(error), "Give the fit.toml that `stickslip fit` wrote."),
    };
    let Some(stated) = table.remove(TABLE) else {
        return wrong(format!("there is no table [{TABLE}] in it"), "Give the fit.toml that `stickslip fit` wrote.");
    };
    let together: JointDistribution = match stated.try_into() {
        Ok(together) => together,
        Err(error) => return wrong(format!("[{TABLE}]: {}", message(error)), "Fit again, or correct the table."),
    };
    let mut values = Vec::new();
    for path in &together.parameters {
        match number(&table, path) {
            Some(value) => values.push(value),
            // A default would not be a fitted value.
            None => return wrong(format!("missing value of {path}"), "Fit again, or add the value."),
        }
    }
    if let Some(fault) = together.fault(&values) {
        return wrong(fault, "Measure more (`stickslip fit` lists the missing measurements), or remove the parameter.");
    }
    match together.factor() {
        Ok(factor) => Ok(Known { together, values, factor }),
        Err(fault) => {
            let remedy = "A correlation is symmetric, has ones on its diagonal, and gives no combination of parameters \
                          a variance of 0 or less.";
            wrong(fault, remedy)
        }
    }
}

/// The number at a dotted path.
pub fn number(table: &toml::Table, path: &str) -> Option<f64> {
    match path.split_once('.') {
        Some((group, rest)) => number(table.get(group)?.as_table()?, rest),
        None => match table.get(path)? {
            toml::Value::Float(value) => Some(*value),
            toml::Value::Integer(value) => Some(*value as f64),
            _ => None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CurvePoint, StribeckPlan, fit_stribeck};

    /// A curve with a drop, 2 mN m off it by turns.
    fn fit(stribeck: [f64; 4]) -> StribeckFit {
        let curve = crate::with_values(&Default::default(), stribeck);
        let point = |k: i32| {
            let velocity = 0.1 * libm::pow(1.4, f64::from(k));
            let off = if k % 3 == 0 { 2e-3 } else { -1e-3 };
            CurvePoint { velocity, torque: curve.torque(velocity) + off, standard_error: 1e-3 }
        };
        fit_stribeck(&(0..20).map(point).collect::<Vec<_>>(), &StribeckPlan::default()).unwrap()
    }

    fn text(fit: &StribeckFit, together: &JointDistribution) -> String {
        let [a, b, c, d] = fit.parameters;
        format!(
            "[model.own]\nbreakaway_torque = {a:?}\nkinetic_torque = {b:?}\nstribeck_velocity = {c:?}\n\
             viscous_friction = {d:?}\n{}",
            together.to_toml()
        )
    }

    fn read_back(text: &str) -> Result<Known, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fit.toml");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn a_file_restores_the_distribution_of_the_fit_exactly() {
        let fit = fit([0.3, 0.18, 2.0, 1e-3]);
        let together = JointDistribution::of_fit(&fit, "model.own");
        assert!(together.logarithmic);
        let file = read_back(&text(&fit, &together)).unwrap();
        assert_eq!((&file.together, &file.values[..]), (&together, &fit.parameters[..]));
        for i in 0..4 {
            for j in 0..4 {
                let correlation: f64 = (0..4).map(|k| file.factor[i][k] * file.factor[j][k]).sum();
                let ours = correlation * together.sd[i] * together.sd[j] * fit.parameters[i] * fit.parameters[j];
                let scale = fit.standard_errors[i] * fit.standard_errors[j];
                // A handful of roundings.
                assert!((ours - fit.covariance[i][j]).abs() < 1e-14 * scale, "{i} {j}");
            }
        }
        // A reader of parameters ignores the table.
        let preset: stickslip_base::Preset<f64> =
            stickslip_base::parameters::read(&text(&fit, &together), "fit.toml").unwrap();
        assert_eq!(crate::values(&preset.model.own), fit.parameters);
    }

    #[test]
    fn an_uncertain_parameter_is_normal_in_its_own_unit() {
        let fit = fit([0.3, 0.18, 2.0, 2e-6]);
        let together = JointDistribution::of_fit(&fit, "model.own");
        assert!(!together.logarithmic && together.sd == fit.standard_errors, "{together:?}");
    }

    #[test]
    fn an_invalid_table_is_refused_with_the_reason() {
        let fit = fit([0.3, 0.18, 2.0, 1e-3]);
        let together = JointDistribution::of_fit(&fit, "model.own");
        let whole = text(&fit, &together);
        let message_of = |change: &dyn Fn(&mut JointDistribution)| {
            let mut changed = together.clone();
            change(&mut changed);
            read_back(&text(&fit, &changed)).unwrap_err().to_string()
        };
        // Of three correlations of 0.9, 0.9 and −0.9 one sum has a negative variance.
        let indefinite = |t: &mut JointDistribution| {
            for (i, j, value) in [(0, 1, 0.9), (0, 2, 0.9), (1, 2, -0.9)] {
                (t.correlation[i][j], t.correlation[j][i]) = (value, value);
            }
        };
        for (message, expected) in [
            (message_of(&indefinite), "invalid correlation"),
            (message_of(&|t| t.correlation[0][1] += 1e-3), "invalid correlation"),
            (message_of(&|t| t.correlation[2][2] = 1.1), "invalid correlation"),
            (message_of(&|t| t.correlation.truncate(3)), "correlation is not 4 × 4"),
            (message_of(&|t| t.sd.truncate(3)), "4 parameters, but 3 standard deviations"),
            (message_of(&|t| t.sd[1] = 0.0), "the standard deviation of model.own.kinetic_torque is 0"),
            (message_of(&|t| t.sd[1] = f64::INFINITY), "the standard deviation of model.own.kinetic_torque is inf"),
            (message_of(&|t| t.sd[3] = 0.8), "the standard deviation of model.own.viscous_friction is 80 %"),
            (message_of(&|t| t.parameters[3] = "model.own.viscosity".into()), "missing value of model.own.viscosity"),
            (
                read_back(&whole.replace("viscous_friction = ", "viscous_friction = 0.0 # ")).unwrap_err().to_string(),
                "model.own.viscous_friction = 0 has no logarithm",
            ),
            (read_back("[model.own]\n").unwrap_err().to_string(), "there is no table [uncertainty] in it"),
            (read_back(&whole.replace("sd =", "sds =")).unwrap_err().to_string(), "[uncertainty]: unknown field `sds`"),
            (read_back("[uncertainty").unwrap_err().to_string(), "Give the fit.toml"),
        ] {
            assert!(message.contains(expected), "{expected}\n{message}");
        }
        assert!(matches!(read(Path::new("no/such/fit.toml")), Err(Error::File { .. })));
    }
}
