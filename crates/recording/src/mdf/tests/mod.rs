//! Written data are recovered after any interruption of the writer; invalid files are refused.

mod hostile;
mod interrupted;
mod other_programs;
mod written;

use std::io::{self, Cursor, ErrorKind, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, UNIX_EPOCH};

use super::reader::contents;
use super::writer::Storage;
use super::{Cause, Channel, Contents, Event, Header, Writer};
use stickslip_base::Error;

const TICK_TIME: f64 = 250e-6;

/// A disk with limited room, whose contents outlive the writer.
#[derive(Clone, Default)]
struct Disk {
    bytes: Arc<Mutex<Cursor<Vec<u8>>>>,
    room: Arc<Mutex<usize>>,
}

impl Disk {
    fn with_room(room: usize) -> Self {
        Disk { room: Arc::new(Mutex::new(room)), ..Disk::default() }
    }

    fn contents(&self) -> Vec<u8> {
        self.bytes.lock().unwrap().get_ref().clone()
    }

    fn make_room(&self) {
        *self.room.lock().unwrap() = usize::MAX;
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut room = self.room.lock().unwrap();
        let accepted = bytes.len().min(*room);
        if accepted == 0 && !bytes.is_empty() {
            return Err(ErrorKind::StorageFull.into());
        }
        *room -= accepted;
        self.bytes.lock().unwrap().write(&bytes[..accepted])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, place: SeekFrom) -> io::Result<u64> {
        self.bytes.lock().unwrap().seek(place)
    }
}

impl Storage for Disk {
    fn settle(&mut self, length: u64) -> io::Result<()> {
        self.bytes.lock().unwrap().settle(length)
    }
}

fn header() -> Header {
    Header {
        start: UNIX_EPOCH + Duration::from_nanos(1_763_812_345_678_901_234),
        program: "stickslip".into(),
        version: "0.1.0".into(),
        comment: "M_S < 0.3 N·m & \"quiet\"\nsecond line\twith a tab".into(),
        properties: vec![("preset".into(), "clm-bench".into()), ("a <b> & \"c\"".into(), "ü\r\n".into())],
    }
}

fn channel(name: &str, unit: &str, comment: &str) -> Channel {
    Channel { name: name.into(), unit: unit.into(), comment: comment.into() }
}

fn channels() -> Vec<Channel> {
    vec![channel("Ω_est", "rad/s", "estimated velocity"), channel("torque", "N m", "")]
}

fn event(cycle: u64) -> Event {
    Event { cycle, name: "fault".into(), comment: "limit < 2 rad/s".into(), cause: Cause::Error }
}

/// Special values and ordinary ones.
fn values(cycle: u64) -> [f64; 2] {
    let odd = [f64::NAN, -0.0, f64::INFINITY, 5e-324, -f64::MAX];
    [libm::sin(cycle as f64 * 0.37), odd.get(cycle as usize % 20).copied().unwrap_or(cycle as f64 * 0.1)]
}

fn writer(disk: &Disk) -> Result<Writer, Error> {
    Writer::on(Path::new("run.mf4"), Box::new(disk.clone()), &header(), &channels(), TICK_TIME)
}

/// The recorded cycles, after a check of all values to the bit.
fn cycles(contents: &Contents) -> Vec<u64> {
    let [group] = &contents.groups[..] else { panic!("{} groups", contents.groups.len()) };
    let names: Vec<_> = group.signals.iter().map(|signal| signal.channel.name.as_str()).collect();
    assert_eq!(names, ["time", "cycle", "Ω_est", "torque"]);
    let [time, cycle, first, second] = &group.signals[..] else { panic!("four signals") };
    let cycles: Vec<u64> = cycle.values.iter().map(|cycle| *cycle as u64).collect();
    for (row, cycle) in cycles.iter().enumerate() {
        let expected = values(*cycle);
        assert_eq!(time.values[row], *cycle as f64 * TICK_TIME);
        assert_eq!(first.values[row].to_bits(), expected[0].to_bits(), "cycle {cycle}");
        assert_eq!(second.values[row].to_bits(), expected[1].to_bits(), "cycle {cycle}");
    }
    cycles
}

/// A small run: its cycles, and the length of the file after each part with its number of rows.
fn small_run(disk: &Disk) -> (Vec<(usize, usize)>, Writer) {
    let mut writer = writer(disk).unwrap();
    let mut lengths = vec![(disk.contents().len(), 0)];
    writer.attach("clm-bench.toml", "application/toml", b"[plant]\n").unwrap();
    for block in 0..4 {
        for cycle in 10 * block..10 * block + 10 {
            writer.row(cycle + 5, &values(cycle + 5)).unwrap();
        }
        writer.flush().unwrap();
        lengths.push((disk.contents().len(), 10 * (block as usize + 1)));
        writer.event(&event(10 * block)).unwrap();
    }
    (lengths, writer)
}

fn full_disk() -> Disk {
    Disk::with_room(usize::MAX)
}
