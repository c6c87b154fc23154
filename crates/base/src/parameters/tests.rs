//! A small machine with all features of a parameter struct, read, written and with errors.

use proptest::prelude::*;
use stickslip_core::Fields;
use stickslip_core::fields::{Field, Fields as _, Kind, Relation, Variant, Walk, at_most};
use stickslip_core::scalar::Scalar;

use super::laws::broken_laws;
use super::*;
use crate::Error;

/// The whole.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
struct Machine<T> {
    /// Samples a second.
    #[field(symbol = "f", unit = "1/s", range = 100.0..=20e3, default = 4000.0, whole)]
    rate: T,
    /// Whether the coupling is open.
    #[field(unit = "1", flag)]
    open: T,
    /// Poles of the observer.
    #[field(symbol = "p", unit = "1/s", range = 50.0..=2000.0, default = 250.0)]
    poles: [T; 3],
    /// A table of numbers.
    #[field(unit = "1")]
    gains: [[T; 2]; 2],
    /// The drive.
    drive: Drive<T>,
    /// The two springs.
    springs: [Spring<T>; 2],
}

/// The drive.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
struct Drive<T> {
    /// Inertia of the motor's side: rotor, disc, half a coupling and the tacho, all of them at the speed of the motor's shaft.
    #[field(symbol = "J_M", unit = "kg m^2", range = 1e-7..=1.0, default = 4.1e-4)]
    motor_inertia: T,
    /// What brakes.
    friction: Friction<T>,
}

/// A spring.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = Spring::law)]
struct Spring<T> {
    /// Slope.
    #[field(symbol = "c", unit = "N m/rad", range = 1.0..=500.0, default = 60.0)]
    stiffness: T,
    /// Strength.
    #[field(unit = "N m", range = 0.0..=1e3, default = 1.0)]
    strength: T,
}

impl<T: Scalar> Spring<T> {
    fn law(&self) -> [Relation<T>; 1] {
        [at_most("strength", self.strength, T::of(2.0) * self.stiffness, "It breaks at two radians.")]
    }
}

/// Friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
enum Friction<T> {
    /// Dry friction.
    Coulomb(Coulomb<T>),
    /// With bristles.
    LuGre(LuGre<T>),
    /// None.
    Free,
}

/// Dry.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
struct Coulomb<T> {
    /// Level.
    #[field(symbol = "M_K", unit = "N m", range = 1e-6..=200.0, default = 0.18)]
    kinetic_torque: T,
}

/// Bristles.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
struct LuGre<T> {
    /// The sliding curve.
    sliding: Coulomb<T>,
    /// Stiffness of the bristles.
    #[field(symbol = "σ₀", unit = "N m/rad", range = 1e-3..=1e7, default = 300.0)]
    bristle_stiffness: T,
}

fn problems(text: &str) -> Vec<String> {
    let problems = read::<Machine<f64>>(text, "m.toml").unwrap_err();
    assert_eq!(problems.to_string().lines().count(), problems.problems.len());
    problems.to_string().lines().map(str::to_string).collect()
}

#[test]
fn a_partial_file_keeps_the_defaults() {
    assert_eq!(read::<Machine<f64>>("", "m.toml"), Ok(Machine::default()));
    let machine: Machine<f64> = read(
        "rate = 1000\nopen = true\npoles = [100, 200.5, 3e2]\ndrive.motor_inertia = 1\n\
         drive.friction = { model = \"lugre\", sliding.kinetic_torque = 0.5 }\n\
         [[springs]]\nstiffness = 10\n[[springs]]\n",
        "m.toml",
    )
    .unwrap();
    let mut expected = Machine { rate: 1000.0, open: 1.0, poles: [100.0, 200.5, 300.0], ..Machine::default() };
    expected.drive.motor_inertia = 1.0;
    expected.drive.friction = Friction::LuGre(LuGre { sliding: Coulomb { kinetic_torque: 0.5 }, ..LuGre::default() });
    expected.springs[0].stiffness = 10.0;
    assert_eq!(machine, expected);
}

