//! Problems of a parameter file, each with place, values and remedy.

use std::fmt;

use stickslip_core::fields::{Field, ParameterError, Variant};

use super::number;
use crate::excerpt::excerpt;

/// All problems of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterProblems {
    /// Name of the file, as stated by the user.
    pub file: String,
    /// In the order of the file.
    pub problems: Vec<Problem>,
}

/// One problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Line in the file, from 1; `None` if the problem is not in the file but follows from defaults.
    pub line: Option<usize>,
    /// Dotted path; empty if the text is not TOML.
    pub path: String,
    /// The kind of problem.
    pub fault: Fault,
}

/// Kinds of problems of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// The text is not TOML.
    Syntax {
        /// The message of the parser.
        message: String,
    },
    /// An unknown parameter.
    Unknown {
        /// The full path of the most similar known name.
        nearest: Option<String>,
        /// The names in this table.
        known: Vec<&'static str>,
    },
    /// A parameter of a variant that is not chosen.
    OtherVariant {
        /// The key of the choice.
        tag: &'static str,
        /// The chosen variant.
        chosen: &'static str,
        /// The variant that has this parameter.
        owner: &'static str,
    },
    /// An unknown variant.
    UnknownVariant {
        /// The value in the file.
        value: String,
        /// The known variants.
        variants: Vec<&'static str>,
    },
    /// A value of another type than the expected number, flag, list, table or name.
    WrongType {
        /// The expected type.
        expected: String,
        /// The actual value.
        got: String,
    },
    /// A number outside its range.
    OutOfRange {
        /// The number [in the unit].
        value: f64,
        /// Smallest allowed.
        minimum: f64,
        /// Largest allowed.
        maximum: f64,
        /// The default.
        default: f64,
        /// Unit of all of them.
        unit: &'static str,
    },
    /// A number that is NaN or infinite.
    NotFinite {
        /// The number.
        value: f64,
        /// Smallest allowed.
        minimum: f64,
        /// Largest allowed.
        maximum: f64,
        /// Unit.
        unit: &'static str,
    },
    /// A fraction instead of a whole number.
    NotWhole {
        /// The number.
        value: f64,
        /// Unit.
        unit: &'static str,
    },
    /// A violated law between parameters.
    Law {
        /// Value, relation, bound and remedy; the field is relative to the struct that states the law.
        law: ParameterError,
        /// Unit of value and bound.
        unit: &'static str,
    },
}

impl Fault {
    pub(super) fn unknown_variant(value: &str, variants: &'static [Variant]) -> Self {
        Fault::UnknownVariant { value: value.into(), variants: variants.iter().map(|variant| variant.name).collect() }
    }

    /// The fault of a number as the value of a field, if it has one.
    pub fn of_number(value: f64, field: &'static Field) -> Option<Self> {
        let Field { minimum, maximum, default, unit, .. } = *field;
        if !value.is_finite() {
            Some(Fault::NotFinite { value, minimum, maximum, unit })
        } else if !(minimum..=maximum).contains(&value) {
            Some(Fault::OutOfRange { value, minimum, maximum, default, unit })
        } else if field.kind != stickslip_core::fields::Kind::Real && value.fract() != 0.0 {
            Some(Fault::NotWhole { value, unit })
        } else {
            None
        }
    }
}

impl std::error::Error for ParameterProblems {}

impl fmt::Display for ParameterProblems {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut written = 0;
        for (index, problem) in self.problems.iter().enumerate() {
            let text = problem.text(&self.file);
            if index > 0 && written + text.len() > LONGEST {
                return write!(f, "\nFurther problems: {}.", self.problems.len() - index);
            }
            written += text.len();
            write!(f, "{}{text}", if index > 0 { "\n" } else { "" })?;
        }
        Ok(())
    }
}

/// Length of all problems in a message above which the rest is only counted [bytes].
const LONGEST: usize = 1500;

impl Problem {
    /// One line: the problem with both values, place, remedy.
    fn text(&self, file: &str) -> String {
        let path = excerpt(&self.path);
        let place = self.line.map_or_else(|| file.to_string(), |line| format!("{file}:{line}"));
        match &self.fault {
            Fault::Syntax { message } => {
                format!("{place} is not TOML: {message}. Write `name = value` lines below [table] headings.")
            }
            Fault::Unknown { nearest: Some(nearest), .. } => {
                format!("unknown parameter {path} ({place}). Did you mean {}?", excerpt(nearest))
            }
            Fault::Unknown { nearest: None, known } => {
                format!("unknown parameter {path} ({place}). Parameters of this table: {}.", known.join(", "))
            }
            Fault::OtherVariant { tag, chosen, owner } => format!(
                "{path} does not belong to {tag} = \"{chosen}\" ({place}). Choose \"{owner}\", which has it, or delete it."
            ),
            Fault::UnknownVariant { value, variants } => {
                format!("{path} = \"{}\" is unknown ({place}). Choose one of: {}.", excerpt(value), variants.join(", "))
            }
            Fault::WrongType { expected, got } => format!("{path} is {got} ({place}). Write {expected}."),
            Fault::OutOfRange { value, minimum, maximum, default, unit } => {
                let (number, range) = (number::with_unit(*value, unit), number::range(*minimum, *maximum, unit));
                let remedy = range_remedy(*value, *minimum..=*maximum, *default, unit);
                format!("{path} = {number} is outside {range} ({place}). {remedy}")
            }
            Fault::NotFinite { value, minimum, maximum, unit } => {
                let range = number::range(*minimum, *maximum, unit);
                format!("{path} = {value} is not finite ({place}). Write a number within {range}.")
            }
            Fault::NotWhole { value, unit } => {
                let (number, rounded) = (number::with_unit(*value, unit), number::with_unit(value.round(), unit));
                format!("{path} = {number} is not a whole number ({place}). Write {rounded}, for example.")
            }
            Fault::Law { law, unit } => {
                // A bound is computed: it is rounded unless the difference is in its last digits.
                let bound = match number::rounded(law.bound, 5).parse() {
                    Ok(rounded) if rounded != law.value => rounded,
                    _ => law.bound,
                };
                let (value, bound) = (number::with_unit(law.value, unit), number::with_unit(bound, unit));
                format!("{path} = {value} must be {} {bound} ({place}). {}", law.relation, law.remedy)
            }
        }
    }
}

/// The most probable mistake of a number outside its range.
fn range_remedy(value: f64, range: std::ops::RangeInclusive<f64>, default: f64, unit: &str) -> String {
    let thousandth = value / 1000.0;
    if value < 0.0 && *range.start() >= 0.0 && range.contains(&-value) {
        "It is a magnitude; drop the sign.".into()
    } else if value > *range.end() && unit != "1" && range.contains(&thousandth) {
        format!("Values are in {unit}: a thousandth of it would be {}.", number::text(thousandth))
    } else {
        format!("The default is {}.", number::with_unit(default, unit))
    }
}
