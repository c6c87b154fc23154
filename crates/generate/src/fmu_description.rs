//! The description of an FMU that serves XCP, for calibration tools: ASAP2 1.61 in one file.

use std::net::SocketAddr;

use stickslip_codegen::c::Project;
use stickslip_codegen::fmu::{self, Service};

use super::Precision;
use super::a2l::{Placed, STRUCTS, objects};
use crate::xcp::a2l::{Doors, METALANGUAGE, Slave, protocol, quoted};

/// The commands that the service of an FMU has.
const COMMANDS: &str = "GET_COMM_MODE_INFO GET_ID SET_MTA UPLOAD SHORT_UPLOAD DOWNLOAD SHORT_DOWNLOAD SET_DAQ_PTR WRITE_DAQ \
    SET_DAQ_LIST_MODE GET_DAQ_LIST_MODE START_STOP_DAQ_LIST START_STOP_SYNCH GET_DAQ_CLOCK GET_DAQ_PROCESSOR_INFO \
    GET_DAQ_RESOLUTION_INFO GET_DAQ_LIST_INFO GET_DAQ_EVENT_INFO FREE_DAQ ALLOC_DAQ ALLOC_ODT ALLOC_ODT_ENTRY";

/// The description of the FMU of a project, called `name`.
pub(super) fn fmu_description(project: &Project, name: &str, service: &Service) -> String {
    let top = project.program.steps.last().expect("a program has at least the block itself");
    let mut address = u64::from(fmu::NUMBERS);
    let mut placed = Vec::new();
    for (group, tree) in STRUCTS.into_iter().zip([&top.parameters, &top.state, &top.input, &top.output]) {
        if tree.numbers() > 0 {
            placed.push(Placed { group, tree, symbol: String::new(), address });
            address += 8 * tree.numbers() as u64;
        }
    }
    let event = "/begin IF_DATA XCP /begin DAQ_EVENT FIXED_EVENT_LIST EVENT 0 /end DAQ_EVENT /end IF_DATA";
    let all =
        objects(
            &placed,
            Precision::Double,
            |placed, _| {
                if placed.group == STRUCTS[0] { String::new() } else { event.into() }
            },
        );
    let slave = Slave {
        commands: COMMANDS,
        max_cto: fmu::MAX_CTO,
        max_dto: fmu::MAX_DTO,
        max_entry: fmu::MAX_CTO / 8 * 8,
        event: fmu::EVENT,
        cycle: service.cycle,
        pages: false,
    };
    let door = Some(SocketAddr::new(service.address, service.port));
    format!(
        "ASAP2_VERSION 1 61\n/begin PROJECT {name} \"An FMU written by stickslip\"\n  /begin MODULE {name} {help}\n\
         {METALANGUAGE}    /begin MOD_COMMON \"\" BYTE_ORDER MSB_LAST ALIGNMENT_BYTE 1 ALIGNMENT_WORD 1 ALIGNMENT_LONG 1 \
         ALIGNMENT_FLOAT32_IEEE 1 ALIGNMENT_FLOAT64_IEEE 1 /end MOD_COMMON\n    \
         /begin MOD_PAR \"\" VERSION \"{version}\" ADDR_EPK {epk_at:#x} EPK {epk} /end MOD_PAR\n\
         {protocol}    /begin RECORD_LAYOUT number FNC_VALUES 1 FLOAT64_IEEE ROW_DIR DIRECT /end RECORD_LAYOUT\n    \
         /begin COMPU_METHOD unit_of_time \"\" IDENTICAL \"%20.12\" \"s\" /end COMPU_METHOD\n\
         {objects}    /begin MEASUREMENT time \"The end of the last step.\" FLOAT64_IEEE unit_of_time 0 0 0.0 1e300 \
         ECU_ADDRESS {address:#x} {event} /end MEASUREMENT\n  /end MODULE\n/end PROJECT\n",
        help = quoted(top.help.lines().next().unwrap_or_default()),
        version = env!("CARGO_PKG_VERSION"),
        epk_at = fmu::EPK,
        epk = quoted(&service.epk),
        protocol = protocol(&slave, Doors { tcp: door, udp: door }),
        objects = all.text,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{blocks, code};
    use stickslip_base::parameters::presets;

    #[test]
    fn a_strict_reader_has_nothing_to_say_of_any_block_and_no_addresses_overlap() {
        let preset = presets::find("clm-bench").and_then(|source| source.read()).expect("a preset of the product");
        for entry in blocks() {
            let made = code(entry.name, &preset, Precision::Double, None).expect("a block of the catalogue");
            let project = Project { files: made.files, program: made.program };
            let address = "::1".parse().expect("an address");
            let service = Service { address, port: 5556, epk: "stickslip \"1\"".into(), cycle: (25, 3) };
            let text = fmu_description(&project, entry.name, &service);
            assert!(text.is_ascii() && !text.contains("/include"), "{}", entry.name);
            let (file, messages) =
                a2lfile::load_from_string(&text, None, true).unwrap_or_else(|error| panic!("{error}"));
            assert!(messages.is_empty(), "{}: {messages:?}", entry.name);
            let found = a2lfile::A2lFile::check(&file);
            assert!(found.is_empty(), "{}: {found:?}", entry.name);
            let module = &file.project.module[0];
            let measured = module.measurement.iter().map(|m| m.ecu_address.as_ref().expect("each has one").address);
            let mut places: Vec<u32> = measured.chain(module.characteristic.iter().map(|c| c.address)).collect();
            places.sort_unstable();
            // Without a gap, and the time behind.
            assert!(places.windows(2).all(|pair| pair[0] + 8 == pair[1]), "{}", entry.name);
            assert!(places[0] == fmu::NUMBERS && *places.last().expect("the time") < fmu::EPK);
        }
    }
}
