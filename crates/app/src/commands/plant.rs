//! `stickslip plant`: the virtual machine for a bench in another process.

use std::io::Write;

use clap::Args;
use stickslip::Watch;
use stickslip::bench::remote::{Address, PlantServer};

use crate::failure::Failure;
use crate::shown::Shown;
use crate::source::{self, Setting};

/// Which machine, and where.
#[derive(Args)]
pub(crate) struct PlantCommand {
    /// Where it is reached; port 0 takes a free one. Who can reach the address can run the machine.
    #[arg(long, value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT")]
    io: Address,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Seed of the noise: each bench that begins gets it from its start.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// End with the first bench.
    #[arg(long)]
    once: bool,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

impl PlantCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let preset = source::preset(&self.preset, settings)?;
        let mut server = PlantServer::bind(&self.io, &preset, self.seed)?;
        self.shown.say(out, &server.address().to_string())?;
        let served = server.serve(self.once, watch)?;
        let text = format!("{} benches, {} ticks, {} frames refused.", served.sessions, served.ticks, served.refused);
        self.shown.say(out, &text)
    }
}
