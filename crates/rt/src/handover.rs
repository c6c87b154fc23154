//! An open file for another process, through a socket between the two.

use std::fs::File;
use std::io::{Error, ErrorKind, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;

use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer, SendAncillaryMessage, SendFlags,
    recvmsg, sendmsg,
};

/// Gives a file to whoever is at the other end; both have it then.
///
/// # Errors
/// What the system refuses.
pub fn hand_over(socket: &UnixStream, file: &File) -> Result<(), Error> {
    let files = [file.as_fd()];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut beside = SendAncillaryBuffer::new(&mut space);
    beside.push(SendAncillaryMessage::ScmRights(&files));
    // It comes beside a byte.
    sendmsg(socket, &[IoSlice::new(&[0])], &mut beside, SendFlags::empty())?;
    Ok(())
}

/// Takes the file that the other end has handed over.
///
/// # Errors
/// Where the next byte comes without one, or nobody is there.
pub fn take_over(socket: &UnixStream) -> Result<File, Error> {
    #[cfg(target_os = "linux")]
    const FLAGS: RecvFlags = RecvFlags::CMSG_CLOEXEC;
    #[cfg(not(target_os = "linux"))]
    const FLAGS: RecvFlags = RecvFlags::empty();
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut beside = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0];
    recvmsg(socket, &mut [IoSliceMut::new(&mut byte)], &mut beside, FLAGS)?;
    let file = beside.drain().find_map(|message| match message {
        RecvAncillaryMessage::ScmRights(mut files) => files.next(),
        _ => None,
    });
    file.map(File::from).ok_or_else(|| Error::new(ErrorKind::UnexpectedEof, "no file came with it"))
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Seek as _, SeekFrom, Write as _};

    use super::*;

    #[test]
    fn a_file_that_was_handed_over_is_the_same_file() {
        let (mut one, other) = UnixStream::pair().expect("sockets");
        let mut file = tempfile::tempfile().expect("a file");
        hand_over(&one, &file).expect("it goes");
        let mut taken = take_over(&other).expect("it comes");
        taken.write_all(b"there").expect("it takes words");
        let mut text = String::new();
        file.seek(SeekFrom::Start(0)).expect("it goes back");
        file.read_to_string(&mut text).expect("it reads");
        assert_eq!(text, "there");
        one.write_all(b"x").expect("it goes");
        assert!(take_over(&other).expect_err("a byte alone").to_string().contains("no file"));
        drop(one);
        take_over(&other).expect_err("nobody is there");
    }
}
