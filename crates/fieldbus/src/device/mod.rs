//! One device of the segment: controller, mailbox, dictionary and function.

mod access;
mod supervision;

use crate::coe::dictionary::{COMMON, DRIVE, NOTICE, NOTICE_TEXT, TERMINAL};
use crate::coe::mailbox::{self, Mailbox};
use crate::coe::object::Objects;
use crate::coe::pdo::{self, Direction, Image};
use crate::drive::{Drive, DriveSheet};
use crate::esc::clock::Clock;
use crate::esc::eeprom::{Eeprom, Identity};
use crate::esc::fmmu::SyncManager;
use crate::esc::memory::{self, Memory};
use crate::esc::state::{Code, State, States};
use crate::machine::{Readings, Shaft};

/// Vendor ID of the emulated devices: for tests, not assigned.
pub const VENDOR: u32 = 0x5354_4943;
/// Product code of an emulated drive.
pub const DRIVE_PRODUCT: u32 = 0x0000_0402;
/// Product code of an emulated analogue terminal.
pub const TERMINAL_PRODUCT: u32 = 0x0000_0401;

/// Start of the sync managers, and control bytes: mailboxes, outputs with watchdog, inputs.
const STARTS: [u16; 4] = [0x1000, 0x1080, 0x1100, 0x1200];
const CONTROLS: [u8; 4] = [0x26, 0x22, 0x64, 0x20];
/// Purpose of a device.
#[derive(Debug)]
pub(crate) enum Function {
    Drive(Drive),
    /// An analogue input.
    Terminal,
}

/// A device.
#[derive(Debug)]
pub(crate) struct Device {
    pub(crate) name: String,
    pub(crate) memory: Memory,
    pub(crate) clock: Clock,
    eeprom: Eeprom,
    states: States,
    mailbox: Mailbox,
    pub(crate) objects: Objects,
    pub(crate) function: Function,
    /// Its shaft or analogue signal in the readings of the machine.
    number: usize,
    outputs: Image,
    inputs: Image,
    /// Time of the last outputs, and whether they came since the last SYNC0.
    received: Option<u64>,
    fresh: bool,
    missed: u32,
}

impl Device {
    pub(crate) fn drive(sheet: &DriveSheet, number: usize, place: (usize, usize)) -> Self {
        let mut objects = Objects::new(&[COMMON, DRIVE]);
        let function = Function::Drive(Drive::new(sheet, &mut objects));
        sheet.fixed_mapping.into_iter().for_each(|mapping| pdo::fix(&mut objects, mapping));
        Device::new(objects, function, (&sheet.name, DRIVE_PRODUCT), number, place)
    }

    pub(crate) fn terminal(number: usize, place: (usize, usize)) -> Self {
        let mut objects = Objects::new(&[COMMON, TERMINAL]);
        objects.set(0x1000, 0, 0x0004_0191);
        Device::new(objects, Function::Terminal, ("stickslip emulated input", TERMINAL_PRODUCT), number, place)
    }

    fn new(
        mut objects: Objects,
        function: Function,
        (name, product): (&str, u32),
        number: usize,
        (position, devices): (usize, usize),
    ) -> Self {
        let identity = Identity { vendor: VENDOR, product, revision: 1, serial: position as u32 + 1 };
        let numbers = [identity.vendor, identity.product, identity.revision, identity.serial];
        for (at, number) in (1..).zip(numbers) {
            objects.set(0x1018, at, i64::from(number));
        }
        objects.set_text(0x1008, name);
        objects.set_text(0x1009, "emulated");
        objects.set_text(0x100A, env!("CARGO_PKG_VERSION"));
        objects.set_text(NOTICE, NOTICE_TEXT);
        let mut memory = Memory::new();
        // PDI operational, link on port 0, and on port 1 unless this is the last device.
        let status: u16 = if position + 1 < devices { 0x5A31 } else { 0x5611 };
        memory.set(memory::DL_STATUS, &status.to_le_bytes());
        let [outputs, inputs] = [Direction::Outputs, Direction::Inputs].map(|it| Image::new(&objects, it));
        let lengths = [mailbox::SIZE, mailbox::SIZE, outputs.length(), inputs.length()];
        let managers: Vec<_> = (0..4).map(|at| (STARTS[at], lengths[at] as u16, CONTROLS[at], at as u8 + 1)).collect();
        let described = |manager, direction: Direction| pdo::described(&objects, manager, direction);
        let eeprom = Eeprom::new(
            &identity,
            name,
            &managers,
            &described(3, Direction::Inputs),
            &described(2, Direction::Outputs),
        );
        Device {
            name: name.into(),
            memory,
            clock: Clock::new(position, devices),
            eeprom,
            states: States::new(),
            mailbox: Mailbox::default(),
            objects,
            function,
            number,
            outputs,
            inputs,
            received: None,
            fresh: false,
            missed: 0,
        }
    }

    pub(crate) fn state(&self) -> State {
        self.states.state()
    }

    pub(crate) fn shaft(&self, readings: &Readings) -> Shaft {
        readings.shafts.get(self.number).copied().unwrap_or_default()
    }

    /// Whether the station address is that of the device.
    pub(crate) fn has_address(&self, address: u16) -> bool {
        let by_alias = self.memory.byte(memory::DL_CONTROL + 3) & 1 != 0;
        self.memory.word(memory::STATION) == address || by_alias && self.memory.word(memory::ALIAS) == address
    }

    pub(crate) fn exchanges(&self) -> bool {
        self.state() >= State::SafeOperational
    }

    /// Executes the outputs.
    fn apply(&mut self, readings: &Readings) {
        if self.state() != State::Operational {
            return;
        }
        let manager = SyncManager::new(&self.memory, 2);
        let bytes = self.memory.get(manager.start, usize::from(manager.length));
        self.outputs.take(&mut self.objects, bytes);
        let shaft = self.shaft(readings);
        if let Function::Drive(drive) = &mut self.function {
            drive.cycle(&self.objects, &shaft);
        }
    }

    /// SYNC0: executes the outputs and takes the inputs.
    pub(crate) fn synchronise(&mut self, now: u64, readings: &Readings) {
        self.clock.pulsed(&self.memory, now);
        if self.state() == State::Operational {
            let is_fresh = std::mem::take(&mut self.fresh);
            // A missed set-point counts three, one in time takes one off.
            self.missed = if is_fresh { self.missed.saturating_sub(1) } else { self.missed.saturating_add(3) };
            if i64::from(self.missed) > self.objects.number(0x10F1, 2) {
                self.fail(Code::Synchronisation);
            }
            self.apply(readings);
        }
        self.refresh(readings);
    }

    /// Puts the actual values into the inputs.
    pub(crate) fn refresh(&mut self, readings: &Readings) {
        let shaft = self.shaft(readings);
        match &mut self.function {
            Function::Drive(drive) => drive.report(&mut self.objects, &shaft),
            Function::Terminal => {
                let signal = readings.analogue.get(self.number).copied().unwrap_or_default();
                self.objects.set(0x6000, 1, (signal * 32767.0).round() as i64);
            }
        }
        let manager = SyncManager::new(&self.memory, 3);
        if self.exchanges() && manager.is_active {
            let bytes = self.inputs.give(&self.objects);
            self.memory.set(manager.start, &bytes[..bytes.len().min(manager.length.into())]);
        }
    }
}
