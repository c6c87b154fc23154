//! The description of a bench for measurement and calibration tools: ASAM MCD-2 MC (ASAP2) 1.61, in ASCII, in one file.
//!
//! 1.61 is what older readers understand as well. Limits are printed with all their digits.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use super::ascii::ascii;
use super::{Cell, Content, EPK, EVENT_NAME, Layout, MAX_CTO, MAX_DTO, PARAMETERS, SIZE, VERSION, cycle_time};

/// What the blocks of XCP consist of, in the metalanguage.
pub(crate) const METALANGUAGE: &str = include_str!("xcp.aml");
/// The commands that a slave may have or not, as far as it has them.
const COMMANDS: &str = "GET_COMM_MODE_INFO GET_ID SET_MTA UPLOAD SHORT_UPLOAD BUILD_CHECKSUM DOWNLOAD SHORT_DOWNLOAD \
    SET_CAL_PAGE GET_CAL_PAGE GET_PAG_PROCESSOR_INFO GET_SEGMENT_INFO GET_PAGE_INFO COPY_CAL_PAGE SET_DAQ_PTR WRITE_DAQ \
    SET_DAQ_LIST_MODE GET_DAQ_LIST_MODE START_STOP_DAQ_LIST START_STOP_SYNCH GET_DAQ_CLOCK GET_DAQ_PROCESSOR_INFO \
    GET_DAQ_RESOLUTION_INFO GET_DAQ_LIST_INFO GET_DAQ_EVENT_INFO FREE_DAQ ALLOC_DAQ ALLOC_ODT ALLOC_ODT_ENTRY \
    WRITE_DAQ_MULTIPLE";
/// Longest text that all readers take [bytes].
const TEXT: usize = 255;

/// Where a bench speaks XCP.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Doors {
    /// By datagrams.
    pub udp: Option<SocketAddr>,
    /// By connections.
    pub tcp: Option<SocketAddr>,
}

/// The description of what has an address, and how to get there.
pub fn describe(layout: &Layout, doors: Doors) -> String {
    let mut text = String::from("ASAP2_VERSION 1 61\n");
    let version = env!("CARGO_PKG_VERSION");
    text += &format!(
        "/begin PROJECT stickslip \"The friction bench\"\n  \
         /begin HEADER \"The friction bench\" VERSION \"{version}\" PROJECT_NO stickslip /end HEADER\n  \
         /begin MODULE stickslip \"All that a running bench measures, and may be told\"\n"
    );
    text += METALANGUAGE;
    text += "    /begin MOD_COMMON \"\" BYTE_ORDER MSB_LAST ALIGNMENT_BYTE 1 ALIGNMENT_WORD 1 ALIGNMENT_LONG 1 \
             ALIGNMENT_FLOAT32_IEEE 1 ALIGNMENT_FLOAT64_IEEE 1 /end MOD_COMMON\n";
    text += &memory(layout);
    let slave = Slave {
        commands: COMMANDS,
        max_cto: MAX_CTO,
        max_dto: MAX_DTO,
        max_entry: MAX_CTO,
        event: EVENT_NAME,
        cycle: cycle_time(layout.rate),
        pages: true,
    };
    text += &protocol(&slave, doors);
    text += "    /begin RECORD_LAYOUT number FNC_VALUES 1 FLOAT64_IEEE ROW_DIR DIRECT /end RECORD_LAYOUT\n";
    let mut conversions = Conversions::default();
    let mut objects = String::new();
    for cell in &layout.measurements {
        let conversion = conversions.of(cell);
        objects += &format!(
            "    /begin MEASUREMENT {} {} FLOAT64_IEEE {conversion} 0 0 {:?} {:?} ECU_ADDRESS {:#x}\n      \
             /begin IF_DATA XCP /begin DAQ_EVENT FIXED_EVENT_LIST EVENT 0 /end DAQ_EVENT /end IF_DATA\n    \
             /end MEASUREMENT\n",
            name(&cell.path),
            about(cell),
            cell.minimum,
            cell.maximum,
            cell.address
        );
    }
    for parameter in &layout.parameters {
        let cell = &parameter.cell;
        let conversion = conversions.of(cell);
        objects += &format!(
            "    /begin CHARACTERISTIC {} {} VALUE {:#x} number 0 {conversion} {:?} {:?} /end CHARACTERISTIC\n",
            name(&cell.path),
            about(cell),
            cell.address,
            cell.minimum,
            cell.maximum
        );
    }
    text + &conversions.text + &objects + &groups(layout) + "  /end MODULE\n/end PROJECT\n"
}

