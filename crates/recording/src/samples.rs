//! Samples of the scope: every cycle of some signals, as bytes for the page and as an MDF 4 file.

use std::path::Path;
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};

use crate::mdf::{self, Cause, Channel, Event, Header, Writer};
use stickslip_base::Error;

/// Name of the event at the trigger.
const TRIGGER: &str = "trigger";
/// Property with the tick time.
const TICK_TIME: &str = "tick_time";
/// Largest number of signals.
const MOST: usize = 256;

/// Samples of consecutive cycles; lost cycles have no row.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Description.
    pub head: Head,
    /// Number of the cycle of each row, rising.
    pub cycles: Vec<u64>,
    /// Values of each signal, one per row.
    pub columns: Vec<Vec<f64>>,
}

/// Description of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// Tick rate [Hz].
    pub rate: f64,
    /// The cycle of the event that started the capture, if there was one.
    #[serde(default)]
    pub trigger: Option<u64>,
    /// The signals, in the order of the columns.
    pub signals: Vec<SampledSignal>,
}

/// A signal of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SampledSignal {
    /// Name, unique in its samples.
    pub name: String,
    /// Unit; empty if there is none.
    pub unit: String,
    /// Description.
    #[serde(default)]
    pub help: String,
}

impl Samples {
    /// Reads the bytes that [`to_bytes`](Self::to_bytes) writes.
    ///
    /// # Errors
    /// [`Error::Answer`] with the fault.
    pub fn read(bytes: &[u8]) -> Result<Self, Error> {
        let (head, numbers) = split(bytes).ok_or_else(|| invalid("the description is missing or cut"))?;
        let head: Head = serde_json::from_slice(head).map_err(|error| invalid(&error.to_string()))?;
        let width = head.signals.len();
        if !(head.rate > 0.0 && head.rate.is_finite() && (1..=MOST).contains(&width)) {
            return Err(invalid("the tick rate or the number of signals is out of range"));
        }
        let numbers: Vec<f64> =
            numbers.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().expect("8 bytes"))).collect();
        let rows = numbers.len() / (width + 1);
        if rows == 0 || numbers.len() != rows * (width + 1) {
            return Err(invalid("the columns have different lengths, or no rows"));
        }
        let cycles: Vec<u64> = numbers[..rows].iter().map(|&cycle| cycle as u64).collect();
        if !cycles.windows(2).all(|pair| pair[0] < pair[1]) {
            return Err(invalid("the cycles are not in order"));
        }
        let columns = numbers[rows..].chunks_exact(rows).map(<[f64]>::to_vec).collect();
        Ok(Samples { head, cycles, columns })
    }

    /// Little-endian: length of the description (u32), the description (JSON, with spaces up to eight bytes), then the
    /// numbers of the cycles and the values of each signal in turn (f64).
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut head = serde_json::to_vec(&self.head).expect("strings and numbers");
        head.resize((head.len() + 4).next_multiple_of(8) - 4, b' ');
        let mut bytes = Vec::with_capacity(4 + head.len() + 8 * self.cycles.len() * (self.columns.len() + 1));
        bytes.extend((head.len() as u32).to_le_bytes());
        bytes.extend(head);
        bytes.extend(self.cycles.iter().flat_map(|&cycle| (cycle as f64).to_le_bytes()));
        for column in &self.columns {
            bytes.extend(column.iter().flat_map(|value| value.to_le_bytes()));
        }
        bytes
    }

    /// Writes an MDF 4 file; times are those since the start of the bench.
    ///
    /// # Errors
    /// [`Error::File`]; signals without a name or with equal names.
    pub fn write(&self, path: &Path, comment: &str) -> Result<(), Error> {
        let Head { rate, trigger, signals } = &self.head;
        let since = self.cycles.last().map_or(0.0, |&cycle| cycle as f64 / rate);
        let since = Duration::try_from_secs_f64(since).unwrap_or_default();
        let header = Header {
            start: SystemTime::now().checked_sub(since).unwrap_or(SystemTime::UNIX_EPOCH),
            program: "stickslip".into(),
            version: env!("CARGO_PKG_VERSION").into(),
            comment: comment.into(),
            properties: vec![
                ("schema".into(), "stickslip.capture/1".into()),
                (TICK_TIME.into(), (1.0 / rate).to_string()),
            ],
        };
        let channel = |signal: &SampledSignal| Channel {
            name: signal.name.clone(),
            unit: signal.unit.clone(),
            comment: signal.help.clone(),
        };
        let channels: Vec<Channel> = signals.iter().map(channel).collect();
        let mut writer = Writer::create(path, &header, &channels, 1.0 / rate)?;
        let mut row = vec![0.0; signals.len()];
        for (at, &cycle) in self.cycles.iter().enumerate() {
            row.iter_mut().zip(&self.columns).for_each(|(value, column)| *value = column[at]);
            writer.row(cycle, &row)?;
        }
        if let Some(cycle) = *trigger {
            writer.event(&Event { cycle, name: TRIGGER.into(), comment: String::new(), cause: Cause::Tool })?;
        }
        writer.finish().map(drop)
    }

    /// Reads such a file.
    ///
    /// # Errors
    /// An unreadable file.
    pub fn read_file(path: &Path) -> Result<Self, Error> {
        let contents = mdf::read(path)?;
        let tick = contents.header.properties.iter().find(|(name, _)| name == TICK_TIME);
        let tick: Option<f64> = tick.and_then(|(_, value)| value.parse().ok());
        let group = contents.groups.into_iter().next();
        let (Some(tick), Some(group)) = (tick, group) else { return Err(invalid("the file is not a capture")) };
        let (mut head, mut cycles, mut columns) =
            (Head { rate: 1.0 / tick, trigger: None, signals: Vec::new() }, Vec::new(), Vec::new());
        for signal in group.signals {
            let Channel { name, unit, comment } = signal.channel;
            match name.as_str() {
                "time" => {}
                "cycle" => cycles = signal.values.iter().map(|&cycle| (cycle + signal.origin) as u64).collect(),
                _ => {
                    head.signals.push(SampledSignal { name, unit, help: comment });
                    columns.push(signal.values);
                }
            }
        }
        head.trigger = contents.events.iter().find(|(_, event)| event.name == TRIGGER).map(|(_, event)| event.cycle);
        Ok(Samples { head, cycles, columns })
    }
}

