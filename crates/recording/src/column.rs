//! One signal of a recording.

/// One signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name in the header, without the unit.
    pub name: String,
    /// Unit in the file.
    pub unit: Option<String>,
    /// One value per row, without the [origin](Self::origin); cells that are not finite numbers are NaN.
    pub values: Vec<f64>,
    origin: f64,
    /// The first cell that is not a usable number. It matters only if the column is used.
    pub(crate) fault: Option<CellFault>,
}

/// A cell that is not a usable number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellFault {
    pub(crate) row: usize,
    /// Text of the cell.
    pub(crate) text: String,
    /// Cause, if it is not simply another text than a number.
    pub(crate) cause: Option<&'static str>,
}

/// Whole numbers up to this one are exact in `f64`.
pub(crate) const EXACT: i128 = 1 << 53;

impl Column {
    /// A column without a unit.
    pub fn new(name: &str, values: Vec<f64>) -> Self {
        let first = values.iter().position(|v| !v.is_finite());
        let fault = first.map(|row| CellFault { row, text: values[row].to_string(), cause: None });
        Column { name: name.to_owned(), unit: None, values, origin: 0.0, fault }
    }

    /// The column with this unit.
    pub fn with_unit(self, unit: Option<String>) -> Self {
        Column { unit, ..self }
    }

    /// The column with another [origin](Self::origin); its values stay.
    pub fn with_origin(self, origin: f64) -> Self {
        Column { origin, ..self }
    }

    /// Zero of the values: a true value is `origin + values[i]`, in the unit of the column.
    ///
    /// It is 0 except for time stamps that exceed the precision of a number, such as nanoseconds since 1970: their
    /// origin is close to the first stamp, and the values are the exact differences from it.
    pub fn origin(&self) -> f64 {
        self.origin
    }

    /// Whether the values count rows: whole numbers of unit 1, mostly rising. A row number is neither time nor signal.
    pub fn is_row_number(&self) -> bool {
        let whole = self.values.iter().all(|value| value.fract() == 0.0);
        let rising = self.values.windows(2).filter(|w| w[1] > w[0]).count();
        self.unit.as_deref() == Some("1") && whole && 10 * rising > 9 * self.values.len().saturating_sub(1)
    }

    /// The rows of these numbers.
    pub(crate) fn keep(&self, rows: &[usize]) -> Self {
        let values: Vec<f64> = rows.iter().map(|row| self.values[*row]).collect();
        let moved = |fault: &CellFault| match rows.binary_search(&fault.row) {
            Ok(row) => Some(CellFault { row, ..fault.clone() }),
            Err(_) => {
                let row = values.iter().position(|v| !v.is_finite())?;
                Some(CellFault { row, text: values[row].to_string(), cause: fault.cause })
            }
        };
        let fault = self.fault.as_ref().and_then(moved);
        Column { name: self.name.clone(), unit: self.unit.clone(), values, origin: self.origin, fault }
    }
}

/// Whether there are at least three whole numbers that rise by the same step.
pub(crate) fn counts_rows(values: &[f64]) -> bool {
    let [first, second, _, ..] = values else { return false };
    let step = second - first;
    step >= 1.0 && first.fract() == 0.0 && values.windows(2).all(|w| w[1] - w[0] == step) && step.fract() == 0.0
}

/// Values of whole numbers, each exact as a difference from a common origin.
#[derive(Default)]
pub(crate) struct Integers {
    pub(crate) origin: Option<i128>,
    /// Whether small numbers have an origin, too.
    pub(crate) relative: bool,
    pub(crate) values: Vec<f64>,
}

impl Integers {
    /// Appends a number; `None` is an empty cell.
    pub(crate) fn push(&mut self, number: Option<i128>) {
        let value = number.map_or(f64::NAN, |number| {
            // The origin is the nearest `f64`, so that `origin + value` is exact.
            let far = if self.relative || number.abs() >= EXACT { number as f64 as i128 } else { 0 };
            (number - *self.origin.get_or_insert(far)) as f64
        });
        self.values.push(value);
    }

    /// The column, in units of `scale`.
    pub(crate) fn column(self, name: &str, scale: f64) -> Column {
        let values = self.values.iter().map(|value| value * scale).collect();
        Column::new(name, values).with_origin(self.origin.unwrap_or(0) as f64 * scale)
    }
}
