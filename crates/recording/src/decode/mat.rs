//! Recordings as MAT files: vectors, matrices, and the structures of Simulink and ControlDesk.

use std::path::Path;

use super::group::{Group, Table, list};
use super::mat_value::{Structure, Value, variables};
use crate::column::Column;
use crate::unreadable;
use stickslip_base::Error;

/// Reads all variables with several numbers.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Table, Error> {
    let damaged = || unreadable(path, "damaged MAT file", "Copy it again, or save it again with save(…, '-v7').");
    let variables = variables(bytes).ok_or_else(damaged)?;
    let mut contents = Contents::default();
    for (name, value) in &variables {
        contents.add(name, value);
    }
    let Contents { mut groups, vectors, mut notes, objects } = contents;
    groups.extend(of_most_frequent_length(vectors, &mut notes));
    if !objects.is_empty() {
        let names = list(objects.iter().map(String::as_str));
        let fault = format!("objects of a class (timeseries, timetable, table, Dataset) are not read: {names}");
        if groups.is_empty() {
            let remedy =
                "In MATLAB, save their numbers: t = x.Time; q = x.Data; save(\"NAME.mat\", \"t\", \"q\", \"-v7\").";
            return Err(unreadable(path, &fault, remedy));
        }
        notes.push(format!("In the file, {fault}."));
    }
    Ok(Table { groups, notes })
}

#[derive(Default)]
struct Contents {
    groups: Vec<Group>,
    /// Columns of variables outside of structures.
    vectors: Vec<Column>,
    notes: Vec<String>,
    objects: Vec<String>,
}

impl Contents {
    fn add(&mut self, name: &str, value: &Value) {
        match value {
            Value::Numbers { size, values } => self.add_numbers(name, size, values),
            Value::Object => self.objects.push(name.to_owned()),
            Value::Structures(_) | Value::Cells(_) => {
                let structures = value.structures();
                let several = structures.len() > 1;
                for (index, structure) in structures.iter().enumerate() {
                    let name = if several { format!("{name}({})", index + 1) } else { name.to_owned() };
                    self.add_structure(&name, *structure);
                }
            }
            Value::Text(_) | Value::Other => {}
        }
    }

    /// Vectors, columns of matrices, or the rows of a To-File matrix, whose first row is the time.
    fn add_numbers(&mut self, name: &str, size: &[usize], values: &[f64]) {
        let [rows, width] = *size else { return };
        if values.len() < 2 {
            return;
        }
        let time: Vec<f64> = values.iter().step_by(rows.max(1)).copied().collect();
        if rows < 2 || rows >= width || !rises(&time) {
            self.vectors.extend(columns(name, rows, values));
            return;
        }
        let row = |row: usize| values[row..].iter().step_by(rows).copied().collect();
        let mut columns = vec![Column::new("time", time).with_unit(Some("s".into()))];
        columns.extend((1..rows).map(|index| Column::new(&numbered(name, index, rows - 1), row(index))));
        self.notes
            .push(format!("The rows of `{name}` were read as signals, the first one as the time in s (To File)."));
        self.groups.push(Group::new(name, Some(0), columns));
    }

    fn add_structure(&mut self, name: &str, structure: Structure) {
        if let Some(group) = with_time(name, structure) {
            self.groups.push(group);
            return;
        }
        let groups = control_desk(name, structure);
        if !groups.is_empty() {
            self.groups.extend(groups);
            return;
        }
        // Any other structure: its fields are variables.
        for (field, value) in structure.0 {
            self.add(&format!("{name}.{field}"), value);
        }
    }
}

/// Simulink's structure with time: `time`, `signals(i).values`, `signals(i).label`.
fn with_time(name: &str, structure: Structure) -> Option<Group> {
    let time = structure.field("time")?.numbers()?;
    let signals = structure.field("signals")?.structures();
    let rows = match signals.first()?.field("values")? {
        Value::Numbers { size, .. } if time.is_empty() => *size.first()?,
        _ => time.len(),
    };
    let mut columns = Vec::new();
    if !time.is_empty() {
        columns.push(Column::new("time", time.to_vec()).with_unit(Some("s".into())));
    }
    for (index, signal) in signals.iter().enumerate() {
        let Some(Value::Numbers { size, values }) = signal.field("values") else { continue };
        let label = signal.field("label").and_then(Value::text).or_else(|| signal.field("title").and_then(Value::text));
        let label = label.map_or_else(|| numbered(name, index + 1, signals.len()), str::to_owned);
        columns.extend(of_length(&label, size, values, rows));
    }
    (columns.len() > usize::from(!time.is_empty())).then(|| Group::new(name, (!time.is_empty()).then_some(0), columns))
}

