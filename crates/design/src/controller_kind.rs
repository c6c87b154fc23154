//! Conversion of a preset's controller to another kind, with the common numbers.

use stickslip_base::{ControllerChoice, PredictiveFeedback, StateFeedback};
use stickslip_core::control::Cascade;

use crate::cascade_as_pid;

/// The controller of a preset as PID controller, if it is of the same family.
pub fn as_pid(controller: &ControllerChoice<f64>) -> ControllerChoice<f64> {
    match (controller, as_cascade(controller)) {
        (ControllerChoice::Pid(_), _) => *controller,
        (_, ControllerChoice::Cascade(cascade)) => ControllerChoice::Pid(cascade_as_pid(&cascade)),
        (_, other) => other,
    }
}

/// The cascade of a preset; default if it has another controller.
pub fn as_cascade(controller: &ControllerChoice<f64>) -> ControllerChoice<f64> {
    match controller {
        ControllerChoice::Cascade(_) => *controller,
        other => ControllerChoice::Cascade(Cascade { torque_limit: other.torque_limit(), ..Cascade::default() }),
    }
}

/// The state feedback of a preset; default if it has another controller.
pub fn as_state_feedback(controller: &ControllerChoice<f64>) -> ControllerChoice<f64> {
    match controller {
        ControllerChoice::StateFeedback(_) => *controller,
        ControllerChoice::Predictive(it) => ControllerChoice::StateFeedback(it.feedback),
        other => ControllerChoice::StateFeedback(StateFeedback {
            torque_limit: other.torque_limit(),
            ..StateFeedback::default()
        }),
    }
}

/// The predictive controller of a preset, or its state feedback within the default limits.
pub fn as_predictive(controller: &ControllerChoice<f64>) -> ControllerChoice<f64> {
    match (controller, as_state_feedback(controller)) {
        (ControllerChoice::Predictive(_), _) => *controller,
        (_, ControllerChoice::StateFeedback(feedback)) => {
            ControllerChoice::Predictive(PredictiveFeedback { feedback, ..PredictiveFeedback::default() })
        }
        (_, other) => other,
    }
}
