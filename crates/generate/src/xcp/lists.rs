//! Dynamic lists of measurements (DAQ): allocated, filled, started.

use super::packet::Refusal;
use super::sampler::Plan;
use super::{Layout, MAX_DTO, SIZE};

/// Maximum number of lists.
pub(super) const LISTS: usize = 32;
/// Maximum number of packets of a list: with the overload mark, their numbers stay below those of responses.
const PACKETS: usize = 0x7c;
/// Maximum number of entries of all lists.
const ENTRIES: usize = 4096;
/// Bytes before the values: numbers of the packet and of the list, then the time if requested.
const IDENTIFICATION: usize = 2;
const TIME: usize = 4;

/// The lists of a master.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists {
    lists: Vec<List>,
    /// List, packet and entry of the next write.
    place: Option<(usize, usize, usize)>,
    stage: Stage,
}

/// Stage of the allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
enum Stage {
    #[default]
    Nothing,
    Freed,
    Lists,
    Packets,
    Entries,
}

/// A list.
#[derive(Clone, Debug)]
pub(super) struct List {
    /// Entries of each packet: first measurement and number of measurements.
    packets: Vec<Vec<Option<(usize, usize)>>>,
    pub(super) timestamp: bool,
    pub(super) prescaler: u8,
    pub(super) priority: u8,
    pub(super) selected: bool,
    pub(super) running: bool,
    /// Whether it has run since it was last stopped.
    started: bool,
}

impl Lists {
    pub(super) fn count(&self) -> usize {
        self.lists.len()
    }

    pub(super) fn any_runs(&self) -> bool {
        self.lists.iter().any(|list| list.running)
    }

    pub(super) fn get(&mut self, number: u16) -> Result<&mut List, Refusal> {
        self.lists.get_mut(usize::from(number)).ok_or(Refusal::OutOfRange)
    }

    /// `FREE_DAQ`.
    pub(super) fn free(&mut self) {
        *self = Lists { stage: Stage::Freed, ..Lists::default() };
    }

    /// `ALLOC_DAQ`.
    pub(super) fn allocate(&mut self, count: u16) -> Result<(), Refusal> {
        self.advance(Stage::Freed, Stage::Lists)?;
        if usize::from(count) > LISTS {
            return Err(Refusal::MemoryOverflow);
        }
        let list = List {
            packets: Vec::new(),
            timestamp: false,
            prescaler: 1,
            priority: 0,
            selected: false,
            running: false,
            started: false,
        };
        self.lists = vec![list; usize::from(count)];
        Ok(())
    }

    /// `ALLOC_ODT`.
    pub(super) fn allocate_packets(&mut self, list: u16, count: u8) -> Result<(), Refusal> {
        self.advance(Stage::Lists, Stage::Packets)?;
        if usize::from(count) > PACKETS {
            return Err(Refusal::MemoryOverflow);
        }
        self.get(list)?.packets = vec![Vec::new(); usize::from(count)];
        Ok(())
    }

    /// `ALLOC_ODT_ENTRY`.
    pub(super) fn allocate_entries(&mut self, list: u16, packet: u8, count: u8) -> Result<(), Refusal> {
        self.advance(Stage::Packets, Stage::Entries)?;
        let packets = self.lists.iter().flat_map(|list| &list.packets);
        let taken: usize = packets.map(Vec::len).sum();
        if taken + usize::from(count) > ENTRIES {
            return Err(Refusal::MemoryOverflow);
        }
        let packet = self.get(list)?.packets.get_mut(usize::from(packet)).ok_or(Refusal::OutOfRange)?;
        *packet = vec![None; usize::from(count)];
        Ok(())
    }

    /// Advances from one stage of allocation to the next; stages after the first may be repeated.
    fn advance(&mut self, before: Stage, after: Stage) -> Result<(), Refusal> {
        let repeats = self.stage == after && after != Stage::Lists;
        if self.stage != before && !repeats {
            return Err(Refusal::Sequence);
        }
        self.stage = after;
        Ok(())
    }

