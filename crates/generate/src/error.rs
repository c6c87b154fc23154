//! Errors of the code generator.

use std::path::PathBuf;

use stickslip_base::did_you_mean;

/// An error of the code generator, in addition to those of every crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GenerateError {
    /// An unknown block.
    #[error("unknown block {name}. {}", did_you_mean(nearest.as_deref(), "`stickslip generate --list` lists all \
        blocks."))]
    UnknownBlock {
        /// The requested name.
        name: String,
        /// The most similar known name.
        nearest: Option<String>,
    },
    /// A name that is not valid in C.
    #[error("{0}. State another name with --prefix")]
    NoIdentifier(#[from] stickslip_codegen::c::NotAName),
    /// A C compiler that is missing or refuses the generated code.
    #[error(
        "{compiler} does not compile the generated code: {message}. Set the environment variable CC to a C99 compiler, \
         such as gcc or clang"
    )]
    Compiler {
        /// The compiler.
        compiler: String,
        /// The first line of its message.
        message: String,
    },
    /// A linked program without the expected code or variables.
    #[error("{}: {reason}. {remedy}", path.display())]
    Program {
        /// Its file.
        path: PathBuf,
        /// The cause.
        reason: String,
        /// The remedy.
        remedy: &'static str,
    },
}

impl From<GenerateError> for stickslip_base::Error {
    fn from(error: GenerateError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
