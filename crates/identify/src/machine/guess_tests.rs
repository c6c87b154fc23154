use super::*;
use crate::machine::{Controller, Recipe};

fn emps() -> Recording {
    Recording::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/emps/emps.csv.gz")).unwrap()
}

/// Answers that no recording determines, for questions without a guess.
const STATED: [(&str, &str); 10] = [
    ("time-unit", "ms"),
    ("period", "1 ms"),
    ("position-unit", "mm"),
    ("axis", "rotary"),
    ("counts-per-rev", "4096"),
    ("command-unit", "V"),
    ("rated", "1 N m"),
    ("gain", "1 N/V"),
    ("lead", "10 mm"),
    ("position-gain", "1"),
];

/// All guesses except these answers, by name; questions without a guess get those of `STATED`.
fn settle<'a>(recording: &'a Recording, answers: &[(&str, &str)]) -> Result<Draft<'a>, Error> {
    let mut draft = Draft::new(recording);
    while let Some(question) = draft.next() {
        let stated = || STATED.iter().filter(|_| question.guess.is_none()).find(|(name, _)| *name == question.name);
        let answer = answers.iter().find(|(name, _)| *name == question.name).or_else(stated);
        draft.answer(&question, answer.map_or("", |(_, answer)| answer))?;
    }
    Ok(draft)
}

fn machine(recording: &Recording, answers: &[(&str, &str)]) -> Machine {
    settle(recording, answers).unwrap().toml(Path::new("machine.toml")).unwrap().1
}

#[test]
fn the_columns_of_the_committed_recording_are_guessed() {
    let recording = emps();
    let guessed = machine(
        &recording,
        &[
            ("position-unit", "m"),
            ("position-gain", "160.18"),
            ("velocity-gain", "243.45"),
            ("limit", "10"),
            ("controller", "p-p"),
        ],
    );
    let columns = &guessed.columns;
    assert_eq!(columns.time.as_ref().unwrap().name, "t");
    assert_eq!((columns.position.name.as_str(), columns.position.unit.as_deref()), ("qm", Some("m")));
    assert_eq!(columns.reference.as_ref().unwrap().name, "qg");
    assert_eq!((columns.command.name.as_str(), guessed.drive.unit.as_str()), ("vir", "V"));
    assert_eq!((guessed.axis, guessed.name.as_str(), guessed.resample), (Axis::Linear, "emps", false));
    assert!((guessed.sampling_period - 1e-3).abs() < 1e-8 && guessed.recipe == Recipe::default());
    let Controller::Cascade(cascade) = guessed.controller else { panic!("{:?}", guessed.controller) };
    assert_eq!(cascade.position_gain, 160.18);
}

#[test]
fn what_the_recording_does_not_determine_has_no_default() {
    let recording = emps();
    for name in ["position-unit", "command-unit", "gain"] {
        let mut draft = Draft::new(&recording);
        let refused = loop {
            let question = draft.next().unwrap();
            if question.name == name {
                assert_eq!(question.guess, None);
                break draft.answer(&question, "").unwrap_err();
            }
            let stated = STATED.iter().find(|(stated, _)| question.guess.is_none() && *stated == question.name);
            draft.answer(&question, stated.map_or("", |(_, answer)| answer)).unwrap();
        };
        assert!(refused.to_string().contains(&format!("--answer {name}=")), "{refused}");
    }
    let text = settle(&recording, &[("position-unit", "m")]).unwrap().toml(Path::new("m.toml")).unwrap().0;
    assert!(text.contains("guessed = [\"time\", \"time-unit\", \"position\", \"axis\", "), "{text}");
    let machine = Machine::parse(Path::new("m.toml"), &text).unwrap();
    let findings = machine.signals(&recording).unwrap().findings;
    assert!(findings[0].starts_with("Guessed by machine init and not checked: time, time-unit"), "{findings:?}");
}

#[test]
fn a_row_number_is_not_taken_for_time_and_the_period_is_asked() {
    let wave = |scale: f64| (0..900).map(|i| scale * libm::sin(f64::from(i) * 0.02)).collect();
    let row = Column::new("row", (0..900).map(f64::from).collect());
    let recording = Recording::from_columns(
        "axis.csv",
        vec![row, Column::new("pos_mm", wave(9.0)), Column::new("cmd_V", wave(3.0))],
    );
    let machine = machine(&recording, &[("period", "0.25 ms")]);
    assert!(machine.columns.time.is_none() && (machine.sampling_period - 0.25e-3).abs() < 1e-12);
    let draft = settle(&recording, &[("time", "row"), ("time-unit", "ms")]).unwrap();
    assert!(draft.guessed().contains(&"position") && !draft.guessed().contains(&"time"));
}

#[test]
fn a_counter_is_not_proposed_as_the_command() {
    let column = |name: &str, unit: &str, value: fn(f64) -> f64| {
        Column::new(name, (0..2000).map(|row| value(f64::from(row))).collect()).with_unit(Some(unit.into()))
    };
    let counted = [
        column("time", "s", |row| 1e-3 * row),
        column("cycle", "1", |row| row),
        column("angle", "rad", |row| (0.01 * row).sin()),
    ];
    let command = column("signal", "1", |row| (0.01 * row).cos());
    let command_among = |columns: Vec<Column>| {
        let recording = Recording::from_columns("run.mf4", columns);
        proposed(&recording, Role::Command, &[]).map(|column| column.name.clone())
    };
    assert_eq!(command_among(counted.to_vec()), None);
    assert_eq!(command_among([&counted[..], &[command]].concat()).as_deref(), Some("signal"));
}

