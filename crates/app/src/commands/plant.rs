//! `stickslip plant`: the virtual machine for a bench in another process.

use std::io::Write;

use clap::Args;
use stickslip::Watch;
use stickslip::bench::remote::{Address, PlantServer};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Machine and address.
#[derive(Args)]
pub(crate) struct PlantCommand {
    /// Address; port 0 selects a free one. Anyone who can reach the address can control the machine.
    #[arg(long, value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT")]
    io: Address,
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

impl PlantCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let preset = source::preset(&self.preset, settings)?;
        let mut server = PlantServer::bind(&self.io, &preset, self.seed)?;
        self.shown.print_line(out, &server.address().to_string())?;
        let served = server.serve(self.once, watch)?;
        let text = format!("{} benches, {} ticks, {} frames refused.", served.sessions, served.ticks, served.refused);
        self.shown.print_line(out, &text)
    }
}
