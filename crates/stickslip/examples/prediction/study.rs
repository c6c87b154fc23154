//! Both recordings and their parts; shared with the test of the committed result.

use std::path::{Path, PathBuf};

use stickslip::identify::cross_validation::{Blocks, Fit, Friction, NAMES};
use stickslip::identify::servo::{Kind, Servo};
use stickslip::identify::{Loop, Motion};
use stickslip::machine::{Machine, Run, Signals};
use stickslip::recording::Recording;
use stickslip::{Error, Watch};

/// Contiguous blocks of the EMPS record: half a lap each.
pub(crate) const EMPS_BLOCKS: usize = 8;
/// Groups of runs of the servo, in the order of their recording.
pub(crate) const XL330_GROUPS: usize = 4;

fn data(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data").join(file)
}

/// The EMPS record.
pub(crate) struct Emps {
    machine: Machine,
    signals: Signals,
    motion: Motion,
}

impl Emps {
    pub(crate) fn read() -> Result<Self, Error> {
        let machine = Machine::read(&data("emps/emps-machine.toml"))?;
        let signals = machine.signals(&Recording::read(&data("emps/emps.csv.gz"))?)?;
        let motion = Motion::of(&signals, &machine)?;
        Ok(Emps { machine, signals, motion })
    }

    /// Published parameters of a friction, fitted to the whole record.
    pub(crate) fn published(&self, friction: Friction) -> Option<Fit> {
        let (group, names): (_, &[(&str, &str)]) = match friction {
            Friction::Viscous => (
                "symmetric",
                &[
                    ("mass", "mass"),
                    ("positive.coulomb", "coulomb"),
                    ("positive.viscous", "viscous"),
                    ("offset", "offset"),
                ],
            ),
            Friction::EachWay => (
                "asymmetric",
                &[
                    ("mass", "mass"),
                    ("positive.coulomb", "positive_coulomb"),
                    ("positive.viscous", "positive_viscous"),
                    ("negative.coulomb", "negative_coulomb"),
                    ("negative.viscous", "negative_viscous"),
                ],
            ),
            _ => return None,
        };
        let table = self.machine.published.get(group)?;
        let value = |name: &str| {
            let theirs = names.iter().find(|(ours, _)| *ours == name).map(|(_, theirs)| theirs)?;
            table.get(*theirs)?.first().copied()
        };
        Some(Fit { friction, parameters: NAMES.map(|name| value(name).unwrap_or(0.0)) })
    }

    pub(crate) fn blocks(&self) -> Blocks<'_> {
        let around = Loop::of(&self.signals, &self.motion, &self.machine).expect("the controller of the EMPS is known");
        Blocks { around, recipe: self.machine.recipe, count: EMPS_BLOCKS }
    }
}

/// The runs of the servo.
pub(crate) struct Xl330 {
    pub(crate) machine: Machine,
    pub(crate) runs: Vec<Run>,
}

impl Xl330 {
    pub(crate) fn read() -> Result<Self, Error> {
        let machine = Machine::read(&data("xl330_pendulum/xl330-machine.toml"))?;
        let runs = machine.runs(&Recording::read(&data("xl330_pendulum/logs.csv.gz"))?)?;
        Ok(Xl330 { machine, runs })
    }

    /// The runs of a group, and all others.
    pub(crate) fn parted(&self, group: usize) -> [Vec<&Run>; 2] {
        let size = self.runs.len().div_ceil(XL330_GROUPS);
        let is_in = |index: usize| index / size == group;
        [true, false].map(|within| {
            let of = self.runs.iter().enumerate().filter(|(index, _)| is_in(*index) == within);
            of.map(|(_, run)| run).collect()
        })
    }

    /// rms(q − q̂) over the runs of a group [rad].
    pub(crate) fn error(&self, kind: Kind, servo: &Servo<f64>, group: usize) -> Result<f64, Error> {
        let [within, _] = self.parted(group);
        let (mut square, mut samples) = (0.0, 0.0);
        for run in within {
            let positions = servo.simulate(kind, run, &Watch::silent())?;
            square +=
                positions.iter().zip(&run.position).map(|(q, measured)| (q - measured) * (q - measured)).sum::<f64>();
            samples += positions.len() as f64;
        }
        Ok((square / samples).sqrt())
    }
}
