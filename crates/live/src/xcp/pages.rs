//! The segment of the parameters with its two pages, as bytes that a master reads and writes.

use std::collections::BTreeMap;

use super::{Bench, Change, Layout, PARAMETERS, SIZE};
use stickslip_base::Error;
use stickslip_base::parameters::{Fault, ParameterProblems, Problem};

/// The working set.
pub(super) const WORKING: u8 = 0;
/// What the run began with.
pub(super) const REFERENCE: u8 = 1;

/// Which page who looks at, and what is collected.
#[derive(Clone, Debug, Default)]
pub(super) struct Pages {
    /// The page that the master reads and writes.
    pub(super) master: u8,
    /// The working set that is collected while the bench runs the reference.
    collected: Option<Vec<f64>>,
    /// Bytes of values that are not complete, by address.
    incomplete: BTreeMap<u32, u8>,
}

impl Pages {
    /// The page that the bench runs.
    pub(super) fn bench(&self) -> u8 {
        if self.collected.is_some() { REFERENCE } else { WORKING }
    }

    /// The values of the page that the master looks at.
    pub(super) fn values(&self, layout: &Layout, bench: &dyn Bench) -> Vec<f64> {
        match (self.master, &self.collected) {
            (REFERENCE, _) => layout.values(&bench.reference()),
            (_, Some(collected)) => collected.clone(),
            (_, None) => layout.values(&bench.in_force()),
        }
    }

    /// Bytes of the page that the master looks at.
    pub(super) fn bytes(&self, layout: &Layout, bench: &dyn Bench) -> Vec<u8> {
        self.values(layout, bench).iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    /// Bytes of the working set are written: what must change in the bench for it, if anything.
    ///
    /// # Errors
    /// A value outside of its range, where the bench is not asked at once.
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
        // Laws between values are asked when all of them are there.
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

    /// The values that these bytes have completed.
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

    /// What must change in the bench before it runs a page.
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

    /// The bench runs a page from now on; these values it had before.
    pub(super) fn switched(&mut self, page: u8, before: Vec<f64>) {
        match page {
            WORKING => self.collected = None,
            _ if self.collected.is_none() => self.collected = Some(before),
            _ => {}
        }
    }

    /// The working set becomes the reference: what must change in the bench for it.
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
