//! The program still gives the committed study of predicting frictions, and its sentences agree with its numbers.

#[path = "../../examples/prediction/study.rs"]
mod study;

use std::path::Path;

use serde_json::Value;
use stickslip::Watch;
use stickslip::fit::choose;
use stickslip::identify::cross_validation::{Fit, Friction, NAMES};
use stickslip::identify::servo::{self, Kind, Servo};
use stickslip_core::fields::Fields as _;
use study::{EMPS_BLOCKS, Emps, XL330_GROUPS, Xl330};

fn committed() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies/prediction.json");
    let text = std::fs::read_to_string(file).expect("the study is committed");
    serde_json::from_str(&text).expect("a study is written as JSON")
}

/// The row of a model on a part of a recording.
fn row<'a>(committed: &'a Value, data: &str, model: &str, part: usize) -> &'a Value {
    let rows = committed["rows"].as_array().expect("the study has rows");
    let is = |row: &&Value| row["data"] == data && row["model"] == model && row["part"] == part + 1;
    rows.iter().find(is).unwrap_or_else(|| panic!("{data}: {model} on part {}", part + 1))
}

fn error(row: &Value) -> f64 {
    row["error"].as_f64().expect("each row has an error")
}

#[test]
fn the_committed_parameters_still_predict_the_parts_as_in_the_study() {
    let committed = committed();
    let emps = Emps::read().unwrap();
    let blocks = emps.blocks();
    for friction in Friction::ALL {
        for block in 0..EMPS_BLOCKS {
            let row = row(&committed, "emps", friction.name(), block);
            let parameters = NAMES.map(|name| row[name].as_f64().unwrap());
            let now = blocks.error(&Fit { friction, parameters }, block, &Watch::silent()).unwrap();
            // The same simulation of the same numbers; the last digits are those of a text.
            assert!((now / error(row) - 1.0).abs() < 1e-6, "{} {block}: {now}, was {}", friction.name(), error(row));
        }
    }
    let xl330 = Xl330::read().unwrap();
    for kind in Kind::ALL {
        for group in 0..XL330_GROUPS {
            let row = row(&committed, "xl330", kind.name(), group);
            let mut names = servo::fields().iter().map(|field| field.name);
            let servo =
                Servo::<f64>::default().map(&mut |_: f64| names.next().and_then(|name| row[name].as_f64()).unwrap());
            let now = xl330.error(kind, &servo, group).unwrap();
            assert!((now / error(row) - 1.0).abs() < 1e-6, "{} {group}: {now}, was {}", kind.name(), error(row));
        }
    }
}

#[test]
fn published_parameters_predict_as_in_the_study() {
    let committed = committed();
    let result = |name: String| committed["results"][&name]["value"].as_f64().unwrap();
    let rms = |errors: Vec<f64>| (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    let emps = Emps::read().unwrap();
    let mut compared = 0;
    for friction in Friction::ALL {
        let Some(theirs) = emps.published(friction) else { continue };
        let error = |block| emps.blocks().error(&theirs, block, &Watch::silent()).unwrap();
        let then = result(format!("emps.{}.published_error", friction.name()));
        assert!((rms((0..EMPS_BLOCKS).map(error).collect()) / then - 1.0).abs() < 1e-6);
        compared += 1;
    }
    let xl330 = Xl330::read().unwrap();
    for kind in Kind::ALL {
        let theirs = servo::published(kind, &xl330.machine).unwrap();
        let error = |group| xl330.error(kind, &theirs, group).unwrap();
        let then = result(format!("xl330.{}.published_error", kind.name()));
        assert!((rms((0..XL330_GROUPS).map(error).collect()) / then - 1.0).abs() < 1e-6);
        compared += 1;
    }
    assert_eq!(compared, 8);
}

#[test]
fn a_fit_to_the_other_blocks_still_gives_the_result_of_the_study() {
    let committed = committed();
    let emps = Emps::read().unwrap();
    for (friction, block) in [(Friction::Viscous, 2), (Friction::EachWay, 5)] {
        let row = row(&committed, "emps", friction.name(), block);
        let fold = emps.blocks().fold(friction, block, &Watch::silent()).unwrap();
        // A search ends where the sum of squares falls by less than a ten-thousandth.
        assert!(
            (fold.error / error(row) - 1.0).abs() < 1e-3,
            "{} {block}: {}, was {}: run `cargo xtask study prediction`",
            friction.name(),
            fold.error,
            error(row)
        );
    }
}

#[test]
fn a_better_model_on_the_page_is_better_by_more_than_its_standard_error() {
    let committed = committed();
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies/prediction.md");
    let page = std::fs::read_to_string(page).unwrap();
    let squares = |data: &str, models: &[&str], parts: usize| -> Vec<Vec<f64>> {
        let square = |model: &str, part| error(row(&committed, data, model, part)).powi(2);
        models.iter().map(|model| (0..parts).map(|part| square(model, part)).collect()).collect()
    };
    let emps = choose(&squares("emps", &Friction::ALL.map(Friction::name), EMPS_BLOCKS)).unwrap();
    let xl330 = choose(&squares("xl330", &Kind::ALL.map(Kind::name), XL330_GROUPS)).unwrap();
    for title in [Friction::ALL[emps.chosen].title(), Kind::ALL[xl330.chosen].title()] {
        assert!(page.contains(&format!("**{title}**")), "{title}");
    }
}
