//! Description of each number: name, symbol, unit, range, default, help.
//!
//! `#[derive(Fields)]` writes the tables from the struct. The file format, forms, C structs and recording channels
//! follow from them by one of three walks: [`Fields::walk`] (visit, read, change), [`Fields::map`] (to another kind of
//! number) and [`Fields::merge`] (two of a kind into one).

use crate::scalar::Scalar;

/// One field of a struct.
#[derive(Debug)]
pub struct Field {
    /// Name in code and files: `stribeck_velocity`.
    pub name: &'static str,
    /// Symbol in equations: `Ω_Strib`; empty for a group.
    pub symbol: &'static str,
    /// SI unit: `N m/rad`; `1` for a pure number; empty for a group.
    pub unit: &'static str,
    /// Smallest allowed value.
    pub minimum: f64,
    /// Largest allowed value.
    pub maximum: f64,
    /// Default value.
    pub default: f64,
    /// The doc comment.
    pub help: &'static str,
    /// Kind of number; [`Kind::Real`] for a group.
    pub kind: Kind,
    /// Contents of the field.
    pub shape: Shape,
}

/// Kind of values, besides the range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Any number.
    Real,
    /// Whole numbers.
    Whole,
    /// 0 or 1, `false` or `true` in files.
    Flag,
}

/// Contents of a field.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// One number.
    Number,
    /// A list of this length.
    List(usize, &'static Shape),
    /// A struct.
    Group(&'static [Field]),
    /// One of several, named in files by the key `tag`.
    Choice {
        /// The key that names the variant.
        tag: &'static str,
        /// The variants.
        variants: &'static [Variant],
    },
}

impl Shape {
    /// The fields of a group; none for anything else.
    pub const fn fields(self) -> &'static [Field] {
        match self {
            Shape::Group(fields) => fields,
            _ => &[],
        }
    }

    /// The variants of a choice; none for anything else.
    pub const fn variants(self) -> &'static [Variant] {
        match self {
            Shape::Choice { variants, .. } => variants,
            _ => &[],
        }
    }
}

/// One alternative of a choice.
#[derive(Debug)]
pub struct Variant {
    /// Name in files: `elasto-plastic`.
    pub name: &'static str,
    /// The doc comment.
    pub help: &'static str,
    /// Its fields, in the same table as the tag.
    pub shape: Shape,
}

/// A law between fields: a field's value and a bound that the other fields give. Over recorded numbers it goes into
/// generated code as well. Names are relative to the struct that states the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relation<T> {
    /// The field to change.
    pub field: &'static str,
    /// Its value.
    pub value: T,
    /// Required relation to the bound.
    pub order: Order,
    /// The bound.
    pub bound: T,
    /// Cause and remedy.
    pub remedy: &'static str,
}

/// Required relation of a value to its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// value ≤ bound
    AtMost,
    /// value ≥ bound
    AtLeast,
}

impl Order {
    /// Text for messages.
    pub const fn words(self) -> &'static str {
        match self {
            Order::AtMost => "at most",
            Order::AtLeast => "at least",
        }
    }
}

/// The law `value ≤ bound`.
pub const fn at_most<T: Copy>(field: &'static str, value: T, bound: T, remedy: &'static str) -> Relation<T> {
    Relation { field, value, order: Order::AtMost, bound, remedy }
}

/// The law `value ≥ bound`.
pub const fn at_least<T: Copy>(field: &'static str, value: T, bound: T, remedy: &'static str) -> Relation<T> {
    Relation { field, value, order: Order::AtLeast, bound, remedy }
}

impl Relation<f64> {
    /// `Err` if it does not hold; NaN on either side is an error.
    pub fn check(self) -> Result<(), ParameterError> {
        let Relation { field, value, order, bound, remedy } = self;
        let holds = match order {
            Order::AtMost => value <= bound,
            Order::AtLeast => value >= bound,
        };
        if holds { Ok(()) } else { Err(ParameterError { field, value, relation: order.words(), bound, remedy }) }
    }
}

/// A violated law between fields.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterError {
    /// The field to change.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// Required relation to the bound: "at most", "at least".
    pub relation: &'static str,
    /// The bound that the other fields give.
    pub bound: f64,
    /// Cause and remedy.
    pub remedy: &'static str,
}

