//! A controller that was recorded elsewhere, such as a function in Python, or a friction: its project in C, and its
//! library for `stickslip load`.

use crate::GenerateError;
use std::ops::Deref;

use stickslip_codegen::c;
use stickslip_codegen::module::{self, record_law};
use stickslip_codegen::record::{Program, Recorded};
use stickslip_core::block::Block;
use stickslip_core::control::{ControllerInput, ControllerOutput};
use stickslip_core::fields::Fields;
use stickslip_core::friction::Bristle;

use super::library;
use super::own::{Own, own_friction};
use stickslip_base::Error;

use stickslip_bench::external::HEADER;

/// A controller or a friction as C.
#[derive(Clone, Debug)]
pub struct Module {
    code: Own,
    /// Names and texts of the files of the library; the last one is compiled.
    pub files: Vec<(String, String)>,
}

/// Writes a controller with the signature of [`stickslip_codegen::module`] as C called `name`; `step` is the sampling
/// time [s] of self-test and example.
///
/// # Errors
/// [`GenerateError::NoIdentifier`] if the name is not valid in C, or begins with `stickslip`.
pub fn module(program: Program, name: &str, step: f64) -> Result<Module, Error> {
    let project = c::project_of(program, name, step).map_err(GenerateError::NoIdentifier)?;
    library_of(Own { kind: "controller", name: name.into(), step, project })
}

fn library_of(own: Own) -> Result<Module, Error> {
    let Own { name, project, .. } = &own;
    // The library has functions with these names.
    if name.starts_with("stickslip") {
        return Err(GenerateError::NoIdentifier(c::NotAName(name.clone())).into());
    }
    let code = |ending: &str| {
        let file = format!("{name}.{ending}");
        let text = project.file(&file).unwrap_or_default().to_owned();
        (file, text)
    };
    let files = vec![
        code("h"),
        code("c"),
        ("stickslip_module.h".into(), HEADER.into()),
        (format!("{name}_module.c"), module::source(&project.program, name)),
    ];
    Ok(Module { code: own, files })
}

/// Writes a controller in Rust, a block over any kind of number that has the inputs of those of the bench, with the values
/// of its parameters.
///
/// ```no_run
/// use stickslip_generate::module_of;
/// use stickslip_core::control::Cascade;
///
/// let module = module_of(&Cascade::<f64>::default(), "cascade", 1e-3)?;
/// std::fs::write("cascade.so", module.library()?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`module()`].
pub fn module_of<C>(controller: &C, name: &str, step: f64) -> Result<Module, Error>
where
    C: Fields<f64>,
    C::With<Recorded>: Block<Recorded, Input = ControllerInput<Recorded>, Output = ControllerOutput<Recorded>>,
{
    module(record_law(controller), name, step)
}

/// The same of a friction with bristles, as [`own_friction`] takes it: of the estimated velocity of the screw, for
/// `stickslip load --as friction`.
///
/// ```no_run
/// use stickslip_generate::friction_module_of;
/// use stickslip_core::friction::LuGre;
///
/// let module = friction_module_of(&LuGre::<f64>::default(), "lugre", 250e-6)?;
/// std::fs::write("lugre.so", module.library()?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`module()`].
pub fn friction_module_of<B>(model: &B, name: &str, step: f64) -> Result<Module, Error>
where
    B: Fields<f64>,
    B::With<f64>: Bristle<f64>,
    B::With<Recorded>: Bristle<Recorded>,
{
    library_of(own_friction(model, name, step)?)
}

impl Module {
    /// Compiles the library for this machine by `$CC`, or `cc`; returns its contents.
    ///
    /// # Errors
    /// [`GenerateError::Compiler`] if the compiler is missing or refuses the code; [`Error::File`].
    pub fn library(&self) -> Result<Vec<u8>, Error> {
        let sources: Vec<String> = self.files.iter().rev().take(1).map(|file| file.0.clone()).collect();
        library::compile(&self.files, &sources, "controller", false)
    }
}

/// Its project, FMU and description.
impl Deref for Module {
    type Target = Own;

    fn deref(&self) -> &Own {
        &self.code
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_codegen::record::{Computed, record_declared};

    fn program() -> Program {
        let signature = module::signature("law", "Nothing.", Vec::new(), Vec::new());
        let program =
            record_declared::<f64, ()>(&signature, |it| Ok(Computed { state: Vec::new(), output: vec![it.input[1]] }));
        program.expect("it computes")
    }

    #[test]
    fn a_controller_has_its_project_and_a_library_of_its_own_files() {
        let module_of_law = module(program(), "law", 1e-3).expect("a good name");
        let names: Vec<&str> = module_of_law.files.iter().map(|file| file.0.as_str()).collect();
        assert_eq!(names, ["law.h", "law.c", "stickslip_module.h", "law_module.c"]);
        let project = module_of_law.generated(true);
        assert!(project.text("README.md").is_some() && project.text("diagram/law.json").is_some());
        assert_eq!(module_of_law.generated(false).files.len(), 6);
        assert_eq!(&module_of_law.library().expect("a compiler")[1..4], b"ELF");
    }

    #[test]
    fn names_of_the_library_are_refused() {
        for name in ["stickslip", "stickslip_module", "double", "<lambda>"] {
            let refused = module(program(), name, 1e-3).map(drop);
            assert!(
                matches!(refused.as_ref().err().and_then(|error| error.of()), Some(GenerateError::NoIdentifier(_))),
                "{name}: {refused:?}"
            );
        }
    }

    #[test]
    fn the_message_of_the_compiler_is_returned() {
        let files = [("a.c".into(), "int x = ;".into())];
        let refused = library::compile(&files, &["a.c".into()], "a", false).map(drop).expect_err("no C");
        assert!(refused.to_string().contains("a.c:1") && refused.to_string().contains("CC"), "{refused}");
    }
}
