//! MDF 4: each channel group is a group, its master the stamps.

use std::path::Path;

use super::group::{Group, Table};
use crate::column::{CellFault, Column};
use crate::mdf::{self, Signal};
use stickslip_base::Error;

/// Reads the numbers of all groups.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Table, Error> {
    let contents = mdf::parse(path, bytes)?;
    let mut groups: Vec<Group> = Vec::new();
    for (index, group) in contents.groups.into_iter().enumerate() {
        let mut name = if group.name.is_empty() { format!("group {}", index + 1) } else { group.name };
        if groups.iter().any(|other| other.name == name) {
            name = format!("{name} (group {})", index + 1);
        }
        let columns = group.signals.into_iter().map(column).collect();
        groups.push(Group::new(&name, group.master, columns));
    }
    let notes = if contents.finished {
        Vec::new()
    } else {
        vec!["The file was not finished by its writer; the rows up to the interruption were read.".to_owned()]
    };
    Ok(Table { groups, notes })
}

fn column(signal: Signal) -> Column {
    let unit = Some(signal.channel.unit).filter(|unit| !unit.is_empty());
    let mut column = Column::new(&signal.channel.name, signal.values).with_unit(unit).with_origin(signal.origin);
    if let Some(text) = signal.fault {
        column.fault = Some(CellFault { row: 0, text, cause: None });
    }
    column
}