/// Description and numbers.
fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

fn invalid(fault: &str) -> Error {
    Error::Answer {
        question: "samples of the scope".into(),
        answer: fault.into(),
        remedy: "Reload the page: it may belong to another version of stickslip.".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> Samples {
        let signal =
            |name: &str, unit: &str| SampledSignal { name: name.into(), unit: unit.into(), help: "It is".into() };
        let signals = vec![signal("angle", "rad"), signal("slope", "")];
        let cycles = vec![1000, 1001, 1003];
        let columns = vec![vec![0.1, 0.1 + 0.2, -1.0 / 3.0], vec![1e300, 0.0, f64::MIN_POSITIVE]];
        Samples { head: Head { rate: 4000.0, trigger: Some(1001), signals }, cycles, columns }
    }

    #[test]
    fn samples_read_back_from_bytes_and_from_a_file_to_the_bit() {
        let samples = samples();
        assert_eq!(Samples::read(&samples.to_bytes()).unwrap(), samples);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("capture.mf4");
        samples.write(&path, "test").unwrap();
        assert_eq!(Samples::read_file(&path).unwrap(), samples);
    }

    #[test]
    fn invalid_samples_are_refused() {
        let whole = samples().to_bytes();
        let mut disordered = samples();
        disordered.cycles = vec![3, 2, 1];
        let mut without_rate = samples();
        without_rate.head.rate = f64::NAN;
        for bytes in [
            &[][..],
            &whole[..3],
            &whole[..40],
            &whole[..whole.len() - 8],
            &disordered.to_bytes(),
            &without_rate.to_bytes(),
        ] {
            assert!(Samples::read(bytes).is_err(), "{}", bytes.len());
        }
        let mut twice = samples();
        twice.head.signals[1].name = "angle".into();
        let folder = tempfile::tempdir().unwrap();
        assert!(twice.write(&folder.path().join("capture.mf4"), "test").is_err());
    }
}
