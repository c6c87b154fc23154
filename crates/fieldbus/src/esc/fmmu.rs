//! Process data by logical addresses: memory management units and sync managers, as configured in the registers.

use super::memory::{DATA, FMMU, Memory, SYNC_MANAGER};

/// Number of units, and of sync managers.
pub(crate) const COUNT: u16 = 4;

/// A memory management unit: logical bits in a frame are bits of the memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fmmu {
    logical: u32,
    length: u16,
    first_bit: u8,
    last_bit: u8,
    pub(crate) physical: u16,
    physical_bit: u8,
    pub(crate) reads: bool,
    pub(crate) writes: bool,
}

impl Fmmu {
    /// The active units.
    pub(crate) fn active(memory: &Memory) -> impl Iterator<Item = Fmmu> + '_ {
        (0..COUNT).map(|number| FMMU + 16 * number).filter(|at| memory.byte(at + 12) & 1 != 0).map(|at| Fmmu {
            logical: memory.number::<4>(at) as u32,
            length: memory.word(at + 4),
            first_bit: memory.byte(at + 6) & 7,
            last_bit: memory.byte(at + 7) & 7,
            physical: memory.word(at + 8),
            physical_bit: memory.byte(at + 10) & 7,
            reads: memory.byte(at + 11) & 1 != 0,
            writes: memory.byte(at + 11) & 2 != 0,
        })
    }

    /// The part of a datagram at this logical address that the unit maps: its bytes and their physical address.
    pub(crate) fn mapped(&self, logical: u32, length: usize) -> Option<(std::ops::Range<usize>, u16)> {
        let (own, theirs) = (u64::from(self.logical), u64::from(logical));
        let first = own.max(theirs);
        let last = (own + u64::from(self.length)).min(theirs + length as u64);
        if first >= last {
            return None;
        }
        let physical = u64::from(self.physical) + (first - own);
        Some(((first - theirs) as usize..(last - theirs) as usize, physical as u16))
    }

    /// Whether whole bytes are mapped.
    pub(crate) fn is_bytewise(&self) -> bool {
        (self.first_bit, self.last_bit, self.physical_bit) == (0, 7, 0)
    }

    /// Copies the mapped bits of one byte, as used for the state of a mailbox.
    pub(crate) fn bits(&self, into: &mut u8, from: u8) {
        for (number, bit) in (self.first_bit..=self.last_bit.max(self.first_bit)).enumerate() {
            let value = from >> ((usize::from(self.physical_bit) + number) & 7) & 1;
            *into = *into & !(1 << bit) | value << bit;
        }
    }
}

/// A sync manager: protects a mailbox or process data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SyncManager {
    pub(crate) number: u16,
    pub(crate) start: u16,
    pub(crate) length: u16,
    pub(crate) control: u8,
    pub(crate) is_active: bool,
}

impl SyncManager {
    pub(crate) fn new(memory: &Memory, number: u16) -> Self {
        let at = SYNC_MANAGER + 8 * number;
        let start = memory.word(at);
        SyncManager {
            number,
            start,
            length: memory.word(at + 2),
            control: memory.byte(at + 4),
            // Registers are not a buffer.
            is_active: memory.byte(at + 6) & 1 != 0 && start >= DATA,
        }
    }

    /// The active sync manager of a range of the memory.
    pub(crate) fn of(memory: &Memory, address: u16, length: usize) -> Option<Self> {
        let all = (0..COUNT).map(|number| SyncManager::new(memory, number));
        all.filter(|it| it.is_active)
            .find(|it| super::memory::touches(address, length, it.start, usize::from(it.length)))
    }

    /// Whether a range contains the last byte, which hands the buffer over.
    pub(crate) fn ends_in(&self, address: u16, length: usize) -> bool {
        let last = u32::from(self.start) + u32::from(self.length.max(1)) - 1;
        (u32::from(address)..u32::from(address) + length as u32).contains(&last)
    }

    pub(crate) fn is_mailbox(&self) -> bool {
        self.control & 3 == 2
    }

    /// Whether the main device writes.
    pub(crate) fn is_output(&self) -> bool {
        self.control >> 2 & 3 == 1
    }

    pub(crate) fn has_watchdog(&self) -> bool {
        self.control & 0x40 != 0
    }

    fn status(&self) -> u16 {
        SYNC_MANAGER + 8 * self.number + 5
    }

    pub(crate) fn is_full(&self, memory: &Memory) -> bool {
        memory.byte(self.status()) & 8 != 0
    }

    pub(crate) fn set_full(&self, memory: &mut Memory, full: bool) {
        let status = memory.byte(self.status()) & !8 | u8::from(full) << 3;
        memory.set(self.status(), &[status]);
    }
}
