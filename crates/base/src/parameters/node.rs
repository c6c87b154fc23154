//! A common view of all forms of tables, lists and values in TOML.

use std::ops::Range;

use toml_edit::{Item, TableLike, Value};

use crate::excerpt::excerpt;

/// A part of a document with its place in the text.
pub(super) struct Node<'a> {
    pub(super) span: Option<Range<usize>>,
    pub(super) content: Content<'a>,
}

/// Content of a part, in any form.
pub(super) enum Content<'a> {
    /// `[heading]`, `{ inline }` or dotted keys.
    Table(&'a dyn TableLike),
    /// `[1, 2]` or `[[heading]]`.
    List(Vec<Node<'a>>),
    /// Anything else.
    Value(&'a Value),
}

impl<'a> Node<'a> {
    /// `None` for an item that was removed.
    pub(super) fn of_item(item: &'a Item) -> Option<Self> {
        let content = match item {
            Item::None => return None,
            Item::Value(value) => return Some(Node::of_value(value)),
            Item::Table(table) => Content::Table(table),
            Item::ArrayOfTables(list) => Content::List(
                list.iter().map(|table| Node { span: table.span(), content: Content::Table(table) }).collect(),
            ),
        };
        Some(Node { span: item.span(), content })
    }

    fn of_value(value: &'a Value) -> Self {
        let content = match value {
            Value::InlineTable(table) => Content::Table(table),
            Value::Array(list) => Content::List(list.iter().map(Node::of_value).collect()),
            other => Content::Value(other),
        };
        Node { span: value.span(), content }
    }

    /// In words: `the string "0.3"`, `a list of 2`.
    pub(super) fn in_words(&self) -> String {
        match &self.content {
            Content::Table(_) => "a table".into(),
            Content::List(list) => format!("a list of {}", list.len()),
            Content::Value(Value::String(text)) => format!("the string \"{}\"", excerpt(text.value())),
            Content::Value(Value::Integer(number)) => format!("the number {}", number.value()),
            Content::Value(Value::Float(number)) => format!("the number {}", number.value()),
            Content::Value(Value::Boolean(flag)) => format!("the flag {}", flag.value()),
            Content::Value(other) => format!("a {}", other.type_name()),
        }
    }
}