#[test]
fn the_log_of_a_servo_is_rotary_in_shares_and_needs_resampling() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/xl330_pendulum/logs.csv.gz");
    let all = Recording::read(&path).unwrap();
    let first = all.column("log").unwrap().values.iter().take_while(|log| **log == 0.0).count();
    let log = all.rows_of(0..first);
    let guessed = machine(&log, &[("position-unit", "rad"), ("command-unit", "‰"), ("rated", "0.5 N m")]);
    let columns = &guessed.columns;
    assert_eq!(columns.reference.as_ref().unwrap().name, "goal");
    assert_eq!((columns.position.name.as_str(), columns.command.name.as_str()), ("position", "load"));
    assert!(guessed.resample && guessed.axis == Axis::Rotary && (guessed.sampling_period - 5e-3).abs() < 5e-4);
    assert!((guessed.gain - 0.5).abs() < 1e-15);
    let signals = guessed.signals(&log).unwrap();
    assert!(signals.notes[0].contains("interpolated"), "{:?}", signals.notes);
    let time = &log.column("t").unwrap().values;
    let duration = time[time.len() - 1] - time[0];
    assert!((signals.position.len() as f64 * signals.period - duration).abs() < 2.0 * signals.period);
}

#[test]
fn names_with_units_behind_them_and_words_of_other_languages_are_understood() {
    let column = |name: &str, scale: f64| {
        Column::new(name, (0..900).map(|i| scale * libm::sin(f64::from(i) * 0.02 + scale)).collect())
    };
    let time = |name: &str, step: f64| Column::new(name, (0..900).map(|i| step * f64::from(i)).collect());
    for (columns, expected) in [
        (
            vec![time("Zeit", 2.0), column("Soll_deg", 90.0), column("Ist_deg", 91.0), column("Strom", 2.0)],
            ["Zeit", "ms", "Ist_deg", "deg", "Strom", "V"],
        ),
        (
            vec![column("iq_actual", 3.0), column("encoder", 3.0), time("time_us", 500.0)],
            ["time_us", "us", "encoder", "mm", "iq_actual", "V"],
        ),
        (vec![time("t", 1e-3), column("torque", 3.0), column("angle", 3.0)], ["t", "s", "angle", "mm", "torque", "V"]),
    ] {
        let recording = Recording::from_columns("axis.csv", columns);
        let draft = settle(&recording, &[("axis", "rotary")]);
        let draft = draft.unwrap();
        let keys = [Key::Time, Key::TimeUnit, Key::Position, Key::PositionUnit, Key::Command, Key::CommandUnit];
        assert_eq!(keys.map(|key| draft.answer_to(key).unwrap()), expected);
    }
}

#[test]
fn an_invalid_answer_is_refused_and_the_question_stays() {
    let recording = emps();
    for (about, answer, remedy) in [
        ("time", "tt", "Did you mean `t`?"),
        ("position-unit", "V", "m, mm"),
        ("axis", "sideways", "linear or rotary"),
        ("gain", "35", "\"35 N/V\""),
        ("gain", "35 furlongs", "a number and its unit"),
        ("controller", "pid", "p-p or unknown"),
    ] {
        let error = settle(&recording, &[(about, answer)]).unwrap_err().to_string();
        assert!(error.contains(&format!("\"{answer}\" is not valid")) && error.contains(remedy), "{error}");
    }
    let mut draft = Draft::new(&recording);
    let name = draft.next().unwrap();
    draft.answer(&name, "axis \"7\"").unwrap();
    let time = draft.next().unwrap();
    assert!(draft.answer(&time, "nothing").is_err());
    assert_eq!(draft.next(), Some(time));
}

#[test]
fn the_screw_lead_is_requested_where_an_angle_must_become_a_distance() {
    let recording = emps();
    let guessed = machine(
        &recording,
        &[
            ("name", "axis \"7\" = #1"),
            ("position-unit", "counts"),
            ("axis", "linear"),
            ("lead", "2,5 mm"),
            ("command-unit", "%"),
            ("rated", "2.4 A"),
            ("gain", "0.05 N m/A"),
        ],
    );
    assert_eq!((guessed.name.as_str(), guessed.screw_lead), ("axis \"7\" = #1", Some(2.5e-3)));
    assert!((guessed.gain / (2.4 * 0.05 * std::f64::consts::TAU / 2.5e-3) - 1.0).abs() < 1e-12);
}

#[test]
fn a_row_number_is_neither_time_nor_command() {
    let rows = |i: u32| format!("{i},{},{}\n", f64::from(i % 7) / 4.0, f64::from(i % 5) / 8.0);
    let text: String = std::iter::once(",pos_mm,signal\n".to_owned()).chain((0..40).map(rows)).collect();
    let recording = Recording::parse(Path::new("axis.csv"), text.as_bytes()).unwrap();
    for role in [Role::Time, Role::Position, Role::Reference, Role::Command] {
        assert_ne!(proposed(&recording, role, &[]).map(|column| column.name.as_str()), Some("row"), "{role:?}");
    }
}

#[test]
fn the_group_of_the_answers_is_read_by_later_commands() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/recording/rasters.mf4");
    let recording = Recording::read_group(&file, Some("1ms")).unwrap();
    let draft = settle(&recording, &[]).unwrap().with_group(Some("1ms".into()));
    let (text, machine) = draft.toml(Path::new("machine.toml")).unwrap();
    assert!(text.contains("group = \"1ms\" #"), "{text}");
    assert_eq!(machine.recording(&file, None).unwrap().notes(), recording.notes());
    // The option replaces the key of the file.
    let error = machine.recording(&file, Some("2ms")).unwrap_err().to_string();
    assert!(error.contains("Groups: 1ms, 10ms, other."), "{error}");
}
