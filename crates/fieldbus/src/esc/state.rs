//! States of the application layer (INIT, PRE-OP, SAFE-OP, OP), with the reason of each refusal as status code.

/// A state, with its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum State {
    Initial = 1,
    PreOperational = 2,
    SafeOperational = 4,
    Operational = 8,
}
use State::{Initial, Operational, PreOperational, SafeOperational};

/// Reason of an error, with its status code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Code {
    InvalidRequest = 0x11,
    UnknownState = 0x12,
    NoBootstrap = 0x13,
    Mailbox = 0x16,
    NoOutputs = 0x19,
    Synchronisation = 0x1A,
    Watchdog = 0x1B,
    Outputs = 0x1D,
    Inputs = 0x1E,
    SyncLost = 0x2C,
    NoSync = 0x2D,
    SyncConfiguration = 0x30,
}

/// Longest time from the request of OP to the first outputs [ns].
const PATIENCE: u64 = 1_000_000_000;

/// State of a device.
#[derive(Debug)]
pub(crate) struct States {
    state: State,
    error: Option<Code>,
    /// OP was requested: when.
    requested: Option<u64>,
}

impl States {
    pub(crate) fn new() -> Self {
        States { state: Initial, error: None, requested: None }
    }

    pub(crate) fn state(&self) -> State {
        self.state
    }

    /// Value of the status register.
    pub(crate) fn status(&self) -> u16 {
        self.state as u16 | u16::from(self.error.is_some()) << 4
    }

    /// Value of the status code register.
    pub(crate) fn code(&self) -> u16 {
        self.error.map_or(0, |code| code as u16)
    }

    /// A request of the main device. `check` refuses an invalid configuration for a state.
    pub(crate) fn request(&mut self, control: u16, now: u64, check: impl Fn(State) -> Result<(), Code>) {
        if control & 0x10 != 0 {
            self.error = None;
        } else if self.error.is_some() {
            return;
        }
        self.requested = None;
        let target = match control & 0xF {
            1 => Initial,
            2 => PreOperational,
            3 => return self.refuse(Code::NoBootstrap),
            4 => SafeOperational,
            8 => Operational,
            _ => return self.refuse(Code::UnknownState),
        };
        // Downward to any state, upward to the next.
        if target as u16 > 2 * self.state as u16 {
            return self.refuse(Code::InvalidRequest);
        }
        if target > self.state
            && let Err(code) = check(target)
        {
            return self.refuse(code);
        }
        match target {
            Operational if self.state != Operational => self.requested = Some(now),
            _ => self.state = target,
        }
    }

    fn refuse(&mut self, code: Code) {
        self.error = Some(code);
    }

    /// Completes a request of OP when outputs have arrived since, and SYNC0 pulses if it is used; refuses it after a
    /// time without.
    pub(crate) fn complete(&mut self, now: u64, outputs: Option<u64>, synchronised: bool) {
        let Some(requested) = self.requested else { return };
        let received = outputs.is_some_and(|at| at >= requested);
        if received && synchronised {
            (self.state, self.requested) = (Operational, None);
        } else if now.saturating_sub(requested) > PATIENCE {
            self.requested = None;
            self.refuse(if received { Code::NoSync } else { Code::NoOutputs });
        }
    }

    /// Leaves OP because of an error.
    pub(crate) fn fail(&mut self, code: Code) {
        if self.state == Operational {
            self.state = SafeOperational;
            self.refuse(code);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(states: &mut States, control: u16) {
        states.request(control, 0, |_| Ok(()));
    }

    #[test]
    fn the_way_up_has_no_shortcut_and_the_way_down_has() {
        let mut states = States::new();
        request(&mut states, 8);
        assert_eq!((states.status(), states.code()), (0x11, 0x11));
        // Without acknowledgement a request has no effect.
        request(&mut states, 2);
        assert_eq!(states.status(), 0x11);
        for (control, status) in [(0x12, 2), (4, 4), (8, 4)] {
            request(&mut states, control);
            assert_eq!((states.status(), states.code()), (status, 0));
        }
        states.complete(1, Some(1), true);
        assert_eq!(states.status(), 8);
        request(&mut states, 1);
        assert_eq!(states.status(), 1);
    }

    #[test]
    fn states_that_do_not_exist_and_bad_configurations_are_refused_with_their_codes() {
        let mut states = States::new();
        for (control, code) in [(0x13, 0x13), (0x17, 0x12)] {
            request(&mut states, control);
            assert_eq!((states.state(), states.code()), (Initial, code));
        }
        states.request(0x12, 0, |_| Err(Code::Mailbox));
        assert_eq!((states.status(), states.code()), (0x11, 0x16));
    }

    #[test]
    fn operation_waits_for_outputs_and_for_the_clock() {
        for (outputs, synchronised, code) in [(None, true, 0x19), (Some(7), false, 0x2D)] {
            let mut states = States::new();
            [2, 4, 8].into_iter().for_each(|control| request(&mut states, control));
            states.complete(PATIENCE, outputs, synchronised);
            assert_eq!(states.status(), 4);
            states.complete(PATIENCE + 1, outputs, synchronised);
            assert_eq!((states.status(), states.code()), (0x14, code));
        }
    }
}
