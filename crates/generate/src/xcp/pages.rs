//! The segment of the parameters with its two pages, as bytes that a master reads and writes.

use std::collections::BTreeMap;

use super::{Bench, Change, Layout, PARAMETERS, SIZE};
use stickslip_base::Error;
use stickslip_base::parameters::{Fault, ParameterProblems, Problem};

/// The working set.
pub(super) const WORKING: u8 = 0;
/// The parameters at the start of the run.
pub(super) const REFERENCE: u8 = 1;

/// The active pages of master and bench, and the collected values.
#[derive(Clone, Debug, Default)]
pub(super) struct Pages {
    /// The page that the master reads and writes.
    pub(super) master: u8,
    /// The collected working set while the bench runs the reference.
    collected: Option<Vec<f64>>,
    /// Bytes of values that are not complete, by address.
    incomplete: BTreeMap<u32, u8>,
}

impl Pages {
    /// The page that the bench runs.
    pub(super) fn bench(&self) -> u8 {
        if self.collected.is_some() { REFERENCE } else { WORKING }
    }

    /// The values of the master's page.
    pub(super) fn values(&self, layout: &Layout, bench: &dyn Bench) -> Vec<f64> {
        match (self.master, &self.collected) {
            (REFERENCE, _) => layout.values(&bench.reference()),
            (_, Some(collected)) => collected.clone(),
            (_, None) => layout.values(&bench.in_force()),
        }
    }

    /// The bytes of the master's page.
    pub(super) fn bytes(&self, layout: &Layout, bench: &dyn Bench) -> Vec<u8> {
        self.values(layout, bench).iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    /// Writes bytes of the working set. Returns the necessary change of the bench, if any.
    ///
    /// # Errors
    /// A value outside of its range, while values are collected.
    pub(super) fn write(
        &mut self,
        layout: &Layout,
        bench: &dyn Bench,
        address: u32,
        bytes: &[u8],
    ) -> Result<Option<Change>, Error> {
        self.incomplete.extend((address..).zip(bytes.iter().copied()));
        let complete = self.take_complete(layout, address, bytes.len());
        let Some(collected) = &mut self.collected else {
            let before = layout.values(&bench.in_force());
            let mut after = before.clone();
            complete.iter().for_each(|&(index, value)| after[index] = value);
            let changes =
                layout.changes(&before, &after, |index| complete.iter().any(|(written, _)| *written == index));
            return Ok((!changes.is_empty()).then_some(Change::Set(changes)));
        };
        // Conditions between values are checked when all of them are complete.
        let outside = |&&(index, value): &&(usize, f64)| {
            let cell = &layout.parameters[index].cell;
            !(cell.minimum..=cell.maximum).contains(&value)
        };
        let problems: Vec<Problem> =
            complete.iter().filter(outside).map(|&(i, value)| outside_of(layout, i, value)).collect();
        if !problems.is_empty() {
            return Err(ParameterProblems { file: "page 0".into(), problems }.into());
        }
        complete.into_iter().for_each(|(index, value)| collected[index] = value);
        Ok(None)
    }

    /// The values completed by these bytes.
    fn take_complete(&mut self, layout: &Layout, address: u32, count: usize) -> Vec<(usize, f64)> {
        let first = (address - PARAMETERS) / SIZE;
        let last = (address + count as u32 - 1 - PARAMETERS) / SIZE;
        let mut complete = Vec::new();
        for index in first..=last.min(layout.parameters.len() as u32 - 1) {
            let begin = PARAMETERS + index * SIZE;
            let bytes: Vec<u8> = self.incomplete.range(begin..begin + SIZE).map(|(_, byte)| *byte).collect();
            if let Ok(bytes) = <[u8; SIZE as usize]>::try_from(bytes) {
                self.incomplete.retain(|place, _| !(begin..begin + SIZE).contains(place));
                complete.push((index as usize, f64::from_le_bytes(bytes)));
            }
        }
        complete
    }

    /// The necessary change of the bench before it runs a page.
    pub(super) fn switching(&self, layout: &Layout, bench: &dyn Bench, page: u8) -> Option<Change> {
        match (page, &self.collected) {
            (REFERENCE, None) => Some(Change::Reset),
            (WORKING, Some(collected)) => {
                let now = layout.values(&bench.in_force());
                let changes = layout.changes(&now, collected, |_| true);
                (!changes.is_empty()).then_some(Change::Set(changes))
            }
            _ => None,
        }
    }

    /// Notes that the bench runs a page from now on, with its values before.
    pub(super) fn switched(&mut self, page: u8, before: Vec<f64>) {
        match page {
            WORKING => self.collected = None,
            _ if self.collected.is_none() => self.collected = Some(before),
            _ => {}
        }
    }

    /// Copies the reference to the working set. Returns the necessary change of the bench.
    pub(super) fn reset(&mut self, layout: &Layout, bench: &dyn Bench) -> Option<Change> {
        match &mut self.collected {
            Some(collected) => {
                *collected = layout.values(&bench.reference());
                None
            }
            None => Some(Change::Reset),
        }
    }
}

fn outside_of(layout: &Layout, index: usize, value: f64) -> Problem {
    let parameter = &layout.parameters[index];
    let (minimum, maximum, unit) = (parameter.cell.minimum, parameter.cell.maximum, parameter.cell.unit);
    let fault = Fault::OutOfRange { value, minimum, maximum, default: parameter.default, unit };
    Problem { line: None, path: parameter.cell.path.clone(), fault }
}
