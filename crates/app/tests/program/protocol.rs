//! `web/src/protocol.ts` has the types of the protocol and is generated from its schema.
//! `UPDATE_EXPECT=1 cargo test -p stickslip-cli --test program protocol` regenerates it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Map, Value};

#[test]
fn the_page_has_the_types_of_the_protocol() {
    let mut definitions = BTreeMap::new();
    let mut text =
        String::from("// Generated from the schema of the protocol; do not edit. See crates/app/tests/protocol.rs.\n");
    // Calls may omit fields with a default; answers have all fields.
    let schema = stickslip::live::protocol::schema(true);
    for (name, schema) in [("Call", &schema["call"]), ("Answer", &schema["answer"])] {
        let schema = schema.as_object().unwrap().clone();
        if let Some(below) = schema.get("$defs").and_then(Value::as_object) {
            definitions.extend(below.clone());
        }
        declare(&mut text, name, &Value::Object(schema));
    }
    for (name, schema) in &definitions {
        declare(&mut text, name, schema);
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../web/src/protocol.ts");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == text,
        "web/src/protocol.ts is stale: UPDATE_EXPECT=1 cargo test -p stickslip-cli --test program protocol"
    );
}

fn declare(text: &mut String, name: &str, schema: &Value) {
    comment(text, schema, "");
    writeln!(text, "export type {name} = {}", type_of(schema, "")).unwrap();
}

fn comment(text: &mut String, schema: &Value, indent: &str) {
    if let Some(about) = schema.get("description").and_then(Value::as_str) {
        let about = about.replace('\n', " ");
        writeln!(text, "{indent}/** {about} */").unwrap();
    } else if indent.is_empty() {
        text.push('\n');
    }
}

fn type_of(schema: &Value, indent: &str) -> String {
    let Some(object) = schema.as_object() else { return "unknown".into() };
    if let Some(name) = object.get("$ref").and_then(Value::as_str) {
        let name = name.rsplit('/').next().unwrap().to_owned();
        // Properties next to a reference, such as the tag of an answer, are added to it.
        return if object.contains_key("properties") { format!("{name} & {}", fields(object, indent)) } else { name };
    }
    if let Some(value) = object.get("const") {
        return value.to_string();
    }
    if let Some(values) = object.get("enum").and_then(Value::as_array) {
        return values.iter().map(Value::to_string).collect::<Vec<_>>().join(" | ");
    }
    for key in ["oneOf", "anyOf"] {
        if let Some(all) = object.get(key).and_then(Value::as_array) {
            let all: Vec<String> = all.iter().map(|one| type_of(one, indent)).collect();
            return all.join(&format!("\n{indent}  | "));
        }
    }
    match object.get("type") {
        Some(Value::Array(all)) => {
            let one = |kind: &Value| type_of(&with_type(object, kind), indent);
            all.iter().map(one).collect::<Vec<_>>().join(" | ")
        }
        Some(Value::String(kind)) => match kind.as_str() {
            "null" => "null".into(),
            "string" => "string".into(),
            "boolean" => "boolean".into(),
            "number" | "integer" => "number".into(),
            "array" => match object.get("prefixItems").and_then(Value::as_array) {
                Some(items) => {
                    format!("[{}]", items.iter().map(|item| type_of(item, indent)).collect::<Vec<_>>().join(", "))
                }
                None => array(object, indent),
            },
            _ => fields(object, indent),
        },
        _ => "unknown".into(),
    }
}

fn array(object: &Map<String, Value>, indent: &str) -> String {
    let item = object.get("items").map_or("unknown".into(), |item| type_of(item, indent));
    match object.get("maxItems").and_then(Value::as_u64) {
        Some(count) => format!("[{}]", vec![item; count as usize].join(", ")),
        None if item.contains(['|', '&']) => format!("({item})[]"),
        None => format!("{item}[]"),
    }
}

fn fields(object: &Map<String, Value>, indent: &str) -> String {
    if let Some(values) = object.get("additionalProperties").filter(|values| values.is_object()) {
        return format!("Record<string, {}>", type_of(values, indent));
    }
    let Some(properties) = object.get("properties").and_then(Value::as_object) else {
        return "Record<string, never>".into();
    };
    let required: Vec<&str> =
        object.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect();
    let deeper = format!("{indent}  ");
    let mut text = String::from("{\n");
    for (name, schema) in properties {
        comment(&mut text, schema, &deeper);
        let mark = if required.contains(&name.as_str()) { "" } else { "?" };
        writeln!(text, "{deeper}{name}{mark}: {}", type_of(schema, &deeper)).unwrap();
    }
    text + indent + "}"
}

fn with_type(object: &Map<String, Value>, kind: &Value) -> Value {
    let mut one = object.clone();
    one.insert("type".into(), kind.clone());
    Value::Object(one)
}
