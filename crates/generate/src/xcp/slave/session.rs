//! Commands of every session: connection, identification, and reading of bytes.

use super::*;
use crate::xcp::{EPK, MAX_DTO, MEASUREMENTS, VERSION};

impl Slave {
    pub(super) fn dispatch(&mut self, code: u8, command: Command<'_>, bench: &dyn Bench) -> Result<Outcome> {
        let answer = match code {
            0xff => self.connect(bench),
            0xfe => {
                self.end(bench);
                Response::ok()
            }
            0xfd => self.status(),
            // No block mode, no queue; driver 1.0.
            0xfb => Response::ok().bytes(&[0, 0, 0, 0, 0, 0, 0x10]),
            0xfa => self.identify(command)?,
            0xc0 => match command.byte(1)? {
                0 => Response::ok().bytes(&[0]).bytes(&VERSION).bytes(&VERSION),
                _ => return Err(Refusal::Unknown),
            },
            0xe4..=0xf6 => return self.calibrate(code, command, bench),
            0xc7 | 0xd3..=0xe2 => self.measure(code, command, bench)?,
            _ => return Err(Refusal::Unknown),
        };
        Ok(Outcome::Answer(answer))
    }

    fn connect(&mut self, bench: &dyn Bench) -> Response {
        self.end(bench);
        self.connected = true;
        // Calibration with pages, measurement; optional modes can be queried; bytes, little-endian.
        Response::ok().bytes(&[0x01 | 0x04, 0x80, MAX_CTO as u8]).word(MAX_DTO as u16).bytes(&[1, 1])
    }

    fn status(&self) -> Response {
        let running = if self.is_measuring() { 0x40 } else { 0 };
        Response::ok().bytes(&[running, 0, 0]).word(0)
    }

    /// `GET_ID`: the text is uploaded.
    fn identify(&mut self, command: Command<'_>) -> Result<Response> {
        let text: Arc<str> = match command.byte(1)? {
            0 => concat!("stickslip ", env!("CARGO_PKG_VERSION")).into(),
            1 => "stickslip".into(),
            4 => self.description.clone(),
            5 => self.layout.epk.as_str().into(),
            // No text of this kind.
            _ => "".into(),
        };
        let length = text.len() as u32;
        self.pointer = Pointer::Text(text, 0);
        Ok(Response::ok().bytes(&[0]).word(0).long(length))
    }

    /// Bytes at an address: of the identification, a parameter, the newest measurements.
    pub(super) fn bytes(&self, bench: &dyn Bench, address: u32, count: usize) -> Result<Vec<u8>> {
        let layout = &*self.layout;
        let (begin, all) = match address {
            EPK.. => (EPK, layout.epk.clone().into_bytes()),
            PARAMETERS..EPK => (PARAMETERS, self.pages.bytes(layout, bench)),
            MEASUREMENTS..PARAMETERS => {
                let (cycle, row) = bench.newest();
                let all = std::iter::once(cycle as f64).chain(row);
                (MEASUREMENTS, all.flat_map(f64::to_le_bytes).collect())
            }
            _ => return Err(Refusal::AccessDenied),
        };
        let begin = (address - begin) as usize;
        let end = begin.checked_add(count).ok_or(Refusal::AccessDenied)?;
        all.get(begin..end).map(<[u8]>::to_vec).ok_or(Refusal::AccessDenied)
    }
}
