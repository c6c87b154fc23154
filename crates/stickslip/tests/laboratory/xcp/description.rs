//! Description of the bench for tools.

use std::path::Path;

use a2lfile::{A2lFile, A2lObjectName as _};
use stickslip::xcp::a2l::{Doors, describe};
use stickslip::xcp::{EPK, Layout};

use super::desk::{Master, RATE};

fn parsed(text: &str) -> A2lFile {
    let (file, messages) = a2lfile::load_from_string(text, None, true).unwrap_or_else(|error| panic!("{error}"));
    assert!(messages.is_empty(), "{messages:?}");
    file
}

#[test]
fn a_strict_reader_has_no_complaints() {
    let master = Master::new();
    assert!(master.description.is_ascii());
    let file = parsed(&master.description);
    let found = file.check();
    assert!(found.is_empty(), "{found:?}");
    let module = &file.project.module[0];
    let found = (module.measurement.len(), module.characteristic.len());
    assert_eq!(found, (master.layout.measurements.len(), master.layout.parameters.len()));
    assert!(found.0 > 20 && found.1 > 50, "{found:?}");
    // The blocks of XCP agree with the metalanguage in the file.
    assert!(module.if_data.iter().all(|block| block.ifdata_valid), "of the module");
    let memory = module.mod_par.as_ref().unwrap();
    assert!(memory.memory_segment[0].if_data.iter().all(|block| block.ifdata_valid), "of the segment");
    assert!(module.measurement.iter().all(|m| m.if_data.iter().all(|block| block.ifdata_valid)));
    assert_eq!(memory.epk.as_ref().unwrap().identifier, master.layout.epk);
    assert_eq!(memory.addr_epk[0].address, EPK);
}

#[test]
fn a_block_of_xcp_that_violates_the_metalanguage_is_detected() {
    let wrong = Master::new().description.replace("/begin PAG 1 /end PAG", "/begin PAG one /end PAG");
    let complaints = match a2lfile::load_from_string(&wrong, None, true) {
        Ok((file, messages)) => {
            messages.len() + file.project.module[0].if_data.iter().filter(|block| !block.ifdata_valid).count()
        }
        Err(_) => 1,
    };
    assert!(complaints > 0);
}

#[test]
fn no_two_addresses_overlap_and_every_value_can_be_uploaded() {
    let mut master = Master::connected();
    let file = parsed(&master.description.clone());
    let module = &file.project.module[0];
    let measured = module.measurement.iter().map(|m| (m.get_name(), m.ecu_address.as_ref().unwrap().address));
    let parameters = module.characteristic.iter().map(|c| (c.get_name(), c.address));
    let mut places: Vec<(u32, u32, &str)> = measured.chain(parameters).map(|(name, at)| (at, at + 8, name)).collect();
    places.push((EPK, EPK + master.layout.epk.len() as u32, "EPK"));
    places.sort_unstable();
    for pair in places.windows(2) {
        assert!(pair[0].1 <= pair[1].0, "{pair:?}");
    }
    for (begin, end, name) in &places {
        let command = [&[0xf4, (end - begin) as u8, 0, 0][..], &begin.to_le_bytes()].concat();
        assert_eq!(master.ask(&command)[0], 0xff, "{name}");
    }
    // No two of the same name, of any kind.
    let mut names: Vec<&str> = places.iter().map(|(.., name)| *name).collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
}

#[test]
fn limits_and_units_are_those_of_the_tables() {
    let master = Master::new();
    let file = parsed(&master.description);
    let module = &file.project.module[0];
    for parameter in &master.layout.parameters {
        let cell = &parameter.cell;
        let name = stickslip::xcp::a2l::name(&cell.path);
        let found = module.characteristic.iter().find(|c| c.get_name() == name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(
            (found.lower_limit.to_bits(), found.upper_limit.to_bits()),
            (cell.minimum.to_bits(), cell.maximum.to_bits())
        );
        // ASCII letters only.
        assert!(!found.long_identifier.contains('?') || cell.help.contains('?'), "{}", found.long_identifier);
        let unit = module.compu_method.iter().find(|m| m.get_name() == found.conversion).map(|m| m.unit.as_str());
        assert!(unit.is_none_or(|unit| !unit.contains('?')), "{unit:?}");
    }
    let kind = module.characteristic.iter().find(|c| c.get_name() == "bench.law.kind").unwrap();
    let method = module.compu_method.iter().find(|m| m.get_name() == kind.conversion).unwrap();
    let table = &method.compu_tab_ref.as_ref().unwrap().conversion_table;
    let table = module.compu_vtab.iter().find(|t| t.get_name() == table).unwrap();
    let names: Vec<&str> = table.value_pairs.iter().map(|pair| pair.out_val.as_str()).collect();
    assert_eq!(names[..4], ["paper", "smooth", "karnopp", "bristle"]);
    assert!(module.characteristic.iter().any(|c| c.get_name() == "bench.observer_poles[1]"));
    // The machine itself, and what a running bench cannot change, have no address.
    for fixed in ["plant", "model.encoder", "bench.tick_rate", "bench.plant_step"] {
        assert!(module.characteristic.iter().all(|c| !c.get_name().starts_with(fixed)), "{fixed}");
    }
}

#[test]
fn a_description_of_another_bench_has_another_identification() {
    let (one, other) = (Layout::new(RATE), Layout::new(10_000.0));
    assert_ne!(one.epk, other.epk);
    assert_eq!(one.epk, Layout::new(RATE).epk);
    let doors = Doors { udp: "0.0.0.0:7000".parse().ok(), tcp: None };
    let text = describe(&other, doors);
    assert!(text.contains("XCP_ON_UDP_IP 0x0104 7000 ADDRESS \"127.0.0.1\"") && !text.contains("/begin XCP_ON_TCP_IP"));
    // 100 µs.
    assert!(text.contains("0 DAQ 255 100 3 0"), "the time of a cycle");
}

/// Readers in Python, each in a separate environment since their packages have the same name.
#[test]
fn the_readers_in_python_accept_it() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/a2l.py");
    let folder = tempfile::tempdir().expect("a folder for the description");
    let path = folder.path().join("bench.a2l");
    let master = Master::new();
    std::fs::write(&path, &*master.description).expect("the folder takes files");
    let python = std::env::var("STICKSLIP_PYTHON").unwrap_or_else(|_| "python3".into());
    let there = std::process::Command::new(&python).args(["-c", "import pya2l"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        println!("NOT RUN: pya2l is missing (pip install pya2l, or pya2ldb)");
        return;
    }
    let output = std::process::Command::new(&python).arg(script).arg(&path).output().expect("it has just run");
    let output_text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{output_text} {}", String::from_utf8_lossy(&output.stderr));
    let counts = format!("{} {}", master.layout.measurements.len(), master.layout.parameters.len());
    assert!(output_text.contains(&counts), "{output_text}, not {counts}");
}
