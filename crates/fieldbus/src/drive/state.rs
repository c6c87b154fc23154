//! State machine of CiA 402: from the controlword to the statusword.

/// State of the power stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Power {
    SwitchOnDisabled,
    ReadyToSwitchOn,
    SwitchedOn,
    OperationEnabled,
    QuickStop,
    Fault,
}
use Power::{Fault, OperationEnabled, QuickStop, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};

/// Bits of the controlword.
const SWITCH_ON: u16 = 1;
const ENABLE_VOLTAGE: u16 = 2;
const NO_QUICK_STOP: u16 = 4;
const ENABLE_OPERATION: u16 = 8;
const RESET: u16 = 0x80;

impl Power {
    /// The state after a controlword. A fault is reset by the rising edge of its bit.
    pub(crate) fn next(self, control: u16, last: u16) -> Power {
        let has = |bits: u16| control & bits == bits;
        let ready = ENABLE_VOLTAGE | NO_QUICK_STOP;
        match self {
            Fault if has(RESET) && last & RESET == 0 => SwitchOnDisabled,
            Fault => Fault,
            _ if !has(ENABLE_VOLTAGE) => SwitchOnDisabled,
            OperationEnabled if !has(NO_QUICK_STOP) => QuickStop,
            QuickStop => QuickStop,
            _ if !has(NO_QUICK_STOP) => SwitchOnDisabled,
            SwitchOnDisabled if control & SWITCH_ON == 0 => ReadyToSwitchOn,
            SwitchOnDisabled => SwitchOnDisabled,
            _ if !has(SWITCH_ON) => ReadyToSwitchOn,
            ReadyToSwitchOn => SwitchedOn,
            SwitchedOn | OperationEnabled if has(ready | ENABLE_OPERATION) => OperationEnabled,
            SwitchedOn | OperationEnabled => SwitchedOn,
        }
    }

    /// Bits of the state within the statusword.
    pub(crate) fn status(self) -> u16 {
        match self {
            SwitchOnDisabled => 0x40,
            ReadyToSwitchOn => 0x21,
            SwitchedOn => 0x23,
            OperationEnabled => 0x27,
            QuickStop => 0x07,
            Fault => 0x08,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The states after some controlwords.
    fn states(from: Power, controls: &[u16]) -> Vec<Power> {
        let (mut power, mut last) = (from, 0);
        let next = |control: &u16| {
            power = power.next(*control, last);
            last = *control;
            power
        };
        controls.iter().map(next).collect()
    }

    #[test]
    fn the_usual_way_leads_to_operation_and_back() {
        let expected = [ReadyToSwitchOn, SwitchedOn, OperationEnabled, SwitchedOn, ReadyToSwitchOn, SwitchOnDisabled];
        assert_eq!(states(SwitchOnDisabled, &[0x06, 0x07, 0x0F, 0x07, 0x06, 0x00]), expected);
        assert_eq!(states(SwitchOnDisabled, &[0x0F, 0x0F]), [SwitchOnDisabled; 2]);
    }

    #[test]
    fn a_fault_is_reset_by_the_rising_edge_only() {
        assert_eq!(states(Fault, &[0x0F, 0x06, 0x86, 0x06]), [Fault, Fault, SwitchOnDisabled, ReadyToSwitchOn]);
        // The bit was set when the fault came.
        assert_eq!(Fault.next(0x80, 0x80), Fault);
    }

    #[test]
    fn a_quick_stop_is_left_by_removing_the_voltage() {
        assert_eq!(states(OperationEnabled, &[0x0B, 0x0F, 0x00]), [QuickStop, QuickStop, SwitchOnDisabled]);
        assert_eq!(states(SwitchedOn, &[0x02]), [SwitchOnDisabled]);
    }
}
