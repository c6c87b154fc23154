//! When the torque of a loaded controller acts.

use stickslip_base::parameters::presets::find;
use stickslip_base::{Preset, Watch};
use stickslip_core::control::reference::Setpoint;

use super::*;
use crate::{Bench as _, Command as Order, VirtualBench};

fn preset() -> Preset<f64> {
    find("clm-bench").expect("it is built in").read().expect("it is right")
}

#[test]
fn the_torque_of_a_sample_is_active_from_its_last_tick_on() {
    /// Torques that count the samples, far below breakaway.
    struct Counts(f64);
    impl Caller for Counts {
        fn begin(&mut self, _: f64, _: f64, _: &[f64]) -> Result<(), ExternalFault> {
            self.0 = 0.0;
            Ok(())
        }
        fn step(&mut self, _: &ModuleSample, _: Option<&[f64]>) -> Result<Answer, ExternalFault> {
            self.0 += 1e-3;
            Ok(Answer { torque: self.0, ..Answer::default() })
        }
    }
    for divider in [1, 4, 7] {
        let mut preset = preset();
        preset.bench.control_divider = divider as f64;
        let mut bench = VirtualBench::new(&preset, 5).unwrap();
        crate::home(&mut bench, &Watch::silent()).unwrap();
        bench.come_to_rest().unwrap();
        bench
            .bring(External::new(Role::Controller, Description::default(), String::new(), Box::new(Counts(0.0))))
            .unwrap();
        let at = bench.step(Order::default()).unwrap();
        let setpoint = Setpoint { position: at.angle, ..Setpoint::default() };
        let (mut samples, mut computed, mut active) = (0.0, 0.0, 0.0);
        for _ in 0..40 {
            let frame = bench.step(Order { setpoint, control: true, ..Order::default() }).unwrap();
            if frame.cycle.is_multiple_of(divider) {
                samples += 1.0;
                computed = samples;
            }
            if frame.cycle % divider == divider - 1 {
                active = 1e-3 * computed;
            }
            // Before its first torque, the last one of the built-in controller is active; the substitute may hold the
            // smallest possible torque limit.
            if active > 0.0 {
                assert!((frame.signals.commanded_torque - active).abs() < 2e-6, "{divider}: {active} {frame:?}");
            }
        }
        assert!(samples > 4.0);
    }
}
