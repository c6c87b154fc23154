//! The description of a running bench for measurement and calibration tools, in ASAP2.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

pub use crate::asap2::name;
use crate::asap2::{Head, Objects, PACKED, quoted};

use super::{EPK, EVENT_NAME, Layout, MAX_CTO, MAX_DTO, PARAMETERS, SIZE, VERSION, cycle_time};

/// Structure of the blocks of XCP, in the metalanguage.
pub(crate) const METALANGUAGE: &str = include_str!("xcp.aml");
/// The optional commands of the slave.
const COMMANDS: &str = "GET_COMM_MODE_INFO GET_ID SET_MTA UPLOAD SHORT_UPLOAD BUILD_CHECKSUM DOWNLOAD SHORT_DOWNLOAD \
    SET_CAL_PAGE GET_CAL_PAGE GET_PAG_PROCESSOR_INFO GET_SEGMENT_INFO GET_PAGE_INFO COPY_CAL_PAGE SET_DAQ_PTR WRITE_DAQ \
    SET_DAQ_LIST_MODE GET_DAQ_LIST_MODE START_STOP_DAQ_LIST START_STOP_SYNCH GET_DAQ_CLOCK GET_DAQ_PROCESSOR_INFO \
    GET_DAQ_RESOLUTION_INFO GET_DAQ_LIST_INFO GET_DAQ_EVENT_INFO FREE_DAQ ALLOC_DAQ ALLOC_ODT ALLOC_ODT_ENTRY \
    WRITE_DAQ_MULTIPLE";

/// Addresses of the XCP service of a bench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Doors {
    /// UDP.
    pub udp: Option<SocketAddr>,
    /// TCP.
    pub tcp: Option<SocketAddr>,
}

/// The description of the measurements and parameters of a running bench, and of the addresses that serve them.
pub fn describe(layout: &Layout, doors: Doors) -> String {
    let event = "/begin IF_DATA XCP /begin DAQ_EVENT FIXED_EVENT_LIST EVENT 0 /end DAQ_EVENT /end IF_DATA";
    let mut objects = Objects::new("FLOAT64_IEEE");
    let measured: Vec<_> = layout.measurements.iter().map(|cell| objects.measurement(cell, event)).collect();
    let mut groups: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for parameter in &layout.parameters {
        let path = parameter.cell.path.as_str();
        // `bench.controller` of `bench.controller.pid.gain`, `bench` of `bench.fade_velocity`.
        let ends = path.match_indices('.').map(|(end, _)| end).take(2).last();
        let group = format!("parameters.{}", name(&path[..ends.unwrap_or(path.len())]));
        groups.entry(group).or_default().push(objects.parameter(&parameter.cell, ""));
    }
    objects.group("parameters", "ROOT", "SUB_GROUP", &groups.keys().cloned().collect::<Vec<_>>());
    groups.iter().for_each(|(group, names)| objects.group(group, "", "REF_CHARACTERISTIC", names));
    objects.group("measurements", "ROOT", "REF_MEASUREMENT", &measured);
    let slave = Slave {
        commands: COMMANDS,
        max_cto: MAX_CTO,
        max_dto: MAX_DTO,
        max_entry: MAX_CTO,
        event: EVENT_NAME,
        cycle: cycle_time(layout.rate),
        pages: true,
    };
    objects.file(&Head {
        project: "stickslip",
        project_help: "The friction bench",
        module: "stickslip",
        module_help: "Measurements and parameters of a running bench",
        byte_order: "MSB_LAST",
        alignments: PACKED,
        metalanguage: METALANGUAGE,
        parameters: &memory(layout),
        protocol: &protocol(&slave, doors),
    })
}

/// `MOD_PAR`: the version of the layout, and the memory of the parameters with its pages.
fn memory(layout: &Layout) -> String {
    let size = SIZE * layout.parameters.len() as u32;
    format!(
        "ADDR_EPK {EPK:#x} EPK {epk}\n      \
         /begin MEMORY_SEGMENT parameters \"Page 0: the working set. Page 1: the reference.\" DATA FLASH INTERN \
         {PARAMETERS:#x} {size:#x} -1 -1 -1 -1 -1\n        \
         /begin IF_DATA XCP /begin SEGMENT 0 2 0 0 0\n          \
         /begin CHECKSUM XCP_CRC_32 MAX_BLOCK_SIZE {size} /end CHECKSUM\n          \
         /begin PAGE 0 ECU_ACCESS_DONT_CARE XCP_READ_ACCESS_DONT_CARE XCP_WRITE_ACCESS_DONT_CARE /end PAGE\n          \
         /begin PAGE 1 ECU_ACCESS_DONT_CARE XCP_READ_ACCESS_DONT_CARE XCP_WRITE_ACCESS_NOT_ALLOWED /end PAGE\n        \
         /end SEGMENT /end IF_DATA\n      /end MEMORY_SEGMENT\n   ",
        epk = quoted(&layout.epk),
    )
}

/// Capabilities of a slave, and its event.
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

/// `IF_DATA` of the module.
pub(crate) fn protocol(slave: &Slave, doors: Doors) -> String {
    let [major, minor] = VERSION;
    let Slave { max_cto, max_dto, max_entry, event, cycle: (time, unit), .. } = slave;
    // A command that takes longer than T1 sends an event.
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
        // If it listens on all addresses, it is reachable at least from this computer.
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
