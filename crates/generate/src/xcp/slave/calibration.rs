//! Memory and pages: the commands of CAL/PAG.

use super::*;
use crate::xcp::SIZE;
use crate::xcp::pages::{REFERENCE, WORKING};
use stickslip_base::parameters::Fault;
use stickslip_bench::BenchError;

/// The only segment.
const SEGMENT: u8 = 0;

/// Code of the reason to refuse a change; `denied` is the code of the bench, if it has one.
pub(super) fn refusal(error: &Error, denied: Option<Refusal>) -> Refusal {
    if let Some(denied) = denied {
        return denied;
    }
    if let Some(BenchError::NotWhileRunning { .. }) = error.of() {
        return Refusal::WriteProtected;
    }
    match error {
        // A parameter of a variant that is not chosen.
        Error::Parameters(faults) if faults.problems.iter().any(|p| matches!(p.fault, Fault::OtherVariant { .. })) => {
            Refusal::AccessDenied
        }
        Error::BenchFault { .. } => Refusal::Generic,
        _ => Refusal::OutOfRange,
    }
}

impl Slave {
    pub(super) fn calibrate(&mut self, code: u8, command: Command<'_>, bench: &dyn Bench) -> Result<Outcome> {
        let answer = match code {
            // SET_MTA, UPLOAD, SHORT_UPLOAD
            0xf6 => {
                self.pointer = Pointer::Address(address(command, 3)?);
                Response::ok()
            }
            0xf5 => {
                let count = length(command, 1)?;
                Response::ok().bytes(&self.upload(bench, count)?)
            }
            0xf4 => {
                let count = length(command, 1)?;
                self.pointer = Pointer::Address(address(command, 3)?);
                Response::ok().bytes(&self.upload(bench, count)?)
            }
            // BUILD_CHECKSUM: CRC-32
            0xf3 => {
                let count = command.long(4)? as usize;
                let mut sum = flate2::Crc::new();
                sum.update(&self.upload(bench, count)?);
                Response::ok().bytes(&[9]).word(0).long(sum.sum())
            }
            // DOWNLOAD, SHORT_DOWNLOAD
            0xf0 => return self.download(bench, command.bytes(2, length(command, 1)?)?),
            0xed => {
                let bytes = command.bytes(8, length(command, 1)?)?;
                self.pointer = Pointer::Address(address(command, 3)?);
                return self.download(bench, bytes);
            }
            0xeb => return self.set_page(command, bench),
            0xea => self.page(command)?,
            // GET_PAG_PROCESSOR_INFO: one segment, which cannot be frozen.
            0xe9 => Response::ok().bytes(&[1, 0]),
            0xe8 => self.segment(command)?,
            0xe7 => page_info(command)?,
            0xe4 => return self.copy_page(command, bench),
            _ => return Err(Refusal::Unknown),
        };
        Ok(Outcome::Answer(answer))
    }

    /// Reads `count` bytes at the pointer and advances it.
    fn upload(&mut self, bench: &dyn Bench, count: usize) -> Result<Vec<u8>> {
        match &mut self.pointer {
            Pointer::Nowhere => Err(Refusal::Sequence),
            Pointer::Text(text, at) => {
                let end = at.checked_add(count).ok_or(Refusal::AccessDenied)?;
                let bytes = text.as_bytes().get(*at..end).ok_or(Refusal::AccessDenied)?.to_vec();
                *at = end;
                Ok(bytes)
            }
            &mut Pointer::Address(at) => {
                let bytes = self.bytes(bench, at, count)?;
                self.pointer = Pointer::Address(at + count as u32);
                Ok(bytes)
            }
        }
    }

    fn download(&mut self, bench: &dyn Bench, bytes: &[u8]) -> Result<Outcome> {
        let Pointer::Address(at) = self.pointer else { return Err(Refusal::Sequence) };
        // An unreadable address cannot be written either.
        self.bytes(bench, at, bytes.len())?;
        if self.layout.parameter_at(at).is_none() {
            return Err(Refusal::WriteProtected);
        }
        if self.pages.master != WORKING {
            return Err(Refusal::WriteProtected);
        }
        self.pointer = Pointer::Address(at + bytes.len() as u32);
        let layout = self.layout.clone();
        Ok(match self.pages.write(&layout, bench, at, bytes) {
            Ok(change) => later(change, Then::Nothing),
            Err(error) => Outcome::Refused(error),
        })
    }

