//! Files of what runs, for whoever takes them along.

use std::net::SocketAddr;

use crate::xcp::Layout;
use crate::xcp::a2l::{self, Doors};
use crate::{Live, lock};
use stickslip_base::Error;
use stickslip_generate::Generated;
use stickslip_generate::archive::archive;

/// The description for measurement and calibration tools.
const DESCRIPTION: &str = "bench.a2l";

impl Live {
    /// A file of what runs, by its name: `tick.zip` with the whole project in C, each file of it, `bench.a2l`.
    ///
    /// # Errors
    /// [`Error::Unknown`] for a name that is none of them; what the design of the software refuses.
    pub fn implementation_file(&self, name: &str) -> Result<Vec<u8>, Error> {
        if name == DESCRIPTION {
            let layout = Layout::with(self.in_force().bench.tick_rate, &self.entries());
            return Ok(a2l::describe(&layout, self.doors()).into_bytes());
        }
        let generated = self.generated()?;
        let archive = format!("{}.zip", generated.prefix);
        if name == archive {
            return packed(&generated);
        }
        generated.text(name).map(|text| text.as_bytes().to_vec()).ok_or_else(|| Error::Unknown {
            what: "file of the implementation",
            name: name.into(),
            remedy: generated
                .files
                .iter()
                .map(|file| &*file.0)
                .chain([&*archive, DESCRIPTION])
                .collect::<Vec<_>>()
                .join(", "),
        })
    }

    /// Where the bench is open to measurement and calibration tools.
    fn doors(&self) -> Doors {
        let known = lock(&self.shared.xcp);
        let door = |transport: &str| -> Option<SocketAddr> {
            known.iter().find(|one| one.transport == transport)?.address.parse().ok()
        };
        Doors { udp: door("udp"), tcp: door("tcp") }
    }
}

fn packed(generated: &Generated) -> Result<Vec<u8>, Error> {
    let files = generated.files.iter().map(|(name, text)| (format!("{}/{name}", generated.prefix), text.as_bytes()));
    archive("tick.zip", files)
}
