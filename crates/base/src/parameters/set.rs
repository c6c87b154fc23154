//! Change of a value in a file; comments and layout of the rest are preserved.

use stickslip_core::fields::{Fields, Variant};
use toml_edit::{DocumentMut, InlineTable, Item, TableLike, Value};

use super::entry::within;
use super::problem::ParameterProblems;
use super::read::{current_name, read, scan};
use super::schema::{Description, describe, schema};
use super::write::write_commented;
use crate::Error;

/// The text with the value at `path` changed or added. `value` is as in a file; quotes around a variant are not needed.
///
/// Choosing another variant removes the keys that only the old one has.
///
/// # Errors
/// [`Error::UnknownParameter`], or [`Error::Parameters`] with all problems of the new file: type, range, laws. The text
/// is changed completely or not at all.
pub fn set<P: Fields<f64> + Default>(text: &str, file_name: &str, path: &str, value: &str) -> Result<String, Error> {
    set_all::<P>(text, file_name, &[(path, value)])
}

/// The text with all these values changed, of paths and values; only the final text must be valid.
///
/// # Errors
/// As [`set`].
pub fn set_all<P: Fields<f64> + Default>(
    text: &str,
    file_name: &str,
    changes: &[(impl AsRef<str>, impl AsRef<str>)],
) -> Result<String, Error> {
    let mut changed = text.to_owned();
    for (path, value) in changes {
        changed = with::<P>(&changed, file_name, path.as_ref(), value.as_ref())?;
    }
    read::<P>(&changed, file_name)?;
    Ok(changed)
}

/// The parameters with all these values changed, of paths and values as in a file.
///
/// # Errors
/// As [`set`].
pub fn changed<P: Fields<f64> + Default>(
    parameters: &P,
    file_name: &str,
    changes: &[(impl AsRef<str>, impl AsRef<str>)],
) -> Result<P, Error> {
    let text = set_all::<P>(&write_commented(parameters), file_name, changes)?;
    Ok(read(&text, file_name)?)
}

/// The text with one value changed, without a check of the value.
fn with<P: Fields<f64> + Default>(text: &str, file_name: &str, path: &str, value: &str) -> Result<String, Error> {
    let rows = describe::<P>(path)?;
    let row = &rows[0];
    let contents = scan(text, P::SHAPE);
    // A group has no value; an element can be replaced only if its list is in the text.
    if path != row.path && !(within(path, &row.path) && contents.spans.contains_key(path)) {
        return Err(Error::UnknownParameter { path: path.into(), nearest: Some(row.path.clone()) });
    }
    let literal = literal(value, row);
    let mut changed = match contents.spans.get(path) {
        Some(span) => format!("{}{literal}{}", &text[..span.start], &text[span.end..]),
        None => insert(text, path, &literal).ok_or_else(|| syntax_problems::<P>(text, file_name))?,
    };
    if !row.variants.is_empty() {
        changed = drop_other_variants(&changed, path, row.variants);
    }
    Ok(changed)
}

/// The problems of a text that is not TOML.
fn syntax_problems<P: Fields<f64> + Default>(text: &str, file_name: &str) -> ParameterProblems {
    let empty = ParameterProblems { file: file_name.into(), problems: Vec::new() };
    read::<P>(text, file_name).err().unwrap_or(empty)
}

/// A value as TOML; an invalid one becomes a string, which the reader refuses with its path.
fn literal(value: &str, row: &Description) -> String {
    let value = value.trim();
    let quoted = |text: &str| Value::from(text).to_string();
    if !row.variants.is_empty() {
        return quoted(value.trim_matches(['"', '\'']));
    }
    match (value.parse::<Value>(), value.parse::<f64>()) {
        (Ok(mut value), _) => {
            value.decor_mut().clear();
            value.to_string()
        }
        // `.5` and `5.` are accepted as numbers, although not valid TOML.
        (_, Ok(number)) => Value::from(number).to_string(),
        _ => quoted(value),
    }
}

/// The text with a new key; `None` if it is not TOML.
fn insert(text: &str, path: &str, literal: &str) -> Option<String> {
    let mut document: DocumentMut = text.parse().ok()?;
    let (group, key) = path.rsplit_once('.').unwrap_or(("", path));
    match table(document.as_item_mut(), group) {
        Some(table) => {
            table.insert(key, Item::Value(literal.parse().ok()?));
            Some(document.to_string())
        }
        None => {
            let gap = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
            let below_a_heading = format!("{text}{gap}\n[{group}]\n{key} = {literal}\n");
            // A heading cannot extend a table that is written within one line.
            let possible = below_a_heading.parse::<DocumentMut>().is_ok();
            if possible { Some(below_a_heading) } else { insert_nested(document, path, literal) }
        }
    }
}

/// The text with a new key, and the tables that it requires, within the innermost existing table; `None` without one.
fn insert_nested(mut document: DocumentMut, path: &str, literal: &str) -> Option<String> {
    let ends = path.rmatch_indices('.').map(|(end, _)| end);
    let end = ends.into_iter().find(|&end| table(document.as_item_mut(), &path[..end]).is_some())?;
    let mut names = path[end + 1..].split('.');
    let first = names.next()?;
    let nested = names.rev().try_fold(literal.parse::<Value>().ok()?, |value, name| {
        Some(Value::InlineTable(InlineTable::from_iter([(name, value)])))
    })?;
    table(document.as_item_mut(), &path[..end])?.insert(first, Item::Value(nested));
    Some(document.to_string())
}

/// The text without the keys that only variants other than the chosen one have.
fn drop_other_variants(text: &str, path: &str, variants: &'static [Variant]) -> String {
    let Ok(mut document) = text.parse::<DocumentMut>() else { return text.into() };
    let (group, tag) = path.rsplit_once('.').unwrap_or(("", path));
    let Some(table) = table(document.as_item_mut(), group) else { return text.into() };
    let chosen = table.get(tag).and_then(Item::as_str).unwrap_or_default();
    let names = |variant: &Variant| -> Vec<String> {
        let mut names: Vec<_> = schema(variant.shape).into_iter().map(|row| row.path).collect();
        for name in &mut names {
            name.truncate(name.find('.').unwrap_or(name.len()));
        }
        names
    };
    let Some(chosen) = variants.iter().find(|variant| variant.name == current_name(chosen)) else { return text.into() };
    let names_of_chosen = names(chosen);
    for name in variants.iter().flat_map(names).filter(|name| !names_of_chosen.contains(name)) {
        table.remove(&name);
    }
    document.to_string()
}

/// The table at a path, if it is there.
fn table<'a>(item: &'a mut Item, path: &str) -> Option<&'a mut dyn TableLike> {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    match item {
        Item::ArrayOfTables(list) => inside(list.get_mut(first.parse().ok()?)?, rest),
        Item::Value(Value::Array(list)) => inside(list.get_mut(first.parse().ok()?)?.as_inline_table_mut()?, rest),
        other => inside(other.as_table_like_mut()?, path),
    }
}

fn inside<'a>(table: &'a mut dyn TableLike, path: &str) -> Option<&'a mut dyn TableLike> {
    if path.is_empty() {
        return Some(table);
    }
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    self::table(table.get_mut(first)?, rest)
}
