//! The numbers of one value as a tree: the tables of [`Fields`] with the choices made.

use stickslip_core::fields::{Field, Fields, Kind, Shape, Variant, Walk};
use stickslip_core::scalar::Scalar;

/// Structure of a struct, a list or a number.
#[derive(Clone, Debug, PartialEq)]
pub enum Tree {
    /// One number.
    Number,
    /// A number of equal elements.
    List(usize, Box<Tree>),
    /// Named parts.
    Group(Group),
}

/// A struct, or the chosen variant of an enum.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Key and name of each choice of this struct: `("model", "elasto-plastic")`.
    pub chosen: Vec<(&'static str, &'static str)>,
    /// The fields, in order of declaration.
    pub members: Vec<Member>,
}

/// The variant of an enum is the struct that it holds.
impl PartialEq for Group {
    fn eq(&self, other: &Self) -> bool {
        self.members == other.members
    }
}

/// A field of a struct.
#[derive(Clone, Debug)]
pub struct Member {
    /// The field's name; with a number if the elements of a list differ in their choices.
    pub name: String,
    /// Its row in the tables.
    pub field: &'static Field,
    /// Its structure.
    pub tree: Tree,
}

/// Tables have no identity: two members are equal if their contents are equal.
impl PartialEq for Member {
    fn eq(&self, other: &Self) -> bool {
        let text = |m: &Member| (m.field.symbol, m.field.unit, m.field.help);
        let range = |m: &Member| [m.field.minimum, m.field.maximum, m.field.default];
        self.name == other.name && self.tree == other.tree && text(self) == text(other) && range(self) == range(other)
    }
}

/// The field of a bare number or list, which has no name.
static VALUE: Field = Field {
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

impl Tree {
    /// The tree of a value. A bare number or list becomes the struct of one member `value`.
    pub fn of<T: Scalar, V: Fields<T>>(value: &V) -> Tree {
        let mut builder = Builder::new(V::SHAPE);
        let mut copy = *value;
        copy.walk(&VALUE, &mut builder);
        builder.finish()
    }

    /// Number of its numbers.
    pub fn numbers(&self) -> usize {
        match self {
            Tree::Number => 1,
            Tree::List(length, element) => length * element.numbers(),
            Tree::Group(group) => group.members.iter().map(|m| m.tree.numbers()).sum(),
        }
    }

    /// This tree and all below it, outermost first: path (`friction.elements[2]`, empty for the whole), position of the
    /// first number, tree.
    pub fn parts(&self) -> Vec<(String, usize, &Tree)> {
        let mut out = Vec::new();
        self.collect(String::new(), 0, &mut out);
        out
    }

    fn collect<'a>(&'a self, path: String, first: usize, out: &mut Vec<(String, usize, &'a Tree)>) {
        out.push((path.clone(), first, self));
        match self {
            Tree::Number => {}
            Tree::List(length, element) => {
                for i in 0..*length {
                    element.collect(format!("{path}[{i}]"), first + i * element.numbers(), out);
                }
            }
            Tree::Group(group) => {
                let mut first = first;
                for member in &group.members {
                    let dot = if path.is_empty() { "" } else { "." };
                    member.tree.collect(format!("{path}{dot}{}", member.name), first, out);
                    first += member.tree.numbers();
                }
            }
        }
    }

    /// The path of each number.
    pub fn paths(&self) -> Vec<String> {
        self.leaves().into_iter().map(|leaf| leaf.0).collect()
    }

    /// The path of each number, and its row in the tables.
    pub fn leaves(&self) -> Vec<(String, &'static Field)> {
        fn collect(tree: &Tree, path: &str, field: &'static Field, out: &mut Vec<(String, &'static Field)>) {
            match tree {
                Tree::Number => out.push((path.into(), field)),
                Tree::List(length, element) => {
                    (0..*length).for_each(|i| collect(element, &format!("{path}[{i}]"), field, out));
                }
                Tree::Group(group) => {
                    let dot = if path.is_empty() { "" } else { "." };
                    for member in &group.members {
                        collect(&member.tree, &format!("{path}{dot}{}", member.name), member.field, out);
                    }
                }
            }
        }
        let mut out = Vec::new();
        collect(self, "", &VALUE, &mut out);
        out
    }

    /// Whether it is a bare number, as the struct of one.
    pub fn is_bare(&self) -> bool {
        matches!(self.members(), [Member { tree: Tree::Number, field, .. }] if std::ptr::eq(*field, &VALUE))
    }

    /// The members of a group; empty for other trees.
    pub fn members(&self) -> &[Member] {
        if let Tree::Group(group) = self { &group.members } else { &[] }
    }
}

/// A struct during the walk, before the elements of lists are combined.
#[derive(Default)]
struct Frame {
    field: Option<&'static Field>,
    chosen: Vec<(&'static str, &'static str)>,
    met: Vec<(&'static Field, Tree)>,
}

struct Builder {
    frames: Vec<Frame>,
    /// The shape behind [`VALUE`].
    shape: Shape,
}

impl Builder {
    fn new(shape: Shape) -> Self {
        Builder { frames: vec![Frame::default()], shape }
    }