    /// `SET_DAQ_PTR`.
    pub(super) fn point(&mut self, list: u16, packet: u8, entry: u8) -> Result<(), Refusal> {
        let entries = self.get(list)?.packets.get(usize::from(packet)).ok_or(Refusal::OutOfRange)?;
        if usize::from(entry) >= entries.len() {
            return Err(Refusal::OutOfRange);
        }
        self.place = Some((usize::from(list), usize::from(packet), usize::from(entry)));
        Ok(())
    }

    /// `WRITE_DAQ`: `size` bytes of measurements from an address on.
    pub(super) fn write(&mut self, layout: &Layout, bit: u8, size: u8, extension: u8, at: u32) -> Result<(), Refusal> {
        let (list, packet, entry) = self.place.ok_or(Refusal::Sequence)?;
        let size = u32::from(size);
        if bit != 0xff || size == 0 || !size.is_multiple_of(SIZE) {
            return Err(Refusal::OutOfRange);
        }
        let count = (size / SIZE) as usize;
        let first = layout.measurement_at(at, count).filter(|_| extension == 0).ok_or(Refusal::AccessDenied)?;
        let entries = &mut self.lists[list].packets[packet];
        let others = entries.iter().enumerate().filter(|(place, _)| *place != entry).filter_map(|(_, entry)| *entry);
        let values: usize = others.map(|(_, count)| count).sum::<usize>() + count;
        if IDENTIFICATION + values * SIZE as usize > MAX_DTO {
            return Err(Refusal::OutOfRange);
        }
        entries[entry] = Some((first, count));
        // After the last entry the place must be set again.
        self.place = (entry + 1 < entries.len()).then_some((list, packet, entry + 1));
        Ok(())
    }

    /// The plans of the running lists. A list that continues while another starts or stops may miss rows; it is marked by
    /// an overload.
    pub(super) fn plans(&mut self) -> Vec<Plan> {
        let plan = |(number, list): (usize, &mut List)| {
            let overload = std::mem::replace(&mut list.started, list.running);
            list.running.then(|| Plan {
                list: number as u8,
                prescaler: u64::from(list.prescaler),
                timestamp: list.timestamp,
                packets: list.packets.iter().map(|entries| columns(entries).collect()).collect(),
                overload,
            })
        };
        self.lists.iter_mut().enumerate().filter_map(plan).collect()
    }

    /// `START_STOP_SYNCH`: stops all lists, or starts or stops the selected ones.
    pub(super) fn synchronise(&mut self, mode: u8) -> Result<(), Refusal> {
        if mode > 2 {
            return Err(Refusal::ModeNotValid);
        }
        if mode == 1 {
            self.lists.iter().filter(|list| list.selected).try_for_each(List::check)?;
        }
        for list in &mut self.lists {
            match mode {
                0 => list.running = false,
                _ if list.selected => list.running = mode == 1,
                _ => {}
            }
            list.selected = false;
        }
        Ok(())
    }
}

fn columns(entries: &[Option<(usize, usize)>]) -> impl Iterator<Item = usize> {
    entries.iter().flatten().flat_map(|(first, count)| *first..first + count)
}

impl List {
    /// Number of packets, and largest number of entries in a packet.
    pub(super) fn sizes(&self) -> (u8, u8) {
        let most = self.packets.iter().map(Vec::len).max().unwrap_or(0);
        (self.packets.len() as u8, most as u8)
    }

    /// Whether it can be started: every entry is written, and the first packet fits.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        let whole = self.packets.iter().flatten().all(Option::is_some);
        let anything = self.packets.iter().any(|entries| !entries.is_empty());
        let first = self.packets.first().map_or(0, |entries| columns(entries).count());
        let time = if self.timestamp { TIME } else { 0 };
        let fits = IDENTIFICATION + time + first * SIZE as usize <= MAX_DTO;
        if whole && anything && fits { Ok(()) } else { Err(Refusal::DaqConfig) }
    }
}