/// The name of a value: elements of a list in brackets, since parts of a name do not begin with a digit; what no name may
/// have is `_`.
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
pub(crate) fn about(cell: &Cell) -> String {
    let help = cell.help.split_whitespace().collect::<Vec<_>>().join(" ");
    quoted(&if cell.symbol.is_empty() { help } else { format!("{}: {help}", cell.symbol) })
}

fn memory(layout: &Layout) -> String {
    let size = SIZE * layout.parameters.len() as u32;
    format!(
        "    /begin MOD_PAR \"\" VERSION \"{version}\" ADDR_EPK {EPK:#x} EPK {epk}\n      \
         /begin MEMORY_SEGMENT parameters \"Page 0: the working set. Page 1: the reference.\" DATA FLASH INTERN \
         {PARAMETERS:#x} {size:#x} -1 -1 -1 -1 -1\n        \
         /begin IF_DATA XCP /begin SEGMENT 0 2 0 0 0\n          \
         /begin CHECKSUM XCP_CRC_32 MAX_BLOCK_SIZE {size} /end CHECKSUM\n          \
         /begin PAGE 0 ECU_ACCESS_DONT_CARE XCP_READ_ACCESS_DONT_CARE XCP_WRITE_ACCESS_DONT_CARE /end PAGE\n          \
         /begin PAGE 1 ECU_ACCESS_DONT_CARE XCP_READ_ACCESS_DONT_CARE XCP_WRITE_ACCESS_NOT_ALLOWED /end PAGE\n        \
         /end SEGMENT /end IF_DATA\n      /end MEMORY_SEGMENT\n    /end MOD_PAR\n",
        version = env!("CARGO_PKG_VERSION"),
        epk = quoted(&layout.epk),
    )
}

/// What a slave can, and how it says it.
pub(crate) struct Slave<'a> {
    pub(crate) commands: &'a str,
    pub(crate) max_cto: usize,
    pub(crate) max_dto: usize,
    /// Largest entry of a packet [bytes].
    pub(crate) max_entry: usize,
    pub(crate) event: &'a str,
    /// The time between two events: a number of units, 10⁻⁹ s × 10^unit.
    pub(crate) cycle: (u8, u8),
    /// Whether parameters have pages.
    pub(crate) pages: bool,
}

pub(crate) fn protocol(slave: &Slave, doors: Doors) -> String {
    let [major, minor] = VERSION;
    let Slave { max_cto, max_dto, max_entry, event, cycle: (time, unit), .. } = slave;
    // A command that takes longer than T1 says so by an event.
    let mut text = format!(
        "    /begin IF_DATA XCP\n      /begin PROTOCOL_LAYER 0x{major:02x}{minor:02x} 2000 2000 2000 2000 2000 2000 2000 \
         {max_cto} {max_dto} BYTE_ORDER_MSB_LAST ADDRESS_GRANULARITY_BYTE\n"
    );
    for command in slave.commands.split_whitespace() {
        text += &format!("        OPTIONAL_CMD {command}\n");
    }
    text += &format!(
        "        OPTIONAL_LEVEL1_CMD GET_VERSION\n      /end PROTOCOL_LAYER\n      \
         /begin DAQ DYNAMIC 0 1 0 OPTIMISATION_TYPE_DEFAULT ADDRESS_EXTENSION_FREE \
         IDENTIFICATION_FIELD_TYPE_RELATIVE_BYTE GRANULARITY_ODT_ENTRY_SIZE_DAQ_DLONG {max_entry} OVERLOAD_INDICATION_PID \
         PRESCALER_SUPPORTED\n        /begin TIMESTAMP_SUPPORTED 1 SIZE_DWORD UNIT_1US /end TIMESTAMP_SUPPORTED\n        \
         /begin EVENT \"{event}\" \"{event}\" 0 DAQ 255 {time} {unit} 0 CONSISTENCY DAQ /end EVENT\n      \
         /end DAQ\n"
    );
    if slave.pages {
        text += "      /begin PAG 1 /end PAG\n";
    }
    for (transport, address) in [("TCP", doors.tcp), ("UDP", doors.udp)] {
        let Some(address) = address else { continue };
        // Where it listens everywhere, it is reached from here at least.
        let (kind, host) = match address.ip() {
            ip if ip.is_unspecified() => ("ADDRESS", IpAddr::from(Ipv4Addr::LOCALHOST)),
            ip @ IpAddr::V4(_) => ("ADDRESS", ip),
            ip @ IpAddr::V6(_) => ("IPV6", ip),
        };
        text += &format!(
            "      /begin XCP_ON_{transport}_IP 0x{major:02x}{minor:02x} {} {kind} \"{host}\" /end XCP_ON_{transport}_IP\n",
            address.port()
        );
    }
    text + "    /end IF_DATA\n"
}