/// A visitor of all numbers of a struct, in the order of declaration.
pub trait Walk<T> {
    /// A number; in a list once for each element.
    fn number(&mut self, field: &'static Field, value: &mut T);

    /// The variant that is chosen; the return value becomes the choice, with the variant's defaults if it is another.
    fn choice(&mut self, tag: &'static str, variants: &'static [Variant], current: usize) -> usize {
        let _ = (tag, variants);
        current
    }

    /// Start of a field; its contents follow up to [`leave`](Self::leave).
    fn enter(&mut self, field: &'static Field) {
        let _ = field;
    }

    /// The end of a field.
    fn leave(&mut self) {}

    /// The next number or group is this element of the list.
    fn element(&mut self, index: usize) {
        let _ = index;
    }

    /// A count outside the signal path, such as the steps of a tick.
    fn fixed(&mut self, count: &mut usize) {
        let _ = count;
    }
}

/// Fixed configuration: one count or two.
pub trait Fixed {
    /// Visits the counts.
    fn counts<T>(&mut self, walk: &mut dyn Walk<T>);
}

impl Fixed for usize {
    fn counts<T>(&mut self, walk: &mut dyn Walk<T>) {
        walk.fixed(self);
    }
}

impl Fixed for (usize, usize) {
    fn counts<T>(&mut self, walk: &mut dyn Walk<T>) {
        walk.fixed(&mut self.0);
        walk.fixed(&mut self.1);
    }
}

/// A receiver of the laws between fields.
pub trait Laws<T> {
    /// Start of a field.
    fn enter(&mut self, field: &'static Field);
    /// The end of a field.
    fn leave(&mut self);
    /// Start of an element of the field's list, up to the next element or [`leave`](Self::leave).
    fn element(&mut self, index: usize) {
        let _ = index;
    }
    /// A law of the current struct.
    fn state(&mut self, law: Relation<T>);
}

/// A struct of numbers with its description. Derived, never written by hand.
pub trait Fields<T: Scalar>: Copy {
    /// The struct's name.
    const NAME: &'static str;
    /// The struct's doc comment, in Markdown; empty for bare numbers.
    const HELP: &'static str = "";
    /// Its contents.
    const SHAPE: Shape;
    /// The same struct over another kind of number.
    type With<U: Scalar>: Fields<U>;

    /// Visits the contents.
    fn contents(&mut self, walk: &mut dyn Walk<T>);

    /// Visits this as the field of a struct.
    fn walk(&mut self, field: &'static Field, walk: &mut dyn Walk<T>) {
        walk.enter(field);
        self.contents(walk);
        walk.leave();
    }

    /// Each number converted. Compiled once for each pair of kinds: in the tick, take [`merge`](Self::merge).
    fn map<U: Scalar>(&self, convert: &mut dyn FnMut(T) -> U) -> Self::With<U>;

    /// Each number made from two. Where a choice differs, the one of `self` stays. Inlined, and so compiled again for each
    /// `join`: a closure belongs to the number alone, not to the struct that is merged.
    fn merge(&self, other: &Self, join: &mut impl FnMut(T, T) -> T) -> Self;

    /// States the laws between fields, here and below. Ranges are checked by a walk over the numbers.
    fn laws(&self, laws: &mut dyn Laws<T>);

    /// Checks laws of this struct that are not relations of two numbers.
    fn check(values: &Self::With<f64>) -> Result<(), ParameterError> {
        let _ = values;
        Ok(())
    }
}

/// Visits each number of a value in the order of declaration, to read or to change it. Compiled once for each kind of
/// number: for code off the tick.
pub fn each<T: Scalar>(value: &mut impl Fields<T>, visit: &mut dyn FnMut(&mut T)) {
    value.walk(&ANY, &mut Each(visit));
}

struct Each<'a, T>(&'a mut dyn FnMut(&mut T));

impl<T> Walk<T> for Each<'_, T> {
    fn number(&mut self, _: &'static Field, value: &mut T) {
        (self.0)(value);
    }
}

/// The field of a value that may be a bare number.
static ANY: Field = Field {
    name: "value",
    symbol: "",
    unit: "",
    minimum: f64::NEG_INFINITY,
    maximum: f64::INFINITY,
    default: 0.0,
    help: "",
    kind: Kind::Real,
    shape: Shape::Number,
};

impl<T: Scalar> Fields<T> for T {
    const NAME: &'static str = "Number";
    const SHAPE: Shape = Shape::Number;
    type With<U: Scalar> = U;

    fn contents(&mut self, _walk: &mut dyn Walk<T>) {}

    fn walk(&mut self, field: &'static Field, walk: &mut dyn Walk<T>) {
        walk.number(field, self);
    }

