//! The rendering law that is chosen, prepared for the bench.

use stickslip_core::render::{Admittance, BristleDifference, Karnopp, Law, SmoothDifference};

use super::{Trust, difference_torque, drive_observer};
use crate::Error;
use crate::preset::{LawChoice, Model, Settings};

/// The rendering law of `settings.law` for what is believed of the machine.
///
/// # Errors
/// As the design of the observer.
pub fn rendering_law(model: &Model<f64>, settings: &Settings<f64>) -> Result<Law<f64>, Error> {
    let paper = difference_torque(&settings.desired, model, settings);
    let (desired, own, torque_limit) = (paper.desired, paper.own, paper.torque_limit);
    let rendered = settings.desired_bristles.under(desired);
    let bristle = |shares: [f64; 3], missing_torque: f64| -> Result<Law<f64>, Error> {
        let observer = drive_observer(model, settings, &Trust { shares, missing_torque, ..Trust::default() })?;
        let ahead = (1.5 * observer.steps as f64).round() as usize;
        Ok(Law::Bristle(BristleDifference { observer, desired: rendered, ahead, torque_limit }))
    };
    Ok(match settings.law {
        LawChoice::Paper => Law::Paper(paper),
        LawChoice::Smooth => {
            let smoothing_velocity = settings.fade_velocity.max(1e-4);
            Law::Smooth(SmoothDifference { desired, own, smoothing_velocity, torque_limit })
        }
        LawChoice::Karnopp => {
            let band = settings.fade_velocity.max(1e-4);
            Law::Karnopp(Karnopp { desired, own, band, torque_limit, ..Karnopp::default() })
        }
        LawChoice::Bristle => bristle([0.0; 3], 0.03)?,
        LawChoice::Residual => bristle([0.0, 0.0, 1.0], 0.03)?,
        LawChoice::Adaptive => bristle([1.0, 1.0, 0.0], 0.03)?,
        LawChoice::Admittance(tracking) => {
            let trust = Trust { shares: [0.0, 0.0, 1.0], missing_torque: 0.1, ..Trust::default() };
            let observer = drive_observer(model, settings, &trust)?;
            let ahead = (1.5 * observer.steps as f64).round() as usize;
            Law::Admittance(Admittance {
                observer,
                desired: rendered,
                bandwidth: tracking.bandwidth,
                ahead,
                torque_limit,
            })
        }
    })
}
