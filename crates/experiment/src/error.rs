//! What only an experiment can fail of.

/// A failure of an experiment, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// Something is wrong with what a file of the friction library says about itself.
    #[error(
        "{file}: {problem}. A file of the friction library begins with [about]: title, source, licence, and, where \
             known, lacks and deviations"
    )]
    Library {
        /// Which file.
        file: String,
        /// What.
        problem: String,
    },
    /// A friction that the load motor cannot render.
    #[error("{name} cannot be the desired friction: {reason}. {remedy}")]
    NotAsDesired {
        /// The friction.
        name: String,
        /// Why.
        reason: &'static str,
        /// What to do.
        remedy: &'static str,
    },
}

impl From<ExperimentError> for stickslip_base::Error {
    fn from(error: ExperimentError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
