//! Consistency of facts that Rust and Python both state. The package itself is tested by pytest, because a Rust program
//! that calls it would have to link to a Python library.

use std::path::Path;

fn text(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The names that follow a word in a text.
fn names_after(text: &str, word: &str) -> Vec<String> {
    let rests = text.split(word).skip(1);
    let name = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    rests.map(name).filter(|name| !name.is_empty()).collect()
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
        assert!(classes.contains(&exception), "{exception} is missing in {classes:?}");
    }
}

#[test]
fn names_after_a_word_are_found() {
    assert_eq!(names_after("class A(B): class C_1:\nclass: D", "class "), ["A", "C_1"]);
}

#[test]
fn the_oldest_python_version_is_stated_consistently() {
    // In the compiled limited interface and in the metadata for pip.
    assert!(text("Cargo.toml").contains("\"abi3-py310\""));
    assert!(text("../pyproject.toml").contains("requires-python = \">=3.10\""));
}
