//! A raw socket for the EtherCAT frames of a network interface.

#![expect(unsafe_code, reason = "system calls that std lacks")]

use std::ffi::CString;
use std::fs::File;
use std::io::{Error, ErrorKind, Read as _, Result, Write as _};
use std::os::fd::{AsRawFd as _, FromRawFd as _};
use std::time::Duration;

use crate::frame::ETHER_TYPE;

/// A socket that is bound to an interface.
#[derive(Debug)]
pub(crate) struct Socket {
    file: File,
}

/// Sets the real-time priority of the calling thread.
pub(crate) fn raise_priority(priority: u8) -> Result<()> {
    // SAFETY: takes nothing.
    let thread = unsafe { libc::syscall(libc::SYS_gettid) };
    stickslip_bench::hurry(thread as u32, priority)
}

fn result(status: libc::c_int) -> Result<libc::c_int> {
    if status < 0 { Err(Error::last_os_error()) } else { Ok(status) }
}

impl Socket {
    pub(crate) fn open(interface: &str) -> Result<Self> {
        let name = CString::new(interface).map_err(|_| Error::from(ErrorKind::InvalidInput))?;
        // SAFETY: the name is a string with its end.
        let index = unsafe { libc::if_nametoindex(name.as_ptr()) };
        if index == 0 {
            return Err(Error::last_os_error());
        }
        let protocol = ETHER_TYPE.to_be();
        let kind = libc::SOCK_RAW | libc::SOCK_CLOEXEC;
        // SAFETY: takes numbers.
        let descriptor = result(unsafe { libc::socket(libc::AF_PACKET, kind, protocol.into()) })?;
        // SAFETY: the descriptor is new and open, and owned by nothing else.
        let file = unsafe { File::from_raw_fd(descriptor) };
        // Frames that this process sends must not come back to it.
        let on: libc::c_int = 1;
        // SAFETY: the pointer is valid for the given size.
        result(unsafe {
            libc::setsockopt(
                descriptor,
                libc::SOL_PACKET,
                libc::PACKET_IGNORE_OUTGOING,
                (&raw const on).cast(),
                size_of_val(&on) as libc::socklen_t,
            )
        })?;
        // SAFETY: an address is numbers, of which zero is valid.
        let mut address: libc::sockaddr_ll = unsafe { std::mem::zeroed() };
        address.sll_family = libc::AF_PACKET as libc::c_ushort;
        address.sll_protocol = protocol;
        address.sll_ifindex = index as libc::c_int;
        let size = size_of_val(&address) as libc::socklen_t;
        // SAFETY: the pointer is valid for the given size.
        result(unsafe { libc::bind(descriptor, (&raw const address).cast(), size) })?;
        Ok(Socket { file })
    }

    /// Waits for a frame; `None` after the time.
    pub(crate) fn receive(&mut self, frame: &mut [u8], within: Duration) -> Result<Option<usize>> {
        let mut waiting = libc::pollfd { fd: self.file.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        let time = libc::timespec { tv_sec: within.as_secs() as _, tv_nsec: within.subsec_nanos() as _ };
        // SAFETY: the pointers are valid for one `pollfd` and one `timespec`; no mask of signals.
        match result(unsafe { libc::ppoll(&raw mut waiting, 1, &raw const time, std::ptr::null()) }) {
            Ok(0) => Ok(None),
            Err(error) if error.kind() == ErrorKind::Interrupted => Ok(None),
            Err(error) => Err(error),
            Ok(_) => self.file.read(frame).map(Some),
        }
    }

    pub(crate) fn send(&mut self, frame: &[u8]) -> Result<()> {
        self.file.write(frame).map(|_| ())
    }
}