#[test]
fn all_problems_come_at_once_with_place_values_and_remedy() {
    let text = "rate = 1000.5\n\
                open = 1\n\
                poles = [250.0, 250.0]\n\
                ploes = 3\n\
                gains = [[1.0, nan], [0.0, 0.0]]\n\
                motor_inertia = 1e-4\n\
                \"a.b\" = 1\n\
                \n\
                [drive]\n\
                motor_inertia = -4e-4\n\
                [drive.friction]\n\
                model = \"coulomb\"\n\
                kinetic_torque = \"0.18\"\n\
                bristle_stiffness = 300\n\
                [[springs]]\n\
                stiffness = 60e3\n\
                [[springs]]\n\
                stiffness = 4\n\
                strength = 9\n";
    assert_eq!(
        problems(text),
        [
            "rate = 1000.5 1/s is not a whole number (m.toml:1). Write 1001 1/s, for example.",
            "open is the number 1 (m.toml:2). Write true or false.",
            "poles is a list of 2 (m.toml:3). Write a list of 3.",
            "unknown parameter ploes (m.toml:4). Did you mean poles?",
            "gains.0.1 = NaN is not finite (m.toml:5). Write a number within -∞ … ∞.",
            "unknown parameter motor_inertia (m.toml:6). Did you mean drive.motor_inertia?",
            "unknown parameter \"a.b\" (m.toml:7). Parameters of this table: rate, open, poles, gains, drive, springs.",
            "drive.motor_inertia = -4e-4 kg m^2 is outside 1e-7 … 1 kg m^2 (m.toml:10). It is a magnitude; drop the sign.",
            "drive.friction.kinetic_torque is the string \"0.18\" (m.toml:13). Write a number in N m, without quotes.",
            "drive.friction.bristle_stiffness does not belong to model = \"coulomb\" (m.toml:14). \
             Choose \"lugre\", which has it, or delete it.",
            "springs.0.stiffness = 60000 N m/rad is outside 1 … 500 N m/rad (m.toml:16). \
             Values are in N m/rad: a thousandth of it would be 60.",
            "springs.1.strength = 9 N m must be at most 8 N m (m.toml:19). It breaks at two radians.",
        ]
    );
}

#[test]
fn an_unknown_choice_lists_the_variants() {
    assert_eq!(
        problems("[drive.friction]\nmodel = \"lugree\"\nanything = 1\n"),
        ["drive.friction.model = \"lugree\" is unknown (m.toml:2). Choose one of: coulomb, lugre, free."]
    );
    assert_eq!(
        problems("drive.friction = { model = 3 }"),
        ["drive.friction.model is the number 3 (m.toml:1). Write one of \"coulomb\", \"lugre\", \"free\"."]
    );
    assert_eq!(problems("drive = 3"), ["drive is the number 3 (m.toml:1). Write a table, [drive]."]);
    assert_eq!(
        problems("[drive]\nmotor_inertia = 7.0\n"),
        ["drive.motor_inertia = 7 kg m^2 is outside 1e-7 … 1 kg m^2 (m.toml:2). \
          Values are in kg m^2: a thousandth of it would be 0.007."]
    );
}

#[test]
fn text_that_is_not_toml_is_located() {
    let [problem] = problems("rate = 1000\nopen = \n").try_into().unwrap();
    assert!(problem.starts_with("m.toml:2 is not TOML: "), "{problem}");
    let [problem] = problems("rate = 1000\n\nrate = 2000\n").try_into().unwrap();
    assert!(problem.starts_with("m.toml:3 is not TOML: duplicate key"), "{problem}");
}

#[test]
fn a_law_broken_by_defaults_points_at_the_group() {
    let problems = problems("[[springs]]\n[[springs]]\nstiffness = 10.0\nstrength = 21.0\n");
    assert_eq!(problems, ["springs.1.strength = 21 N m must be at most 20 N m (m.toml:4). It breaks at two radians."]);
    let problems = self::problems("[[springs]]\nstrength = 121.0\n[[springs]]\n");
    assert_eq!(
        problems,
        ["springs.0.strength = 121 N m must be at most 120 N m (m.toml:2). It breaks at two radians."]
    );
}