/// What numbers mean: units, and names of whole numbers, each said once.
#[derive(Default)]
pub(crate) struct Conversions {
    named: BTreeMap<String, String>,
    /// All that were asked for.
    pub(crate) text: String,
}

impl Conversions {
    /// The name of a cell's conversion, which is said before it is used.
    pub(crate) fn of(&mut self, cell: &Cell) -> String {
        let verbs = match cell.content {
            Content::Flag => vec!["false", "true"],
            Content::Choice(variants) => variants.iter().map(|variant| variant.name).collect(),
            Content::Real | Content::Whole if cell.unit == "1" => return "NO_COMPU_METHOD".into(),
            Content::Real | Content::Whole => {
                let unit = ascii(cell.unit);
                let word = unit.replace('/', "_per_").replace(['^', '(', ')'], "");
                let word = word.replace(|letter: char| !letter.is_ascii_alphanumeric(), "_");
                return self.say(&format!("unit {unit}"), &format!("unit_{word}"), |name| {
                    format!("    /begin COMPU_METHOD {name} \"\" IDENTICAL \"%20.12\" \"{unit}\" /end COMPU_METHOD\n")
                });
            }
        };
        let number = self.named.len();
        self.say(&format!("names {verbs:?}"), &format!("names_{number}"), |name| {
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

    fn say(&mut self, what: &str, name: &str, how: impl FnOnce(&str) -> String) -> String {
        let known = self.named.entry(what.to_owned()).or_insert_with(|| {
            self.text += &how(name);
            name.to_owned()
        });
        known.clone()
    }
}

/// Measurements and parameters by the group that they stand in.
fn groups(layout: &Layout) -> String {
    let mut groups: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for parameter in &layout.parameters {
        let path = parameter.cell.path.as_str();
        // `bench.controller` of `bench.controller.pid.gain`, `bench` of `bench.fade_velocity`.
        let ends = path.match_indices('.').map(|(end, _)| end).take(2).last();
        groups.entry(name(&path[..ends.unwrap_or(path.len())])).or_default().push(name(path));
    }
    let subgroups: Vec<String> = groups.keys().map(|group| format!("parameters.{group}")).collect();
    let mut text = format!(
        "    /begin GROUP parameters \"\" ROOT /begin SUB_GROUP {} /end SUB_GROUP /end GROUP\n",
        subgroups.join(" ")
    );
    for (group, names) in subgroups.iter().zip(groups.values()) {
        text += &format!(
            "    /begin GROUP {group} \"\" /begin REF_CHARACTERISTIC\n      {}\n    /end REF_CHARACTERISTIC /end GROUP\n",
            names.join("\n      ")
        );
    }
    let measured: Vec<String> = layout.measurements.iter().map(|cell| name(&cell.path)).collect();
    text + &format!(
        "    /begin GROUP measurements \"\" ROOT /begin REF_MEASUREMENT\n      {}\n    /end REF_MEASUREMENT /end GROUP\n",
        measured.join("\n      ")
    )
}
