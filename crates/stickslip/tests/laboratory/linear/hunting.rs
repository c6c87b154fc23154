//! Hunting is predicted from the model: the first cases of the study, run on the virtual bench.

#[path = "../../../examples/hunting/case.rs"]
mod case;

use case::{Case, Chance, MACHINES};

#[test]
fn most_hunting_is_predicted_within_a_tenth() {
    let mut chance = Chance(1);
    let (mut right, mut hunts, mut report) = (0, 0, String::new());
    for number in 0..4 {
        let case = Case::draw(MACHINES[0], number, &mut chance).unwrap();
        let outcome = case.outcome().unwrap();
        report += &format!("{} {number}: {:?}, truly {:?}\n", case.machine, outcome.predicted, outcome.truth);
        right += u32::from(outcome.is_right());
        if let Some([amplitude, interval]) = outcome.errors() {
            hunts += 1;
            assert!(amplitude < 0.1 && interval < 0.15, "{report}");
            // The describing function replaces friction by a damping and predicts no hunting.
            assert!(outcome.radius < 1.0, "{report}");
        }
    }
    assert!(right == 4 && hunts >= 1, "{report}");
}