#[test]
fn a_bound_has_as_many_digits_as_required() {
    let message = |stiffness: f64, strength: f64| {
        problems(&format!("[[springs]]\nstiffness = {stiffness}\nstrength = {strength}\n[[springs]]\n")).concat()
    };
    assert!(message(10.0 / 3.0, 7.0).starts_with("springs.0.strength = 7 N m must be at most 6.6667 N m"));
    assert!(message(9.9999999, 20.0).starts_with("springs.0.strength = 20 N m must be at most 19.9999998 N m"));
}

#[test]
fn a_written_file_explains_every_key() {
    let mut machine = Machine::<f64>::default();
    machine.drive.friction = Friction::LuGre(LuGre::default());
    let text = write_commented(&machine);
    assert!(
        text.starts_with("# Samples a second.\n# f [1/s], 100 … 20000, whole, default 4000\nrate = 4000\n"),
        "{text}"
    );
    assert!(text.contains("\n# true or false, default false\nopen = false\n\n"), "{text}");
    assert!(
        text.contains("# p [1/s], 50 … 2000, a list of 3, default 250\npoles = [250.0, 250.0, 250.0]\n\n# A table"),
        "{text}"
    );
    assert!(
        text.contains(
            "\n# The drive.\n[drive]\n# Inertia of the motor's side: rotor, disc, half a coupling and the tacho, all of \
             them at the speed\n# of the motor's shaft.\n# J_M [kg m^2], 1e-7 … 1, default 4.1e-4\nmotor_inertia = 4.1e-4\n"
        ),
        "{text}"
    );
    assert!(
        text.contains("[drive.friction]\n# With bristles.\n# One of: coulomb, lugre, free.\nmodel = \"lugre\"\n"),
        "{text}"
    );
    assert_eq!(text.matches("[[springs]]\n").count(), 2);
}

