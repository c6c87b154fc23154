use std::path::Path;

use super::*;
use crate::machine::{Controller, Machine};
use crate::recording::Recording;

pub(super) fn emps() -> (Machine, Recording) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/emps");
    let machine = Machine::read(&folder.join("emps-machine.toml")).unwrap();
    (machine, Recording::read(&folder.join("emps.csv.gz")).unwrap())
}

#[test]
fn probe() {
    let (machine, recording) = emps();
    let signals = machine.signals(&recording).unwrap();
    let motion = Motion::of(&signals, &machine).unwrap();
    let r = machine.recipe.skip..motion.samples();
    let s = Symmetric::identify(&motion, r.clone(), 10).unwrap().fit;
    let a = Asymmetric::identify(&motion, r.clone(), 10).unwrap().fit;
    for f in [&s, &a] {
        println!(
            "{:?}\n {:?}\n white {:?}\n ci {:?} lag {} cond {} err {}",
            f.coefficients, f.standard_errors, f.white_standard_errors, f.ci95, f.lag, f.condition, f.relative_error
        );
    }
    let Controller::Cascade(controller) = machine.controller else { panic!() };
    let l = Loop {
        signals: &signals,
        reference: signals.reference.as_ref().unwrap(),
        motion: &motion,
        controller,
        gain: machine.gain,
    };
    let c = &s.coefficients;
    let m = AxisModel {
        inertia: c[0],
        positive: coulomb(c[2], c[1]),
        negative: coulomb(c[2], c[1]),
        offset: c[3],
        lag: 0.0,
    };
    println!("{:?}", l.compare(&l.simulate(&m, 2..motion.samples()), 48));
    let c = &a.coefficients;
    let m = AxisModel {
        inertia: c[0],
        positive: coulomb(c[2], c[1]),
        negative: coulomb(c[4], c[3]),
        offset: 0.0,
        lag: 0.0,
    };
    let t = std::time::Instant::now();
    println!("{:?}", l.compare(&l.simulate(&m, 2..motion.samples()), 48));
    println!("{:?}", t.elapsed());
}
