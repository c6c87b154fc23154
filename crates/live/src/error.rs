//! What only a served bench can fail of.

use std::path::PathBuf;

use stickslip_core::supervise::Role;

/// A failure of a served bench, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// Somebody else operates the bench.
    #[error(
        "{by} operates the bench. Wait until it is left for ten seconds, or take it over (`stickslip bench operate`)."
    )]
    Operated {
        /// Who.
        by: String,
    },
    /// Something runs that does not go with what was asked for.
    #[error("{what} runs. Wait for its end, or end it (`stickslip bench halt`).")]
    Busy {
        /// What runs.
        what: String,
    },
    /// Nothing of that kind runs.
    #[error("there is no {what} to end.")]
    NothingToEnd {
        /// What was asked for.
        what: &'static str,
    },
    /// The catalogue of runs does not take or give something. The runs themselves are as they were.
    #[error("{}: {fault}. {remedy}", path.display())]
    Catalogue {
        /// Its file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The catalogue knows no such run.
    #[error("there is no run {number}. `stickslip runs` lists them.")]
    NoRun {
        /// The number asked for.
        number: i64,
    },
    /// A run of the catalogue whose files are not where it says.
    #[error("run {number}: {how}. {remedy}")]
    RunGone {
        /// Its number.
        number: i64,
        /// Why.
        how: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// No name or tag of a run.
    #[error("{text:?} will not do for a run. {remedy}")]
    RunText {
        /// What was given.
        text: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Nothing was brought along.
    #[error(
        "no file was loaded. Start the bench with one: stickslip serve --controller FILE, --friction FILE or --law FILE."
    )]
    NothingLoaded,
    /// Values that what was brought along does not take.
    #[error(
        "{name} refuses these values of its parameters (it answers {code}): it goes on with those before. Choose others; \
         which it takes, its author knows."
    )]
    ForeignRefuses {
        /// Its name.
        name: String,
        /// What its function returned.
        code: i32,
    },
    /// The friction that is rendered is not that of the parameters.
    #[error(
        "a {role} of a file renders: what is measured under it is not the desired friction of the parameters. Measure it \
         by stickslip load FILE --as {role}, or let that of the preset take its place ({selector} = preset)."
    )]
    RendersItself {
        /// What the file is.
        role: Role,
        /// The parameter that says whether it acts.
        selector: &'static str,
    },
}

impl From<LiveError> for stickslip_base::Error {
    fn from(error: LiveError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
