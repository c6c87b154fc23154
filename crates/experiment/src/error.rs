//! Errors of experiments.

/// Errors of experiments, besides those common to all crates.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// An invalid section `[about]` in a file of the friction library.
    #[error(
        "{file}: {problem}. A file of the friction library begins with [about]: title, source, licence, and, if \
         known, lacks and deviations"
    )]
    Library {
        /// The file.
        file: String,
        /// What is wrong.
        problem: String,
    },
    /// A friction that the load motor cannot render.
    #[error("{name} cannot be the desired friction: {reason}. {remedy}")]
    NotAsDesired {
        /// Name of the friction.
        name: String,
        /// The reason.
        reason: &'static str,
        /// The remedy.
        remedy: &'static str,
    },
}

impl From<ExperimentError> for stickslip_base::Error {
    fn from(error: ExperimentError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
