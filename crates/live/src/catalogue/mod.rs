//! The catalogue of a project: which runs there are, found again by words, numbers and parameters.
//!
//! An index in SQLite, never the truth. A run is its folder: results in `summary.json`, parameters in `report.json` or in
//! the record, and in `run.json` what only the catalogue would know, its number, name, tags and note. So the index can be
//! deleted and built again ([`Catalogue::rebuild`]), and what is moved by hand is missing only until then. Several
//! processes may write at once; whoever cannot write it has lost no run.

mod bin;
mod connection;
mod edit;
mod enter;
mod facts;
mod label;
mod place;
mod query;
mod rebuild;
mod row;
#[cfg(test)]
mod tests;

pub use enter::Made;
pub use place::Catalogue;
pub use rebuild::Rebuilt;
pub use row::{Details, Found, KeyNumber, Run, State, Value};
