//! Code of custom blocks, or of frictions with bristles, from user code.

use stickslip_codegen::c::{self, Project};
use stickslip_codegen::record::Recorded;
use stickslip_core::block::Block;
use stickslip_core::fields::{Fields, Laws, ParameterError, Shape, Walk};
use stickslip_core::friction::{Bend, Bristle, FrictionElementOutput, advance, predict};
use stickslip_core::scalar::Scalar;

use super::a2l::{CodeDescription, Variables, describe};
use super::fmu::{Fmu, Version, fmu_of};
use super::{Generated, Precision};
use crate::GenerateError;
use stickslip_base::Error;

/// A block as C.
#[derive(Clone, Debug)]
pub struct Own {
    pub(super) kind: &'static str,
    pub(super) name: String,
    /// Time step in self-test and example [s].
    pub(super) step: f64,
    pub(super) project: Project,
}

/// Writes a block over any kind of number, with the values of its parameters, as C called `name`; `step` is the time step
/// [s] of self-test and example.
///
/// # Errors
/// [`GenerateError::NoIdentifier`](crate::GenerateError::NoIdentifier) if the name is not valid in C.
pub fn own<B>(block: &B, name: &str, step: f64) -> Result<Own, Error>
where
    B: Fields<f64>,
    B::With<f64>: Block<f64, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let project = c::project::<B, f64>(block, name, step).map_err(GenerateError::NoIdentifier)?;
    Ok(Own { kind: "block", name: name.into(), step, project })
}

/// The same of a friction with bristles alone: velocity in, mean torque of the bristles in the step out. A viscous part
/// is linear in the velocity and not included.
///
/// ```no_run
/// use stickslip_generate::own_friction;
/// use stickslip_core::friction::LuGre;
///
/// own_friction(&LuGre::<f64>::default(), "lugre", 50e-6)?.generated(true).write("lugre".as_ref())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`own`].
pub fn own_friction<B>(model: &B, name: &str, step: f64) -> Result<Own, Error>
where
    B: Fields<f64>,
    B::With<f64>: Bristle<f64>,
    B::With<Recorded>: Bristle<Recorded>,
{
    Ok(Own { kind: "friction", ..own(&Bristles(*model), name, step)? })
}

impl Own {
    /// Describes its code for calibration tools, as [`code_description`](super::code_description) does for built-in
    /// blocks.
    ///
    /// # Errors
    /// As there.
    pub fn description(&self, variables: &Variables) -> Result<CodeDescription, Error> {
        describe(&self.project.program, &self.name, Precision::Double, variables)
    }

    /// The whole project: as of `stickslip generate c`. The diagram takes most of the time for many operations, and is
    /// optional.
    pub fn generated(&self, diagram: bool) -> Generated {
        let generated = Generated::new(self.project.clone(), self.kind, &self.name, self.step);
        if diagram { generated.with_diagram() } else { generated }
    }

    /// Makes its FMU, as [`fmu()`](super::fmu()) does for a built-in block.
    ///
    /// # Errors
    /// [`GenerateError::Compiler`](crate::GenerateError::Compiler) if the compiler refuses the code; [`Error::File`].
    pub fn fmu(&self, version: Version) -> Result<Fmu, Error> {
        fmu_of(&self.project, &self.name, self.step, version, None)
    }
}

/// Bristles as a block. It has the model's name, parameters and laws.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bristles<B>(B);

/// State of the bristles.
#[derive(Clone, Copy, Debug, PartialEq, stickslip_core::Fields)]
struct BristlesState<T> {
    /// Mean deflection of the bristles.
    #[field(symbol = "z", unit = "rad")]
    deflection: T,
}

/// Input of the bristles.
#[derive(Clone, Copy, Debug, PartialEq, stickslip_core::Fields)]
struct Sliding<T> {
    /// Velocity of the sliding surface, held over the step.
    #[field(symbol = "Ω", unit = "rad/s")]
    velocity: T,
}

impl<T: Scalar, B: Fields<T>> Fields<T> for Bristles<B> {
    const NAME: &'static str = B::NAME;
    const HELP: &'static str = B::HELP;
    const SHAPE: Shape = B::SHAPE;
    type With<U: Scalar> = Bristles<B::With<U>>;

    fn contents(&mut self, walk: &mut dyn Walk<T>) {
        self.0.contents(walk);
    }

    fn map<U: Scalar>(&self, convert: &mut dyn FnMut(T) -> U) -> Self::With<U> {
        Bristles(self.0.map(convert))
    }

    fn merge(&self, other: &Self, join: &mut impl FnMut(T, T) -> T) -> Self {
        Bristles(self.0.merge(&other.0, join))
    }

    fn laws(&self, laws: &mut dyn Laws<T>) {
        self.0.laws(laws);
    }

    fn check(values: &Self::With<f64>) -> Result<(), ParameterError> {
        B::check(&values.0)
    }
}

impl<T: Scalar, B: Fields<T> + Bristle<T>> Block<T> for Bristles<B> {
    type State = BristlesState<T>;
    type Input = Sliding<T>;
    type Output = FrictionElementOutput<T>;

    /// As [`FrictionElement`](stickslip_core::friction::FrictionElement): midpoint of the exponential step.
    fn step(&self, state: &mut BristlesState<T>, input: Sliding<T>, dt: T) -> FrictionElementOutput<T> {
        let deflection = state.deflection;
        let bend = |probe: T, dt: T| Bend { deflection, probe, velocity: input.velocity, dt };
        let (middle, _) = predict(&self.0, bend(deflection, T::of(0.5) * dt));
        let (end, torque) = advance(&self.0, bend(middle, dt));
        state.deflection = end;
        FrictionElementOutput { torque }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::friction::{Contact, ElastoPlastic, Friction, FrictionElement, Model};

    #[test]
    fn custom_bristles_are_stepped_as_the_built_in_ones() {
        let mut bristle = ElastoPlastic::<f64>::default();
        bristle.lugre.sliding.viscous_friction = 0.0;
        let element =
            FrictionElement { friction: Friction { model: Model::ElastoPlastic(bristle), ..Friction::default() } };
        let (mut house, mut own) = (Default::default(), BristlesState::default());
        for k in 0..2000 {
            let velocity = 0.3 * f64::from(k % 500 - 250) / 250.0;
            let theirs = element.step(&mut house, Contact { velocity, ..Contact::default() }, 50e-6).torque;
            let ours = Bristles(bristle).step(&mut own, Sliding { velocity }, 50e-6).torque;
            assert!((theirs - ours).abs() <= 1e-15 * theirs.abs().max(1.0), "{k}: {theirs} {ours}");
        }
        assert!(own.deflection != 0.0);
    }
}
