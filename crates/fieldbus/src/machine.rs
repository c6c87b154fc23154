//! The machine behind the drives.

use stickslip_bench::{DriveSignals, MachineWithDrives};

/// A machine with shafts, driven by torques.
pub trait Machine {
    /// Duration of a step [ns].
    fn period(&self) -> u64;

    /// One step under these torques on the shafts [N m]. Without this method a machine does not move.
    fn step(&mut self, torques: &[f64], readings: &mut Readings);
}

/// Drive motor and load motor of the virtual machine of a preset, and its accelerometer.
impl Machine for MachineWithDrives {
    fn period(&self) -> u64 {
        (MachineWithDrives::period(self) * 1e9).round() as u64
    }

    fn step(&mut self, torques: &[f64], readings: &mut Readings) {
        let torque = |at: usize| torques.get(at).copied().unwrap_or(0.0);
        let (signals, accelerometer) = self.exchange([torque(0), torque(1)]);
        for (shaft, signals) in readings.shafts.iter_mut().zip(signals) {
            let DriveSignals { angle, velocity, torque, index } = signals;
            *shaft = Shaft { angle, velocity, torque, index };
        }
        if let Some(signal) = readings.analogue.first_mut() {
            *signal = accelerometer;
        }
    }
}

/// Signals of a machine at the end of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// One for each drive.
    pub shafts: Vec<Shaft>,
    /// Signals of the analogue terminals, as a share of their range from −1 to 1.
    pub analogue: Vec<f64>,
}

/// Signals of a shaft, in the positive direction of its drive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shaft {
    /// Angle [rad].
    pub angle: f64,
    /// Velocity [rad/s].
    pub velocity: f64,
    /// Torque of the motor [N m].
    pub torque: f64,
    /// Angle of an index pulse within the last step [rad].
    pub index: Option<f64>,
}

/// A free rotor with viscous friction on each shaft, for tests of a main device.
#[derive(Clone, Debug)]
pub struct Rotors {
    /// Inertia [kg m²].
    pub inertia: f64,
    /// Viscous friction [N m s/rad].
    pub friction: f64,
}

impl Machine for Rotors {
    fn period(&self) -> u64 {
        125_000
    }

    fn step(&mut self, torques: &[f64], readings: &mut Readings) {
        let dt = self.period() as f64 * 1e-9;
        for (shaft, torque) in readings.shafts.iter_mut().zip(torques) {
            let before = (shaft.angle / std::f64::consts::TAU).floor();
            shaft.velocity += (torque - self.friction * shaft.velocity) / self.inertia * dt;
            shaft.angle += shaft.velocity * dt;
            shaft.torque = *torque;
            let turn = (shaft.angle / std::f64::consts::TAU).floor();
            shaft.index = (turn != before).then_some(turn.max(before) * std::f64::consts::TAU);
        }
        for signal in &mut readings.analogue {
            *signal = 0.5;
        }
    }
}
