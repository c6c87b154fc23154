//! The segment: devices in a row, which a frame passes, in front of one machine.

use crate::coe::dictionary::INJECTION;
use crate::device::{Device, Function};
use crate::drive::DriveSheet;
use crate::esc::fmmu::Fmmu;
use crate::frame::{Access, Command, Datagram, Target, each_datagram, has_process_data};
use crate::machine::{Machine, Readings, Shaft};

/// Longest time that the machine makes up for after a pause [ns].
const LONGEST_PAUSE: u64 = 100_000_000;

/// Counters of a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames that passed.
    pub frames: u64,
    /// Datagrams in them.
    pub datagrams: u64,
    /// Frames lost on request.
    pub lost: u64,
    /// Frames without EtherCAT datagrams.
    pub foreign: u64,
    /// Steps of the machine.
    pub steps: u64,
    /// Steps left out after pauses of the process.
    pub skipped: u64,
}

/// Emulated devices in front of a machine.
pub struct Segment {
    devices: Vec<Device>,
    sheets: Vec<DriveSheet>,
    /// A device without supply, and the end of that time [ns]. Devices behind it are out of reach.
    off: Option<(usize, u64)>,
    machine: Box<dyn Machine>,
    readings: Readings,
    torques: Vec<f64>,
    /// Time of the last step of the machine [ns].
    time: Option<u64>,
    counters: Counters,
}

impl Segment {
    /// A segment with drives, then analogue terminals.
    pub fn new(drives: &[DriveSheet], terminals: usize, machine: Box<dyn Machine>) -> Self {
        let all = drives.len() + terminals;
        Segment {
            devices: (0..all).map(|at| device(drives, at, all)).collect(),
            sheets: drives.to_vec(),
            off: None,
            machine,
            readings: Readings { shafts: vec![Shaft::default(); drives.len()], analogue: vec![0.0; terminals] },
            torques: vec![0.0; drives.len()],
            time: None,
            counters: Counters::default(),
        }
    }

    /// Delays the set-points of all drives by a number of cycles; a main device may change it (object 0x2010:2).
    pub fn delay_set_points(&mut self, cycles: u8) {
        for device in &mut self.devices {
            device.objects.set(0x2010, 2, cycles.into());
        }
    }

    /// Causes a fault, as an SDO to object 0x2020 does: position of the device, subindex, value.
    pub fn request_fault(&mut self, device: usize, subindex: u8, value: u16) {
        if let Some(device) = self.devices.get_mut(device) {
            device.objects.set(INJECTION, subindex, value.into());
            device.inject();
        }
    }

    /// Counters since the start.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Names and states of the devices.
    pub fn states(&self) -> Vec<(&str, &'static str)> {
        let state = |device: &Device| ["", "INIT", "PRE-OP", "", "SAFE-OP", "", "", "", "OP"][device.state() as usize];
        self.devices.iter().map(|device| (device.name.as_str(), state(device))).collect()
    }

    /// Lets time pass up to an instant [ns]: steps of the machine, SYNC0 of the devices, watchdogs.
    pub fn advance(&mut self, now: u64) {
        let period = self.machine.period().max(1);
        let mut time = *self.time.get_or_insert(now);
        if now.saturating_sub(time) > LONGEST_PAUSE {
            let skipped = (now - time - LONGEST_PAUSE) / period;
            self.counters.skipped += skipped;
            time += skipped * period;
        }
        loop {
            let pulse = self.devices.iter().enumerate().filter_map(|(at, device)| {
                let due = device.clock.due(&device.memory, time)?;
                Some((due, at))
            });
            match pulse.min() {
                Some((due, at)) if due <= (time + period).min(now) => {
                    self.devices[at].synchronise(due.max(time), &self.readings)
                }
                _ if time + period > now => break,
                _ => {
                    time += period;
                    self.step();
                }
            }
        }
        self.time = Some(time);
        for device in &mut self.devices {
            device.supervise(now);
            if !device.clock.is_pulsing() {
                device.refresh(&self.readings);
            }
        }
    }

    /// One step of the machine.
    fn step(&mut self) {
        let dt = self.machine.period() as f64 * 1e-9;
        let drives = self.devices.iter_mut().filter_map(|device| match &mut device.function {
            Function::Drive(drive) => Some((drive, &device.objects)),
            Function::Terminal => None,
        });
        for ((drive, objects), (torque, shaft)) in drives.zip(self.torques.iter_mut().zip(&self.readings.shafts)) {
            *torque = drive.torque(objects, shaft, dt);
        }
        self.machine.step(&self.torques, &mut self.readings);
        for device in &mut self.devices {
            let shaft = device.shaft(&self.readings);
            if let Function::Drive(drive) = &mut device.function {
                drive.index(&mut device.objects, &shaft);
            }
        }
        self.counters.steps += 1;
    }

