//! Access of the main device to registers, mailboxes and process data, and what it causes.

use super::{Device, Function};
use crate::coe::dictionary::INJECTION;
use crate::esc::clock::Clock;
use crate::esc::eeprom::Eeprom;
use crate::esc::fmmu::SyncManager;
use crate::esc::memory;
use crate::machine::Readings;

impl Device {
    /// Reads for the main device. False: the access fails, the working counter stays.
    pub(crate) fn read(&mut self, address: u16, into: &mut [u8], now: u64) -> bool {
        let touches = |register, size| memory::touches(address, into.len(), register, size);
        if touches(memory::SYSTEM_TIME, 8) {
            self.clock.show(&mut self.memory, now);
        }
        let manager = SyncManager::of(&self.memory, address, into.len()).filter(|_| address >= memory::DATA);
        if let Some(manager) = manager {
            let is_empty = manager.is_mailbox() && !manager.is_full(&self.memory);
            if manager.is_output() || is_empty || !manager.is_mailbox() && !self.exchanges() {
                return false;
            }
        }
        let seen = touches(memory::EEPROM_CONTROL, 2);
        let bytes = self.memory.get(address, into.len());
        into[..bytes.len()].copy_from_slice(bytes);
        if seen {
            Eeprom::seen(&mut self.memory);
        }
        if let Some(manager) = manager.filter(|it| it.is_mailbox() && it.ends_in(address, into.len())) {
            manager.set_full(&mut self.memory, false);
            self.load();
        }
        true
    }

    /// Writes for the main device. False: the access fails, the working counter stays.
    pub(crate) fn write(&mut self, address: u16, bytes: &[u8], now: u64, readings: &Readings) -> bool {
        if address >= memory::DATA {
            return self.write_data(address, bytes, now, readings);
        }
        if !self.memory.write(address, bytes) {
            return false;
        }
        let touches = |register, size| memory::touches(address, bytes.len(), register, size);
        if touches(memory::AL_CONTROL, 1) {
            self.request(now);
        }
        if touches(memory::EEPROM_CONTROL + 1, 1) {
            self.eeprom.execute(&mut self.memory);
        }
        if touches(memory::PORT_TIMES, 4) {
            self.clock.latch(&mut self.memory, now);
        }
        if touches(memory::SYSTEM_TIME, 4) {
            let reference = self.memory.number::<4>(memory::SYSTEM_TIME) as u32;
            self.clock.follow(&mut self.memory, reference, now);
        }
        if touches(memory::SPEED_COUNTER, 2) {
            self.clock.reset_correction();
        }
        if touches(memory::SYNC_ACTIVATION, 1) {
            self.clock.activate(&self.memory, now);
        }
        if touches(memory::SYNC_MANAGER + 14, 1) {
            self.repeat();
        }
        true
    }

    fn write_data(&mut self, address: u16, bytes: &[u8], now: u64, readings: &Readings) -> bool {
        let Some(manager) = SyncManager::of(&self.memory, address, bytes.len()) else {
            return self.memory.write(address, bytes);
        };
        if !manager.is_output() || !manager.is_mailbox() && !self.exchanges() || !self.memory.write(address, bytes) {
            return false;
        }
        if !manager.ends_in(address, bytes.len()) {
            return true;
        }
        if manager.is_mailbox() {
            let message = self.memory.get(manager.start, usize::from(manager.length)).to_vec();
            self.mailbox.receive(&message, &mut self.objects, self.states.state());
            self.load();
            self.inject();
        } else {
            (self.received, self.fresh) = (Some(now), true);
            if !Clock::is_active(&self.memory) {
                self.apply(readings);
            }
        }
        true
    }

    /// Hands the next answer over if the mailbox is empty.
    fn load(&mut self) {
        let manager = SyncManager::new(&self.memory, 1);
        if manager.is_active
            && !manager.is_full(&self.memory)
            && let Some(message) = self.mailbox.next()
        {
            self.memory.set(manager.start, &message[..message.len().min(manager.length.into())]);
            manager.set_full(&mut self.memory, true);
        }
    }

    /// Hands the last answer over again if the main device has toggled its request.
    fn repeat(&mut self) {
        let manager = SyncManager::new(&self.memory, 1);
        let [request, done] = [6, 7].map(|byte| self.memory.byte(memory::SYNC_MANAGER + 8 + byte) & 2);
        if request != done && manager.is_active {
            self.memory.set(memory::SYNC_MANAGER + 15, &[request]);
            self.memory.set(manager.start, self.mailbox.repeat());
            manager.set_full(&mut self.memory, true);
        }
    }

    /// Executes a fault on request. Lost and ignored frames are left to the segment.
    pub(crate) fn inject(&mut self) {
        let error = self.objects.number(INJECTION, 1) as u16;
        if let (Function::Drive(drive), true) = (&mut self.function, error != 0) {
            drive.fail(error);
            self.objects.set(INJECTION, 1, 0);
        }
        if self.objects.number(INJECTION, 4) != 0 {
            self.clock.stop();
            self.objects.set(INJECTION, 4, 0);
        }
    }
}
