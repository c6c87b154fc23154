use std::path::Path;

use super::*;

fn emps() -> (Machine, Recording) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/emps");
    let machine = Machine::read(&folder.join("emps-machine.toml")).unwrap();
    (machine, Recording::read(&folder.join("emps.csv.gz")).unwrap())
}

#[test]
fn probe() {
    let (machine, recording) = emps();
    let t = std::time::Instant::now();
    let found = identify(&recording, &machine).unwrap();
    println!("{:?}", t.elapsed());
    for c in &found.candidates {
        println!("{:?} {} {:?}", c.kind, c.held_out, c.prediction);
        if let Some(r) = &c.refined {
            for i in 0..r.parameters.len() {
                println!("  {} {} {} {:?}", CLOSED_LOOP[i], r.parameters[i], r.standard_errors[i], r.ci95[i]);
            }
        }
    }
    println!("{}\n{}", model_toml(&found, &machine), feedforward_csv(&found, &machine));
    println!("{:?}", found.stribeck_verdicts());
}
