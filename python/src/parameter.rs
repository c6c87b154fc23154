//! Description of a parameter, from the tables behind the parameter files.

use pyo3::prelude::*;
use stickslip::parameters::Description;
use stickslip_core::fields::Kind;

use crate::value::Named;

/// Description of a parameter: unit, range, default and meaning.
///
/// `str()` returns the text of `stickslip params describe`.
#[pyclass(frozen, module = "stickslip", name = "Parameter")]
pub(crate) struct Parameter {
    pub(crate) description: Description,
}

#[pymethods]
impl Parameter {
    /// Dotted path.
    #[getter]
    fn path(&self) -> &str {
        &self.description.path
    }

    /// Symbol in equations; empty if there is none.
    #[getter]
    fn symbol(&self) -> &str {
        self.description.field.map_or("", |field| field.symbol)
    }

    /// SI unit; "1" for a pure number, empty for a choice.
    #[getter]
    fn unit(&self) -> &str {
        self.description.field.map_or("", |field| field.unit)
    }

    /// Smallest allowed value, in the unit; None for a choice.
    #[getter]
    fn minimum(&self) -> Option<f64> {
        self.description.field.map(|field| field.minimum)
    }

    /// Largest allowed value, in the unit; None for a choice.
    #[getter]
    fn maximum(&self) -> Option<f64> {
        self.description.field.map(|field| field.maximum)
    }

    /// Default value, in the unit; None for a choice.
    #[getter]
    fn default(&self) -> Option<f64> {
        self.description.field.map(|field| field.default)
    }

    /// "real", "whole", "flag" or "choice".
    #[getter]
    fn kind(&self) -> &'static str {
        match self.description.field.map(|field| field.kind) {
            Some(Kind::Real) => "real",
            Some(Kind::Whole) => "whole",
            Some(Kind::Flag) => "flag",
            None => "choice",
        }
    }

    /// Meaning of the parameter.
    #[getter]
    fn help(&self) -> &str {
        self.description.field.map_or("", |field| field.help)
    }

    /// Variants of a choice, each with its meaning; empty for a number.
    #[getter]
    fn variants(&self) -> Named<&'static str> {
        Named(self.description.variants.iter().map(|variant| (variant.name, variant.help)).collect())
    }

    /// The choice that the parameter requires, such as `friction.model = "lugre"`; None if it always exists.
    #[getter]
    fn only_with(&self) -> Option<&str> {
        self.description.only_with.as_deref()
    }

    fn __str__(&self) -> String {
        self.description.to_string()
    }

    fn __repr__(&self) -> String {
        self.description.to_string()
    }
}
