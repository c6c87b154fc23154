//! `stickslip ethercat`: the devices of a segment.

use std::io::Write;

use clap::Subcommand;
use stickslip::BenchError;
use stickslip_fieldbus::{MAIN_DEVICE, ScannedDevice};

use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Action on a segment.
#[derive(Subcommand)]
pub(crate) enum EthercatCommand {
    /// List the devices at a network interface: names, states, process data, and what is missing for the bench. The
    /// devices leave operation; needs the right to open raw sockets.
    #[command(after_help = "Example: stickslip ethercat scan eth0")]
    Scan {
        /// Network interface.
        #[arg(value_name = "INTERFACE")]
        interface: String,
        #[command(flatten)]
        shown: OutputOptions,
    },
}

impl EthercatCommand {
    pub(crate) fn shown(&self) -> OutputOptions {
        let EthercatCommand::Scan { shown, .. } = self;
        *shown
    }

    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let EthercatCommand::Scan { interface, shown } = self;
        let Some(functions) = MAIN_DEVICE else {
            return Err(Failure::Served(BenchError::without_main_device(&interface).to_string()));
        };
        let failed = |reason: &str| Failure::Served(format!("ethercat:{interface}: {reason}"));
        let devices = (functions.scan)(&interface).map_err(|reason| failed(&reason))?;
        if devices.is_empty() {
            return Err(failed("no device answers. Check cable and supply; the IN port of the first device is used."));
        }
        for device in &devices {
            shown.print_line(out, &text(device))?;
        }
        let drives: Vec<_> = devices.iter().filter(|device| device.modes.is_some()).collect();
        let text = match drives[..] {
            [motor, load, ..] => format!(
                "Default: drive motor at position {}, load motor at position {}; a file with [motor] and [load] selects \
                 others.",
                motor.position, load.position
            ),
            _ => format!("{} of 2 drives found. Connect drive motor and load motor.", drives.len()),
        };
        shown.print_line(out, &text)
    }
}

/// A device in some lines.
fn text(device: &ScannedDevice) -> String {
    let ScannedDevice { position, name, vendor, product, revision, state, .. } = device;
    let objects = |objects: &[u16]| match objects {
        [] => "none".into(),
        _ => objects.iter().map(|object| format!("0x{object:04X}")).collect::<Vec<_>>().join(", "),
    };
    let mut text = format!(
        "{position}  {name}  {state}\n   vendor 0x{vendor:08X}, product 0x{product:08X}, revision 0x{revision:08X}\n   \
         outputs {}, inputs {}",
        objects(&device.outputs),
        objects(&device.inputs)
    );
    if let Some(modes) = device.modes {
        text += &format!("\n   modes {}", modes_text(modes));
    }
    for missing in &device.missing {
        text += &format!("\n   {missing}");
    }
    text
}

/// Names of the modes of operation (0x6502).
fn modes_text(modes: u32) -> String {
    let names = ["pp", "vl", "pv", "pt", "", "hm", "ip", "csp", "csv", "cst"];
    let supported = names.iter().enumerate().filter(|(bit, name)| modes & 1 << bit != 0 && !name.is_empty());
    supported.map(|(_, name)| *name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_listed_with_its_modes_and_what_is_missing() {
        let device = ScannedDevice {
            position: 1,
            name: "drive".into(),
            vendor: 2,
            product: 3,
            revision: 4,
            state: "PRE-OP".into(),
            outputs: vec![0x1600],
            inputs: vec![],
            modes: Some(0x0380),
            missing: vec!["no touch probe".into()],
        };
        let text = text(&device);
        for part in ["1  drive  PRE-OP", "outputs 0x1600, inputs none", "csp, csv, cst", "no touch probe"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
