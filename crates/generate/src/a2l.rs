//! The description of generated code for calibration tools: where the numbers of a block are in the memory of a processor.
//!
//! ASAP2 1.61 in one file, as [`crate::xcp::a2l`] writes it of a running bench. Each struct of a block is a row of numbers of
//! one kind, so that the place of a number follows from where its struct begins. That is known once the program is linked:
//! it is read from the ELF file, or tools take it from there by `SYMBOL_LINK`.

use crate::GenerateError;
use std::path::Path;

use object::{Object as _, ObjectSection as _, ObjectSymbol as _, SymbolKind};
use stickslip_codegen::c;
use stickslip_codegen::record::Program;
use stickslip_codegen::tree::Tree;
use stickslip_core::fields::{Field, Kind};

use super::{Precision, code};
use crate::xcp::a2l::{Conversions, about, name, quoted};
use crate::xcp::{Cell, Content};
use stickslip_base::{Error, Preset};

/// The structs of a block, and what their groups are called.
pub const STRUCTS: [&str; 4] = ["parameters", "state", "input", "output"];
/// Where an address space begins that nobody has linked: the RAM of most microcontrollers.
const BASE: u64 = 0x2000_0000;

/// The variables of a program that hold a block.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Variables<'a> {
    /// Their names, in the order of [`STRUCTS`]; `PREFIX_parameters` and so on unless given.
    pub names: [Option<String>; 4],
    /// The linked program; without it they lie one behind the other from 0x20000000 on, and tools must link them.
    pub program: Option<&'a Path>,
}

/// A description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CodeDescription {
    /// The text.
    pub text: String,
    /// Name and first address of each struct that has numbers.
    pub variables: Vec<(String, u64)>,
    /// Numbers that can be measured.
    pub measurements: usize,
    /// Numbers that can be changed.
    pub parameters: usize,
}

/// One struct in memory.
pub(super) struct Placed<'a> {
    pub(super) group: &'static str,
    pub(super) tree: &'a Tree,
    pub(super) symbol: String,
    pub(super) address: u64,
}

/// Describes the code of a block, as [`generate`](super::generate()) makes it.
///
/// # Errors
/// As [`generate`](super::generate()); [`GenerateError::Program`] where a variable is not in the program, or is not as long as its struct, or where the
/// program says that it has other code.
pub fn code_description(
    block: &str,
    preset: &Preset<f64>,
    precision: Precision,
    prefix: Option<&str>,
    variables: &Variables,
) -> Result<CodeDescription, Error> {
    let made = code(block, preset, precision, prefix)?;
    describe(&made.program, &made.prefix, precision, variables)
}

/// Describes the code of a program that is called `prefix`.
///
/// # Errors
/// [`GenerateError::Program`].
pub(super) fn describe(
    program: &Program,
    prefix: &str,
    precision: Precision,
    variables: &Variables,
) -> Result<CodeDescription, Error> {
    let (size, kind, _) = numbers(precision);
    let top = program.steps.last().expect("a program has at least the block itself");
    let symbols = variables.program.map(Symbols::read).transpose()?;
    let mut next = BASE;
    let mut placed = Vec::new();
    for ((group, tree), given) in
        STRUCTS.into_iter().zip([&top.parameters, &top.state, &top.input, &top.output]).zip(&variables.names)
    {
        let bytes = size * tree.numbers() as u64;
        let symbol = given.clone().unwrap_or_else(|| format!("{prefix}_{group}"));
        let address = match &symbols {
            _ if bytes == 0 => continue,
            Some(symbols) => symbols.address(&symbol, bytes, group)?,
            None => next,
        };
        next += bytes;
        placed.push(Placed { group, tree, symbol, address });
    }
    let epk = epk(program, prefix, precision)?;
    let addressed = match &symbols {
        Some(symbols) => symbols.epk(&format!("{prefix}_epk"), &epk)?,
        None => None,
    };
    let addressed = addressed.map_or_else(String::new, |at| format!(" ADDR_EPK {at:#x}"));
    let order = if symbols.is_some_and(|it| !it.little) { "MSB_FIRST" } else { "MSB_LAST" };
    let Objects { text: objects, counts } =
        objects(&placed, precision, |placed, offset| format!("SYMBOL_LINK {} {offset}", quoted(&placed.symbol)));
    let version = env!("CARGO_PKG_VERSION");
    let text = format!(
        "ASAP2_VERSION 1 61\n/begin PROJECT {prefix} \"Code written by stickslip\"\n  \
         /begin MODULE {prefix} {help}\n    \
         /begin MOD_COMMON \"\" BYTE_ORDER {order} ALIGNMENT_BYTE 1 ALIGNMENT_WORD 2 ALIGNMENT_LONG 4 \
         ALIGNMENT_FLOAT32_IEEE 4 ALIGNMENT_FLOAT64_IEEE 8 /end MOD_COMMON\n    \
         /begin MOD_PAR \"\" VERSION \"{version}\"{addressed} EPK {epk} /end MOD_PAR\n    \
         /begin RECORD_LAYOUT number FNC_VALUES 1 {kind} ROW_DIR DIRECT /end RECORD_LAYOUT\n\
         {objects}  /end MODULE\n/end PROJECT\n",
        epk = quoted(&epk),
        help = quoted(top.help.lines().next().unwrap_or_default()),
    );
    let variables = placed.into_iter().map(|it| (it.symbol, it.address)).collect();
    Ok(CodeDescription { text, variables, measurements: counts[0], parameters: counts[1] })
}

