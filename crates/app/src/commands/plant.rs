//! `stickslip plant`: the virtual machine for a bench in another process, or behind emulated drives on EtherCAT.

#[cfg(target_os = "linux")]
mod ethercat;
#[cfg(target_os = "linux")]
mod faults;

use std::io::Write;

use clap::Args;
use stickslip::bench::remote::{Address, PlantServer};
use stickslip::{Preset, Watch};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Machine and address.
#[derive(Args)]
pub(crate) struct PlantCommand {
    /// Address; port 0 selects a free one. Anyone who can reach the address can control the machine.
    #[arg(long, value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT", required_unless_present = "ethercat")]
    io: Option<Address>,
    /// Network interface: the machine is served as emulated servo drives (CiA 402) for any EtherCAT main device. A test
    /// tool without claim of conformance; Linux only, with the right to open raw sockets.
    #[arg(long, value_name = "INTERFACE", conflicts_with = "io")]
    ethercat: Option<String>,
    #[command(flatten)]
    segment: SegmentOptions,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Seed of the noise, the same for each bench that connects.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// End when the first bench disconnects.
    #[arg(long)]
    once: bool,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

/// Devices of an emulated segment.
#[derive(Args)]
struct SegmentOptions {
    /// Number of drives: 1 is the drive motor, 2 the load motor also.
    #[arg(long, value_name = "N", default_value_t = 2, conflicts_with = "io", value_parser = clap::value_parser!(u8).range(1..=2))]
    drives: u8,
    /// Number of analogue inputs; the first has the accelerometer, the others read zero.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "io", value_parser = clap::value_parser!(u8).range(0..=4))]
    analog: u8,
    /// The process data of the drives cannot be mapped: they have gaps, a torque limit and set-points of other modes, and
    /// no touch probe.
    #[arg(long, conflicts_with = "io")]
    fixed_mapping: bool,
    /// Delay of the torque in cycles.
    #[arg(long, value_name = "CYCLES", default_value_t = 0, conflicts_with = "io", value_parser = clap::value_parser!(u8).range(0..=64))]
    torque_delay: u8,
    /// Read faults from standard input, one a line: position of the device, entry of object 0x2020, value.
    #[arg(long, conflicts_with = "io")]
    faults: bool,
    /// Largest additional delay of a frame in microseconds, at random.
    #[arg(long, value_name = "MICROSECONDS", default_value_t = 0, conflicts_with = "io")]
    frame_jitter: u32,
}

impl PlantCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let preset = source::preset(&self.preset, settings)?;
        match (&self.io, &self.ethercat) {
            (_, Some(interface)) => self.serve_drives(interface, &preset, out, watch),
            (Some(address), None) => self.serve_bench(address, &preset, out, watch),
            (None, None) => Err(Failure::Served("no address: use --io or --ethercat".into())),
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn serve_drives(&self, _: &str, _: &Preset<f64>, _: &mut dyn Write, _: &Watch) -> Result<(), Failure> {
        Err(Failure::Served("emulated drives need raw sockets of Linux. Use --io on this system.".into()))
    }

    fn serve_bench(
        &self,
        address: &Address,
        preset: &Preset<f64>,
        out: &mut dyn Write,
        watch: &Watch,
    ) -> Result<(), Failure> {
        let mut server = PlantServer::bind(address, preset, self.seed)?;
        self.shown.print_line(out, &server.address().to_string())?;
        let served = server.serve(self.once, watch)?;
        let text = format!("{} benches, {} ticks, {} frames refused.", served.sessions, served.ticks, served.refused);
        self.shown.print_line(out, &text)
    }
}
