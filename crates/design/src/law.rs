//! The selected rendering law, prepared for the bench.

use stickslip_core::estimate::DriveObserver;
use stickslip_core::render::{Admittance, BristleDifference, Karnopp, Law, SmoothDifference};

use crate::{Trust, difference_torque, drive_observer};
use stickslip_base::Error;
use stickslip_base::preset::{LawChoice, Model, ObserverChoice, Settings};

/// Prediction horizon of the drive from the tick in which a voltage starts to act: to the middle of the sample in which
/// the current reaches its reference [samples].
const AHEAD: f64 = 1.5;

/// The rendering law named by `settings.law`, for the model of the machine. `None` for `auto`, which requires
/// simulations (`stickslip_simulate::rendering_law`).
///
/// # Errors
/// As the design of the observer.
pub fn named_law(model: &Model<f64>, settings: &Settings<f64>) -> Result<Option<Law<f64>>, Error> {
    let paper = difference_torque(&settings.desired, model, settings);
    let (desired, own, torque_limit) = (paper.desired, paper.own, paper.torque_limit);
    // Without accelerometer and tacho the law's observer gives the bench its velocities too.
    let least = match settings.observer {
        ObserverChoice::Accelerometer => 0.0,
        ObserverChoice::Model(trust) => trust.missing_torque,
    };
    let observer = |missing_torque: f64| {
        let trust = Trust { missing_torque: missing_torque.max(least), ..Trust::default() };
        drive_observer(model, settings, &trust)
    };
    let rendered = settings.desired_bristles.under(desired);
    let bristle = |observer| {
        Law::Bristle(BristleDifference {
            ahead: ahead(&observer, model, settings),
            observer,
            desired: rendered,
            torque_limit,
        })
    };
    Ok(Some(match settings.law {
        LawChoice::Paper => Law::Paper(paper),
        LawChoice::Smooth => {
            let smoothing_velocity = settings.fade_velocity.max(1e-4);
            Law::Smooth(SmoothDifference { desired, own, smoothing_velocity, torque_limit })
        }
        LawChoice::Karnopp => {
            let band = settings.fade_velocity.max(1e-4);
            Law::Karnopp(Karnopp { desired, own, band, torque_limit, ..Karnopp::default() })
        }
        LawChoice::Bristle => {
            let mut observer = observer(Trust::default().missing_torque)?;
            if settings.observer == ObserverChoice::Accelerometer {
                observer.gains.torque = [0.0; 3];
                observer.fast_gains.torque = [0.0; 3];
            }
            bristle(observer)
        }
        LawChoice::Residual(residual) => bristle(observer(residual.missing_torque)?),
        LawChoice::Admittance(tracking) => {
            let observer = observer(tracking.missing_torque)?;
            Law::Admittance(Admittance {
                ahead: ahead(&observer, model, settings),
                observer,
                desired: rendered,
                bandwidth: tracking.bandwidth,
                torque_limit,
            })
        }
        LawChoice::Auto => return Ok(None),
    }))
}

/// Steps of the observer's model from the tick in which a command acts to the start and to the end of the interval over
/// which its torque acts.
fn ahead(observer: &DriveObserver<f64>, model: &Model<f64>, settings: &Settings<f64>) -> (usize, usize) {
    let late = observer.load_delay.fraction();
    let [start, end] = if settings.torque_amplifier > 0.5 {
        // The held torque, as much later as the drive lags.
        let lag = model.load_amplifier.lag * settings.tick_rate;
        [late + lag, late + lag + 1.0]
    } else {
        [late, late + AHEAD]
    };
    let steps = |samples: f64| (samples * observer.steps as f64).round() as usize;
    (steps(start), steps(end).max(steps(start) + 1))
}