/// Which code a block is written as.
fn epk(program: &Program, prefix: &str, precision: Precision) -> Result<String, Error> {
    let code = match precision {
        Precision::Double => c::print::<f64>(program, prefix),
        Precision::Single => c::print::<f32>(program, prefix),
    };
    Ok(code.map_err(GenerateError::NoIdentifier)?.epk)
}

/// Bytes of a number, its kind, the largest.
fn numbers(precision: Precision) -> (u64, &'static str, f64) {
    match precision {
        Precision::Double => (8, "FLOAT64_IEEE", f64::MAX),
        Precision::Single => (4, "FLOAT32_IEEE", f64::from(f32::MAX)),
    }
}

/// What is measured and changed, with its conversions and groups.
pub(super) struct Objects {
    pub(super) text: String,
    /// How many measurements, and how many parameters.
    pub(super) counts: [usize; 2],
}

/// Describes structs; `more` is said of each measurement and parameter, by its struct and how many bytes it is into it.
pub(super) fn objects(placed: &[Placed], precision: Precision, more: impl Fn(&Placed, u64) -> String) -> Objects {
    let (size, kind, largest) = numbers(precision);
    let mut conversions = Conversions::default();
    let (mut objects, mut groups, mut counts) = (String::new(), String::new(), [0; 2]);
    for it in placed {
        let Placed { group, tree, address, .. } = it;
        let mut names = Vec::new();
        for (index, (path, field)) in tree.leaves().into_iter().enumerate() {
            let offset = size * index as u64;
            let cell = cell(format!("{group}.{path}"), address + offset, field, largest);
            let (conversion, called, said) = (conversions.of(&cell), name(&cell.path), about(&cell));
            let (at, limits) = (address + offset, format!("{:?} {:?}", cell.minimum, cell.maximum));
            let more = more(it, offset);
            if *group == STRUCTS[0] {
                counts[1] += 1;
                objects += &format!(
                    "    /begin CHARACTERISTIC {called} {said} VALUE {at:#x} number 0 {conversion} {limits} {more} \
                     /end CHARACTERISTIC\n"
                );
            } else {
                counts[0] += 1;
                objects += &format!(
                    "    /begin MEASUREMENT {called} {said} {kind} {conversion} 0 0 {limits} ECU_ADDRESS {at:#x} {more} \
                     /end MEASUREMENT\n"
                );
            }
            names.push(called);
        }
        let what = if *group == STRUCTS[0] { "REF_CHARACTERISTIC" } else { "REF_MEASUREMENT" };
        groups += &format!(
            "    /begin GROUP {group} \"\" ROOT /begin {what}\n      {}\n    /end {what} /end GROUP\n",
            names.join("\n      ")
        );
    }
    Objects { text: conversions.text + &objects + &groups, counts }
}

fn cell(path: String, address: u64, field: &'static Field, largest: f64) -> Cell {
    let content = match field.kind {
        Kind::Real => Content::Real,
        Kind::Whole => Content::Whole,
        Kind::Flag => Content::Flag,
    };
    Cell {
        path,
        // A tool takes no longer one; the text has it whole.
        address: u32::try_from(address).unwrap_or(u32::MAX),
        symbol: field.symbol,
        unit: if field.unit.is_empty() { "1" } else { field.unit },
        help: field.help,
        minimum: field.minimum.max(-largest),
        maximum: field.maximum.min(largest),
        content,
    }
}

/// The variables of a linked program.
struct Symbols {
    path: std::path::PathBuf,
    bytes: Vec<u8>,
    /// Name, address, bytes.
    known: Vec<(String, u64, u64)>,
    little: bool,
}

