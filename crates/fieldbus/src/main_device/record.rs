//! What viewers see of the cycle: devices, their states, the working counter.

use ethercrab::subdevice_group::CycleInfo;
use ethercrab::{SubDeviceState, TxRxResponse};
use stickslip_bench::segment::SegmentDevice;

use super::bring_up::DEVICES;
use super::cyclic::Cyclic;

impl Cyclic<'_> {
    /// The devices with their roles, and the expected working counter.
    pub(crate) fn segment(&self) -> (Vec<SegmentDevice>, u16) {
        let role = |position: usize| {
            let is_at = |other: u8| usize::from(other) == position;
            match &self.drives {
                [motor, _] if is_at(motor.position) => "motor",
                [_, load] if is_at(load.position) => "load",
                _ if self.analogue.is_some_and(|input| is_at(input.position)) => "accelerometer",
                _ => "",
            }
        };
        let devices = self.group.iter(self.main).enumerate();
        let devices = devices.map(|(at, device)| SegmentDevice { name: device.name().into(), role: role(at) });
        (devices.collect(), self.due)
    }

    /// Notes working counter and states for viewers. The inputs of a device that did not answer are old.
    pub(super) fn note(&mut self, response: &TxRxResponse<DEVICES, CycleInfo>) {
        self.record.counter = response.working_counter;
        for (noted, state) in self.record.states.iter_mut().zip(&response.subdevice_states) {
            *noted = code(*state);
        }
        let is_silent = self.record.states[..self.group.len()].contains(&0);
        self.silent = if is_silent { self.silent.saturating_add(1) } else { 0 };
        for (drive, noted) in self.drives.iter().zip(&mut self.record.drives) {
            let position = usize::from(drive.position);
            if let (Ok(device), true) = (self.group.subdevice(self.main, position), self.record.states[position] != 0) {
                *noted = drive.record(&device.inputs_raw());
            }
        }
    }
}

/// Code of an AL state; 0: no answer.
fn code(state: SubDeviceState) -> u8 {
    match state {
        SubDeviceState::None => 0,
        SubDeviceState::Init => 1,
        SubDeviceState::PreOp => 2,
        SubDeviceState::Bootstrap => 3,
        SubDeviceState::SafeOp => 4,
        SubDeviceState::Op => 8,
        SubDeviceState::Other(code) => code,
    }
}
