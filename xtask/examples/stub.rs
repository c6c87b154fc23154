//! Prints the type stub of an extension module, from the descriptions that PyO3 stores in the library:
//!
//!     cargo run -p xtask --example stub -- target/debug/lib_stickslip.so _stickslip
#![forbid(unsafe_code)]

use std::path::Path;

use pyo3_introspection::{introspect_cdylib, module_stub_files};

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [library, module] = &arguments[..] else { return Err("usage: stub LIBRARY MODULE".into()) };
    let described = introspect_cdylib(Path::new(library), module).map_err(|error| format!("{library}: {error:#}"))?;
    let stub = module_stub_files(&described).into_values().next();
    print!("{}", stub.ok_or_else(|| format!("{library} describes no module {module}"))?);
    Ok(())
}
