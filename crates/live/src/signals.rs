//! The signals with their labels, for selection.

use stickslip_core::fields::Kind;

use super::protocol::{Answer, Signal};
use stickslip_base::parameters::Entry;
use stickslip_base::quantity::unit;
use stickslip_bench::run::{STATES, channels};

/// Signals of the default panes: position, velocity, torque.
const PANES: [&[&str]; 3] = [
    &["angle", "setpoint.position"],
    &["software.estimated_velocity", "setpoint.velocity"],
    &["software.commanded_torque", "software.measured_load_torque"],
];

/// All signals.
pub(super) fn all() -> Answer {
    let panes = PANES.iter().map(|pane| pane.iter().map(|&name| name.to_owned()).collect()).collect();
    Answer::Signals { signals: channels().into_iter().map(signal).collect(), panes }
}

fn signal(entry: Entry) -> Signal {
    let values: &[&str] = match entry.field.kind {
        Kind::Flag => &["no", "yes"],
        _ if entry.path == "state" => &STATES,
        _ => &[],
    };
    Signal {
        // The names of the software's signals are clear without the prefix.
        label: entry.path.strip_prefix("software.").unwrap_or(&entry.path).replace(['.', '_'], " "),
        symbol: entry.field.symbol.into(),
        unit: entry.field.unit.into(),
        printed_unit: unit(entry.field.unit),
        help: entry.field.help.into(),
        values: values.iter().map(|&value| value.to_owned()).collect(),
        name: entry.path,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_signals_of_the_default_panes_exist_and_labels_are_unique() {
        let Answer::Signals { signals, panes } = all() else { unreachable!() };
        assert!(panes.iter().flatten().all(|name| signals.iter().any(|signal| signal.name == *name)), "{panes:?}");
        let mut labels: Vec<_> = signals.iter().map(|signal| &signal.label).collect();
        labels.sort();
        labels.dedup();
        assert_eq!(labels.len(), signals.len());
        let state = signals.iter().find(|signal| signal.name == "state").unwrap();
        assert_eq!(state.values[4], "fault");
    }
}
