//! State of a fieldbus segment for viewers: frames, states of the devices, place of the frames relative to SYNC0.
//!
//! The thread of the frames writes one record a frame into a bounded ring, without allocation or lock. The collector of
//! the bench takes the records and computes the statistics; viewers read those.

mod status;
#[cfg(test)]
mod tests;
mod words;

use std::sync::{Mutex, MutexGuard, PoisonError};

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_rt::Durations;

use status::Spread;
pub use status::{DeviceStatus, DriveStatus, FrameOffset, SegmentStatus};

use crate::bins::logarithmic;

/// Most devices.
pub const DEVICES: usize = 16;
/// Records that fit into the ring: half a second at 8 kHz.
const ROOM: usize = 4096;

/// A frame with process data, and the states of the devices after it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameRecord {
    /// From sending to receiving [ns]; `None`: lost.
    pub round_trip: Option<u32>,
    /// Time at which it passed the reference clock, relative to the middle between two pulses of SYNC0 [ns]; positive for
    /// a late frame. `None` for a frame without a tick of the bench.
    pub offset: Option<i32>,
    /// Working counter of the last frame that returned.
    pub counter: u16,
    /// AL states, by position; 0: no answer.
    pub states: [u8; DEVICES],
    /// Drive motor and load motor.
    pub drives: [DriveRecord; 2],
    /// Position and AL status code of a device that has left OP.
    pub left: Option<(u16, u16)>,
}

/// State of a drive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriveRecord {
    /// Statusword (0x6041).
    pub statusword: u16,
    /// Its state, in words.
    pub state: &'static str,
    /// Error code (0x603F); 0: none.
    pub error: u16,
}

/// A device of the segment.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentDevice {
    /// Name in its EEPROM.
    pub name: String,
    /// Role in the bench: `motor`, `load`, `accelerometer`; otherwise empty.
    pub role: &'static str,
}

/// The writing end.
#[derive(Debug)]
pub struct SegmentOutlet(Producer<FrameRecord>);

impl SegmentOutlet {
    /// Stores the record of a frame; without room it is lost.
    pub fn push(&mut self, record: FrameRecord) {
        let _ = self.0.push(record);
    }
}

/// A segment, shared by collector and viewers.
#[derive(Debug)]
pub struct Segment {
    devices: Vec<SegmentDevice>,
    expected: u16,
    period: f64,
    collected: Mutex<Collected>,
}

#[derive(Debug)]
struct Collected {
    ring: Consumer<FrameRecord>,
    last: FrameRecord,
    frames: u64,
    lost: u64,
    wrong: u64,
    /// Since the start; in the running second; in the last complete one.
    all: Spread,
    running: Spread,
    second: Spread,
    /// Frames of the running second.
    running_frames: u64,
    distances: Durations,
    round_trips: Durations,
}

impl Segment {
    /// A segment with these devices, this working counter and this period [s]; and the end that writes.
    pub fn new(devices: Vec<SegmentDevice>, expected: u16, period: f64) -> (Self, SegmentOutlet) {
        let (writer, ring) = RingBuffer::new(ROOM);
        let collected = Collected {
            ring,
            last: FrameRecord::default(),
            frames: 0,
            lost: 0,
            wrong: 0,
            all: Spread::default(),
            running: Spread::default(),
            second: Spread::default(),
            running_frames: 0,
            distances: Durations::default(),
            round_trips: Durations::default(),
        };
        (Segment { devices, expected, period, collected: Mutex::new(collected) }, SegmentOutlet(writer))
    }

    fn lock(&self) -> MutexGuard<'_, Collected> {
        self.collected.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the available records.
    pub fn collect(&self) {
        let mut collected = self.lock();
        while let Ok(record) = collected.ring.pop() {
            collected.add(&record, self.expected, (1.0 / self.period).round() as u64);
        }
    }

    /// Present state.
    pub fn status(&self) -> SegmentStatus {
        self.collect();
        let collected = self.lock();
        let last = &collected.last;
        let devices = self.devices.iter().enumerate().map(|(position, device)| device.status(position, last));
        SegmentStatus {
            devices: devices.collect(),
            counter: last.counter,
            expected: self.expected,
            frames: collected.frames,
            lost: collected.lost,
            wrong: collected.wrong,
            offset: collected.all.summary(),
            last_second: collected.second.summary(),
            distance: status::seconds(collected.distances.quantiles()),
            round_trip: status::seconds(collected.round_trips.quantiles()),
            distance_bins: logarithmic(|edges| collected.distances.counts(edges)),
            round_trip_bins: logarithmic(|edges| collected.round_trips.counts(edges)),
        }
    }
}

impl Collected {
    fn add(&mut self, record: &FrameRecord, expected: u16, second: u64) {
        self.last = *record;
        self.frames += 1;
        match record.round_trip {
            Some(time) => {
                self.round_trips.add(time.into());
                self.wrong += u64::from(record.counter != expected);
            }
            None => self.lost += 1,
        }
        if let Some(offset) = record.offset {
            self.all.add(offset);
            self.running.add(offset);
            self.distances.add(offset.unsigned_abs().into());
        }
        self.running_frames += 1;
        if self.running_frames >= second {
            (self.second, self.running, self.running_frames) = (self.running, Spread::default(), 0);
        }
    }
}
