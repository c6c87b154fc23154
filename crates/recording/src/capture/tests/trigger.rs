//! The text of a trigger, and its events.

use crate::RecordingError;
use proptest::prelude::*;

use crate::capture::detector::Detector;
use crate::capture::{Account, Condition, Row, Side, Sink, Slope, Stream, Test, Trigger};

/// Collects the cycles of events.
struct Events {
    detector: Detector,
    events: Vec<u64>,
}

impl Sink for Events {
    fn width(&self) -> usize {
        self.detector.width()
    }

    fn push(&mut self, row: Row<'_>) {
        if self.detector.sees(&row) {
            self.events.push(row.cycle());
        }
    }

    fn account(&self) -> Account {
        Account::default()
    }
}

/// Cycles of the events on a signal `v`.
fn events(trigger: &str, values: &[f64]) -> Vec<u64> {
    let detector = Detector::new(&trigger.parse().unwrap(), &["other", "v"]).unwrap();
    let mut stream = Stream::new(2);
    let tap = stream.add(Events { detector, events: Vec::new() }).unwrap();
    for (cycle, &value) in (0..).zip(values) {
        stream.push(cycle, &[f64::NAN, value]).unwrap();
    }
    stream.remove(tap).unwrap().events
}

#[test]
fn each_condition_finds_its_events() {
    let ramp = [-1.0, 0.0, 1.0, 2.0, 1.0, 0.0, -1.0];
    for (trigger, expected) in [
        ("immediate", &[0, 1, 2, 3, 4, 5, 6][..]),
        ("v above 0", &[2, 3, 4]),
        ("v below 0", &[0, 6]),
        ("v rises through 1", &[2]),
        ("v rises through -1", &[]),
        ("v falls through 1", &[4]),
        ("v crosses 0.5", &[2, 5]),
        ("v enters 0..1", &[1, 4]),
        ("v leaves 0..1", &[3, 6]),
        ("v leaves 0..1, hysteresis 0.5", &[]),
        ("v is 1", &[2, 4]),
        ("v becomes -1", &[6]),
        ("v becomes 1", &[2, 4]),
        ("v changes", &[1, 2, 3, 4, 5, 6]),
    ] {
        assert_eq!(events(trigger, &ramp), expected, "{trigger}");
    }
}

#[test]
fn an_edge_requires_an_earlier_value_beyond_its_hysteresis() {
    let noisy = [0.9, 1.1, 0.9, 1.1, 0.7, 1.0, 0.9, 1.0];
    assert_eq!(events("v rises through 1", &noisy), [1, 3, 5, 7]);
    assert_eq!(events("v rises through 1, hysteresis 0.2", &noisy), [5]);
    assert_eq!(events("v crosses 1, hysteresis 0.2", &noisy), [5]);
    assert_eq!(events("v enters 1..2, hysteresis 0.2", &noisy), [5]);
    assert_eq!(events("v enters 0..1, hysteresis 0.2", &[1.1, 0.9, 1.3, 0.9]), [3]);
    assert_eq!(events("v falls through 1, hysteresis 0.05", &noisy), [2, 4]);
    assert_eq!(events("v leaves 0..1, hysteresis 0.2", &noisy), [] as [u64; 0]);
    assert_eq!(events("v leaves 0..1, hysteresis 0.05", &noisy), [1, 3]);
}

#[test]
fn nan_is_not_an_event_and_does_not_change_the_memory() {
    let nan = f64::NAN;
    let values = [nan, 0.0, nan, 2.0, nan, 2.0, nan, 0.0, nan];
    for (trigger, expected) in [
        ("v above -1", &[1, 3, 5, 7][..]),
        ("v below 1", &[1, 7]),
        ("v rises through 1", &[3]),
        ("v falls through 1", &[7]),
        ("v crosses 1", &[3, 7]),
        ("v enters 1..3", &[3]),
        ("v leaves 1..3", &[7]),
        ("v is 0", &[1, 7]),
        ("v becomes 0", &[7]),
        ("v changes", &[3, 7]),
    ] {
        assert_eq!(events(trigger, &values), expected, "{trigger}");
        assert_eq!(events(trigger, &[nan; 5]), [] as [u64; 0], "{trigger}");
    }
}

#[test]
fn infinite_values_are_values() {
    let values = [0.0, f64::INFINITY, 0.0, f64::NEG_INFINITY];
    assert_eq!(events("v rises through 1", &values), [1]);
    assert_eq!(events("v leaves -1..1", &values), [1, 3]);
    assert_eq!(events("v changes", &values), [1, 2, 3]);
}

