//! What a master measures, as packets in a bounded ring.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::Producer;

use stickslip_recording::capture::{Account, Row, Sink};

/// Marks the first number of a packet where rows before it are lost (overload indication by the PID).
pub(super) const OVERLOAD: u8 = 0x80;

/// A list of measurements that runs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    /// Its number.
    pub(super) list: u8,
    /// Of so many cycles it takes one: those whose number it divides.
    pub(super) prescaler: u64,
    /// Whether its first packet has the time.
    pub(super) timestamp: bool,
    /// Of each packet the columns, 0 the number of the cycle, then the signals.
    pub(super) packets: Vec<Vec<usize>>,
    /// Whether rows were lost since the last packet.
    pub(super) overload: bool,
}

impl Plan {
    /// Bytes of all its packets with the length before each.
    fn bytes(&self) -> usize {
        let values: usize = self.packets.iter().map(|columns| 8 * columns.len()).sum();
        4 * self.packets.len() + values + if self.timestamp { 4 } else { 0 }
    }
}

/// Takes every row, and puts what the lists want of it into a ring: all packets of a row, or none where there is no
/// room.
pub struct Sampler {
    plans: Vec<Plan>,
    width: usize,
    rate: f64,
    out: Producer<u8>,
    packed: Vec<u8>,
    lost: Arc<AtomicU64>,
    account: Account,
}

impl Sampler {
    /// Of these lists, at a rate [Hz], into a ring; rows that are lost are counted up.
    pub(super) fn new(plans: Vec<Plan>, rate: f64, out: Producer<u8>, lost: Arc<AtomicU64>) -> Self {
        let width = plans.iter().flat_map(|plan| plan.packets.iter().flatten()).max().copied().unwrap_or(0);
        let packed = Vec::with_capacity(plans.iter().map(Plan::bytes).max().unwrap_or(0));
        Sampler { plans, width, rate, out, packed, lost, account: Account::default() }
    }
}

/// The time stamp of a cycle [µs], which starts anew every 2³² µs.
pub(super) fn timestamp(cycle: u64, rate: f64) -> u32 {
    (cycle as f64 * 1e6 / rate).round() as u64 as u32
}

impl Sink for Sampler {
    fn width(&self) -> usize {
        self.width
    }

    fn push(&mut self, row: Row<'_>) {
        self.account.arrive(&row);
        let cycle = row.cycle();
        let mut gone = row.lost();
        let mut stored = false;
        for plan in &mut self.plans {
            plan.overload |= row.lost() > 0;
            if !cycle.is_multiple_of(plan.prescaler) {
                continue;
            }
            let Ok(mut chunk) = self.out.write_chunk(plan.bytes()) else {
                plan.overload = true;
                gone += 1;
                continue;
            };
            self.packed.clear();
            for (number, columns) in plan.packets.iter().enumerate() {
                let time = plan.timestamp && number == 0;
                let length = 2 + 8 * columns.len() + if time { 4 } else { 0 };
                let mark = if plan.overload { OVERLOAD } else { 0 };
                self.packed.extend_from_slice(&(length as u16).to_le_bytes());
                self.packed.extend_from_slice(&[number as u8 | mark, plan.list]);
                if time {
                    self.packed.extend_from_slice(&timestamp(cycle, self.rate).to_le_bytes());
                }
                for &column in columns {
                    let value = column.checked_sub(1).map_or(cycle as f64, |signal| row.values()[signal]);
                    self.packed.extend_from_slice(&value.to_le_bytes());
                }
            }
            let (first, second) = chunk.as_mut_slices();
            let (begin, end) = self.packed.split_at(first.len());
            first.copy_from_slice(begin);
            second.copy_from_slice(end);
            chunk.commit_all();
            plan.overload = false;
            stored = true;
        }
        if gone > 0 {
            self.lost.fetch_add(gone, Ordering::Relaxed);
        }
        if stored {
            self.account.stored += 1;
        } else {
            self.account.discarded += 1;
        }
    }

    fn account(&self) -> Account {
        self.account
    }
}