impl Symbols {
    fn read(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(|source| Error::file(path, "read", source))?;
        let program = object::File::parse(&*bytes).map_err(|error| GenerateError::Program {
            path: path.into(),
            reason: format!("it cannot be read ({error})"),
            remedy: "Give the linked program as ELF file, with its table of symbols (not stripped).",
        })?;
        let known = program
            .symbols()
            .filter(|it| it.is_definition() && it.kind() == SymbolKind::Data)
            .filter_map(|it| Some((it.name().ok()?.to_owned(), it.address(), it.size())))
            .collect();
        let little = program.is_little_endian();
        Ok(Symbols { path: path.into(), bytes, known, little })
    }

    /// Where the program says which code it has; `None` if it does not. `Err` if that is other code.
    fn epk(&self, symbol: &str, epk: &str) -> Result<Option<u64>, Error> {
        let Some((_, address, size)) = self.known.iter().find(|known| known.0 == symbol) else { return Ok(None) };
        let program = object::File::parse(&*self.bytes).ok();
        let sections = program.iter().flat_map(|program| program.sections());
        let said = sections.filter_map(|section| section.data_range(*address, *size).ok().flatten()).next();
        let said = said.unwrap_or_default().strip_suffix(b"\0").unwrap_or_default();
        if said != epk.as_bytes() {
            return Err(GenerateError::Program {
                path: self.path.clone(),
                reason: format!("it has the code \"{}\", this describes \"{epk}\"", said.escape_ascii()),
                remedy: "Build it with the files that are generated now, of the same preset and precision.",
            }
            .into());
        }
        Ok(Some(*address))
    }

    /// The address of a variable that is to be so long.
    fn address(&self, symbol: &str, bytes: u64, group: &'static str) -> Result<u64, Error> {
        let wrong = |reason, remedy| GenerateError::Program { path: self.path.clone(), reason, remedy };
        let Some((_, address, size)) = self.known.iter().find(|known| known.0 == symbol) else {
            let known = self.known.iter().map(|known| known.0.as_str());
            let near = stickslip_base::parameters::schema::nearest(symbol, known)
                .map_or_else(String::new, |near| format!(", but {near}"));
            let reason = format!("it has no variable {symbol} for the {group}{near}");
            return Err(wrong(reason, "Name it: --variable parameters=NAME, and state, input, output alike.").into());
        };
        if *size != bytes {
            let reason = format!("{symbol} has {size} bytes, the {group} of the block {bytes}");
            return Err(wrong(
                reason,
                "Is it of this block, of the same preset, and double or float as here (--single)?",
            )
            .into());
        }
        if address.checked_add(bytes).is_none_or(|end| end > u64::from(u32::MAX)) {
            let reason = format!("{symbol} is at {address:#x}, beyond the 32 bits of an address in ASAP2 1.61");
            return Err(wrong(reason, "Link it for the target, or on a computer without -pie.").into());
        }
        Ok(*address)
    }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use a2lfile::A2lObjectName as _;

    use super::*;
    use stickslip_base::parameters::presets;

    fn preset() -> Preset<f64> {
        presets::find("clm-bench").and_then(|source| source.read()).expect("a preset of the product")
    }

    fn strict(text: &str) -> a2lfile::A2lFile {
        let (file, messages) = a2lfile::load_from_string(text, None, true).unwrap_or_else(|error| panic!("{error}"));
        assert!(messages.is_empty(), "{messages:?}");
        let found = a2lfile::A2lFile::check(&file);
        assert!(found.is_empty(), "{found:?}");
        file
    }

    #[test]
    fn a_strict_reader_has_nothing_to_say_of_any_block_and_no_addresses_overlap() {
        for entry in super::super::blocks() {
            for (precision, size) in [(Precision::Double, 8), (Precision::Single, 4)] {
                let made = code_description(entry.name, &preset(), precision, None, &Variables::default());
                let made = made.unwrap_or_else(|error| panic!("{}: {error}", entry.name));
                assert!(made.text.is_ascii(), "{}", entry.name);
                let file = strict(&made.text);
                let module = &file.project.module[0];
                assert_eq!(
                    (module.measurement.len(), module.characteristic.len()),
                    (made.measurements, made.parameters)
                );
                let measured = module.measurement.iter().map(|m| m.ecu_address.as_ref().expect("each has one").address);
                let mut places: Vec<u32> = measured.chain(module.characteristic.iter().map(|c| c.address)).collect();
                places.sort_unstable();
                assert!(places.windows(2).all(|pair| pair[0] + size <= pair[1]), "{}", entry.name);
            }
        }
    }

