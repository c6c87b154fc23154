use super::*;

/// Both ends of a shared memory in a separate folder.
fn ends() -> (tempfile::TempDir, String, Mailbox, Mailbox) {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("axis").display().to_string();
    let machine = Mailbox::open(&name, Side::Machine).unwrap();
    let software = Mailbox::open(&name, Side::Software).unwrap();
    (folder, name, machine, software)
}

fn received(end: &mut Mailbox) -> Option<Vec<u8>> {
    let mut bytes = [0; LONGEST];
    end.receive(&mut bytes).ok().map(|length| bytes[..length].to_vec())
}

#[test]
fn frames_come_whole_once_and_in_order_in_both_directions() {
    let (_folder, _, mut machine, mut software) = ends();
    for length in 0..=LONGEST {
        let bytes: Vec<u8> = (0..length).map(|k| (k * 7 + length) as u8).collect();
        software.send(&bytes).unwrap();
        machine.send(&bytes[..length / 2]).unwrap();
        assert_eq!(received(&mut machine).unwrap(), bytes);
        assert_eq!(received(&mut software).unwrap(), bytes[..length / 2]);
        assert_eq!((received(&mut machine), received(&mut software)), (None, None));
    }
}

#[test]
fn a_full_ring_loses_only_the_next_frame() {
    let (_folder, _, mut machine, mut software) = ends();
    let sent = (0..20).map(|k| software.send(&[k])).filter(Result::is_ok).count();
    assert_eq!(sent, FRAMES as usize);
    assert!(software.send(&[0; LONGEST + 1]).is_err());
    let came: Vec<_> = std::iter::from_fn(|| received(&mut machine)).collect();
    assert_eq!(came, (0..8).map(|k| vec![k]).collect::<Vec<_>>());
    assert!(software.send(&[9]).is_ok());
}

#[test]
fn a_side_in_use_is_refused() {
    let (_folder, name, machine, software) = ends();
    let refused = |side| Mailbox::open(&name, side).unwrap_err().to_string();
    assert!(refused(Side::Machine).contains("another process serves a machine at this address"));
    assert!(refused(Side::Software).contains("another bench uses the machine"));
    drop(software);
    drop(Mailbox::open(&name, Side::Software).unwrap());
    drop(machine);
    assert_eq!(Mailbox::open(&name, Side::Software).unwrap_err().kind(), ErrorKind::NotFound);
}

/// Files of a killed process, without locks.
fn abandoned(name: &str, content: &[u8]) {
    let path = Address::file(name);
    for path in [bench_file(&path), path] {
        open_private(&path, true).unwrap();
        std::fs::write(&path, content).unwrap();
    }
}

#[test]
fn files_of_a_killed_process_are_detected_and_reset() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("axis").display().to_string();
    // Empty, random, and a ring with invalid counts.
    let mut words = [0u64; WORDS];
    (words[0], words[COUNTS[0][0]], words[COUNTS[1][1]]) = (MARK, 1000, 3);
    let claims: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    for content in [vec![], vec![0xA5; 8 * WORDS], claims] {
        abandoned(&name, &content);
        let ended = Mailbox::open(&name, Side::Software).unwrap_err();
        assert!(ended.to_string().contains("the machine at this address has ended"), "{ended}");
        let mut machine = Mailbox::open(&name, Side::Machine).unwrap();
        let mut software = Mailbox::open(&name, Side::Software).unwrap();
        assert_eq!((received(&mut machine), received(&mut software)), (None, None));
        software.send(b"one").unwrap();
        machine.send(b"two").unwrap();
        assert_eq!((received(&mut machine), received(&mut software)), (Some(b"one".into()), Some(b"two".into())));
    }
}

#[test]
fn a_restarted_machine_finds_the_waiting_bench() {
    let (_folder, name, machine, mut software) = ends();
    drop(machine);
    // The bench fills the ring meanwhile.
    (0..20).for_each(|_| drop(software.send(b"old")));
    let mut machine = Mailbox::open(&name, Side::Machine).unwrap();
    assert_eq!(received(&mut machine), None, "frames for its predecessor are skipped");
    software.send(b"new").unwrap();
    assert_eq!(received(&mut machine), Some(b"new".into()));
}

#[cfg(unix)]
#[test]
fn the_memory_is_accessible_only_for_its_user() {
    use std::os::unix::fs::PermissionsExt as _;
    let (_folder, name, machine, software) = ends();
    for path in [Address::file(&name), bench_file(&Address::file(&name))] {
        assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, 0o600, "{}", path.display());
    }
    drop(software);
    std::fs::set_permissions(Address::file(&name), std::fs::Permissions::from_mode(0o660)).unwrap();
    let refused = Mailbox::open(&name, Side::Software).unwrap_err().to_string();
    assert!(refused.contains("other users have access") && refused.contains("chmod 600"), "{refused}");
    drop(machine);
}

#[test]
fn an_unknown_memory_is_refused() {
    let (_folder, name, _machine, software) = ends();
    software.word(0).store(MARK + 1, Ordering::Release);
    drop(software);
    let refused = Mailbox::open(&name, Side::Software).unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::InvalidData, "{refused}");
}
