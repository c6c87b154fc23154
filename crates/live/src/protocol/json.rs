//! Calls and answers as JSON objects that name their kind by a key: `{"call": "set", "values": {…}}`.
//!
//! They are read and written only here, so that the derived code is compiled once, for one reader and one writer. The
//! derives use the kind as outer key (`{"set": {…}}`): with a key among the others, each value would be read into a buffer
//! first.

use schemars::generate::SchemaSettings;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use stickslip_base::excerpt;

use super::{Answer, Call};

impl Call {
    /// The call of a JSON object.
    ///
    /// # Errors
    /// No object, unknown kind, missing or unknown field, wrong type.
    pub fn from_json(value: Value) -> Result<Self, String> {
        read("call", value)
    }

    /// The call as a JSON object.
    pub fn to_json(&self) -> Value {
        write("call", self)
    }
}

impl Answer {
    /// The answer of a JSON object.
    ///
    /// # Errors
    /// As [`Call::from_json`].
    pub fn from_json(value: Value) -> Result<Self, String> {
        read("answer", value)
    }

    /// The answer as a JSON object.
    pub fn to_json(&self) -> Value {
        write("answer", self)
    }
}

/// The schema of calls and answers. With `complete` an answer has every field, as the page receives it.
pub fn schema(complete: bool) -> Value {
    let settings = SchemaSettings::default();
    let answer = if complete { settings.for_serialize() } else { settings }.into_generator();
    json!({ "call": schemars::schema_for!(Call), "answer": answer.into_root_schema_for::<Answer>() })
}

fn read<T: DeserializeOwned>(key: &str, value: Value) -> Result<T, String> {
    let outside = outside(key, value)?;
    // The message quotes values of the client.
    serde_json::from_value(outside).map_err(|error| excerpt::message(&error.to_string()))
}

/// `{"call": "set", "values": {…}}` as `{"set": {"values": {…}}}`.
fn outside(key: &str, value: Value) -> Result<Value, String> {
    let Value::Object(mut fields) = value else { return Err("not a JSON object".into()) };
    match fields.remove(key) {
        Some(Value::String(kind)) => Ok(Value::Object(Map::from_iter([(kind, Value::Object(fields))]))),
        Some(other) => Err(format!("\"{key}\" is {other}, not a text")),
        None => Err(format!("missing field `{key}`")),
    }
}

fn write(key: &str, value: &impl Serialize) -> Value {
    inside(key, serde_json::to_value(value).expect("keys are text"))
}

/// `{"set": {"values": {…}}}` as `{"call": "set", "values": {…}}`.
fn inside(key: &str, value: Value) -> Value {
    let Value::Object(outside) = value else { unreachable!("each kind has fields, or none in braces") };
    let mut fields = Map::new();
    for (kind, value) in outside {
        fields.insert(key.into(), Value::String(kind));
        if let Value::Object(more) = value {
            fields.extend(more);
        }
    }
    Value::Object(fields)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Quantity;

    #[test]
    fn a_call_and_an_answer_read_back_as_they_were_written() {
        let call = Call::Curve { run: Some(7) };
        assert_eq!(call.to_json(), json!({ "call": "curve", "run": 7 }));
        assert_eq!(Call::from_json(call.to_json()), Ok(call));
        assert_eq!(Call::from_json(json!({ "call": "status" })), Ok(Call::Status {}));
        let plan = Call::from_json(json!({ "call": "plan", "what": "friction" }));
        assert!(matches!(plan, Ok(Call::Plan { what: Quantity::Friction, thorough: false, .. })), "{plan:?}");
        let answer = Answer::Done {};
        assert_eq!(answer.to_json(), json!({ "answer": "done" }));
        assert_eq!(Answer::from_json(answer.to_json()), Ok(answer));
    }

    #[test]
    fn the_error_of_an_invalid_call_names_the_fault() {
        for (call, expected) in [
            (json!([1]), "not a JSON object"),
            (json!({ "values": {} }), "missing field `call`"),
            (json!({ "call": 3 }), "\"call\" is 3, not a text"),
            (json!({ "call": "sett" }), "unknown variant `sett`"),
            (json!({ "call": "status", "more": 1 }), "unknown field `more`"),
            (json!({ "call": "load" }), "missing field `name`"),
            (json!({ "call": "load", "name": 1 }), "invalid type: integer `1`, expected a string"),
        ] {
            let error = Call::from_json(call.clone()).unwrap_err();
            assert!(error.contains(expected), "{call}: {error}");
        }
    }
}