    /// A program with a block in it.
    fn linked(folder: &Path, precision: Precision) -> std::path::PathBuf {
        let made = code("pid", &preset(), precision, None).expect("a block of the catalogue");
        made.write(folder).expect("the folder takes files");
        let main = "#include \"pid.h\"\npid_parameters pid_parameters_;\nstatic pid_state axis_state;\n\
                    pid_input pid_input_;\npid_output pid_output_;\nint main(void) {\n    \
                    pid_parameters_init(&pid_parameters_);\n    pid_init(&axis_state);\n    \
                    return (int)pid_step(&pid_parameters_, &axis_state, &pid_input_, 1e-3, &pid_output_);\n}\n";
        std::fs::write(folder.join("linked.c"), main).expect("the folder takes files");
        let output = Command::new("cc")
            .args(["-no-pie", "-o", "linked", "linked.c", "pid.c", "-lm"])
            .current_dir(folder)
            .output()
            .expect("a C compiler");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        folder.join("linked")
    }

    fn names() -> [Option<String>; 4] {
        ["pid_parameters_", "axis_state", "pid_input_", "pid_output_"].map(|name| Some(name.into()))
    }

    #[test]
    fn addresses_are_those_of_the_linked_program() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = linked(folder.path(), Precision::Double);
        let variables = Variables { names: names(), program: Some(&path) };
        let made = code_description("pid", &preset(), Precision::Double, None, &variables).expect("all is there");
        let output = Command::new("nm").arg(&path).output().expect("nm comes with the compiler");
        let said = String::from_utf8(output.stdout).expect("text");
        let address = |symbol: &str| {
            let line = said.lines().find(|line| line.ends_with(&format!(" {symbol}"))).expect("the linker has it");
            u64::from_str_radix(&line[..16], 16).expect("an address")
        };
        for (symbol, at) in &made.variables {
            assert_eq!(*at, address(symbol), "{symbol}");
        }
        let file = strict(&made.text);
        let memory = file.project.module[0].mod_par.as_ref().expect("it is described");
        assert_eq!(u64::from(memory.addr_epk[0].address), address("pid_epk"));
        // The third of the state: ω_f.
        let third = file.project.module[0].measurement.iter().find(|m| m.get_name() == "state.filtered_velocity");
        let third = third.and_then(|m| m.ecu_address.as_ref()).expect("it is described").address;
        assert_eq!(u64::from(third), address("axis_state") + 16);
    }

    #[test]
    fn what_is_not_in_the_program_or_has_another_size_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = linked(folder.path(), Precision::Double);
        let refused = |precision, names, program: &Path| {
            let variables = Variables { names, program: Some(program) };
            code_description("pid", &preset(), precision, None, &variables).expect_err("refused").to_string()
        };
        let message = refused(Precision::Double, Default::default(), &path);
        assert!(message.contains("no variable pid_parameters for the parameters, but pid_parameters_."), "{message}");
        let message = refused(Precision::Single, names(), &path);
        assert!(message.contains("has 64 bytes, the parameters of the block 32"), "{message}");
        let message = refused(Precision::Double, names(), &folder.path().join("pid.c"));
        assert!(message.contains("pid.c") && message.contains("ELF"), "{message}");
        assert!(refused(Precision::Double, names(), &folder.path().join("none")).contains("none"));
    }

    #[test]
    fn a_program_that_has_other_code_is_refused_and_one_that_does_not_say_gets_no_address() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = linked(folder.path(), Precision::Double);
        let epk = code("pid", &preset(), Precision::Double, None).expect("a block of the catalogue");
        let epk = self::epk(&epk.program, "pid", Precision::Double).expect("a good name");
        let mut bytes = std::fs::read(&path).expect("it was linked");
        let at = bytes.windows(epk.len()).position(|window| window == epk.as_bytes()).expect("the program says it");
        let described = || {
            let variables = Variables { names: names(), program: Some(&path) };
            code_description("pid", &preset(), Precision::Double, None, &variables)
        };
        bytes[at + epk.len() - 1] ^= 1;
        std::fs::write(&path, &bytes).expect("it can be written");
        let message = described().expect_err("another code").to_string();
        assert!(message.contains("it has the code \"stickslip ") && message.contains(&epk), "{message}");
        // A linker that was not told to keep it leaves the name out.
        let symbol = bytes.windows(8).position(|window| window == b"\0pid_epk").expect("its name is in the table");
        bytes[symbol + 1] = b'q';
        std::fs::write(&path, &bytes).expect("it can be written");
        let text = described().expect("all that is described is there").text;
        assert!(!text.contains("ADDR_EPK") && text.contains(&epk), "{text}");
    }
}