    /// `SET_CAL_PAGE`
    fn set_page(&mut self, command: Command<'_>, bench: &dyn Bench) -> Result<Outcome> {
        let (mode, page) = (command.byte(1)?, command.byte(3)?);
        if mode & 0x80 == 0 && command.byte(2)? != SEGMENT {
            return Err(Refusal::SegmentNotValid);
        }
        if mode & 3 == 0 || mode & !0x83 != 0 {
            return Err(Refusal::ModeNotValid);
        }
        if page > REFERENCE {
            return Err(Refusal::PageNotValid);
        }
        let (of_bench, of_master) = (mode & 1 != 0, mode & 2 != 0);
        let before = self.layout.values(&bench.in_force());
        let then = Then::Page { page, of_master, before: of_bench.then_some(before) };
        match self.pages.switching(&self.layout, bench, page).filter(|_| of_bench) {
            None => {
                self.follow(then);
                Ok(Outcome::Answer(Response::ok()))
            }
            Some(change) => Ok(Outcome::Later(change, then)),
        }
    }

    /// Completes a command after its change.
    pub(super) fn follow(&mut self, then: Then) {
        let Then::Page { page, of_master, before } = then else { return };
        if of_master {
            self.pages.master = page;
        }
        if let Some(before) = before {
            self.pages.switched(page, before);
        }
    }

    /// `GET_CAL_PAGE`
    fn page(&self, command: Command<'_>) -> Result<Response> {
        if command.byte(2)? != SEGMENT {
            return Err(Refusal::SegmentNotValid);
        }
        let page = match command.byte(1)? {
            1 => self.pages.bench(),
            2 => self.pages.master,
            _ => return Err(Refusal::ModeNotValid),
        };
        Ok(Response::ok().bytes(&[0, 0, page]))
    }

    /// `GET_SEGMENT_INFO`
    fn segment(&self, command: Command<'_>) -> Result<Response> {
        if command.byte(2)? != SEGMENT {
            return Err(Refusal::SegmentNotValid);
        }
        let basic = |value: u32| Response::ok().bytes(&[0, 0, 0]).long(value);
        match (command.byte(1)?, command.byte(3).unwrap_or(0)) {
            (0, 0) => Ok(basic(PARAMETERS)),
            (0, 1) => Ok(basic(SIZE * self.layout.parameters.len() as u32)),
            // Two pages; extension 0, no mapping, neither compressed nor encrypted.
            (1, _) => Ok(Response::ok().bytes(&[2, 0, 0, 0, 0])),
            _ => Err(Refusal::OutOfRange),
        }
    }

    /// `COPY_CAL_PAGE`: copies the reference to the working set.
    fn copy_page(&mut self, command: Command<'_>, bench: &dyn Bench) -> Result<Outcome> {
        if (command.byte(1)?, command.byte(3)?) != (SEGMENT, SEGMENT) {
            return Err(Refusal::SegmentNotValid);
        }
        match (command.byte(2)?, command.byte(4)?) {
            (REFERENCE, WORKING) => {
                let layout = self.layout.clone();
                Ok(later(self.pages.reset(&layout, bench), Then::Nothing))
            }
            (WORKING | REFERENCE, REFERENCE) => Err(Refusal::WriteProtected),
            (WORKING, WORKING) => Ok(Outcome::Answer(Response::ok())),
            _ => Err(Refusal::PageNotValid),
        }
    }
}

fn later(change: Option<Change>, then: Then) -> Outcome {
    change.map_or_else(|| Outcome::Answer(Response::ok()), |change| Outcome::Later(change, then))
}

/// `GET_PAGE_INFO`: both pages can be read and run at any time, the working page can also be written.
fn page_info(command: Command<'_>) -> Result<Response> {
    match (command.byte(2)?, command.byte(3)?) {
        (SEGMENT, WORKING) => Ok(Response::ok().bytes(&[0x3f, 0])),
        (SEGMENT, REFERENCE) => Ok(Response::ok().bytes(&[0x0f, 0])),
        (SEGMENT, _) => Err(Refusal::PageNotValid),
        _ => Err(Refusal::SegmentNotValid),
    }
}

/// An address after its extension, which is 0.
fn address(command: Command<'_>, at: usize) -> Result<u32> {
    let address = command.long(at + 1)?;
    if command.byte(at)? == 0 { Ok(address) } else { Err(Refusal::AccessDenied) }
}

/// A number of bytes that fits into a packet.
fn length(command: Command<'_>, at: usize) -> Result<usize> {
    match usize::from(command.byte(at)?) {
        0 => Err(Refusal::OutOfRange),
        count if count < MAX_CTO => Ok(count),
        _ => Err(Refusal::OutOfRange),
    }
}
