//! Untrustworthy archives.

use std::io::{Cursor, Write as _};

use zip::write::{SimpleFileOptions, ZipWriter};

use super::*;

/// Its refusal.
fn refused(path: &Path, limits: Limits) -> String {
    Controller::open_within(path, Role::Controller, &[], None, limits).map(drop).expect_err("it is refused")
}

#[test]
fn a_file_that_is_not_an_fmu_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let of = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        refused(&path, Limits::default())
    };
    assert!(of("text.fmu", b"no archive").contains("invalid zip archive"));
    assert!(of("empty.fmu", b"").contains("invalid zip archive"));
    let whole = fs::read(servo(folder.path(), 2, 0)).unwrap();
    assert!(of("half.fmu", &whole[..whole.len() / 2]).contains("invalid zip archive"));
    // The kind is detected by the first bytes, not by the name.
    let renamed = folder.path().join("servo.so.zip");
    fs::write(&renamed, &whole).unwrap();
    assert!(External::trusted_as(&renamed, Role::Controller, &map(&MAP)).is_ok());
    // A changed byte in the compressed library.
    let mut flipped = whole.clone();
    let middle = whole.len() / 2;
    flipped[middle] ^= 0x55;
    let path = folder.path().join("flipped.fmu");
    fs::write(&path, flipped).unwrap();
    let message =
        Controller::open(&path, Role::Controller, &map(&MAP), None).map(drop).expect_err("its checksum is another");
    assert!(message.contains("cannot be unpacked"), "{message}");
    let other = packed(folder.path(), "other.fmu", &[("readme.txt", b"hello")]);
    assert!(refused(&other, Limits::default()).contains("has no modelDescription.xml"));
}

#[test]
fn names_outside_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let described = description(2, SIMULATION);
    for name in ["../evil.so", "resources/../../evil", "/etc/evil", "resources\\..\\..\\evil", "C:\\evil"] {
        let path = packed(folder.path(), "out.fmu", &[("modelDescription.xml", described.as_bytes()), (name, b"x")]);
        let message = refused(&path, Limits::default());
        assert!(message.contains("would be written outside the target folder"), "{name}: {message}");
    }
    assert!(!folder.path().join("evil.so").exists());
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file("modelDescription.xml", SimpleFileOptions::default()).unwrap();
    zip.write_all(description(2, SIMULATION).as_bytes()).unwrap();
    zip.start_file(library_path(2), SimpleFileOptions::default()).unwrap();
    zip.add_symlink("resources/link", "/etc/passwd", SimpleFileOptions::default()).unwrap();
    let path = folder.path().join("link.fmu");
    fs::write(&path, zip.finish().unwrap().into_inner()).unwrap();
    let message = Controller::open(&path, Role::Controller, &map(&MAP), None).map(drop).expect_err("a link");
    assert!(message.contains("resources/link is a link"), "{message}");
}

#[test]
fn an_archive_that_is_too_large_is_refused_in_bounded_memory() {
    let folder = tempfile::tempdir().unwrap();
    let (described, library) = (description(2, SIMULATION), library_path(2));
    let zeros = vec![0; 1 << 20];
    let files: [(&str, &[u8]); 3] =
        [("modelDescription.xml", described.as_bytes()), (&library, &zeros), ("resources/zeros", &zeros)];
    let path = packed(folder.path(), "bomb.fmu", &files);
    // A million zeros compress to a thousand bytes.
    assert!(fs::metadata(&path).unwrap().len() < 20_000);
    let opened = |limits| {
        Controller::open_within(&path, Role::Controller, &map(&MAP), None, limits).map(drop).expect_err("no library")
    };
    let few = Limits { unpacked: 1 << 20, ..Limits::default() };
    assert!(opened(few).contains("unpacked it is larger than 1048576 bytes"));
    assert!(opened(Limits { archive: 100, ..Limits::default() }).contains("the maximum is 100"));
    assert!(opened(Limits { files: 2, ..Limits::default() }).contains("has 3 files; the maximum is 2"));
    assert!(opened(Limits { description: 50, ..Limits::default() }).contains("is longer than 50 bytes"));
    // Within the limits it is unpacked, and zeros are not a library.
    assert!(opened(Limits::default()).contains("its library cannot be opened"));
}

#[test]
fn the_folder_of_an_fmu_is_removed_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = servo(folder.path(), 3, 0);
    let trusted = Controller::open(&path, Role::Controller, &map(&MAP), None).unwrap();
    let there = trusted._folder.path().to_owned();
    assert!(there.join("resources/table.txt").exists());
    drop(trusted);
    assert!(!there.exists());
}
