//! Measured curves and their fits as results, rows and columns.

use serde_json::Value;

use crate::FrictionCurve;
use stickslip_base::Summary;
use stickslip_base::quantity::Estimate;
use stickslip_base::table::Column;
use stickslip_fit::{PARAMETERS, StribeckFit};

pub(crate) fn estimate(fit: &StribeckFit, index: usize, unit: &str) -> Estimate {
    let [low, high] = fit.ci95[index];
    Estimate::new(fit.parameters[index], unit).with_half_width(0.5 * (high - low))
}

pub(crate) fn estimates(summary: &mut Summary, prefix: &str, fit: &StribeckFit) {
    for (k, (name, _, unit)) in PARAMETERS.iter().enumerate() {
        summary.with_interval(&format!("{prefix}.{name}"), fit.parameters[k], fit.ci95[k], unit);
    }
}

pub(crate) fn rows(summary: &mut Summary, measurement: &str, curve: &FrictionCurve) {
    for plateau in &curve.plateaus {
        summary.row([
            ("measurement", Value::from(measurement)),
            ("set_velocity", plateau.set_velocity.into()),
            ("velocity", plateau.velocity.into()),
            ("velocity_spread", plateau.velocity_spread.into()),
            ("torque", plateau.torque.into()),
            ("standard_error", plateau.standard_error.into()),
            ("speed_deviation", plateau.deviation.into()),
            ("counts", plateau.dropped.is_none().into()),
        ]);
    }
}

pub(crate) fn columns(curve: &FrictionCurve) -> [Column; 8] {
    let blocks = || curve.plateaus.iter().flat_map(|plateau| plateau.blocks.iter().map(move |block| (plateau, block)));
    let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
    [
        column("set_velocity", "rad/s", blocks().map(|(plateau, _)| plateau.set_velocity).collect()),
        column("plateau_velocity", "rad/s", blocks().map(|(plateau, _)| plateau.velocity).collect()),
        column("plateau_torque", "N m", blocks().map(|(plateau, _)| plateau.torque).collect()),
        column("plateau_standard_error", "N m", blocks().map(|(plateau, _)| plateau.standard_error).collect()),
        column("counts", "1", blocks().map(|(plateau, _)| f64::from(u8::from(plateau.dropped.is_none()))).collect()),
        column("velocity", "rad/s", blocks().map(|(_, block)| block.velocity).collect()),
        column("torque", "N m", blocks().map(|(_, block)| block.torque).collect()),
        column("load_torque", "N m", blocks().map(|(_, block)| block.load_torque).collect()),
    ]
}
