//! The catalogue of a project: its runs, searchable by words, numbers and parameters.
//!
//! It is an index: one small JSON file per run. The runs themselves hold all data: results in `summary.json`, parameters
//! in `report.json` or in the record, and number, name, tags and note in `run.json`. The index can therefore be deleted and
//! rebuilt ([`Catalogue::rebuild`]). Several processes may change it at once: a change holds a lock and replaces whole
//! files; a search takes no lock. If the index cannot be written, the run is still complete.

mod bin;
mod edit;
mod enter;
mod entry;
mod facts;
mod label;
mod place;
mod query;
mod rebuild;
mod records;
mod run;
mod store;
#[cfg(test)]
mod tests;

pub use enter::RunOrigin;
pub(crate) use facts::CAPTURE;
pub use place::Catalogue;
pub use rebuild::Rebuilt;
pub(crate) use records::incomplete;
pub use records::{Records, write_incomplete};
pub use run::{Details, Found, KeyNumber, Run, State, Value};