    #[inline]
    fn map<U: Scalar>(&self, convert: &mut dyn FnMut(T) -> U) -> U {
        convert(*self)
    }

    #[inline(always)]
    fn merge(&self, other: &Self, join: &mut impl FnMut(T, T) -> T) -> Self {
        join(*self, *other)
    }

    fn laws(&self, _laws: &mut dyn Laws<T>) {}
}

impl<T: Scalar> Fields<T> for () {
    const NAME: &'static str = "Nothing";
    const SHAPE: Shape = Shape::Group(&[]);
    type With<U: Scalar> = ();

    fn contents(&mut self, _walk: &mut dyn Walk<T>) {}

    fn map<U: Scalar>(&self, _convert: &mut dyn FnMut(T) -> U) {}

    #[inline(always)]
    fn merge(&self, _other: &Self, _join: &mut impl FnMut(T, T) -> T) {}

    fn laws(&self, _laws: &mut dyn Laws<T>) {}
}

impl<T: Scalar, V: Fields<T>, const N: usize> Fields<T> for [V; N] {
    const NAME: &'static str = V::NAME;
    const HELP: &'static str = V::HELP;
    const SHAPE: Shape = Shape::List(N, &V::SHAPE);
    type With<U: Scalar> = [V::With<U>; N];

    fn contents(&mut self, walk: &mut dyn Walk<T>) {
        list(self, None, walk);
    }

    fn walk(&mut self, field: &'static Field, walk: &mut dyn Walk<T>) {
        list(self, Some(field), walk);
    }

    fn map<U: Scalar>(&self, convert: &mut dyn FnMut(T) -> U) -> Self::With<U> {
        // Not `from_fn`: it compiles to a hundred times as much code.
        const { assert!(N > 0, "a list has elements") }
        let mut mapped = [self[0].map(convert); N];
        for index in 1..N {
            mapped[index] = self[index].map(convert);
        }
        mapped
    }

    #[inline(always)]
    fn merge(&self, other: &Self, join: &mut impl FnMut(T, T) -> T) -> Self {
        // Not `from_fn`: that may stay a call, and lanes want none.
        let mut merged = *self;
        for (one, other) in merged.iter_mut().zip(other) {
            *one = one.merge(other, join);
        }
        merged
    }

    fn laws(&self, laws: &mut dyn Laws<T>) {
        for (index, value) in self.iter().enumerate() {
            laws.element(index);
            value.laws(laws);
        }
    }
}

