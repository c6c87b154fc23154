//! The friction bench for Python: compiled part of the package `stickslip`.
//!
//! The library `stickslip` computes everything. This crate converts values to NumPy arrays, errors to exceptions and
//! help texts to docstrings. Code without Rust (results as mappings, xarray, Matplotlib) is in `python/stickslip`.
//!
//! `python/stickslip/_stickslip.pyi` is generated from the signatures here (`cargo xtask bless`).

mod array;
mod benchmark;
mod calibrate;
mod error;
mod fidelity;
mod fit;
mod friction;
mod functions;
mod group;
mod identify;
mod judge;
mod library;
mod measure;
mod outcome;
mod parameter;
mod preset;
mod record;
mod runs;
mod simulate;
mod study;
mod table;
mod target;
mod tree;
mod value;
mod watched;

use pyo3::prelude::*;

/// The compiled part of stickslip.
#[pymodule]
mod _stickslip {
    #[pymodule_export]
    use crate::benchmark::benchmark_on;
    #[pymodule_export]
    use crate::calibrate::calibrate_bench;
    #[pymodule_export]
    use crate::fidelity::fidelity_of;
    #[pymodule_export]
    use crate::fit::{Fit, curves_of, fit_points};
    #[pymodule_export]
    use crate::friction::{_friction, Friction};
    #[pymodule_export]
    use crate::functions::{clip, cos, exp, floor, log, maximum, minimum, sign, sin, sqrt, where_};
    #[pymodule_export]
    use crate::group::Group;
    #[pymodule_export]
    use crate::identify::{identify_axis, validate_model};
    #[pymodule_export]
    use crate::judge::{demo_on, design_for, hunting_of, loop_of, render_on};
    #[pymodule_export]
    use crate::library::{IdentifiedFriction, friction_library, identified_friction};
    #[pymodule_export]
    use crate::measure::{measure_on_preset, plan_of};
    #[pymodule_export]
    use crate::outcome::Outcome;
    #[pymodule_export]
    use crate::parameter::Parameter;
    #[pymodule_export]
    use crate::preset::{_restored, Preset, preset, presets};
    #[pymodule_export]
    use crate::record::{Number, Truth, number};
    #[pymodule_export]
    use crate::runs::{folder_of_run, replay_record, runs_of};
    #[pymodule_export]
    use crate::simulate::{Measured, Setpoint, simulate_on};
    #[pymodule_export]
    use crate::study::{StudyParts, StudyWork, open_study};
    #[pymodule_export]
    use crate::table::{MachineFile, Table, machine_file, read_table, table_of};
    #[pymodule_export]
    use crate::target::{Code, Recording, record_controller, sampling_of};

    /// Version of the package.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "standard name in Python")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
