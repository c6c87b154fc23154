//! Protocol between the bench and the host process: words of 64 bits in native byte order. Both ends are the same
//! program; other versions are refused by [`VERSION`].

use serde_json::{Value, json};
use stickslip_rt::{ANSWER, MOST_PARAMETERS, ModuleParameter, ModuleSample};
use stickslip_software::supervise::ExternalFault;

use super::library::Library;
use super::watchdog::now;
use super::{Answer, Caller as _, Description, Signal};

/// Version of the protocol.
const VERSION: u64 = 5;
/// Maximum length of a description [bytes].
pub(super) const LONGEST: usize = 1 << 22;
/// Maximum number of words of a question.
pub(super) const QUESTION: usize = SAMPLE + MOST_PARAMETERS;
/// Number of words before the parameter values.
const HEAD: usize = 4;
const SAMPLE: usize = 11;

/// Kinds of questions.
const BEGIN: u64 = 1;
const STEP: u64 = 2;
/// Kinds of answers.
const DONE: u64 = 0;
const FAILED: u64 = 1;
const MODE: u64 = 2;

/// Request to start, sent at this time [ns].
pub(super) fn begin(sent: u64, sample_time: f64, torque_limit: f64, values: &[f64]) -> impl Iterator<Item = u64> {
    let head = [BEGIN, sent, sample_time.to_bits(), torque_limit.to_bits()];
    head.into_iter().chain(values.iter().map(|value| value.to_bits()))
}

/// Request of one sample, with new parameter values if there are any, sent at this time [ns].
pub(super) fn step(sent: u64, sample: &ModuleSample, values: Option<&[f64]>) -> impl Iterator<Item = u64> {
    let ModuleSample { time, reference_position, reference_velocity, reference_acceleration, .. } = *sample;
    let numbers = [
        time,
        reference_position,
        reference_velocity,
        reference_acceleration,
        sample.measured_angle,
        sample.measured_velocity,
        sample.estimated_velocity,
        sample.measured_load_torque,
        sample.commanded_torque,
    ];
    let values = values.unwrap_or_default().iter().map(|value| value.to_bits());
    [STEP, sent].into_iter().chain(numbers.map(f64::to_bits)).chain(values)
}

/// Executes a request.
pub(super) fn execute(question: &[u64], library: &mut Library) -> [u64; ANSWER] {
    let number = |index: usize| f64::from_bits(question.get(index).copied().unwrap_or_default());
    let behind = |head: usize| question.iter().skip(head).map(|bits| f64::from_bits(*bits)).collect::<Vec<_>>();
    let done = match question.first() {
        Some(&BEGIN) => library.begin(number(2), number(3), &behind(HEAD)).map(|()| Answer::default()),
        Some(&STEP) => {
            let sample = ModuleSample {
                time: number(2),
                reference_position: number(3),
                reference_velocity: number(4),
                reference_acceleration: number(5),
                measured_angle: number(6),
                measured_velocity: number(7),
                estimated_velocity: number(8),
                measured_load_torque: number(9),
                commanded_torque: number(10),
            };
            library.step(&sample, Some(&behind(SAMPLE)[..]).filter(|values| !values.is_empty()))
        }
        // The memory was overwritten.
        _ => Err(ExternalFault::Failed { code: -1 }),
    };
    let code = |code: i32| u64::from(code.cast_unsigned());
    let (kind, word, time, refused) = match done {
        Ok(Answer { torque, time, refused }) => (DONE, torque.to_bits(), time, code(refused)),
        Err(ExternalFault::Failed { code: failed }) => (FAILED, code(failed), 0, 0),
        Err(_) => (MODE, 0, 0, 0),
    };
    let sent = question.get(1).copied().unwrap_or_default();
    [kind, word, time, now().saturating_sub(sent), refused, 0]
}

/// Decodes an answer of any bits.
pub(super) fn answer([kind, word, time, _, refused, _]: [u64; ANSWER]) -> Result<Answer, ExternalFault> {
    match kind {
        DONE => Ok(Answer { torque: f64::from_bits(word), time, refused: refused as i32 }),
        MODE => Err(ExternalFault::FloatingPoint),
        _ => Err(ExternalFault::Failed { code: word as i32 }),
    }
}

