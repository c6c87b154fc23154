//! Parameter pages: a complete, checked parameter set becomes active at the start of a cycle, or not at all.
//!
//! There are three slots: one for the writer, one for the reader, one in the middle. Each side exchanges its slot with
//! the middle one by one atomic operation. Neither side waits, and the reader has the newest set or the one before,
//! never a mixture. The writer drops old sets, so that the reader frees no memory.
//!
//! ```
//! let (mut writer, mut reader) = stickslip_rt::pages::exchange("gains of the morning");
//! assert_eq!(writer.publish("gains of noon"), 1);
//! assert_eq!(writer.entered(), None);
//! assert!(reader.take(4711));
//! assert_eq!((reader.page(), reader.generation(), writer.entered()), (&"gains of noon", 1, Some(4711)));
//! ```

#![expect(unsafe_code, reason = "each slot belongs to one side at a time, given by the atomic exchange")]

use crate::sync::{Arc, AtomicU8, AtomicU64, Ordering, UnsafeCell};

/// Flag in `middle`, in addition to the slot index: the reader has not taken it.
const FRESH: u8 = 4;
/// Value of `entered` before the first cycle with the page.
const NEVER: u64 = u64::MAX;

struct Slot<T> {
    page: UnsafeCell<Option<T>>,
    generation: AtomicU64,
    /// First cycle with this page.
    entered: AtomicU64,
}

struct Shared<T> {
    slots: [Slot<T>; 3],
    /// Index of the middle slot.
    middle: AtomicU8,
}

/// The side that publishes pages.
pub struct Writer<T> {
    shared: Arc<Shared<T>>,
    own: u8,
    /// Slot and generation of the newest page.
    newest: (u8, u64),
}

/// The side inside the deadline.
pub struct Reader<T> {
    shared: Arc<Shared<T>>,
    own: u8,
}

/// Both sides; the reader has `first`, generation 0, active from cycle 0.
pub fn exchange<T: Send>(first: T) -> (Writer<T>, Reader<T>) {
    let slot = |page, entered| Slot {
        page: UnsafeCell::new(page),
        generation: AtomicU64::new(0),
        entered: AtomicU64::new(entered),
    };
    let slots = [slot(Some(first), 0), slot(None, NEVER), slot(None, NEVER)];
    let shared = Arc::new(Shared { slots, middle: AtomicU8::new(1) });
    (Writer { shared: shared.clone(), own: 2, newest: (0, 0) }, Reader { shared, own: 0 })
}

impl<T> Writer<T> {
    /// Publishes a page. It replaces one that the reader has not taken yet. Returns its generation: 1, 2, 3, …
    pub fn publish(&mut self, page: T) -> u64 {
        let generation = self.newest.1 + 1;
        let slot = &self.shared.slots[usize::from(self.own)];
        slot.generation.store(generation, Ordering::Relaxed);
        slot.entered.store(NEVER, Ordering::Relaxed);
        // SAFETY: the slot `own` belongs to the writer until the exchange below.
        slot.page.with_mut(|place| unsafe { *place = Some(page) });
        self.newest = (self.own, generation);
        // Release: the page is written before the reader gets its slot. Acquire: the reader no longer uses the other
        // slot.
        self.own = self.shared.middle.swap(self.own | FRESH, Ordering::AcqRel) & !FRESH;
        generation
    }

    /// First cycle with the newest page; `None` until then.
    pub fn entered(&self) -> Option<u64> {
        let cycle = self.shared.slots[usize::from(self.newest.0)].entered.load(Ordering::Acquire);
        (cycle != NEVER).then_some(cycle)
    }
}

impl<T> Reader<T> {
    /// At the start of a cycle: takes a new page, if there is one, and stores the cycle for the writer.
    pub fn take(&mut self, cycle: u64) -> bool {
        if self.shared.middle.load(Ordering::Relaxed) & FRESH == 0 {
            return false;
        }
        self.own = self.shared.middle.swap(self.own, Ordering::AcqRel) & !FRESH;
        self.slot().entered.store(cycle, Ordering::Release);
        true
    }

    /// The active page.
    pub fn page(&self) -> &T {
        // SAFETY: the slot `own` belongs to the reader until the next exchange, which needs `&mut self`.
        let page = self.slot().page.with(|place| unsafe { &*place });
        page.as_ref().expect("the first page exists from the start, and only filled slots are marked as fresh")
    }

    /// Generation of the active page.
    pub fn generation(&self) -> u64 {
        self.slot().generation.load(Ordering::Relaxed)
    }

    fn slot(&self) -> &Slot<T> {
        &self.shared.slots[usize::from(self.own)]
    }
}