    /// Passes a frame through the devices at an instant [ns]. False: the frame does not come back.
    pub fn pass(&mut self, frame: &mut [u8], now: u64) -> bool {
        self.advance(now);
        self.switch_off(now);
        let is_cyclic = has_process_data(frame);
        if is_cyclic && self.takes_one(2, 0) {
            self.counters.lost += 1;
            return false;
        }
        let reach = self.off.map_or(self.devices.len(), |(at, _)| at);
        if reach == 0 {
            return false;
        }
        let absent: Vec<bool> =
            (0..self.devices.len()).map(|at| at >= reach || is_cyclic && self.takes_one(3, at)).collect();
        let Segment { devices, readings, .. } = self;
        let passed = each_datagram(frame, |datagram| {
            for (device, absent) in devices.iter_mut().zip(&absent) {
                if !absent {
                    visit(device, datagram, now, readings);
                }
            }
        });
        let Some(datagrams) = passed else {
            self.counters.foreign += 1;
            return false;
        };
        // The first device marks the source address, by which a main device knows a frame that has come back.
        frame[6] |= 2;
        self.counters.frames += 1;
        self.counters.datagrams += datagrams as u64;
        true
    }

    /// A device without supply on request starts again at the end of that time, as after power-on.
    fn switch_off(&mut self, now: u64) {
        for at in 0..self.devices.len() {
            let time = self.devices[at].objects.number(INJECTION, 5) as u64;
            if time > 0 {
                self.devices[at] = device(&self.sheets, at, self.devices.len());
                self.off = Some((at, now + time * 1_000_000));
            }
        }
        self.off = self.off.filter(|(_, end)| now < *end);
    }

    /// Takes one from a counter of faults on request; whether it was above zero.
    fn takes_one(&mut self, subindex: u8, device: usize) -> bool {
        let Some(objects) = self.devices.get_mut(device).map(|device| &mut device.objects) else { return false };
        let left = objects.number(INJECTION, subindex);
        objects.set(INJECTION, subindex, left - 1);
        left > 0
    }
}

/// The device at a position: drives, then analogue terminals.
fn device(sheets: &[DriveSheet], at: usize, all: usize) -> Device {
    match sheets.get(at) {
        Some(sheet) => Device::drive(sheet, at, (at, all)),
        None => Device::terminal(at - sheets.len(), (at, all)),
    }
}

/// A datagram passes a device.
fn visit(device: &mut Device, datagram: &mut Datagram, now: u64, readings: &Readings) {
    match datagram.command {
        Command::Nothing => {}
        Command::Physical(target, access) => {
            if is_addressed(device, target, datagram) {
                physical(device, access, target == Target::All, datagram, now, readings);
            }
        }
        Command::ReadThenWrite(target) => {
            let access = if is_addressed(device, target, datagram) { Access::Read } else { Access::Write };
            physical(device, access, false, datagram, now, readings);
        }
        Command::Logical(access) => logical(device, access, datagram, now, readings),
    }
}

fn is_addressed(device: &Device, target: Target, datagram: &mut Datagram) -> bool {
    let address = datagram.device;
    if target != Target::Station {
        datagram.device = address.wrapping_add(1);
    }
    match target {
        Target::Position => address == 0,
        Target::Station => device.has_address(address),
        Target::All => true,
    }
}

fn physical(device: &mut Device, access: Access, merges: bool, datagram: &mut Datagram, now: u64, readings: &Readings) {
    let mut before = Vec::new();
    if access.reads() {
        before = datagram.data.to_vec();
        let mut read = if merges { vec![0; before.len()] } else { before.clone() };
        if device.read(datagram.offset, &mut read, now) {
            datagram.counter = datagram.counter.wrapping_add(1);
            // A broadcast combines the answers of all devices.
            for (byte, read) in datagram.data.iter_mut().zip(read) {
                *byte = if merges { *byte | read } else { read };
            }
        }
    }
    if access.writes() {
        let data = if access.reads() { &before[..] } else { &*datagram.data };
        if device.write(datagram.offset, data, now, readings) {
            datagram.counter = datagram.counter.wrapping_add(access.write_count());
        }
    }
}

fn logical(device: &mut Device, access: Access, datagram: &mut Datagram, now: u64, readings: &Readings) {
    let (logical, length) = (datagram.logical(), datagram.data.len());
    let units: Vec<Fmmu> = Fmmu::active(&device.memory).collect();
    let (mut read, mut written) = (false, false);
    // Outputs first: inputs may be at the same logical address.
    for unit in units.iter().filter(|unit| unit.writes && access.writes() && unit.is_bytewise()) {
        if let Some((range, physical)) = unit.mapped(logical, length) {
            written |= device.write(physical, &datagram.data[range], now, readings);
        }
    }
    for unit in units.iter().filter(|unit| unit.reads && access.reads()) {
        let Some((range, physical)) = unit.mapped(logical, length) else { continue };
        if unit.is_bytewise() {
            read |= device.read(physical, &mut datagram.data[range], now);
        } else {
            let mut byte = [0];
            read |= device.read(physical, &mut byte, now);
            unit.bits(&mut datagram.data[range.start], byte[0]);
        }
    }
    let count = u16::from(read) + if written { access.write_count() } else { 0 };
    datagram.counter = datagram.counter.wrapping_add(count);
}
