//! Every block gives the same bits as `f64`, in lanes, as the value of a dual and as generated C.

use super::support::{bits_agree, slopes_agree};

/// A test: a block, then parameters for each run.
macro_rules! agree {
    ($test:ident, $Block:ident $(, $parameters:expr)+ $(,)?) => {
        #[test]
        fn $test() {
            // Without optimisation each value of a tick in 32 lanes has a separate place on the stack.
            let roomy = std::thread::Builder::new().stack_size(64 << 20);
            let agrees = roomy.spawn(|| {
                $(
                    bits_agree::<$Block<f64>>($parameters, DT);
                    slopes_agree::<$Block<f64>>($parameters, DT);
                )+
            });
            agrees.expect("memory for a stack").join().expect("all agree");
        }
    };
}

include!("../../../codegen/tests/support/list.rs");

/// The names after a marker in a text.
fn names_after<'a>(text: &'a str, marker: &str) -> Vec<&'a str> {
    let name = |rest: &'a str| rest.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
    text.split(marker).skip(1).map(name).collect()
}

#[test]
fn every_block_has_an_agree_line() {
    let core = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/src");
    let mut blocks = Vec::new();
    let mut folders = vec![core];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("the source of the core is next to this crate") {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).expect("readable source");
                blocks.extend(names_after(&text, " Block<T> for ").into_iter().map(String::from));
            }
        }
    }
    // Converters have no slopes to compare: these two run in `bench.rs`.
    blocks.retain(|block| !["VirtualMachine", "VirtualBench"].contains(&block.as_str()));
    assert!(blocks.len() >= 13, "only {blocks:?}: has the form of an `impl Block` changed?");
    let missing = missing(&blocks, include_str!("../../../codegen/tests/support/list.rs"));
    assert_eq!(missing, Vec::<&str>::new(), "these have no agree! line in crates/codegen/tests/support/list.rs");
}

/// The blocks without an agree! line in a text.
fn missing<'a>(blocks: &'a [String], text: &str) -> Vec<&'a str> {
    let listed: Vec<&str> =
        text.split("\nagree!(").skip(1).filter_map(|line| line.split(',').nth(1)).map(str::trim).collect();
    blocks.iter().map(String::as_str).filter(|block| !listed.contains(block)).collect()
}

#[test]
fn a_block_without_a_line_is_reported() {
    let blocks = ["Pid".to_string(), "Cascade".to_string()];
    assert_eq!(missing(&blocks, "\nagree!(pid, Pid, Pid::default());\n"), ["Cascade"]);
}
