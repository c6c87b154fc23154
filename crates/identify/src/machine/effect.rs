//! Keys of a machine file that would have no effect: refused, since their author expects one.

use super::{Axis, Channel, Controller, Machine, Place};
use stickslip_base::units::Dimension::{Angle, AngularVelocity, Counts};
use stickslip_base::units::measure;

impl Machine {
    /// A key without effect and the reason; none if all have one. `motor_side`: the drive's gain is the motor's.
    pub(super) fn without_effect(&self, motor_side: bool) -> Option<(String, &'static str)> {
        let columns = &self.columns;
        let positions = [
            ("position", Some(&columns.position)),
            ("motor_position", columns.motor_position.as_ref()),
            ("reference", columns.reference.as_ref()),
            ("velocity", columns.velocity.as_ref()),
        ];
        let positions = || positions.iter().filter_map(|(role, channel)| Some((*role, (*channel)?)));
        let others = [
            ("time", columns.time.as_ref()),
            ("run", columns.run.as_ref()),
            ("enabled", columns.enabled.as_ref()),
            ("command", Some(&columns.command)),
            ("injected", columns.injected.as_ref()),
        ];
        let others = || others.iter().filter_map(|(role, channel)| Some((*role, (*channel)?)));
        let key = |role: &str, key: &str| format!("columns.{role}.{key}");
        let angle = |channel: &Channel| {
            channel.unit.as_deref().and_then(measure).is_none_or(|(d, _)| [Angle, Counts, AngularVelocity].contains(&d))
        };
        let is = |unit: &Option<String>, dimension| {
            unit.as_deref().and_then(measure).is_none_or(|(found, _)| found == dimension)
        };
        for (role, channel) in positions() {
            if channel.counts_per_rev.is_some() && !is(&channel.unit, Counts) {
                return Some((key(role, "counts_per_rev"), "is for a column in counts"));
            }
            if channel.at == Place::Motor && !angle(channel) {
                return Some((key(role, "at"), "is for an angle or counts: a length is that of the load"));
            }
        }
        for (role, channel) in others() {
            let registers = ["command", "injected"].contains(&role);
            if channel.wraps.is_some() && !registers {
                return Some((key(role, "wraps"), "is for positions, velocities and commands"));
            }
            if channel.counts_per_rev.is_some() || channel.at == Place::Motor {
                return Some((format!("columns.{role}"), "takes neither counts_per_rev nor at"));
            }
        }
        if columns.reference.as_ref().is_some_and(|channel| channel.wraps.is_some()) {
            return Some((key("reference", "wraps"), "is not needed: the reference wraps as the position does"));
        }
        let at_motor = motor_side || positions().any(|(_, channel)| channel.at == Place::Motor);
        if self.gear_ratio != 1.0 && !at_motor {
            return Some(("gear_ratio".into(), "needs a torque of the motor or a column `at = \"motor\"`"));
        }
        if self.screw_lead.is_some() && self.axis == Axis::Rotary {
            return Some(("screw_lead".into(), "is for a linear axis"));
        }
        if self.lifted_mass.is_some() && !self.vertical {
            return Some(("lifted_mass".into(), "is for an axis with vertical = true"));
        }
        if columns.run.is_some() && self.pendulum.is_none() {
            return Some(("columns.run".into(), "is for a recording with [pendulum]: cut the file to one run"));
        }
        if self.controller != Controller::Unknown && columns.reference.is_none() && self.pendulum.is_none() {
            return Some(("[controller]".into(), "needs columns.reference to predict the closed loop"));
        }
        None
    }
}
