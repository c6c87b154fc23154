//! The state of the software, stored and restored.

use super::{Command, Software};
use stickslip_core::snapshot::{StateVisitor, count, fields, flag};

impl Software {
    /// Everything that the next ticks depend on, parameters included; the length of a tick is not included.
    pub fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Software {
            parameters,
            state,
            safety,
            tick_time: _,
            cycle,
            missed,
            silent,
            spoilt,
            voltages,
            command,
            last,
            asked,
        } = self;
        fields(keep, parameters);
        fields(keep, state);
        safety.keep(keep);
        count(keep, cycle);
        count(keep, missed);
        count(keep, silent);
        flag(keep, spoilt);
        fields(keep, voltages);
        command.keep(keep);
        fields(keep, last);
        asked.iter_mut().for_each(|current| keep.number(current));
    }
}

impl Command {
    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Command { setpoint, control, render, added_torque, added_load_torque, mark } = self;
        fields(keep, setpoint);
        flag(keep, control);
        flag(keep, render);
        keep.number(added_torque);
        keep.number(added_load_torque);
        let mut number = u64::from(*mark);
        count(keep, &mut number);
        *mark = number as u32;
    }
}
