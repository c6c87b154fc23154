//! One device of the segment: controller, mailbox, dictionary and function.

use crate::coe::dictionary::{COMMON, DRIVE, INJECTION, NOTICE, NOTICE_TEXT, TERMINAL};
use crate::coe::mailbox::{self, Mailbox};
use crate::coe::object::Objects;
use crate::coe::pdo::{Direction, Image};
use crate::drive::{COMMUNICATION, Drive, DriveSheet};
use crate::esc::clock::{Clock, SHORTEST_CYCLE};
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
        let described = |manager, direction: Direction| crate::coe::pdo::described(&objects, manager, direction);
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

    fn exchanges(&self) -> bool {
        self.state() >= State::SafeOperational
    }

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
    fn inject(&mut self) {
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

    /// A request of a state.
    fn request(&mut self, now: u64) {
        let before = self.state();
        let control = self.memory.word(memory::AL_CONTROL);
        let images = [Direction::Outputs, Direction::Inputs].map(|it| Image::new(&self.objects, it));
        let memory = &self.memory;
        self.states.request(control, now, |target| match target {
            State::PreOperational => check_mailboxes(memory),
            State::SafeOperational => check_process_data(memory, [images[0].length(), images[1].length()]),
            _ => Ok(()),
        });
        if before < State::SafeOperational && self.exchanges() {
            [self.outputs, self.inputs] = images;
            self.received = None;
        }
        if before == State::Initial && self.state() == State::PreOperational {
            self.mailbox = Mailbox::default();
            SyncManager::new(&self.memory, 1).set_full(&mut self.memory, false);
        }
        self.changed(before, None);
    }

    /// Leaves OP because of an error.
    fn fail(&mut self, code: Code) {
        let before = self.state();
        self.states.fail(code);
        self.changed(before, Some(COMMUNICATION));
    }

    /// Shows the state, and switches the drive off if it has left OP.
    fn changed(&mut self, before: State, error: Option<u16>) {
        self.memory.set(memory::AL_STATUS, &self.states.status().to_le_bytes());
        self.memory.set(memory::AL_STATUS_CODE, &self.states.code().to_le_bytes());
        if let Function::Drive(drive) = &mut self.function
            && before == State::Operational
            && self.states.state() != State::Operational
        {
            drive.release();
            error.into_iter().for_each(|error| drive.fail(error));
        }
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
        if self.exchanges() {
            let bytes = self.inputs.give(&self.objects);
            let manager = SyncManager::new(&self.memory, 3);
            self.memory.set(manager.start, &bytes[..bytes.len().min(manager.length.into())]);
        }
    }

    /// Supervision: completes a change to OP, and leaves OP without set-points or SYNC0.
    pub(crate) fn supervise(&mut self, now: u64) {
        let synchronised = !Clock::is_active(&self.memory) || self.clock.is_pulsing();
        let before = self.state();
        // A terminal has no outputs to wait for.
        let received = if self.outputs.length() > 0 { self.received } else { Some(now) };
        self.states.complete(now, received, synchronised);
        self.changed(before, None);
        if self.state() != State::Operational {
            return;
        }
        if before != State::Operational {
            (self.missed, self.fresh) = (0, true);
        }
        let expired = self.watchdog().is_some_and(|time| now.saturating_sub(received.unwrap_or(0)) > time);
        self.memory.set(memory::WATCHDOG_STATUS, &[u8::from(!expired)]);
        if expired {
            let count = self.memory.byte(memory::WATCHDOG_COUNT).saturating_add(1);
            self.memory.set(memory::WATCHDOG_COUNT, &[count]);
            self.fail(Code::Watchdog);
        } else if !synchronised {
            self.fail(Code::SyncLost);
        }
    }

    /// Time without outputs after which OP is left [ns]; `None` if the watchdog is off.
    fn watchdog(&self) -> Option<u64> {
        let [divider, time] =
            [memory::WATCHDOG_DIVIDER, memory::WATCHDOG_TIME].map(|it| u64::from(self.memory.word(it)));
        let is_on = self.outputs.length() > 0 && SyncManager::new(&self.memory, 2).has_watchdog() && time > 0;
        // The clock of the divider has 25 MHz.
        is_on.then_some(time * (divider + 2) * 40)
    }
}

fn check_mailboxes(memory: &Memory) -> Result<(), Code> {
    let is_valid = |at: u16| {
        let manager = SyncManager::new(memory, at);
        let is_output = at == 0;
        manager.is_active
            && manager.is_mailbox()
            && manager.is_output() == is_output
            && (manager.start, usize::from(manager.length)) == (STARTS[usize::from(at)], mailbox::SIZE)
    };
    if is_valid(0) && is_valid(1) { Ok(()) } else { Err(Code::Mailbox) }
}

fn check_process_data(memory: &Memory, lengths: [usize; 2]) -> Result<(), Code> {
    for (at, (length, code)) in (2..).zip(lengths.into_iter().zip([Code::Outputs, Code::Inputs])) {
        let manager = SyncManager::new(memory, at);
        let is_used = manager.is_active && manager.length > 0;
        let is_right = usize::from(manager.length) == length
            && manager.is_output() == (at == 2)
            && !manager.is_mailbox()
            && manager.start == STARTS[usize::from(at)];
        if is_used != (length > 0) || is_used && !is_right {
            return Err(code);
        }
    }
    if Clock::is_active(memory) && Clock::cycle(memory) < SHORTEST_CYCLE {
        return Err(Code::SyncConfiguration);
    }
    Ok(())
}