/// Visits the elements of a list, as the field of a struct or by themselves; the same code for lists of any length.
fn list<T: Scalar, V: Fields<T>>(elements: &mut [V], field: Option<&'static Field>, walk: &mut dyn Walk<T>) {
    for (index, element) in elements.iter_mut().enumerate() {
        walk.element(index);
        match field {
            Some(field) => element.walk(field, walk),
            None => element.contents(walk),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Fields;
    use std::string::String;
    use std::vec::Vec;

    /// Two springs.
    #[derive(Clone, Copy, Debug, PartialEq, Fields)]
    #[fields(law = Pair::law)]
    struct Pair<T> {
        /// The soft one.
        #[field(symbol = "c₁", unit = "N m/rad", range = 0.0..=10.0, default = 2.0)]
        soft: T,
        /// The stiff one, thrice.
        #[field(symbol = "c₂", unit = "N m/rad", range = 1.0..=100.0, default = 20.0)]
        stiff: [T; 3],
    }

    impl<T: Scalar> Pair<T> {
        fn law(&self) -> [Relation<T>; 1] {
            [at_least("stiff", self.stiff[0], self.soft, "The stiff spring is the stiffer one.")]
        }
    }

    /// The holder of the load.
    #[derive(Clone, Copy, Debug, PartialEq, Fields)]
    #[fields(tag = "kind")]
    enum Holder<T> {
        /// Nothing.
        Nothing,
        /// Two springs.
        TwoSprings(Pair<T>),
    }

    /// The whole.
    #[derive(Clone, Copy, Debug, PartialEq, Fields)]
    struct Whole<T> {
        /// The holder.
        holder: Holder<T>,
        /// On or off.
        #[field(unit = "1", flag)]
        on: T,
    }

    #[derive(Default)]
    struct Names(Vec<String>, Vec<String>, bool);

    impl Walk<f64> for Names {
        fn number(&mut self, field: &'static Field, value: &mut f64) {
            self.1.push(std::format!("{}.{}={value}", self.0.join("."), field.name));
            *value += 1.0;
        }
        fn choice(&mut self, tag: &'static str, variants: &'static [Variant], current: usize) -> usize {
            self.1.push(std::format!("{tag}: {}", variants[current].name));
            if self.2 { 1 } else { current }
        }
        fn enter(&mut self, field: &'static Field) {
            self.0.push(field.name.into());
        }
        fn leave(&mut self) {
            self.0.pop();
        }
    }

    #[test]
    fn a_walk_meets_every_number_and_may_change_a_choice() {
        let mut whole = Whole::<f64>::default();
        assert_eq!(whole, Whole { holder: Holder::Nothing, on: 0.0 });
        let mut walk = Names(Vec::new(), Vec::new(), true);
        whole.contents(&mut walk);
        assert_eq!(
            walk.1,
            ["kind: nothing", "holder.soft=2", "holder.stiff=20", "holder.stiff=20", "holder.stiff=20", ".on=0"]
        );
        assert_eq!(whole.holder, Holder::TwoSprings(Pair { soft: 3.0, stiff: [21.0; 3] }));
    }

    /// A spring that is counted.
    #[derive(Clone, Copy, Debug, PartialEq, Fields)]
    struct Counted<T> {
        /// Number of springs.
        #[field(fixed)]
        count: usize,
        /// Stiffness of each.
        #[field(unit = "N m/rad", default = 3.0)]
        stiffness: T,
    }

    #[test]
    fn fixed_configuration_is_not_a_number_and_is_kept() {
        let springs = Counted { count: 4, ..Counted::<f64>::default() };
        let single = springs.map(&mut |v| v as f32);
        assert_eq!(single, Counted { count: 4, stiffness: 3.0f32 });
        let fewer = Counted { count: 2, stiffness: 1.0 };
        assert_eq!(springs.merge(&fewer, &mut |a, b| a + b), Counted { count: 4, stiffness: 4.0 });
        assert_eq!(<Counted<f64> as Fields<f64>>::SHAPE.fields().len(), 1);
    }

    #[test]
    fn each_number_is_visited_in_order_and_may_be_changed() {
        let mut pairs = [Pair::<f64>::default(), Pair { soft: 3.0, stiff: [4.0, 5.0, 6.0] }];
        let mut met = Vec::new();
        each(&mut pairs, &mut |number| {
            met.push(*number);
            *number += 1.0;
        });
        assert_eq!(met, [2.0, 20.0, 20.0, 20.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(pairs[1], Pair { soft: 4.0, stiff: [5.0, 6.0, 7.0] });
        let mut bare = 1.0;
        each::<f64>(&mut bare, &mut |number| *number = 2.0);
        assert_eq!(bare, 2.0);
    }

    #[test]
    fn map_and_merge_keep_the_structure() {
        let a = Pair::<f64>::default();
        let b = a.map(&mut |v| v as f32);
        assert_eq!(b, Pair { soft: 2.0f32, stiff: [20.0; 3] });
        assert_eq!(a.merge(&a, &mut |x, y| x - y), Pair { soft: 0.0, stiff: [0.0; 3] });
    }

    #[test]
    fn a_broken_law_is_reported_with_its_place() {
        struct Report(Vec<&'static str>, Vec<String>);
        impl Laws<f64> for Report {
            fn enter(&mut self, field: &'static Field) {
                self.0.push(field.name);
            }
            fn leave(&mut self) {
                self.0.pop();
            }
            fn state(&mut self, law: Relation<f64>) {
                if let Err(error) = law.check() {
                    let group = self.0.join(".");
                    self.1.push(std::format!("{group}.{} {} {}", error.field, error.relation, error.bound));
                }
            }
        }
        let whole = |soft| Whole { holder: Holder::TwoSprings(Pair { soft, stiff: [20.0; 3] }), on: 0.0 };
        let mut report = Report(Vec::new(), Vec::new());
        for soft in [20.0, 30.0, f64::NAN] {
            whole(soft).laws(&mut report);
        }
        assert_eq!(report.1, ["holder.stiff at least 30", "holder.stiff at least NaN"]);
    }

    #[test]
    fn the_doc_comment_of_a_struct_is_its_help() {
        assert_eq!(<Pair<f64> as Fields<f64>>::HELP, "Two springs.");
        assert_eq!(<[Holder<f64>; 2] as Fields<f64>>::HELP, "The holder of the load.");
    }
}
