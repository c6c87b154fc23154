//! Dotted paths as a tree.

use stickslip::parameters::Entry;

/// `group.name`; `name` at the top.
pub(crate) fn join(group: &str, name: &str) -> String {
    if group.is_empty() { name.into() } else { format!("{group}.{name}") }
}

/// The part of a path below a group; `None` if the path is not below it.
pub(crate) fn below<'a>(path: &'a str, group: &str) -> Option<&'a str> {
    if group.is_empty() { Some(path) } else { path.strip_prefix(group)?.strip_prefix('.') }
}

/// Content at a path.
pub(crate) enum Node<'a> {
    /// One value.
    Value(&'a Entry),
    /// A list of values.
    List(&'a [Entry]),
    /// Named values.
    Group,
    /// Nothing.
    Nothing,
}

/// All entries below a group; they are contiguous in the order of declaration.
pub(crate) fn all_below<'a>(entries: &'a [Entry], group: &str) -> &'a [Entry] {
    let inside = |entry: &Entry| below(&entry.path, group).is_some();
    let start = entries.iter().position(inside).unwrap_or(entries.len());
    let count = entries[start..].iter().take_while(|entry| inside(entry)).count();
    &entries[start..start + count]
}

/// The content at a path.
pub(crate) fn find<'a>(entries: &'a [Entry], path: &str) -> Node<'a> {
    if let Some(entry) = entries.iter().find(|entry| entry.path == path) {
        return Node::Value(entry);
    }
    let all = all_below(entries, path);
    let numbered = |entry: &Entry| below(&entry.path, path).is_some_and(|rest| rest.parse::<usize>().is_ok());
    match all {
        [] => Node::Nothing,
        list if list.iter().all(numbered) => Node::List(list),
        _ => Node::Group,
    }
}

/// The names right below a group, in the order of declaration.
pub(crate) fn names(entries: &[Entry], group: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for entry in all_below(entries, group) {
        let rest = below(&entry.path, group).unwrap_or_default();
        let name = rest.split('.').next().unwrap_or_default();
        if !names.iter().any(|other| other == name) {
            names.push(name.into());
        }
    }
    names
}
