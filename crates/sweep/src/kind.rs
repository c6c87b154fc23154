//! What can be swept: frictions and laws that exist over any kind of number.

use stickslip_core::block::Block;
use stickslip_core::control::{Cascade, ControllerInput, ControllerOutput, Pid};
use stickslip_core::fields::{Fields, each};
use stickslip_core::friction::{Bristle, Dahl, ElastoPlastic, LuGre};
use stickslip_core::scalar::{Lanes, Scalar};

use super::number::Number;

/// Friction with bristles.
pub trait SweptFriction: Copy + Sync {
    /// The same over another kind of number.
    type Over<T: Scalar>: Bristle<T> + Fields<T>;
    /// As many `f32` side by side as are fastest: of a friction of few operations four vectors of the widest registers, of
    /// one of many two, since their choices do not stay in registers.
    type Singles: Number;

    /// Its numbers as another kind.
    fn over<T: Scalar>(&self) -> Self::Over<T>;
}

/// A law from set-point and measurements to a torque.
pub trait SweptLaw: Copy + Sync {
    /// The same over another kind of number.
    type Over<T: Scalar>: Fields<T>
        + Block<T, Input = ControllerInput<T>, Output = ControllerOutput<T>, State: Copy + Default>;

    /// Its numbers as another kind.
    fn over<T: Scalar>(&self) -> Self::Over<T>;
}

macro_rules! swept {
    ($trait:ident: $($kind:ident $(by $lanes:literal)?),*) => {
        $(impl $trait for $kind<f64> {
            type Over<T: Scalar> = $kind<T>;
            $(type Singles = Lanes<f32, $lanes>;)?

            fn over<T: Scalar>(&self) -> $kind<T> {
                self.map(&mut T::of)
            }
        })*
    };
}

swept!(SweptFriction: Dahl by 64, LuGre by 64, ElastoPlastic by 32);
swept!(SweptLaw: Cascade, Pid);

/// The numbers of a struct in the order of declaration.
pub(super) fn numbers(of: &impl Fields<f64>) -> Vec<f64> {
    let (mut copy, mut numbers) = (*of, Vec::new());
    each(&mut copy, &mut |number: &mut f64| numbers.push(*number));
    numbers
}

/// Puts numbers into one lane of a struct.
pub(super) fn put<T: Number>(numbers: &[f64], lane: usize, into: &mut impl Fields<T>) {
    let mut numbers = numbers.iter();
    each(into, &mut |number| {
        number.set(lane, *numbers.next().expect("a struct has as many numbers over any kind"));
    });
}
