//! Compares symbols and units of the guide with the code.

use stickslip::Preset;
use stickslip::parameters::describe;

use super::markdown::Page;

/// The number of rows `symbol`, `unit`, `parameter`, and those that differ from the code.
fn wrong(page: &Page) -> (usize, Vec<String>) {
    let (mut checked, mut wrong) = (0, Vec::new());
    for table in page.tables() {
        for [symbol, unit, path] in table.columns(["symbol", "unit", "parameter"]).unwrap_or_default() {
            if path.is_empty() {
                continue;
            }
            checked += 1;
            let on_the_page = (plain(symbol), plain(unit));
            match describe::<Preset<f64>>(path) {
                Err(error) => wrong.push(error.to_string()),
                Ok(found) => {
                    for field in found.iter().filter_map(|description| description.field) {
                        let in_the_code = (plain(field.symbol), plain(field.unit));
                        if on_the_page != in_the_code {
                            wrong.push(format!("{path}: {on_the_page:?} on the page, {in_the_code:?} in the code"));
                        }
                    }
                }
            }
        }
    }
    (checked, wrong)
}

/// Text without the typography of multiplication, indices and powers.
fn plain(text: &str) -> String {
    let flat = |c: char| match c {
        '·' => Some(' '),
        '₀' => Some('0'),
        '₁' => Some('1'),
        '²' => Some('2'),
        '³' => Some('3'),
        '_' | '^' => None,
        c => Some(c),
    };
    text.chars().filter_map(flat).collect()
}

#[test]
fn symbols_and_units_of_parameters_are_those_of_the_code() {
    let mut checked = 0;
    for page in Page::all() {
        let (count, wrong) = wrong(&page);
        assert_eq!(wrong, [] as [String; 0], "{}", page.name);
        checked += count;
    }
    // They are in the glossary and in four chapters of theory.
    assert!(checked > 40, "{checked}");
}

#[test]
fn a_wrong_unit_a_wrong_symbol_and_a_wrong_name_are_found() {
    let text = "| symbol | unit | parameter |\n|-|-|-|\n| J<sub>M</sub> | kg·m² | `plant.drive.motor_inertia` |\n\
                | J<sub>M</sub> | kg·m | `plant.drive.motor_inertia` |\n| J | kg·m² | `plant.drive.motor_inertia` |\n\
                | x | 1 | `plant.drive.motor_inertai` |\n| free | anything | |\n";
    let (checked, wrong) = wrong(&Page { name: "a.md".into(), text: text.into() });
    assert_eq!((checked, wrong.len()), (4, 3), "{wrong:?}");
}
