//! Controlwords that switch a drive on and off (CiA 402).

/// State of a drive by its statusword.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    NotReady,
    SwitchOnDisabled,
    ReadyToSwitchOn,
    SwitchedOn,
    OperationEnabled,
    QuickStop,
    FaultReaction,
    Fault,
}

impl State {
    /// Its name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            State::NotReady => "not ready to switch on",
            State::SwitchOnDisabled => "switch on disabled",
            State::ReadyToSwitchOn => "ready to switch on",
            State::SwitchedOn => "switched on",
            State::OperationEnabled => "operation enabled",
            State::QuickStop => "quick stop active",
            State::FaultReaction => "fault reaction active",
            State::Fault => "fault",
        }
    }

    /// The state of a statusword.
    pub(crate) fn of(status: u16) -> Self {
        match (status & 0x4F, status & 0x6F) {
            (0x40, _) => State::SwitchOnDisabled,
            (0x0F, _) => State::FaultReaction,
            (0x08, _) => State::Fault,
            (_, 0x21) => State::ReadyToSwitchOn,
            (_, 0x23) => State::SwitchedOn,
            (_, 0x27) => State::OperationEnabled,
            (_, 0x07) => State::QuickStop,
            _ => State::NotReady,
        }
    }
}

const DISABLE: u16 = 0x00;
const QUICK_STOP: u16 = 0x02;
const SHUT_DOWN: u16 = 0x06;
const SWITCH_ON: u16 = 0x07;
const ENABLE: u16 = 0x0F;
const RESET: u16 = 0x80;

/// Switches a drive on and off, one controlword a cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Power {
    last: u16,
    /// Cycles in quick stop.
    stopping: u32,
}

impl Power {
    /// The controlword for this statusword. A quick stop lasts for this number of cycles at most.
    pub(crate) fn control(&mut self, status: u16, on: bool, patience: u32) -> u16 {
        let state = State::of(status);
        let stops = !on && matches!(state, State::OperationEnabled | State::QuickStop);
        self.stopping = if stops { self.stopping.saturating_add(1) } else { 0 };
        self.last = match state {
            // The rising edge resets.
            State::Fault if on && self.last != RESET => RESET,
            State::SwitchOnDisabled if on => SHUT_DOWN,
            State::ReadyToSwitchOn if on => SWITCH_ON,
            State::SwitchedOn | State::OperationEnabled if on => ENABLE,
            State::OperationEnabled | State::QuickStop if stops && self.stopping <= patience => QUICK_STOP,
            _ => DISABLE,
        };
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Controlwords for these statuswords.
    fn controls(on: bool, statuses: &[u16]) -> Vec<u16> {
        let mut power = Power::default();
        statuses.iter().map(|status| power.control(*status, on, 2)).collect()
    }

    #[test]
    fn a_drive_is_switched_on_step_by_step_after_a_reset_by_one_edge() {
        let statuses = [0x0218, 0x0208, 0x0208, 0x0250, 0x0231, 0x0233, 0x1237, 0x1237];
        assert_eq!(controls(true, &statuses), [0x80, 0x00, 0x80, 0x06, 0x07, 0x0F, 0x0F, 0x0F]);
    }

    #[test]
    fn a_drive_is_stopped_before_it_is_disabled_but_not_for_ever() {
        assert_eq!(controls(false, &[0x0237, 0x0217, 0x0250, 0x0208]), [0x02, 0x02, 0x00, 0x00]);
        assert_eq!(controls(false, &[0x0217; 4]), [0x02, 0x02, 0x00, 0x00]);
    }

    #[test]
    fn other_bits_of_the_statusword_do_not_matter() {
        for other in [0x0000, 0x0010, 0x0080, 0x9F90] {
            assert_eq!(State::of(0x0027 | other), State::OperationEnabled);
            assert_eq!(State::of(0x0008 | other | 0x0020), State::Fault);
        }
        assert_eq!((State::of(0), State::of(0x000F)), (State::NotReady, State::FaultReaction));
    }
}
