//! Devices that have left OP, or have restarted.

use std::time::{Duration, Instant};

use ethercrab::Command;
use stickslip_software::supervise::MachineFault;

use super::cyclic::{Cyclic, QUESTION};

/// Frames in a row without an answer after which a device is searched.
pub(super) const SILENT: u32 = 50;
/// Interval of attempts to return to OP.
const RETRY: Duration = Duration::from_millis(500);
/// Register of the station address.
const ADDRESS: u16 = 0x0010;

impl Cyclic<'_> {
    /// A device has left OP: its codes. Tries to return to OP now and then.
    pub(super) fn left_operation(&mut self, position: usize) -> MachineFault {
        if let (Some(fault), true) = (self.left, self.retry.elapsed() < RETRY) {
            return fault;
        }
        self.retry = Instant::now();
        let Ok(device) = self.group.subdevice(self.main, position) else {
            return MachineFault::Restarted;
        };
        let status = self.wire.run_within(device.register_read::<u16>(0x0134_u16), QUESTION).and_then(Result::ok);
        let error = self.wire.run_within(device.sdo_read::<u16>(0x603F, 0), QUESTION).and_then(Result::ok);
        let acknowledge = async {
            // SAFE-OP with acknowledgement, then OP.
            device.register_write(0x0120_u16, 0x14_u16).await?;
            device.register_write(0x0120_u16, 0x08_u16).await
        };
        // It is tried again.
        let _ = self.wire.run_within(acknowledge, QUESTION);
        let (error, status) = (error.unwrap_or(0), status.unwrap_or(0));
        let fault = MachineFault::Device { position: position as u16, error, status };
        self.record.left = Some((position as u16, status));
        // The first cause counts.
        self.failed.get_or_insert(fault);
        *self.left.get_or_insert(fault)
    }

    /// Whether all devices are present, and one does not answer to its address: it was switched off and on. Searches now
    /// and then, if a device does not answer.
    pub(crate) fn has_restarted(&mut self) -> bool {
        if self.silent < SILENT || self.searched.elapsed() < RETRY {
            return false;
        }
        self.searched = Instant::now();
        let mut restarted = false;
        for position in 0..self.group.len() {
            let read = Command::aprd(position as u16, ADDRESS).receive::<u16>(self.main);
            let Some(Ok(address)) = self.wire.run_within(read, QUESTION) else { return false };
            let device = self.group.subdevice(self.main, position);
            restarted |= device.is_ok_and(|device| device.configured_address() != address);
        }
        restarted
    }
}