    fn finish(mut self) -> Tree {
        let mut whole = self.close();
        if let [Member { tree: Tree::Group(_), .. }] = whole.members.as_slice()
            && let Some(Member { tree, .. }) = whole.members.pop()
        {
            return tree;
        }
        Tree::Group(whole)
    }

    fn top(&mut self) -> &mut Frame {
        self.frames.last_mut().expect("the outermost frame is closed last")
    }

    fn met(&mut self, field: &'static Field) {
        self.top().met.push((field, Tree::Number));
    }

    fn chosen(&mut self, tag: &'static str, variant: &'static str) {
        self.top().chosen.push((tag, variant));
    }

    fn entered(&mut self, field: &'static Field) {
        self.frames.push(Frame { field: Some(field), ..Frame::default() });
    }

    fn left(&mut self) {
        let field = self.top().field;
        let group = self.close();
        if let Some(field) = field {
            self.top().met.push((field, Tree::Group(group)));
        }
    }

    /// Ends the innermost frame.
    fn close(&mut self) -> Group {
        let frame = self.frames.pop().expect("each field that is left was entered");
        let mut members = Vec::new();
        for run in frame.met.chunk_by(|a, b| std::ptr::eq(a.0, b.0)) {
            let field = run[0].0;
            let shape = if std::ptr::eq(field, &VALUE) { self.shape } else { field.shape };
            let mut elements = run.iter().map(|(_, tree)| tree);
            let alike = run.iter().all(|(_, tree)| *tree == run[0].1);
            if alike && let Some(tree) = gather(shape, &mut elements) {
                members.push(Member { name: field.name.into(), field, tree });
            } else {
                members.extend(run.iter().enumerate().map(|(i, (_, tree))| Member {
                    name: format!("{}_{i}", field.name),
                    field,
                    tree: tree.clone(),
                }));
            }
        }
        Group { chosen: frame.chosen, members }
    }
}

/// The lists of this shape from their equal elements.
fn gather<'a>(shape: Shape, elements: &mut impl Iterator<Item = &'a Tree>) -> Option<Tree> {
    let Shape::List(length, inner) = shape else { return elements.next().cloned() };
    let first = gather(*inner, elements)?;
    Some(Tree::List(length, Box::new(first)))
}

impl<T> Walk<T> for Builder {
    fn number(&mut self, field: &'static Field, _value: &mut T) {
        self.met(field);
    }

    fn choice(&mut self, tag: &'static str, variants: &'static [Variant], current: usize) -> usize {
        self.chosen(tag, variants[current].name);
        current
    }

    fn enter(&mut self, field: &'static Field) {
        self.entered(field);
    }

    fn leave(&mut self) {
        self.left();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::Fields;

    /// Two numbers.
    #[derive(Clone, Copy, Debug, PartialEq, Fields)]
    struct Pair<T> {
        /// One.
        #[field(unit = "1")]
        one: T,
        /// A table.
        #[field(unit = "N m")]
        table: [[T; 3]; 2],
    }

    /// One of two.
    #[derive(Clone, Copy, Debug, PartialEq, Fields)]
    enum Either<T> {
        /// Nothing.
        Nothing,
        /// A pair.
        Pair(Pair<T>),
    }

    /// Several.
    #[derive(Clone, Copy, Debug, PartialEq, Fields)]
    struct Several<T> {
        /// Choices.
        either: [Either<T>; 2],
        /// Pairs.
        pairs: [Pair<T>; 2],
    }

    #[test]
    fn paths_reach_every_number_in_order() {
        let mut value = Several::<f64>::default();
        value.either[1] = Either::Pair(Pair::default());
        let paths = Tree::of(&value).paths();
        assert_eq!(paths.len(), 3 * 7);
        assert_eq!(paths[0], "either_1.one");
        assert_eq!(paths[6], "either_1.table[1][2]");
        assert_eq!(paths[7], "pairs[0].one");
        assert_eq!(paths[20], "pairs[1].table[1][2]");
        let mut sum = 0;
        value.map(&mut |v: f64| {
            sum += 1;
            v
        });
        assert_eq!(sum, paths.len(), "map and tree have equal counts");
    }

    #[test]
    fn lists_with_equal_elements_stay_lists() {
        let value = Several::<f64>::default();
        let tree = Tree::of(&value);
        assert!(matches!(tree.members()[0].tree, Tree::List(2, _)));
        assert_eq!(tree.numbers(), 14);
    }

    #[test]
    fn bare_numbers_become_a_struct_of_one() {
        assert_eq!(Tree::of::<f64, _>(&1.0).paths(), ["value"]);
        assert_eq!(Tree::of::<f64, _>(&[1.0, 2.0]).paths(), ["value[0]", "value[1]"]);
        assert_eq!(Tree::of::<f64, _>(&()), Tree::Group(Group::default()));
    }
}