#[test]
fn a_set_value_keeps_everything_else() {
    let text = "# My bench.\nrate = 1000 # slow\npoles = [ 100,\n  200, 300 ] # tuned\n\n[drive]\nmotor_inertia   =  4.1e-4 # rotor\n";
    let set = |path, value| set::<Machine<f64>>(text, "m.toml", path, value);
    assert_eq!(set("drive.motor_inertia", "4.2e-4").unwrap(), text.replace("4.1e-4", "4.2e-4"));
    assert_eq!(set("drive.motor_inertia", " .5 ").unwrap(), text.replace("4.1e-4", "0.5"));
    assert_eq!(set("poles.1", "250").unwrap(), text.replace("200", "250"));
    assert_eq!(set("open", "true").unwrap(), text.replace("# tuned\n", "# tuned\nopen = true\n"));
    assert_eq!(set("drive.friction.model", "free").unwrap(), format!("{text}\n[drive.friction]\nmodel = \"free\"\n"));
    for (path, value, expected) in [
        ("rate", "1", "rate = 1 1/s is outside 100 … 20000 1/s (m.toml:2)"),
        ("rate", "fast", "rate is the string \"fast\" (m.toml:2)"),
        ("drive", "1", "unknown parameter drive. Did you mean drive.motor_inertia?"),
        ("drive.motor_inertie", "1", "unknown parameter drive.motor_inertie. Did you mean drive.motor_inertia?"),
        ("7", "1", "unknown parameter 7."),
        ("poles.7", "1", "unknown parameter poles.7. Did you mean poles?"),
        ("gains.0.1", "1", "unknown parameter gains.0.1. Did you mean gains?"),
    ] {
        let message = set(path, value).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn a_set_value_enters_a_table_that_is_written_within_a_line() {
    let set =
        |text, value| set::<Machine<f64>>(text, "m.toml", "drive.friction.sliding.kinetic_torque", value).unwrap();
    let one_line = "[drive]\nfriction = { model = \"lugre\" } # bristles\n";
    let expected = "[drive]\nfriction = { model = \"lugre\" , sliding = { kinetic_torque = 0.4 } } # bristles\n";
    assert_eq!(set(one_line, "0.4"), expected);
    assert_eq!(set(expected, "0.5"), expected.replace("0.4", "0.5"));
    // Below a heading it is another heading, as usual.
    assert!(
        set("[drive.friction]\nmodel = \"lugre\"\n", "0.4")
            .ends_with("[drive.friction.sliding]\nkinetic_torque = 0.4\n")
    );
}

#[test]
fn setting_a_value_checks_laws_too() {
    let text = "[[springs]]\nstiffness = 10.0\n[[springs]]\n";
    let error = set::<Machine<f64>>(text, "m.toml", "springs.0.strength", "21").unwrap_err();
    assert!(error.to_string().contains("springs.0.strength = 21 N m must be at most 20 N m (m.toml:3)"), "{error}");
    let changed = set::<Machine<f64>>(text, "m.toml", "springs.0.strength", "20").unwrap();
    assert_eq!(changed, "[[springs]]\nstiffness = 10.0\nstrength = 20\n[[springs]]\n");
}

#[test]
fn another_variant_removes_the_keys_of_the_old_one() {
    let text = "[drive.friction]\nmodel = \"lugre\" # real\nbristle_stiffness = 1.0\n[drive.friction.sliding]\nkinetic_torque = 1.0\n";
    let changed = set::<Machine<f64>>(text, "m.toml", "drive.friction.model", "coulomb").unwrap();
    assert_eq!(changed, "[drive.friction]\nmodel = \"coulomb\" # real\n");
    let error = set::<Machine<f64>>(text, "m.toml", "drive.friction.model", "dahl").unwrap_err();
    assert!(error.to_string().contains("Choose one of: coulomb, lugre, free."), "{error}");
}

#[test]
fn values_are_listed_and_compared_by_path() {
    let a = Machine::<f64>::default();
    let mut b = a;
    b.gains[1][0] = -0.0;
    b.springs[1].strength = 2.0;
    b.drive.friction = Friction::LuGre(LuGre::default());
    let paths: Vec<_> = flatten(&a).into_iter().map(|entry| format!("{} = {entry}", entry.path)).collect();
    assert_eq!(paths[1..4], ["open = false", "poles.0 = 250 1/s", "poles.1 = 250 1/s"]);
    assert!(paths.contains(&"gains.1.0 = 0".into()) && paths.contains(&"drive.friction.model = coulomb".into()));
    let show = |entry: &Option<Entry>| entry.as_ref().map_or("-".into(), Entry::to_string);
    let differences: Vec<_> =
        diff(&a, &b).iter().map(|d| format!("{}: {} → {}", d.path, show(&d.before), show(&d.after))).collect();
    assert_eq!(
        differences,
        [
            "gains.1.0: 0 → -0",
            "drive.friction.model: coulomb → lugre",
            "drive.friction.kinetic_torque: 0.18 N m → -",
            "springs.1.strength: 1 N m → 2 N m",
            "drive.friction.bristle_stiffness: - → 300 N m/rad",
            "drive.friction.sliding.kinetic_torque: - → 0.18 N m",
        ]
    );
    assert!(diff(&a, &a).is_empty());
}

#[test]
fn a_former_name_of_a_variant_is_accepted() {
    use stickslip_core::control::reference::Reference;
    for name in ["point-to-point", "point-topoint"] {
        let moves =
            read::<Reference<f64>>(&format!("reference = \"{name}\"\nmoves = 3"), "a.toml").expect("a known name");
        assert!(matches!(moves, Reference::PointToPoint(moves) if moves.moves == 3.0), "{name}");
    }
}

#[test]
fn a_path_is_described_with_every_variant_that_has_it() {
    let describe =
        |path| describe::<Machine<f64>>(path).map(|rows| rows.iter().map(|r| r.to_string()).collect::<Vec<_>>());
    assert_eq!(
        describe("drive.friction.bristle_stiffness").unwrap(),
        ["drive.friction.bristle_stiffness\n    only with drive.friction.model = \"lugre\"\n    \
          σ₀ [N m/rad], 1e-3 … 1e7, default 300\n    Stiffness of the bristles.\n"
            .replace("1e-3", "0.001")]
    );
    assert_eq!(describe("drive.friction").unwrap().len(), 4);
    assert_eq!(describe("poles.2").unwrap(), describe("poles").unwrap());
    assert_eq!(describe("").unwrap().len(), 4 + 5 + 4);
    for (path, nearest) in [("friction", "drive.friction"), ("strength", "springs.0.strength")] {
        let Err(Error::UnknownParameter { nearest: found, .. }) = describe(path) else { panic!("{path} is known") };
        assert_eq!(found.as_deref(), Some(nearest));
    }
    for wrong in ["7", "poles.3", "gains.0.0.0", "drive.7", "pole", "drive.motor"] {
        assert!(matches!(describe(wrong), Err(Error::UnknownParameter { .. })), "{wrong}");
    }
}

/// Fills a struct from a seed, within ranges.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        // Splitmix64 (Steele, Lea and Flood 2014).
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

impl Walk<f64> for Random {
    fn number(&mut self, field: &'static Field, value: &mut f64) {
        let (bits, part) = (f64::from_bits(self.next()), self.next() as f64 / u64::MAX as f64);
        let (low, high) = (field.minimum, field.maximum);
        *value = match field.kind {
            Kind::Flag => part.round(),
            Kind::Whole => (low + part * (high - low)).round(),
            // All magnitudes, subnormal numbers and −0 among them, where the range allows them.
            Kind::Real if bits.is_finite() && (low..=high).contains(&bits) => bits,
            Kind::Real if low.is_finite() => (low + part * (high - low)).clamp(low, high),
            Kind::Real => -0.0,
        };
    }

    fn choice(&mut self, _tag: &'static str, variants: &'static [Variant], _current: usize) -> usize {
        self.next() as usize % variants.len()
    }
}

/// Text that is similar enough to a parameter file to reach every branch of the reader.
fn nearly_toml() -> impl Strategy<Value = String> {
    let pieces = [
        "rate",
        "open",
        "poles",
        "gains",
        "drive",
        "springs",
        ".",
        "motor_inertia",
        "friction",
        "model",
        "=",
        "= ",
        "\n",
        "[",
        "]",
        "[[",
        "]]",
        "{",
        "}",
        "\"",
        "'",
        "lugre",
        "\"coulomb\"",
        "free",
        "1",
        "-2.5e3",
        "nan",
        "true",
        ", ",
        "#",
        "\"\"\"",
        "\\u00e9",
        "é",
        "1979-05-27",
        "0x",
        "sliding",
    ];
    prop::collection::vec(prop::sample::select(pieces.to_vec()), 0..40).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn a_written_file_reads_back_to_the_same_bits(seed: u64) {
        let mut machine = Machine::<f64>::default();
        machine.contents(&mut Random(seed));
        prop_assume!(broken_laws(&machine).is_empty());
        let text = write_commented(&machine);
        let back: Machine<f64> = read(&text, "m.toml").map_err(|problems| TestCaseError::fail(problems.to_string()))?;
        prop_assert!(diff(&machine, &back).is_empty(), "{:?}\n{}", diff(&machine, &back), text);
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in prop_oneof![nearly_toml(), any::<String>()], value in nearly_toml()) {
        let _ = read::<Machine<f64>>(&text, "m.toml").map_err(|problems| problems.to_string());
        for path in ["rate", "poles.1", "drive.motor_inertia", "drive.friction.model", "springs.0.strength", &value] {
            if let Ok(changed) = set::<Machine<f64>>(&text, "m.toml", path, &value) {
                prop_assert!(read::<Machine<f64>>(&changed, "m.toml").is_ok());
            }
        }
    }

    #[test]
    fn a_set_value_is_in_the_result(text in nearly_toml(), seed: u64) {
        let value = 1e-7 + (1.0 - 1e-7) * (seed as f64 / u64::MAX as f64);
        if let Ok(changed) = set::<Machine<f64>>(&text, "m.toml", "drive.motor_inertia", &format!("{value:e}")) {
            let machine: Machine<f64> = read(&changed, "m.toml").expect("set checks what it gives");
            prop_assert_eq!(machine.drive.motor_inertia.to_bits(), value.to_bits());
        }
    }
}
