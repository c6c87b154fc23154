//! All files of a project.

use stickslip_core::block::Block;
use stickslip_core::fields::Fields;

use super::vectors::{self, Vector};
use super::{NotAName, example, page, print_in, selftest};
use crate::record::{self, Precision, Program, Real, Recorded};

/// The files of one folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Project {
    /// Names and texts: `NAME.h`, `NAME.c`, `NAME_selftest.h`, `NAME_selftest.c`, `main.c`, `README.md`.
    pub files: Vec<(String, String)>,
    /// The recorded program.
    pub program: Program,
}

impl Project {
    /// The text of a file.
    pub fn file(&self, name: &str) -> Option<&str> {
        self.files.iter().find(|file| file.0 == name).map(|file| file.1.as_str())
    }
}

/// Writes a block as a project in C, in the precision `F`: the code with a self-test, a runnable example, and a page.
/// `step` is the time step [s] of self-test and example.
///
/// # Errors
/// If the name is not valid in C.
pub fn project<B, F>(block: &B, name: &str, step: f64) -> Result<Project, NotAName>
where
    F: Precision,
    B: Fields<f64>,
    B::With<F>: Block<F, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let vectors = vectors::vectors(&block.map(&mut F::of), step);
    files(Real::of::<F>(), record::record::<B, F>(block), &vectors, name, step)
}

/// The same of a program that was recorded without a block, in `double`: see [`record::record_declared`].
///
/// # Errors
/// If the name is not valid in C.
pub fn project_of(program: Program, name: &str, step: f64) -> Result<Project, NotAName> {
    evaluated::<f64>(program, name, step)
}

/// The project of a program in the precision that it was recorded in; the program itself computes the vectors of the
/// self-test.
pub(super) fn evaluated<F: Precision>(program: Program, name: &str, step: f64) -> Result<Project, NotAName> {
    let vectors = vectors::of_program::<F>(&program, step);
    files(Real::of::<F>(), program, &vectors, name, step)
}

fn files(real: Real, program: Program, vectors: &[Vector], name: &str, step: f64) -> Result<Project, NotAName> {
    let code = print_in(real, &program, name)?;
    let top = program.top();
    let file = |name: String, text: String| (name, text);
    let files = vec![
        file(format!("{name}.h"), code.header),
        file(format!("{name}.c"), code.source),
        file(format!("{name}_selftest.h"), selftest::header(name)),
        file(format!("{name}_selftest.c"), selftest::source(real, name, top, vectors)),
        file("main.c".into(), example::main(real, name, top, step)),
        file("README.md".into(), page::page(real, &program, top, name, step)),
    ];
    Ok(Project { files, program })
}
