//! The writer of descriptions for calibration tools: ASAP2 1.61 (ASAM MCD-2 MC) in ASCII, in one file.
//!
//! Running benches, generated code and FMUs are described by it. Version 1.61 is supported by older readers as well.
//! Limits are printed with all their digits.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::xcp::ascii::ascii;
use crate::xcp::{Cell, Content};

/// Longest text that all readers accept [bytes].
const TEXT: usize = 255;
/// Alignments without gaps, for bytes, words, longs, single and double precision.
pub(crate) const PACKED: [u8; 5] = [1; 5];

/// Head of a description, before its objects.
pub(crate) struct Head<'a> {
    pub(crate) project: &'a str,
    pub(crate) project_help: &'a str,
    pub(crate) module: &'a str,
    pub(crate) module_help: &'a str,
    /// `MSB_FIRST` or `MSB_LAST`.
    pub(crate) byte_order: &'a str,
    /// For bytes, words, longs, single and double precision [bytes].
    pub(crate) alignments: [u8; 5],
    /// Metalanguage of `IF_DATA`; empty without such blocks.
    pub(crate) metalanguage: &'a str,
    /// The content of `MOD_PAR`.
    pub(crate) parameters: &'a str,
    /// `IF_DATA` of the module; empty without a protocol.
    pub(crate) protocol: &'a str,
}

/// Measurements, parameters (characteristics) and groups of a description.
pub(crate) struct Objects {
    /// Type of the numbers, such as `FLOAT64_IEEE`.
    number: &'static str,
    conversions: Conversions,
    text: String,
    groups: String,
}

impl Objects {
    pub(crate) fn new(number: &'static str) -> Self {
        Self { number, conversions: Conversions::default(), text: String::new(), groups: String::new() }
    }

    /// Adds a measurement with further attributes. Returns its name.
    pub(crate) fn measurement(&mut self, cell: &Cell, more: &str) -> String {
        let Cell { address, minimum, maximum, .. } = cell;
        let (number, name, help, conversion) = (self.number, name(&cell.path), about(cell), self.conversions.of(cell));
        self.text += &format!(
            "    /begin MEASUREMENT {name} {help} {number} {conversion} 0 0 {minimum:?} {maximum:?} \
             ECU_ADDRESS {address:#x} {more} /end MEASUREMENT\n"
        );
        name
    }

    /// Adds a parameter with further attributes. Returns its name.
    pub(crate) fn parameter(&mut self, cell: &Cell, more: &str) -> String {
        let Cell { address, minimum, maximum, .. } = cell;
        let (name, help, conversion) = (name(&cell.path), about(cell), self.conversions.of(cell));
        self.text += &format!(
            "    /begin CHARACTERISTIC {name} {help} VALUE {address:#x} number 0 {conversion} {minimum:?} {maximum:?} \
             {more} /end CHARACTERISTIC\n"
        );
        name
    }

    /// Adds a group. `kind` is `ROOT` at the top and empty below; `references` is `SUB_GROUP`, `REF_MEASUREMENT` or
    /// `REF_CHARACTERISTIC`.
    pub(crate) fn group(&mut self, group: &str, kind: &str, references: &str, names: &[String]) {
        let names = names.join("\n      ");
        self.groups += &format!(
            "    /begin GROUP {group} \"\" {kind} /begin {references}\n      {names}\n    /end {references} /end GROUP\n"
        );
    }

