//! What Rust and Python say of the package in two places is the same. The package itself is tested by pytest: a program
//! that calls it would need a library of Python to link to.

use std::path::Path;

fn text(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The words that follow a word in a text, up to what is no part of a name.
fn names_after(text: &str, word: &str) -> Vec<String> {
    let begins = text.split(word).skip(1);
    let name = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    begins.map(name).filter(|name| !name.is_empty()).collect()
}

#[test]
fn every_exception_that_is_raised_exists_in_python() {
    let classes = names_after(&text("stickslip/_errors.py"), "\nclass ");
    let raised: Vec<String> = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
        .expect("there are sources")
        .flat_map(|entry| names_after(&std::fs::read_to_string(entry.unwrap().path()).unwrap(), "Exception::"))
        .filter(|name| name.starts_with(char::is_uppercase))
        .collect();
    assert!(raised.len() > 10, "{raised:?}");
    for exception in raised {
        assert!(classes.contains(&exception), "{exception} is not among {classes:?}");
    }
}

#[test]
fn names_are_found_after_their_word() {
    assert_eq!(names_after("class A(B): class C_1:\nclass: D", "class "), ["A", "C_1"]);
}

#[test]
fn the_oldest_python_is_one() {
    // In the limited interface that is compiled, and in what pip is told.
    assert!(text("Cargo.toml").contains("\"abi3-py310\""));
    assert!(text("../pyproject.toml").contains("requires-python = \">=3.10\""));
}
