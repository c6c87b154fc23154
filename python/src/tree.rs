//! Dotted paths as a tree.

use stickslip::parameters::Entry;

/// `group.name`; `name` at the top.
pub(crate) fn join(group: &str, name: &str) -> String {
    if group.is_empty() { name.into() } else { format!("{group}.{name}") }
}

/// What a path has below a group; `None` where it does not lie below.
pub(crate) fn below<'a>(path: &'a str, group: &str) -> Option<&'a str> {
    if group.is_empty() { Some(path) } else { path.strip_prefix(group)?.strip_prefix('.') }
}

/// What lies at a path.
pub(crate) enum Found<'a> {
    /// One value.
    Value(&'a Entry),
    /// A list of values.
    List(&'a [Entry]),
    /// Values under names.
    Group,
    /// Nothing.
    Nothing,
}

/// All that lies below a group: what lies together in the order of declaration stands together.
pub(crate) fn all_below<'a>(entries: &'a [Entry], group: &str) -> &'a [Entry] {
    let inside = |entry: &Entry| below(&entry.path, group).is_some();
    let begin = entries.iter().position(inside).unwrap_or(entries.len());
    let count = entries[begin..].iter().take_while(|entry| inside(entry)).count();
    &entries[begin..begin + count]
}

/// What lies at a path.
pub(crate) fn find<'a>(entries: &'a [Entry], path: &str) -> Found<'a> {
    if let Some(entry) = entries.iter().find(|entry| entry.path == path) {
        return Found::Value(entry);
    }
    let all = all_below(entries, path);
    let numbered = |entry: &Entry| below(&entry.path, path).is_some_and(|rest| rest.parse::<usize>().is_ok());
    match all {
        [] => Found::Nothing,
        list if list.iter().all(numbered) => Found::List(list),
        _ => Found::Group,
    }
}

/// The names right below a group, in the order of declaration.
pub(crate) fn names(entries: &[Entry], group: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for entry in all_below(entries, group) {
        let rest = below(&entry.path, group).unwrap_or_default();
        let name = rest.split('.').next().unwrap_or_default();
        if !names.iter().any(|known| known == name) {
            names.push(name.into());
        }
    }
    names
}