    /// The text of the file.
    pub(crate) fn file(self, head: &Head) -> String {
        let Head { project, module, byte_order, metalanguage, parameters, protocol, .. } = head;
        let (project_help, module_help) = (quoted(head.project_help), quoted(head.module_help));
        let version = env!("CARGO_PKG_VERSION");
        let [byte, word, long, single, double] = head.alignments;
        let Self { number, conversions, text, groups } = self;
        format!(
            "ASAP2_VERSION 1 61\n/begin PROJECT {project} {project_help}\n  \
             /begin HEADER {project_help} VERSION \"{version}\" PROJECT_NO stickslip /end HEADER\n  \
             /begin MODULE {module} {module_help}\n{metalanguage}    \
             /begin MOD_COMMON \"\" BYTE_ORDER {byte_order} ALIGNMENT_BYTE {byte} ALIGNMENT_WORD {word} \
             ALIGNMENT_LONG {long} ALIGNMENT_FLOAT32_IEEE {single} ALIGNMENT_FLOAT64_IEEE {double} /end MOD_COMMON\n    \
             /begin MOD_PAR \"\" VERSION \"{version}\" {parameters} /end MOD_PAR\n{protocol}    \
             /begin RECORD_LAYOUT number FNC_VALUES 1 {number} ROW_DIR DIRECT /end RECORD_LAYOUT\n\
             {}{text}{groups}  /end MODULE\n/end PROJECT\n",
            conversions.text
        )
    }
}

/// The name of a value: elements of a list in brackets, since parts of a name do not begin with a digit; invalid
/// characters become `_`.
pub fn name(path: &str) -> String {
    let allowed = |letter: char| letter.is_ascii_alphanumeric() || "._".contains(letter);
    let path = path.replace(|letter: char| !allowed(letter), "_");
    let part = |part: &str| {
        if part.starts_with(|c: char| c.is_ascii_digit()) { format!("[{part}]") } else { format!(".{part}") }
    };
    path.split('.').map(part).collect::<String>().trim_start_matches('.').to_owned()
}

/// A text between quotes.
pub(crate) fn quoted(text: &str) -> String {
    let mut text = ascii(text).replace('"', "'").replace('\\', "/");
    text.truncate(TEXT);
    format!("\"{text}\"")
}

/// Symbol and meaning.
fn about(cell: &Cell) -> String {
    let help = cell.help.split_whitespace().collect::<Vec<_>>().join(" ");
    quoted(&if cell.symbol.is_empty() { help } else { format!("{}: {help}", cell.symbol) })
}

/// Conversions: units, and names of whole numbers, each written once.
#[derive(Default)]
struct Conversions {
    names: BTreeMap<String, String>,
    /// The conversions in use.
    text: String,
}

impl Conversions {
    /// The name of a cell's conversion, which is written before it is used.
    fn of(&mut self, cell: &Cell) -> String {
        let verbs = match cell.content {
            Content::Flag => vec!["false", "true"],
            Content::Choice(variants) => variants.iter().map(|variant| variant.name).collect(),
            Content::Real | Content::Whole if cell.unit == "1" => return "NO_COMPU_METHOD".into(),
            Content::Real | Content::Whole => {
                let unit = ascii(cell.unit);
                let word = unit.replace('/', "_per_").replace(['^', '(', ')'], "");
                let word = word.replace(|letter: char| !letter.is_ascii_alphanumeric(), "_");
                return self.once(&format!("unit {unit}"), &format!("unit_{word}"), |name| {
                    format!("    /begin COMPU_METHOD {name} \"\" IDENTICAL \"%20.12\" \"{unit}\" /end COMPU_METHOD\n")
                });
            }
        };
        let number = self.names.len();
        self.once(&format!("names {verbs:?}"), &format!("names_{number}"), |name| {
            let pairs = verbs.iter().enumerate().fold(String::new(), |mut pairs, (value, verb)| {
                let _ = write!(pairs, " {value} \"{verb}\"");
                pairs
            });
            format!(
                "    /begin COMPU_VTAB {name}.table \"\" TAB_VERB {}{pairs} /end COMPU_VTAB\n    \
                 /begin COMPU_METHOD {name} \"\" TAB_VERB \"%3.0\" \"\" COMPU_TAB_REF {name}.table /end COMPU_METHOD\n",
                verbs.len()
            )
        })
    }

    fn once(&mut self, what: &str, name: &str, how: impl FnOnce(&str) -> String) -> String {
        let entry = self.names.entry(what.to_owned()).or_insert_with(|| {
            self.text += &how(name);
            name.to_owned()
        });
        entry.clone()
    }
}
