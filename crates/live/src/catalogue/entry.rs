//! Entries of the index.

use serde::{Deserialize, Serialize};

use super::facts::Facts;
use super::label::Label;

/// Version of the file format.
pub(super) const SCHEMA: &str = "stickslip.catalogue-entry/1";

/// A run in the index.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    pub(super) schema: String,
    /// Folder or file of the run, relative to the project's folder.
    pub(super) folder: String,
    pub(super) label: Label,
    pub(super) facts: Facts,
}

/// A column of the search.
pub(super) enum Column {
    Number(Option<f64>),
    Text(String),
}

impl Entry {
    pub(super) fn new(folder: String, label: Label, facts: Facts) -> Self {
        Entry { schema: SCHEMA.into(), folder, label, facts }
    }

    /// The column `name` of a query; `None` for a parameter or result.
    pub(super) fn column(&self, name: &str) -> Option<Column> {
        let Entry { folder, label, facts, .. } = self;
        let text = match name {
            "number" => return Some(Column::Number(Some(label.number as f64))),
            "duration" => return Some(Column::Number(label.duration)),
            "key" => return Some(Column::Number(facts.key.as_ref().map(|key| key.value))),
            "tag" => return Some(Column::Text(label.tags.join(" "))),
            "name" => &label.name,
            "kind" => &facts.kind,
            "begun" => &label.begun,
            "preset" => &label.preset,
            "controller" => &facts.controller,
            "law" => &facts.law,
            "note" => &label.note,
            "command" => &facts.command,
            "version" => &facts.version,
            "folder" => folder,
            _ => return None,
        };
        Some(Column::Text(text.clone()))
    }

    /// Whether one of the searched texts contains a word, regardless of case.
    pub(super) fn contains(&self, word: &str) -> bool {
        let Entry { folder, label, facts, .. } = self;
        let number = label.number.to_string();
        let texts =
            [&number, &label.name, &facts.kind, &label.preset, &facts.controller, &facts.law, &label.note, folder];
        let texts = texts.into_iter().chain([&facts.command]).chain(&label.tags);
        texts.map(|text| text.to_lowercase()).any(|text| text.contains(word))
    }
}
