//! The oldest GNU C library with which a shared library loads, from the versions of the symbols that it needs.

use std::fmt;

use object::Endianness;
use object::read::elf::ElfFile64;

/// A version of the GNU C library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Glibc(u32, u32);

impl Glibc {
    /// The version of the oldest systems for which libraries are made: RHEL 7 (2014) and all later ones.
    pub const EARLY: Self = Glibc(2, 17);

    /// The oldest version with which a library loads; `None` for a library that does not use it, or is not in ELF.
    pub(super) fn needed_by(library: &[u8]) -> Option<Self> {
        let file = ElfFile64::<Endianness>::parse(library).ok()?;
        let (endian, sections) = (file.endian(), file.elf_section_table());
        let (needs, link) = sections.gnu_verneed(endian, library).ok()??;
        let names = sections.strings(endian, library, link).ok()?;
        let versions = needs.flatten().flat_map(|(_, versions)| versions.flatten());
        versions.filter_map(|version| Glibc::named(version.name(endian, names).ok()?)).max()
    }

    /// The consequence of a version that early systems do not have, and the remedy.
    pub fn note(self) -> Option<String> {
        (self > Glibc::EARLY).then(|| {
            format!(
                "the library needs glibc {self} and does not load on systems with an earlier one (ldd --version). For such a \
                 system compile the FMU there, with this command or `python -m fmpy compile FILE.fmu`, or name a \
                 cross-compiler for it in the variable CC."
            )
        })
    }

    /// The version of a symbol: `GLIBC_2.2.5`.
    fn named(version: &[u8]) -> Option<Self> {
        let numbers = std::str::from_utf8(version).ok()?.strip_prefix("GLIBC_")?;
        if numbers == "ABI_DT_RELR" {
            // A format of relocations that is read from this version on.
            return Some(Glibc(2, 36));
        }
        let mut numbers = numbers.split('.').map(|number| number.parse().ok());
        Some(Glibc(numbers.next()??, numbers.next()??))
    }
}

impl fmt::Display for Glibc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.0, self.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_of_symbols_are_compared_as_numbers() {
        for (name, version) in [
            ("GLIBC_2.2.5", Some(Glibc(2, 2))),
            ("GLIBC_2.17", Some(Glibc::EARLY)),
            ("GLIBC_2.34", Some(Glibc(2, 34))),
            ("GLIBC_ABI_DT_RELR", Some(Glibc(2, 36))),
            ("GLIBC_PRIVATE", None),
            ("GCC_3.0", None),
        ] {
            assert_eq!(Glibc::named(name.as_bytes()), version, "{name}");
        }
        assert!(Glibc(2, 2) < Glibc::EARLY && Glibc(2, 9) < Glibc::EARLY && Glibc(2, 34) > Glibc::EARLY);
    }

    #[test]
    fn a_library_for_later_systems_only_is_noted() {
        let note = Glibc(2, 34).note().expect("a later version");
        assert!(note.starts_with("the library needs glibc 2.34") && note.contains("CC"), "{note}");
        assert_eq!(Glibc::EARLY.note(), None);
    }

    #[test]
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    fn the_version_is_read_from_a_program_and_not_from_other_files() {
        let program = std::fs::read(std::env::current_exe().expect("this program")).expect("its file");
        assert!(Glibc::needed_by(&program) >= Some(Glibc::EARLY), "the standard library of Rust needs 2.17");
        assert_eq!(Glibc::needed_by(&program[..program.len() / 2]), None);
        assert_eq!(Glibc::needed_by(b"MZ"), None);
    }
}
