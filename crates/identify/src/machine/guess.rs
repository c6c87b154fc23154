//! A machine file for a recording: guessed from names, units and numbers, and completed by answers.
//!
//! [`Draft::next`] asks, with a guess; [`Draft::answer`] takes the answer; [`Draft::toml`] writes the file.

use std::fmt::Write;
use std::path::Path;

use super::columns::{Role, proposed, unit_of};
use super::{Axis, Machine};
use stickslip_base::Error;
use stickslip_base::units::Dimension::{self, Angle, Counts, Current, Force, Length, Share, Time, Torque, Voltage};
use stickslip_base::units::measure;
use stickslip_recording::understand::clock;
use stickslip_recording::understand::stamp_unit::{StampUnit, stamp_unit};
use stickslip_recording::{Column, Recording};

/// Answers so far, in order.
#[derive(Clone, Debug)]
pub struct Draft<'a> {
    recording: &'a Recording,
    group: Option<String>,
    answers: Vec<(Key, String)>,
    /// Names of the questions whose guess was accepted.
    guessed: Vec<&'static str>,
}

/// Subject of a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Key {
    Name,
    Axis,
    Time,
    TimeUnit,
    Period,
    Position,
    PositionUnit,
    CountsPerRev,
    Reference,
    Command,
    CommandUnit,
    Rated,
    Gain,
    Lead,
    Controller,
    PositionGain,
    VelocityGain,
    Limit,
}

/// A question with its guess.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Question {
    /// Name for scripts; it does not change when questions are added.
    pub name: &'static str,
    /// Text of the question.
    pub text: String,
    /// Default answer; none where a wrong one would give a wrong result without notice.
    pub guess: Option<String>,
    key: Key,
}

/// The questions in their order, with their names.
const QUESTIONS: [(Key, &str); 18] = [
    (Key::Name, "name"),
    (Key::Time, "time"),
    (Key::TimeUnit, "time-unit"),
    (Key::Period, "period"),
    (Key::Position, "position"),
    (Key::PositionUnit, "position-unit"),
    (Key::Axis, "axis"),
    (Key::CountsPerRev, "counts-per-rev"),
    (Key::Reference, "reference"),
    (Key::Command, "command"),
    (Key::CommandUnit, "command-unit"),
    (Key::Rated, "rated"),
    (Key::Gain, "gain"),
    (Key::Lead, "lead"),
    (Key::Controller, "controller"),
    (Key::PositionGain, "position-gain"),
    (Key::VelocityGain, "velocity-gain"),
    (Key::Limit, "limit"),
];

/// Names of all questions, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    QUESTIONS.iter().map(|(_, name)| *name)
}

/// The answer "none".
const NONE: &str = "-";

impl<'a> Draft<'a> {
    /// A draft without answers.
    pub fn new(recording: &'a Recording) -> Self {
        Draft { recording, group: None, answers: Vec::new(), guessed: Vec::new() }
    }

    /// The draft for this group of the file, which later commands read as well.
    pub fn with_group(self, group: Option<String>) -> Self {
        Draft { group, ..self }
    }

    fn answer_to(&self, key: Key) -> Option<&str> {
        self.answers.iter().find(|(k, _)| *k == key).map(|(_, answer)| answer.as_str())
    }

    fn column(&self, key: Key) -> Option<&Column> {
        let name = self.answer_to(key).filter(|name| *name != NONE)?;
        self.recording.columns().iter().find(|c| c.name == name)
    }

    fn measured(&self, key: Key) -> Option<Dimension> {
        self.answer_to(key).and_then(measure).map(|(dimension, _)| dimension)
    }

    fn axis(&self) -> Axis {
        if self.answer_to(Key::Axis) == Some("rotary") { Axis::Rotary } else { Axis::Linear }
    }

    /// Whether a torque or an angle must become a force or a distance.
    fn needs_lead(&self) -> bool {
        let gain = self.answer_to(Key::Gain).or(self.answer_to(Key::Rated)).and_then(|text| quantity(text).ok());
        let torque = gain.is_some_and(|(_, unit)| unit.replace(' ', "").contains("Nm"));
        let counted = self.measured(Key::PositionUnit) == Some(Counts);
        self.axis() == Axis::Linear
            && (torque
                || counted
                || self.measured(Key::CommandUnit) == Some(Torque)
                || self.measured(Key::PositionUnit) == Some(Angle))
    }