/// Response time according to the answer [ns].
pub(super) fn response([_, _, _, time, ..]: [u64; ANSWER]) -> u64 {
    time
}

/// Encodes a description, or a problem.
pub(super) fn encode_description(description: Result<&Description, String>) -> Vec<u8> {
    let parameter = |p: &ModuleParameter| json!([p.name, p.unit, p.help, p.minimum, p.maximum, p.initial, p.fixed]);
    let signal = |signal: &Signal| json!([signal.name, signal.variable, signal.unit]);
    let message = match description {
        Ok(it) => json!({
            "version": VERSION,
            "name": it.name,
            "parameters": it.parameters.iter().map(parameter).collect::<Vec<_>>(),
            "kind": it.kind,
            "tool": it.tool,
            "step": it.step,
            "signals": it.signals.iter().map(signal).collect::<Vec<_>>(),
            "notes": it.notes,
        }),
        Err(problem) => json!({ "version": VERSION, "problem": problem }),
    };
    message.to_string().into_bytes()
}

/// Decodes a description, or its problem.
pub(super) fn decode_description(bytes: &[u8]) -> Result<Description, String> {
    let message: Value =
        serde_json::from_slice(bytes).map_err(|error| format!("invalid message from its process ({error})"))?;
    if message["version"] != VERSION {
        return Err("its process is another version of stickslip. Set the variable STICKSLIP to this program".into());
    }
    if let Some(problem) = message["problem"].as_str() {
        return Err(problem.to_owned());
    }
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let parameter = |p: &Value| ModuleParameter {
        name: text(&p[0]),
        unit: text(&p[1]),
        help: text(&p[2]),
        minimum: number(&p[3]),
        maximum: number(&p[4]),
        initial: number(&p[5]),
        fixed: p[6].as_bool().unwrap_or_default(),
    };
    let signal = |s: &Value| Signal { name: text(&s[0]), variable: text(&s[1]), unit: text(&s[2]) };
    let all = |what: &str| message[what].as_array().map_or(&[][..], Vec::as_slice);
    Ok(Description {
        name: text(&message["name"]),
        parameters: all("parameters").iter().map(parameter).collect(),
        kind: text(&message["kind"]),
        tool: message["tool"].as_str().map(String::from),
        step: message["step"].as_f64(),
        signals: all("signals").iter().map(signal).collect(),
        notes: all("notes").iter().map(text).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_bits_decode_to_an_answer_or_a_fault() {
        let done = answer([DONE, 0.25f64.to_bits(), 17, 0, u64::from((-2i32).cast_unsigned()), 0]);
        assert_eq!(done, Ok(Answer { torque: 0.25, time: 17, refused: -2 }));
        assert_eq!(answer([MODE; ANSWER]), Err(ExternalFault::FloatingPoint));
        assert_eq!(
            answer([FAILED, u64::from((-3i32).cast_unsigned()), 0, 0, 0, 0]),
            Err(ExternalFault::Failed { code: -3 })
        );
        assert_eq!(answer([u64::MAX; ANSWER]), Err(ExternalFault::Failed { code: -1 }));
        assert!(answer([DONE, f64::NAN.to_bits(), u64::MAX, 0, 0, 0]).is_ok_and(|answer| answer.torque.is_nan()));
    }

    #[test]
    fn a_process_of_another_version_is_refused() {
        let signals = vec![Signal { name: "torque".into(), variable: "M".into(), unit: "N.m".into() }];
        let description = Description { name: "it".into(), signals, step: Some(1e-3), ..Description::default() };
        assert_eq!(decode_description(&encode_description(Ok(&description))), Ok(description));
        assert_eq!(decode_description(&encode_description(Err("broken".into()))), Err("broken".into()));
        let other = decode_description(br#"{"name":"it","parameters":[]}"#).unwrap_err();
        assert!(other.contains("another version") && decode_description(b"{").is_err(), "{other}");
    }
}
