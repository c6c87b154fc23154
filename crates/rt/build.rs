//! Compiles the one function that Rust cannot have: it takes any number of arguments.

fn main() {
    cc::Build::new().file("src/fmu/log.c").warnings_into_errors(true).compile("stickslip_fmu_log");
}
