//! States of a device: requests and their checks, and the end of OP because of an error.

use super::{Device, Function, STARTS};
use crate::coe::mailbox::{self, Mailbox};
use crate::coe::pdo::{Direction, Image};
use crate::drive::COMMUNICATION;
use crate::esc::clock::{Clock, SHORTEST_CYCLE};
use crate::esc::fmmu::SyncManager;
use crate::esc::memory::{self, Memory};
use crate::esc::state::{Code, State};

impl Device {
    /// A request of a state.
    pub(super) fn request(&mut self, now: u64) {
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
    pub(super) fn fail(&mut self, code: Code) {
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
