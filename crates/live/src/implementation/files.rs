//! Files of the implementation, for download.

use crate::xcp::Layout;
use crate::xcp::a2l;
use crate::{Live, Shared};
use stickslip_base::Error;
use stickslip_generate::Generated;
use stickslip_generate::archive::archive;

/// A2L description for measurement and calibration tools.
const DESCRIPTION: &str = "bench.a2l";

impl Live {
    /// A file of the running software: `tick.zip` with the whole project in C, each file of it, `bench.a2l`.
    ///
    /// # Errors
    /// [`Error::Unknown`] for an unknown name; errors of the software's design.
    pub fn implementation_file(&self, name: &str) -> Result<Vec<u8>, Error> {
        let Shared { parameters, implementation, links, .. } = &*self.shared;
        if name == DESCRIPTION {
            let layout = Layout::with(parameters.rate(), &self.entries());
            return Ok(a2l::describe(&layout, links.doors()).into_bytes());
        }
        let generated = implementation.generated(&parameters.tuning())?;
        let archive = format!("{}.zip", generated.prefix);
        if name == archive {
            return packed(&generated);
        }
        generated.text(name).map(|text| text.as_bytes().to_vec()).ok_or_else(|| Error::Unknown {
            what: "file of the implementation",
            name: name.into(),
            remedy: {
                let names = generated.files.iter().map(|file| &*file.0).chain([&*archive, DESCRIPTION]);
                format!("Available: {}.", names.collect::<Vec<_>>().join(", "))
            },
        })
    }
}

fn packed(generated: &Generated) -> Result<Vec<u8>, Error> {
    let files = generated.files.iter().map(|(name, text)| (format!("{}/{name}", generated.prefix), text.as_bytes()));
    archive("tick.zip", files)
}
