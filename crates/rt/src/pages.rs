//! Parameter pages: a whole, checked set of parameters enters at the beginning of a cycle, or not at all.
//!
//! Three slots: the writer fills one, the reader holds one, the third is on its way. Each side swaps its own with that
//! on the way by one atomic exchange, so that nobody ever waits, and the reader has the newest set or the one before,
//! never half of one. Old sets are dropped by the writer: the reader frees no memory.
//!
//! ```
//! let (mut writer, mut reader) = stickslip_rt::pages::exchange("gains of the morning");
//! assert_eq!(writer.publish("gains of noon"), 1);
//! assert_eq!(writer.entered(), None);
//! assert!(reader.take(4711));
//! assert_eq!((reader.page(), reader.generation(), writer.entered()), (&"gains of noon", 1, Some(4711)));
//! ```

#![expect(unsafe_code, reason = "one slot belongs to one side at a time; the exchange of the third says to which")]

use crate::sync::{Arc, AtomicU8, AtomicU64, Ordering, UnsafeCell};

/// In `middle`, beside the index of a slot: the reader has not seen it.
const FRESH: u8 = 4;
/// In `entered`: no cycle has begun with it yet.
const NEVER: u64 = u64::MAX;

struct Slot<T> {
    page: UnsafeCell<Option<T>>,
    generation: AtomicU64,
    /// The cycle that first ran with it.
    entered: AtomicU64,
}

struct Shared<T> {
    slots: [Slot<T>; 3],
    /// Index of the slot on the way.
    middle: AtomicU8,
}

/// The side that hands in.
pub struct Writer<T> {
    shared: Arc<Shared<T>>,
    own: u8,
    /// Slot and generation of the newest page.
    newest: (u8, u64),
}

/// The side within the deadline.
pub struct Reader<T> {
    shared: Arc<Shared<T>>,
    own: u8,
}

/// Both sides; the reader holds `first`, generation 0, in force from cycle 0.
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
    /// Hands in a page, which replaces one that the reader has not taken yet. Returns its generation: 1, 2, 3, …
    pub fn publish(&mut self, page: T) -> u64 {
        let generation = self.newest.1 + 1;
        let slot = &self.shared.slots[usize::from(self.own)];
        slot.generation.store(generation, Ordering::Relaxed);
        slot.entered.store(NEVER, Ordering::Relaxed);
        // SAFETY: the slot `own` is the writer's alone until the exchange below.
        slot.page.with_mut(|place| unsafe { *place = Some(page) });
        self.newest = (self.own, generation);
        // Release: the page is written before the reader can see its slot. Acquire: the reader is done with the other.
        self.own = self.shared.middle.swap(self.own | FRESH, Ordering::AcqRel) & !FRESH;
        generation
    }

    /// The cycle that first ran with the newest page; `None` while it waits for one.
    pub fn entered(&self) -> Option<u64> {
        let cycle = self.shared.slots[usize::from(self.newest.0)].entered.load(Ordering::Acquire);
        (cycle != NEVER).then_some(cycle)
    }
}

impl<T> Reader<T> {
    /// At the beginning of a cycle: takes the newest page, if there is a new one, and tells the writer.
    pub fn take(&mut self, cycle: u64) -> bool {
        if self.shared.middle.load(Ordering::Relaxed) & FRESH == 0 {
            return false;
        }
        self.own = self.shared.middle.swap(self.own, Ordering::AcqRel) & !FRESH;
        self.slot().entered.store(cycle, Ordering::Release);
        true
    }

    /// The page in force.
    pub fn page(&self) -> &T {
        // SAFETY: the slot `own` is the reader's alone until the next exchange, which needs `&mut self`.
        let page = self.slot().page.with(|place| unsafe { &*place });
        page.as_ref().expect("the first page is there from the start, and only filled slots are on the way as fresh")
    }

    /// Its generation.
    pub fn generation(&self) -> u64 {
        self.slot().generation.load(Ordering::Relaxed)
    }

    fn slot(&self) -> &Slot<T> {
        &self.shared.slots[usize::from(self.own)]
    }
}
