//! The optional XCP service of an FMU: FMI-LS-XCP 1.0.0, <https://github.com/modelica/fmi-ls-xcp>.
//!
//! A slave for one master, by TCP or UDP. It is in C (`xcp_slave.h`), because it is compiled together with the model.
//! Addresses are positions of numbers in the model, the same on every machine.

use std::fmt::Write as _;
use std::net::IpAddr;

use super::Version;
use super::description::{HEAD, attributes};

/// Folder of the layered standard in an FMU.
pub const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-xcp";
/// Address of the first number of the model: parameters, states, inputs, outputs and time, in this order.
pub const NUMBERS: u32 = 0x1000_0000;
/// Address of the identification of the model.
pub const EPK: u32 = 0x3000_0000;
/// Largest command and its response [bytes]: after two bytes a whole number of doubles.
pub const MAX_CTO: usize = 250;
/// Largest packet of measurements [bytes]: with its frame it fits a datagram on Ethernet.
pub const MAX_DTO: usize = 1440;
/// The only event.
pub const EVENT: &str = "step";

/// Configuration of a service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Service {
    /// Default listen address.
    pub address: IpAddr,
    /// Default port, of TCP or of UDP.
    pub port: u16,
    /// Identification of the model, the same as in its description.
    pub epk: String,
    /// The time of a step as a number of units, 10⁻⁹ s × 10^unit.
    pub cycle: (u8, u8),
}

/// A variable for the configuration of the service by an importer.
struct Setting {
    name: &'static str,
    role: &'static str,
    kind: Kind,
    help: &'static str,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Enable(bool),
    Port,
    Address,
}

/// In the order of their references.
const SETTINGS: [Setting; 6] = [
    Setting {
        name: "xcp.tcp.enable",
        role: "XCPServiceTCPEnable",
        kind: Kind::Enable(true),
        help: "Whether an XCP master may connect by TCP. Enable either TCP or UDP.",
    },
    Setting { name: "xcp.tcp.port", role: "XCPServiceTCPPort", kind: Kind::Port, help: "Port of TCP." },
    Setting {
        name: "xcp.tcp.listen_address",
        role: "XCPServiceTCPListenAddress",
        kind: Kind::Address,
        help: "Listen address of TCP. XCP has no password: on an address of a network, any computer that reaches it \
        can change the parameters.",
    },
    Setting {
        name: "xcp.udp.enable",
        role: "XCPServiceUDPEnable",
        kind: Kind::Enable(false),
        help: "Whether an XCP master may connect by UDP.",
    },
    Setting { name: "xcp.udp.port", role: "XCPServiceUDPPort", kind: Kind::Port, help: "Port of UDP." },
    Setting {
        name: "xcp.udp.listen_address",
        role: "XCPServiceUDPListenAddress",
        kind: Kind::Address,
        help: "Listen address of UDP.",
    },
];

impl Service {
    /// Definitions for the C code of the service; `name` is the model.
    pub(super) fn definitions(&self, name: &str) -> String {
        let text = |text: &str| text.replace('\\', "\\\\").replace('"', "\\\"");
        let mut out = String::from("\n/* The XCP service. */\n#define FMU_XCP 1\n");
        let (cycle, unit) = self.cycle;
        for (what, value) in [
            ("NAME", format!("\"{} {name}\"", super::description::TOOL)),
            ("FILE", format!("\"{name}\"")),
            ("EPK", format!("\"{}\"", text(&self.epk))),
            ("EPK_ADDRESS", format!("{EPK:#x}U")),
            ("BASE", format!("{NUMBERS:#x}U")),
            ("MAX_CTO", format!("{MAX_CTO}U")),
            ("MAX_DTO", format!("{MAX_DTO}U")),
            ("EVENT", format!("\"{EVENT}\"")),
            ("CYCLE", format!("{cycle}U")),
            ("UNIT", format!("{unit}U")),
            ("PORT", self.port.to_string()),
            ("LISTEN", format!("\"{}\"", self.address)),
        ] {
            writeln!(out, "#define FMU_XCP_{what} {value}").expect("writing to a String cannot fail");
        }
        out
    }