#[test]
fn a_wrong_text_is_refused_with_column_reason_and_remedy() {
    for (text, column, part) in [
        ("", 1, "the text is empty"),
        ("v", 2, "a verb is missing after the signal"),
        ("v rise through 1", 3, "unknown verb `rise`. Did you mean `rises`?"),
        ("v jumps 1", 3, "Use one of above, below,"),
        ("v rises 1", 9, "`through` is missing after `rises`"),
        ("v rises through", 16, "a number is missing after `through`"),
        ("v above 20 mV", 12, "unexpected `mV`"),
        ("v above 20mV", 9, "\"20mV\" is not a finite number"),
        ("v above NaN", 9, "\"NaN\" is not a finite number"),
        ("v above 1,5", 11, "unknown option `5`"),
        ("v enters 1", 10, "a band is missing"),
        ("v enters", 9, "a band is missing"),
        ("v enters 2..1", 10, "the band 2..1 is empty"),
        ("v leaves 0..1, hysteresis 0.6", 16, "Use at most half its width, 0.5."),
        ("v becomes 2.5", 11, "\"2.5\" is not a whole number"),
        ("v changes 3", 11, "unexpected `3`"),
        ("v above 1, hysteresis 0.1", 12, "only edges and bands have a hysteresis"),
        ("v crosses 1, hysteresis -0.1", 14, "drop the sign"),
        ("v crosses 1, histeresis 0.1", 14, "Did you mean `hysteresis`?"),
        ("v crosses 1, delay 20 ms", 23, "times in ticks"),
        ("v crosses 1, delay 0.02", 20, "seconds times the tick rate"),
        ("v crosses 1, delay 3, delay 4", 23, "delay is stated twice"),
        ("v crosses 1,", 13, "no option after a comma"),
        ("v, crosses 1", 2, "a verb is missing after the signal"),
        ("\"v above 1", 1, "this quote is not closed"),
    ] {
        let error = text.parse::<Trigger>().unwrap_err();
        let message = error.to_string();
        assert!(
            matches!(error.of(), Some(RecordingError::Trigger { column: found, .. }) if *found == column),
            "{text}: {message}"
        );
        assert!(message.contains(part), "{text}: {message}");
    }
}

#[test]
fn an_unknown_signal_is_refused_with_the_most_similar_one() {
    let refusal = |text: &str| {
        let trigger: Trigger = text.parse().unwrap();
        Detector::new(&trigger, &["velocity", "position"]).unwrap_err().to_string()
    };
    assert!(refusal("velocty above 1").ends_with("unknown signal `velocty`. Did you mean `velocity`?"));
    assert!(refusal("x above 1").ends_with("None of the 2 signals has a similar name."));
}

#[test]
fn an_invalid_trigger_is_refused_like_its_text() {
    let level = Test::Edge { slope: Slope::Rising, level: f64::NAN, hysteresis: 0.0 };
    let band = Test::Window { side: Side::Leaves, low: 0.0, high: 1.0, hysteresis: 0.6 };
    for (test, part) in [(level, "\"NaN\" is not a finite number"), (band, "is too large for the band")] {
        let trigger = Trigger::from(Condition::Signal { name: "v".into(), test });
        let message = Detector::new(&trigger, &["v"]).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn spaces_true_minus_and_quotes_are_understood() {
    let trigger: Trigger = "  \"der(a, \"\"b\"\")\"   enters −0.5 .. 1e-3 ,hold-off 7,hysteresis .25".parse().unwrap();
    let test = Test::Window { side: Side::Enters, low: -0.5, high: 1e-3, hysteresis: 0.25 };
    let condition = Condition::Signal { name: "der(a, \"b\")".into(), test };
    assert_eq!(trigger, Trigger { condition, delay: 0, hold_off: 7, auto: None });
    assert_eq!(trigger.to_string(), "\"der(a, \"\"b\"\")\" enters -0.5..0.001, hysteresis 0.25, hold-off 7");
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![-2.0..2.0, any::<f64>().prop_filter("finite", |x| x.is_finite()), Just(3.0), Just(-0.0)]
}

fn triggers() -> impl Strategy<Value = Trigger> {
    let slope = prop_oneof![Just(Slope::Rising), Just(Slope::Falling), Just(Slope::Both)];
    let hysteresis = || finite().prop_map(f64::abs);
    let test = prop_oneof![
        finite().prop_map(Test::Above),
        finite().prop_map(Test::Below),
        (slope, finite(), hysteresis()).prop_map(|(slope, level, hysteresis)| Test::Edge { slope, level, hysteresis }),
        (any::<bool>(), finite(), finite(), hysteresis()).prop_map(|(enters, a, b, hysteresis)| {
            let (low, high) = (a.min(b), a.max(b));
            let side = if enters { Side::Enters } else { Side::Leaves };
            // A quarter of the band remains.
            let hysteresis = if enters { hysteresis } else { 0.375 * high - 0.375 * low };
            Test::Window { side, low, high, hysteresis }
        }),
        any::<i32>().prop_map(Test::Is),
        any::<i32>().prop_map(Test::Becomes),
        Just(Test::Changes),
    ];
    let name = prop_oneof!["[a-z][a-z_.0-9]{0,12}", any::<String>(), Just("immediate".to_string())];
    let signal = (name, test).prop_map(|(name, test)| Condition::Signal { name, test });
    let condition = prop_oneof![1 => Just(Condition::Immediate), 9 => signal];
    let ticks = || prop_oneof![Just(0), 0..10_000_u64, any::<u64>()];
    (condition, ticks(), ticks(), prop::option::of(ticks())).prop_map(|(condition, delay, hold_off, auto)| Trigger {
        condition,
        delay,
        hold_off,
        auto,
    })
}

proptest! {
    #[test]
    fn the_text_of_a_trigger_gives_it_back(trigger in triggers()) {
        let text = trigger.to_string();
        let back = text.parse::<Trigger>().map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!(&back, &trigger);
        prop_assert_eq!(back.to_string(), text);
    }

    #[test]
    fn no_text_makes_the_parser_panic(
        text in prop_oneof![any::<String>(), "[v\", .a-z0-9-]{0,30}", "v (enters|rises through|delay|,| |[-0-9.]{0,4}){0,8}"]
    ) {
        // A parsed trigger can be written.
        if let Ok(trigger) = text.parse::<Trigger>() {
            prop_assert_eq!(trigger.to_string().parse::<Trigger>().ok(), Some(trigger));
        }
    }
}
