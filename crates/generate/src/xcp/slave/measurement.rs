//! Lists of measurements: the commands of DAQ.

use rtrb::RingBuffer;

use super::*;
use crate::xcp::sampler::timestamp;
use crate::xcp::{EVENT_NAME, cycle_time};

/// The only event: every cycle.
const EVENT: u16 = 0;
/// Buffer of measurements for the transport [bytes].
const RING: usize = 4 << 20;

impl Slave {
    pub(super) fn measure(&mut self, code: u8, command: Command<'_>, bench: &dyn Bench) -> Result<Response> {
        // The lists cannot be changed while one is running.
        if matches!(code, 0xc7 | 0xd3..=0xd6 | 0xe0..=0xe2) && self.lists.any_runs() && code != 0xd6 {
            return Err(Refusal::DaqActive);
        }
        match code {
            0xd6 => {
                self.stop(bench);
                self.lists.free();
            }
            0xd5 => self.lists.allocate(command.word(2)?)?,
            0xd4 => self.lists.allocate_packets(command.word(2)?, command.byte(4)?)?,
            0xd3 => self.lists.allocate_entries(command.word(2)?, command.byte(4)?, command.byte(5)?)?,
            0xe2 => self.lists.point(command.word(2)?, command.byte(4)?, command.byte(5)?)?,
            0xe1 => {
                let (bit, size, extension) = (command.byte(1)?, command.byte(2)?, command.byte(3)?);
                self.lists.write(&self.layout, bit, size, extension, command.long(4)?)?;
            }
            0xc7 => self.write_several(command)?,
            0xe0 => self.set_mode(command)?,
            0xdf => return self.mode(command),
            0xde => return self.start_or_stop(command, bench),
            0xdd => {
                self.lists.synchronise(command.byte(1)?)?;
                self.run(bench)?;
            }
            0xdc => {
                let (cycle, _) = bench.newest();
                return Ok(Response::ok().bytes(&[0, 0, 0]).long(timestamp(cycle, self.layout.rate)));
            }
            // Dynamic, with prescaler and time stamps, overload in the PID; relative number of a packet, list as a byte.
            0xda => {
                let lists = self.lists.count() as u16;
                return Ok(Response::ok().bytes(&[0x01 | 0x02 | 0x10 | 0x40]).word(lists).word(1).bytes(&[0, 0x40]));
            }
            // Entries of doubles; time stamps of 4 bytes, a microsecond each.
            0xd9 => return Ok(Response::ok().bytes(&[8, MAX_CTO as u8, 8, 0, 0x34]).word(1)),
            0xd8 => {
                let (packets, entries) = self.lists.get(command.word(2)?)?.sizes();
                return Ok(Response::ok().bytes(&[0x04, packets, entries]).word(EVENT));
            }
            0xd7 => return self.event(command),
            _ => return Err(Refusal::Unknown),
        }
        Ok(Response::ok())
    }

    /// `WRITE_DAQ_MULTIPLE`
    fn write_several(&mut self, command: Command<'_>) -> Result<()> {
        for entry in 0..usize::from(command.byte(1)?) {
            let at = 2 + 8 * entry;
            let (bit, size, extension) = (command.byte(at)?, command.byte(at + 1)?, command.byte(at + 6)?);
            self.lists.write(&self.layout, bit, size, extension, command.long(at + 2)?)?;
        }
        Ok(())
    }

    /// `SET_DAQ_LIST_MODE`
    fn set_mode(&mut self, command: Command<'_>) -> Result<()> {
        let (mode, event) = (command.byte(1)?, command.word(4)?);
        let (prescaler, priority) = (command.byte(6)?, command.byte(7)?);
        let list = self.lists.get(command.word(2)?)?;
        // No stimulation, no packets without identification.
        if mode & !0x10 != 0 {
            return Err(Refusal::ModeNotValid);
        }
        if event != EVENT || prescaler == 0 {
            return Err(Refusal::OutOfRange);
        }
        (list.timestamp, list.prescaler, list.priority) = (mode & 0x10 != 0, prescaler, priority);
        Ok(())
    }

    /// `GET_DAQ_LIST_MODE`
    fn mode(&mut self, command: Command<'_>) -> Result<Response> {
        let list = self.lists.get(command.word(2)?)?;
        let bit = |on: bool, bit: u8| if on { bit } else { 0 };
        let mode = bit(list.selected, 0x01) | bit(list.timestamp, 0x10) | bit(list.running, 0x40);
        Ok(Response::ok().bytes(&[mode]).word(0).word(EVENT).bytes(&[list.prescaler, list.priority]))
    }

    /// `START_STOP_DAQ_LIST`
    fn start_or_stop(&mut self, command: Command<'_>, bench: &dyn Bench) -> Result<Response> {
        let list = self.lists.get(command.word(2)?)?;
        match command.byte(1)? {
            0 => list.running = false,
            1 => {
                list.check()?;
                list.running = true;
            }
            2 => list.selected = true,
            _ => return Err(Refusal::ModeNotValid),
        }
        if command.byte(1)? != 2 {
            self.run(bench)?;
        }
        // Numbers of packets are relative to their list.
        Ok(Response::ok().bytes(&[0]))
    }

    /// Applies the running state of all lists.
    fn run(&mut self, bench: &dyn Bench) -> Result<()> {
        if let Some((tap, _)) = self.stream.take() {
            bench.detach(tap);
        }
        let plans = self.lists.plans();
        if plans.is_empty() {
            return Ok(());
        }
        let (into, rows) = RingBuffer::new(RING);
        let sampler = Sampler::new(plans, self.layout.rate, into, self.lost.clone());
        let tap = bench.attach(sampler).map_err(|_| Refusal::DaqConfig)?;
        self.stream = Some((tap, rows));
        Ok(())
    }

    /// Stops all lists.
    pub(super) fn stop(&mut self, bench: &dyn Bench) {
        // Mode 0 cannot be refused, and nothing is attached without running lists.
        let _ = self.lists.synchronise(0).and_then(|()| self.run(bench));
    }

    /// `GET_DAQ_EVENT_INFO`: any number of lists, all values of a row consistent; the name is uploaded.
    fn event(&mut self, command: Command<'_>) -> Result<Response> {
        if command.word(2)? != EVENT {
            return Err(Refusal::OutOfRange);
        }
        let (time, unit) = cycle_time(self.layout.rate);
        self.pointer = Pointer::Text(EVENT_NAME.into(), 0);
        Ok(Response::ok().bytes(&[0x44, 0xff, EVENT_NAME.len() as u8, time, unit, 0]))
    }
}
