//! One entrant on one machine in one manoeuvre.

use stickslip_core::control::reference::Generator;
use stickslip_core::tick::Order;

use super::Manoeuvre;
use crate::design::software;
use crate::judged::Judged;
use crate::preset::Preset;
use crate::{Error, Watch};

/// Time at rest before it begins [s].
const REST: f64 = 0.3;

/// What truly happened, once a sample of the controller, from the begin of the manoeuvre on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Course {
    /// Time between samples [s].
    pub(crate) period: f64,
    /// Set-point less true angle [rad].
    pub(crate) deviation: Vec<f64>,
    /// True velocity [rad/s].
    pub(crate) velocity: Vec<f64>,
    /// Torque in force [N m].
    pub(crate) torque: Vec<f64>,
}

/// Runs it; `None` where it did not come to its end: what the supervision of a bench would stop.
pub(crate) fn run(
    preset: &Preset<f64>,
    manoeuvre: Manoeuvre,
    seed: u64,
    chance: f64,
    watch: &Watch,
) -> Result<Option<Course>, Error> {
    let settings = &preset.bench;
    let divider = settings.divider();
    let mut tick = software(&preset.model, settings)?;
    tick.law = stickslip_core::render::Law::Off;
    let mut bench = Judged::new(&preset.plant, tick, settings, divider, seed)?;
    let (reference, duration) = manoeuvre.reference(preset, chance);
    let mut setpoints = Generator::new(reference, settings.tick_rate);
    let in_samples = |time: f64| ((time / settings.control_period()).round() as u64) * divider;
    let (rest, cycles) = (in_samples(REST), in_samples(duration));
    let mut course = Course { period: settings.control_period(), ..Course::default() };
    for cycle in 0..rest + cycles {
        if cycle % 8192 == 0 {
            watch.check()?;
        }
        let mut order = Order { control: 1.0, ..Order::default() };
        if cycle >= rest {
            order.reference = setpoints.next();
        }
        // Before the tick: what is true while its set-point is asked for.
        let machine = &bench.truth().plant.machine;
        let (deviation, velocity) = (order.reference.position - machine.angle, machine.velocity);
        // Written so that a NaN is a fault.
        let follows = deviation.abs() <= settings.safety.following_error && velocity.abs() <= settings.safety.speed;
        if !follows {
            return Ok(None);
        }
        bench.tick(order);
        if cycle >= rest && (cycle - rest).is_multiple_of(divider) {
            course.deviation.push(deviation);
            course.velocity.push(velocity);
            course.torque.push(bench.truth().tick.commanded_torque);
        }
    }
    Ok(Some(course))
}
