//! What only the code generator can fail of.

use std::path::PathBuf;

use stickslip_base::did_you_mean;

/// A failure of the code generator, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GenerateError {
    /// There is no block of this name.
    #[error("{name} is no block. {}", did_you_mean(nearest.as_deref(), "`stickslip generate --list` names them."))]
    UnknownBlock {
        /// The name asked for.
        name: String,
        /// The known name most like it.
        nearest: Option<String>,
    },
    /// A name that C does not take.
    #[error("{0}. Say another by --prefix")]
    NoIdentifier(#[from] stickslip_codegen::c::NotAName),
    /// A C compiler that refuses what was generated.
    #[error(
        "{compiler} does not compile it: {said}. Say by the variable CC which C99 compiler to take, such as gcc or clang"
    )]
    Compiler {
        /// Which one.
        compiler: String,
        /// The first line of its complaint.
        said: String,
    },
    /// A linked program that does not hold what is looked for.
    #[error("{}: {reason}. {remedy}", path.display())]
    Program {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
}

impl From<GenerateError> for stickslip_base::Error {
    fn from(error: GenerateError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