    /// Whether a question applies after the answers so far.
    fn applies(&self, key: Key) -> bool {
        let command = self.measured(Key::CommandUnit);
        let torque = command == Some(Share) && self.measured_quantity(Key::Rated) == Some(Torque);
        let cascade = self.answer_to(Key::Controller) == Some("p-p");
        match key {
            Key::TimeUnit => self.column(Key::Time).is_some(),
            Key::Period => self.column(Key::Time).is_none(),
            Key::CountsPerRev => self.measured(Key::PositionUnit) == Some(Counts),
            Key::Rated => command == Some(Share),
            Key::Gain => match command {
                Some(Share) => !torque && self.measured_quantity(Key::Rated) != Some(Force),
                command => matches!(command, Some(Voltage | Current)),
            },
            Key::Lead => self.needs_lead(),
            Key::Controller => self.column(Key::Reference).is_some(),
            Key::PositionGain | Key::VelocityGain | Key::Limit => cascade,
            _ => true,
        }
    }

    fn measured_quantity(&self, key: Key) -> Option<Dimension> {
        let (_, unit) = quantity(self.answer_to(key)?).ok()?;
        measure(&unit).map(|(dimension, _)| dimension)
    }

    /// The next question; none when the file can be written.
    pub fn next(&self) -> Option<Question> {
        let open = |(key, _): &&(Key, &'static str)| self.answer_to(*key).is_none() && self.applies(*key);
        let (key, name) = QUESTIONS.iter().find(open)?;
        Some(Question { name, text: self.text(*key), guess: self.guess(*key), key: *key })
    }

    /// Names of the questions whose guess was accepted.
    pub fn guessed(&self) -> &[&'static str] {
        &self.guessed
    }

    fn text(&self, key: Key) -> String {
        let unit = self.answer_to(Key::CommandUnit).unwrap_or_default();
        let text = match key {
            Key::Name => "Name of the machine",
            Key::Axis => "Does it move linear or rotary",
            Key::Time => "Column of time, - if there is none",
            Key::TimeUnit => return self.text_of_time_unit(),
            Key::Period => "Sampling period, with unit",
            Key::Position => "Column of the measured position",
            Key::PositionUnit => "Unit of position; counts, if it is not scaled",
            Key::CountsPerRev => "Counts per turn",
            Key::Reference => "Column of the reference position, - if there is none",
            Key::Command => "Column of the command to the drive",
            Key::CommandUnit => "Unit of the command: V, A, %, N m, N",
            Key::Rated => "Quantity at a command of 100 %, with unit: A, N m, N",
            Key::Gain if unit == "%" || unit == "‰" || unit == "1" => {
                return "Force or torque per current or voltage, with unit: N m/A, N/A, N m/V, N/V".into();
            }
            Key::Gain => return format!("Force or torque per {unit}, with unit: N/{unit} or N m/{unit}"),
            Key::Lead => "Travel per turn of the screw, with unit",
            Key::Controller => "Controller: p-p (position and velocity loop, proportional) or unknown",
            Key::PositionGain => "Position gain, 1/s",
            Key::VelocityGain => "Velocity gain, command per m/s or rad/s",
            Key::Limit => "Largest command, SI unit",
        };
        text.into()
    }

    fn text_of_time_unit(&self) -> String {
        let possible = match self.column(Key::Time).map(|time| stamp_unit(time.origin(), &time.values)) {
            Some(StampUnit::RowNumber) => {
                "; the column counts rows, and may be no time: answer - to `time` then".into()
            }
            Some(StampUnit::Possible(units)) if units.len() > 1 => format!(", one of {}", units.join(", ")),
            _ => String::new(),
        };
        format!("Unit of time{possible}")
    }

    /// A guess; none for what neither names nor numbers of the recording determine.
    fn guess(&self, key: Key) -> Option<String> {
        let column = |role| {
            let taken: Vec<&str> = self.answers.iter().map(|(_, answer)| answer.as_str()).collect();
            proposed(self.recording, role, &taken).map(|c| c.name.clone())
        };
        let or_none = |column: Option<String>| Some(column.unwrap_or_else(|| NONE.into()));
        let unit = |key, role| self.column(key).and_then(|c| unit_of(c, role));
        match key {
            Key::Name => {
                let file = self.recording.path().file_name().unwrap_or_default().to_string_lossy();
                Some(file.split('.').next().filter(|name| !name.is_empty()).unwrap_or("axis").into())
            }
            Key::Axis => match self.measured(Key::PositionUnit) {
                Some(Length) => Some("linear".into()),
                Some(Angle) => Some("rotary".into()),
                _ => None,
            },
            Key::Time => or_none(column(Role::Time)),
            Key::TimeUnit => unit(Key::Time, Role::Time),
            Key::Position => column(Role::Position),
            Key::PositionUnit => unit(Key::Position, Role::Position),
            Key::Reference => or_none(column(Role::Reference)),
            Key::Command => column(Role::Command),
            Key::CommandUnit => unit(Key::Command, Role::Command),
            Key::Controller => Some("unknown".into()),
            Key::Period
            | Key::CountsPerRev
            | Key::Rated
            | Key::Gain
            | Key::Lead
            | Key::PositionGain
            | Key::VelocityGain
            | Key::Limit => None,
        }
    }

    /// An answer as it is written.
    fn example(&self, key: Key) -> String {
        let per = self.answer_to(Key::CommandUnit).filter(|_| self.measured(Key::CommandUnit) != Some(Share));
        match key {
            Key::Period => "1 ms".into(),
            Key::Rated => "2.4 N m".into(),
            Key::Lead => "10 mm".into(),
            _ => format!("35 {}/{}", if self.axis() == Axis::Linear { "N" } else { "N m" }, per.unwrap_or("A")),
        }
    }

    /// Takes an answer; an empty answer takes the guess.
    ///
    /// # Errors
    /// [`Error::Answer`] for an empty answer to a question without a guess, and for an invalid one: unknown column, unit,
    /// a number that is not positive. The question stays.
    pub fn answer(&mut self, question: &Question, text: &str) -> Result<(), Error> {
        let given = Some(text.trim()).filter(|text| !text.is_empty());
        let Some(answer) = given.map(str::to_owned).or_else(|| question.guess.clone()) else {
            let remedy = format!(
                "The recording does not determine this value, and a wrong one gives wrong results. State it, also as \
                 --answer {}=….",
                question.name
            );
            return Err(Error::Answer { question: question.text.clone(), answer: String::new(), remedy });
        };
        let refuse =
            |remedy: String| Err(Error::Answer { question: question.text.clone(), answer: answer.clone(), remedy });
        let unit = |fits: &[Dimension]| measure(&answer).is_some_and(|(dimension, _)| fits.contains(&dimension));
        let positive = |text: &str| text.parse().is_ok_and(|v: f64| v.is_finite() && v > 0.0);
        let key = question.key;
        match key {
            Key::Time | Key::Reference if answer == NONE => {}
            Key::Time | Key::Position | Key::Reference | Key::Command => {
                if let Err(error) = self.recording.column(&answer) {
                    return refuse(error.to_string());
                }
            }
            Key::Axis if !["linear", "rotary"].contains(&answer.as_str()) => {
                return refuse("Answer linear or rotary.".into());
            }
            Key::Controller if !["p-p", "unknown"].contains(&answer.as_str()) => {
                return refuse("Answer p-p or unknown.".into());
            }
            Key::TimeUnit if !unit(&[Time]) => return refuse("Answer s, ms, us, ns, 100 ns or d.".into()),
            Key::PositionUnit if !unit(&[Length, Angle, Counts]) => {
                return refuse("Answer m, mm, um, rad, deg, rev or counts.".into());
            }
            Key::CommandUnit if !unit(&[Voltage, Current, Share, Torque, Force]) => {
                return refuse("Answer V, A, %, N m or N.".into());
            }
            Key::CountsPerRev | Key::PositionGain | Key::VelocityGain | Key::Limit if !positive(&answer) => {
                return refuse("Enter a positive number.".into());
            }
            Key::Period | Key::Rated | Key::Gain | Key::Lead if quantity(&answer).is_err() => {
                return refuse(format!("Enter a number and its unit, as in \"{}\".", self.example(key)));
            }
            _ => {}
        }
        if given.is_none() {
            self.guessed.push(question.name);
        }
        self.answers.push((key, answer));
        Ok(())
    }

    /// The machine file, with comments, and the machine that it describes. `path` is its future path.
    ///
    /// # Errors
    /// Errors of [`Machine::parse`] and [`Machine::signals`]: an unusable file is not written.
    pub fn toml(&self, path: &Path) -> Result<(String, Machine), Error> {
        let (period, resample) = self.period()?;
        let text = self.text_of_file(period, resample);
        let machine = Machine::parse(path, &text)?;
        machine.signals(self.recording)?;
        Ok((text, machine))
    }

    /// Sampling period [s], and whether samples must be interpolated.
    fn period(&self) -> Result<(f64, bool), Error> {
        let Some(time) = self.column(Key::Time) else {
            let (value, unit) = quantity(self.answer_to(Key::Period).unwrap_or_default()).unwrap_or_default();
            return Ok((value * measure(&unit).map_or(f64::NAN, |(_, factor)| factor), false));
        };
        let seconds = self.answer_to(Key::TimeUnit).and_then(measure).map_or(1.0, |(_, factor)| factor);
        let clock =
            clock::understand(&time.values, seconds).map_err(|fault| self.recording.refuse(&time.name, &fault))?;
        let (stamps, rows) = (&clock.time[clock.rows.clone()], self.recording.rows_of(clock.rows.clone()));
        match rows.spacing(stamps) {
            Ok(spacing) => Ok((spacing.period, false)),
            // Lost rows are interpolated without a request: the usual step is the period.
            Err(_) if clock.lost => {
                let mut steps: Vec<f64> = stamps.windows(2).map(|w| w[1] - w[0]).collect();
                let middle = steps.len() / 2;
                Ok((*steps.select_nth_unstable_by(middle, f64::total_cmp).1, false))
            }
            Err(uneven) => rows.order(stamps).map(|spacing| (spacing.period, true)).map_err(|_| uneven),
        }
    }

    fn text_of_file(&self, period: f64, resample: bool) -> String {
        let answer_to = |key| self.answer_to(key).unwrap_or_default();
        let mut text = String::new();
        let mut line = |line: String| writeln!(text, "{line}").expect("a string takes all");
        let file = self.recording.path().file_name().unwrap_or_default().to_string_lossy();
        line(format!("# The machine of the recording {file}, for `stickslip identify`."));
        line(format!("name = {}", string(answer_to(Key::Name))));
        line(format!("axis = \"{}\" # linear: kg, N; rotary: kg m², N m", answer_to(Key::Axis)));
        let guessed: Vec<String> =
            self.guessed.iter().filter(|name| **name != "name").map(|name| string(name)).collect();
        if !guessed.is_empty() {
            let names = guessed.join(", ");
            line(format!("guessed = [{names}] # from the recording; remove the names that you have checked"));
        }
        if let Some(group) = &self.group {
            line(format!("group = {} # the only group of the file that is read", string(group)));
        }
        // Six digits: no clock is more accurate.
        let milliseconds: f64 = format!("{:.5e}", period * 1e3).parse().unwrap_or(period * 1e3);
        line(format!("sampling_period = {{ value = {milliseconds:?}, unit = \"ms\" }}"));
        let resampled = "resample = true # the time stamps are uneven: samples are interpolated on an even grid";
        line(if resample { resampled.into() } else { "# resample = true # for uneven time stamps".into() });
        match self.answer_to(Key::Lead) {
            Some(lead) => line(format!("screw_lead = {}", inline(lead))),
            None => line("# screw_lead = { value = 10.0, unit = \"mm\" } # travel per turn".into()),
        }
        line("# gear_ratio = 10.0 # turns of the motor per turn of the screw or load".into());
        line("# inertia = { value = 12.0, unit = \"kg\" } # if known, rotor included; identified otherwise".into());
        line("# vertical = true # the constant force is then a weight, of lifted_mass if that is known".into());
        line("# lifted_mass = { value = 8.0, unit = \"kg\" }".into());

        line("\n# Roles of the columns.\n[columns]".into());
        let channel = |name: &str, unit: &str, more: &str| {
            format!("{{ name = {}, unit = {}{more} }}", string(name), string(unit))
        };
        if self.column(Key::Time).is_some() {
            line(format!("time = {}", channel(answer_to(Key::Time), answer_to(Key::TimeUnit), "")));
        }
        let counts = self.answer_to(Key::CountsPerRev).map_or(String::new(), |n| format!(", counts_per_rev = {n}"));
        line(format!("position = {}", channel(answer_to(Key::Position), answer_to(Key::PositionUnit), &counts)));
        if let Some(reference) = self.column(Key::Reference) {
            // A reference without a unit has that of the position.
            let unit = reference.unit.as_deref().filter(|unit| measure(unit).is_some());
            let unit = unit.unwrap_or(answer_to(Key::PositionUnit));
            line(format!("reference = {}", channel(answer_to(Key::Reference), unit, &counts)));
        }
        line(format!("command = {}", channel(answer_to(Key::Command), answer_to(Key::CommandUnit), "")));
        line("# velocity = { name = \"…\", unit = \"mm/s\" } # if measured better than by differences".into());
        line(
            "# motor_position = { name = \"…\", unit = \"rev\", at = \"motor\" } # if `position` is the load's".into(),
        );
        line("# injected = { name = \"…\", unit = \"V\" } # known signal added to the command behind its limit".into());

        line("\n# From the command to the force or torque.\n[drive]".into());
        if let Some(rated) = self.answer_to(Key::Rated) {
            line(format!("rated = {} # a command of 100 %", inline(rated)));
        }
        match self.answer_to(Key::Gain) {
            Some(gain) => line(format!("gain = {}", inline(gain))),
            None => line("# gain = { value = -1.0, unit = \"1\" } # for a command of opposite sign".into()),
        }

        if answer_to(Key::Controller) == "p-p" {
            line("\n# u = limited(k_v·(k_p·(reference − position) − v)), v from the last two positions.".into());
            line("[controller]\nkind = \"p-p\"".into());
            line(format!("position_gain = {} # 1/s", answer_to(Key::PositionGain)));
            line(format!("velocity_gain = {} # command per m/s or rad/s", answer_to(Key::VelocityGain)));
            line(format!("limit = {} # command", answer_to(Key::Limit)));
        }
        let rate = 1.0 / period;
        line("\n# Before the least squares.\n[recipe]".into());
        line(format!("low_pass = {:?} # Hz, both ways", (rate / 10.0).clamp(rate / 100.0, 100.0).round().max(1.0)));
        line("order = 4".into());
        line(format!("decimation = {}", ((rate / 100.0).round() as usize).max(1)));
        line("skip = 50 # samples dropped at the start".into());
        text
    }
}

/// `35.15 N/V` as number and unit.
fn quantity(text: &str) -> Result<(f64, String), ()> {
    let (number, unit) = text.trim().split_once(' ').ok_or(())?;
    let value: f64 = number.replace(',', ".").parse().map_err(|_| ())?;
    let valid = measure(unit).is_some() && value.is_finite();
    if valid { Ok((value, unit.trim().to_owned())) } else { Err(()) }
}

/// A quantity as an inline table.
fn inline(text: &str) -> String {
    let (value, unit) = quantity(text).unwrap_or((f64::NAN, String::new()));
    format!("{{ value = {value:?}, unit = {} }}", string(&unit))
}

/// A TOML string.
fn string(text: &str) -> String {
    toml_edit::Value::from(text).to_string().trim().to_owned()
}

#[cfg(test)]
#[path = "guess_tests.rs"]
mod tests;