    /// The variables in `modelDescription.xml`, with references from `first` on: of FMI 2.0 they are parameters that are set
    /// before the experiment is set up, of FMI 3.0 structural ones, set in configuration mode.
    pub(super) fn variables(&self, first: usize, version: Version) -> String {
        let mut out = String::new();
        for (setting, reference) in SETTINGS.iter().zip(first..) {
            let start = match setting.kind {
                Kind::Enable(on) => on.to_string(),
                Kind::Port => self.port.to_string(),
                Kind::Address => self.address.to_string(),
            };
            let causality = if version == Version::Two { "parameter" } else { "structuralParameter" };
            let whole = attributes(&[
                ("name", setting.name.into()),
                ("valueReference", reference.to_string()),
                ("description", setting.help.into()),
                ("causality", causality.into()),
                ("variability", "fixed".into()),
                ("initial", if version == Version::Two { "exact".into() } else { String::new() }),
            ]);
            let range = match setting.kind {
                Kind::Port => attributes(&[("min", "1".into()), ("max", "65535".into())]),
                _ => String::new(),
            };
            let begin = attributes(&[("start", start.clone())]);
            match (version, setting.kind) {
                (Version::Two, kind) => {
                    let element = match kind {
                        Kind::Enable(_) => "Boolean",
                        Kind::Port => "Integer",
                        Kind::Address => "String",
                    };
                    writeln!(out, "    <ScalarVariable{whole}><{element}{range}{begin}/></ScalarVariable>")
                }
                (Version::Three, Kind::Enable(_)) => writeln!(out, "    <Boolean{whole}{begin}/>"),
                (Version::Three, Kind::Port) => writeln!(out, "    <UInt16{whole}{range}{begin}/>"),
                (Version::Three, Kind::Address) => {
                    writeln!(out, "    <String{whole}>\n      <Start value=\"{start}\"/>\n    </String>")
                }
            }
            .expect("writing to a String cannot fail");
        }
        out
    }

    /// Number of its variables.
    pub const VARIABLES: usize = SETTINGS.len();
}

/// `fmi-ls-manifest.xml`; `file` is the description.
pub(super) fn manifest(file: &str) -> String {
    let roles: String = SETTINGS
        .iter()
        .map(|it| format!("    <Variable{}/>\n", attributes(&[("name", it.name.into()), ("role", it.role.into())])))
        .collect();
    let interface = attributes(&[
        ("definition", file.into()),
        (
            "description",
            "All numbers of the model, measured after each step; its parameters, changed between two steps.".into(),
        ),
        ("containsXCPService", "true".into()),
    ]);
    format!(
        "{HEAD}<fmiLayeredStandardManifest xmlns:fmi-ls=\"http://fmi-standard.org/fmi-ls-manifest\"\n    \
         fmi-ls:fmi-ls-name=\"org.fmi-standard.fmi-ls-xcp\"\n    fmi-ls:fmi-ls-version=\"1.0.0\"\n    \
         fmi-ls:fmi-ls-description=\"Layered standard based on FMI 2.0 and FMI 3.0 for describing and implementing XCP \
         support for FMUs, which can either provide an XCP service or allow direct memory access via A2L files.\">\n  \
         <Interface{interface}>\n{roles}  </Interface>\n</fmiLayeredStandardManifest>\n"
    )
}

/// `documentation/fmi-ls-xcp.html`.
pub(super) fn page(name: &str, service: &Service) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}: XCP</title></head><body>\n\
         <h1>XCP</h1>\n<p>The model serves one XCP master (CANape, INCA, pyxcp), default: by TCP at {address}, port \
         {port}. Set the variables xcp.… for other addresses: in FMI 2.0 before the initialization, in FMI 3.0 in \
         configuration mode. The \
         description is {name}.a2l in {FOLDER}; its addresses are numbers within the model, the same for each platform \
         and for the sources. Another port must be changed there, too.</p>\n<p>Event {EVENT} is raised after each \
         step of the model; time stamps are simulated time in microseconds. Parameters change between two steps; \
         values outside their range or in conflict with others are refused with a text. The service runs in a \
         separate thread (POSIX \
         threads, sockets; compile with -pthread) and ends with the simulation. It is not available on Windows: set \
         xcp.tcp.enable to false.</p>\n</body></html>\n",
        address = service.address,
        port = service.port,
    )
}
