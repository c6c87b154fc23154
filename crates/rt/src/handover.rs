//! Transfer of an open file to another process through a socket.

use std::fs::File;
use std::io::{Error, ErrorKind, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;

use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer, SendAncillaryMessage, SendFlags,
    recvmsg, sendmsg,
};

/// Sends an open file to the other end; both ends then have it open.
///
/// # Errors
/// Errors of the operating system.
pub fn hand_over(socket: &UnixStream, file: &File) -> Result<(), Error> {
    let files = [file.as_fd()];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut ancillary = SendAncillaryBuffer::new(&mut space);
    ancillary.push(SendAncillaryMessage::ScmRights(&files));
    // A file is sent together with a byte.
    sendmsg(socket, &[IoSlice::new(&[0])], &mut ancillary, SendFlags::empty())?;
    Ok(())
}

/// Receives the file that the other end has sent.
///
/// # Errors
/// The next byte comes without a file, or the other end is closed.
pub fn take_over(socket: &UnixStream) -> Result<File, Error> {
    #[cfg(target_os = "linux")]
    const FLAGS: RecvFlags = RecvFlags::CMSG_CLOEXEC;
    #[cfg(not(target_os = "linux"))]
    const FLAGS: RecvFlags = RecvFlags::empty();
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut ancillary = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0];
    recvmsg(socket, &mut [IoSliceMut::new(&mut byte)], &mut ancillary, FLAGS)?;
    let file = ancillary.drain().find_map(|message| match message {
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
        let mut received = take_over(&other).expect("it comes");
        received.write_all(b"there").expect("it takes words");
        let mut text = String::new();
        file.seek(SeekFrom::Start(0)).expect("it goes back");
        file.read_to_string(&mut text).expect("it reads");
        assert_eq!(text, "there");
        one.write_all(b"x").expect("it goes");
        assert!(take_over(&other).expect_err("a byte alone").to_string().contains("no file"));
        drop(one);
        take_over(&other).expect_err("the other end is closed");
    }
}
