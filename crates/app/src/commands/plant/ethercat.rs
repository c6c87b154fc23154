//! The virtual machine behind emulated servo drives.

use std::io::{self, ErrorKind, Write};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use stickslip::bench::MachineWithDrives;
use stickslip::{Preset, Watch};
use stickslip_fieldbus::{DriveSheet, FIXED_MAPPING, Segment, Server};

use super::{PlantCommand, faults};
use crate::failure::Failure;

const FAULT: &str = "Write position, entry of object 0x2020 and value, for example: 0 1 0x4210";

impl PlantCommand {
    /// Serves the drives until the watch is cancelled, or with `--once` until they have been in OP and have left it.
    pub(super) fn serve_drives(
        &self,
        interface: &str,
        preset: &Preset<f64>,
        out: &mut dyn Write,
        watch: &Watch,
    ) -> Result<(), Failure> {
        let machine = MachineWithDrives::new(preset, self.seed)?;
        let mut sheets = DriveSheet::of_bench(machine.ratings(), preset.plant.drive.inertia());
        if self.segment.fixed_mapping {
            sheets.iter_mut().for_each(|sheet| sheet.fixed_mapping = Some(FIXED_MAPPING));
        }
        let sheets = &sheets[..usize::from(self.segment.drives).min(sheets.len())];
        let mut segment = Segment::new(sheets, self.segment.analog.into(), Box::new(machine));
        segment.delay_set_points(self.segment.torque_delay);
        let jitter = Duration::from_micros(self.segment.frame_jitter.into());
        let mut server = Server::bind(interface, segment, jitter).map_err(|error| refusal(interface, &error))?;
        self.shown.print_line(out, &format!("ethercat:{interface}"))?;
        let (mut last, mut printed, mut was_operational) = (Vec::new(), Ok(()), false);
        let requests = self.segment.faults.then(faults::requests);
        server
            .serve(|segment| {
                for request in requests.iter().flat_map(Receiver::try_iter) {
                    match request {
                        Ok((position, entry, value)) => segment.request_fault(position, entry, value),
                        Err(line) => printed = self.shown.print_line(out, &format!("Not a fault: {line}. {FAULT}")),
                    }
                }
                let states = segment.states();
                if !states.iter().map(|(_, state)| *state).eq(last.iter().copied()) {
                    let text: Vec<String> = states.iter().map(|(name, state)| format!("{name}: {state}")).collect();
                    printed = self.shown.print_line(out, &text.join(", "));
                    last = states.iter().map(|(_, state)| *state).collect();
                }
                // Only drives have a watchdog: an input stays in OP when its main device ends.
                let is_operational = last.iter().take(sheets.len()).any(|state| *state == "OP");
                let ends = self.once && was_operational && !is_operational;
                was_operational |= is_operational;
                watch.check().is_ok() && printed.is_ok() && !ends
            })
            .map_err(|error| Failure::Served(format!("{interface}: {error}. Switch the interface on again.")))?;
        printed?;
        let counters = server.segment().counters();
        let text = format!(
            "{} frames, {} datagrams, {} frames lost on request, {} steps of the machine, {} left out.",
            counters.frames, counters.datagrams, counters.lost, counters.steps, counters.skipped
        );
        self.shown.print_line(out, &text)
    }
}

fn refusal(interface: &str, error: &io::Error) -> Failure {
    let remedy = match error.kind() {
        ErrorKind::PermissionDenied => "Raw sockets need the capability CAP_NET_RAW: run as root.",
        _ => "`ip link` lists the interfaces; `ip link set NAME up` switches one on.",
    };
    Failure::Served(format!("{interface}: {error}. {remedy}"))
}