/// Columns of a signal with a value or a vector for each of the rows, which are the first or the last dimension.
fn of_length(name: &str, size: &[usize], values: &[f64], rows: usize) -> Vec<Column> {
    let width = values.len().checked_div(rows).unwrap_or(0);
    if width * rows != values.len() || width == 0 {
        return Vec::new();
    }
    if size.first() == Some(&rows) {
        return columns(name, rows, values);
    }
    let column = |index: usize| values[index..].iter().step_by(width).copied().collect();
    (0..width).map(|index| Column::new(&numbered(name, index + 1, width), column(index))).collect()
}

/// ControlDesk's structure: stamps in `X(k).Data`, signals in `Y(i)` with `Name`, `Data`, `Unit` and, if there are
/// several stamps, `XIndex`.
fn control_desk(name: &str, structure: Structure) -> Vec<Group> {
    let part = |name| structure.field(name).map(Value::structures).unwrap_or_default();
    let (stamps, signals) = (part("X"), part("Y"));
    let unit =
        |part: &Structure| part.field("Unit").and_then(Value::text).filter(|unit| *unit != "-").map(str::to_owned);
    let mut groups = Vec::new();
    for (index, x) in stamps.iter().enumerate() {
        let Some(time) = x.field("Data").and_then(Value::numbers) else { continue };
        let label = x.field("Name").and_then(Value::text).unwrap_or("time");
        let unit_of_time = unit(x).or_else(|| Some("s".into()));
        let mut columns = vec![Column::new(label, time.to_vec()).with_unit(unit_of_time)];
        for (number, y) in signals.iter().enumerate() {
            let belongs = match y.field("XIndex").and_then(Value::numbers).and_then(<[f64]>::first) {
                Some(of) => *of == (index + 1) as f64,
                None => true,
            };
            let Some(Value::Numbers { size, values }) = y.field("Data").filter(|_| belongs) else { continue };
            let label = y.field("Name").and_then(Value::text).map(|name| name.replace('"', ""));
            let label = label.unwrap_or_else(|| format!("Y{}", number + 1));
            let with_unit = |column: Column| column.with_unit(unit(y));
            columns.extend(of_length(&label, size, values, time.len()).into_iter().map(with_unit));
        }
        if columns.len() > 1 {
            let name = if stamps.len() > 1 { format!("{name}.X({})", index + 1) } else { name.to_owned() };
            groups.push(Group::new(&name, Some(0), columns));
        }
    }
    groups
}

/// A vector, or the columns of a matrix.
fn columns(name: &str, rows: usize, values: &[f64]) -> Vec<Column> {
    if rows <= 1 || values.len() == rows {
        return vec![Column::new(name, values.to_vec())];
    }
    let width = values.len() / rows;
    let column = |(index, values): (usize, &[f64])| Column::new(&numbered(name, index + 1, width), values.to_vec());
    values.chunks(rows).enumerate().map(column).collect()
}

/// `NAME_2`, or the name if there is only one.
fn numbered(name: &str, index: usize, of: usize) -> String {
    if of > 1 { format!("{name}_{index}") } else { name.to_owned() }
}

fn rises(values: &[f64]) -> bool {
    values.len() >= 3 && values.windows(2).all(|w| w[1] > w[0])
}

/// The vectors of the most frequent length. A time that is a sample longer loses its last one.
fn of_most_frequent_length(mut columns: Vec<Column>, notes: &mut Vec<String>) -> Option<Group> {
    let alike = |length: usize| columns.iter().filter(|column| column.values.len() == length).count();
    let lengths = columns.iter().map(|column| column.values.len());
    let length = lengths.max_by_key(|length| (alike(*length), *length))?;
    let is_time = |column: &Column| column.values.len() == length + 1 && rises(&column.values);
    let longer: Vec<usize> = (0..columns.len()).filter(|index| is_time(&columns[*index])).collect();
    if let [index] = longer[..] {
        let column = &mut columns[index];
        let kept: Vec<usize> = (0..length).collect();
        notes.push(format!(
            "Variable `{}` has {} values, the others {length}: its last one was omitted.",
            column.name,
            length + 1
        ));
        *column = column.keep(&kept);
    }
    let (kept, others): (Vec<Column>, Vec<Column>) = columns.into_iter().partition(|c| c.values.len() == length);
    if !others.is_empty() {
        let names = list(others.iter().map(|column| column.name.as_str()));
        notes.push(format!("Variables of other lengths than {length} were not read: {names}."));
    }
    Some(Group::new("variables", None, kept))
}
