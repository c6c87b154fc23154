//! `stickslip serve`: the bench by the clock, for terminals, scripts and browsers at once.

use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use clap::Args;
use stickslip::Watch;
use stickslip::bench::remote::Address;
use stickslip::bench::{Cpu, keep_off};
use stickslip::external::{ExternalFile, Role};
use stickslip::live::{Live, Start};

use super::load::HowLoaded;
use super::xcp::XcpDoors;
use crate::failure::Failure;
use crate::serve::{Client, Patience, Place, Server};
use crate::shown::Shown;
use crate::source::{self, Setting};

/// Which bench, and where.
#[derive(Args)]
pub(crate) struct ServeCommand {
    /// Where it listens; port 0 takes a free one. Who can reach the address and has the token can move the axis. Without
    /// it: 127.0.0.1:9740, or a free port where that one is taken.
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Folder of runs and parameter sets; other terminals find the bench by it.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT)]
    project: PathBuf,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Run a machine in another process or on a board, as `stickslip plant` serves one; the preset says what is believed
    /// of it.
    #[arg(long, value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT", conflicts_with = "seed")]
    io: Option<Address>,
    /// A controller of one's own in the loop beside the preset's, as `stickslip load` takes one: a shared library, an FMU,
    /// or a function in Python. It controls first; its numbers are parameters (loaded.NAME) like all others, and
    /// position_controller says who controls.
    #[arg(long, value_name = "FILE")]
    controller: Option<PathBuf>,
    /// A friction of one's own instead: the load motor gives its torque, beside the preset's law, which makes the load as
    /// frictionless as it can. rendered_friction says which friction is rendered.
    #[arg(long, value_name = "FILE")]
    friction: Option<PathBuf>,
    /// A rendering law of one's own instead: its torque is all of the load motor's. rendering_law says which law renders.
    #[arg(long, value_name = "FILE")]
    law: Option<PathBuf>,
    /// Value of a parameter of that file; may be given several times.
    #[arg(long, value_name = "NAME=VALUE", visible_alias = "controller-set")]
    loaded_set: Vec<Setting>,
    #[command(flatten)]
    how: HowLoaded,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Run the loop on this CPU alone, awake a little before each deadline, and everything else of the program on the
    /// others.
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    /// Record every cycle into this file (MDF 4), which other tools read and `stickslip replay` replays.
    #[arg(long, value_name = "FILE.mf4")]
    record: Option<PathBuf>,
    #[command(flatten)]
    xcp: XcpDoors,
    /// Stop what runs where the operator is silent for so long [s]; each call is a sign of life.
    #[arg(long, value_name = "S")]
    operator_time: Option<f64>,
    /// End after so many seconds instead of at Ctrl-C.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

impl ServeCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let source = source::read(&self.preset, settings)?;
        if let Ok(place) = Place::find(&self.project)
            && Client::at(place.clone()).status().is_ok()
        {
            return Err(Failure::Served(format!(
                "a bench is served for {} already, at {}. End it, or name another folder by --project.",
                self.project.display(),
                place.address
            )));
        }
        let loaded = loaded([self.controller, self.friction, self.law], self.how, &self.loaded_set)?;
        let (record, operator_time) = (self.record.clone(), self.operator_time);
        let new = Start::new(source, &self.project);
        let mut start = Start { seed: self.seed, io: self.io, loaded, record, operator_time, ..new };
        if let Some(cpu) = self.cpu {
            // Each thread that is started from here on inherits it.
            keep_off(cpu).map_err(|error| {
                Failure::Served(format!("cannot leave CPU {cpu} to the loop ({error}). Leave --cpu out."))
            })?;
            start.wishes.cpu = Cpu::Number(cpu);
        }
        let live = Live::start(start)?;
        let refused = live.refused();
        let listen = self.listen.map_or(LISTEN.to_vec(), |address| vec![address]);
        let mut server = Server::start(live, &listen, &self.project, Patience::default()).map_err(|error| {
            Failure::Served(format!(
                "cannot listen at {} for {} ({error}). Another bench may be served there: name another address by \
                 --listen, port 0 takes a free one.",
                listen[0],
                self.project.display()
            ))
        })?;
        // The one line that scripts read, whatever else is to be shown.
        writeln!(out, "{}", server.place.url())?;
        out.flush()?;
        let wanted = self.xcp.doors();
        let doors = server.open_xcp(wanted).map_err(|error| {
            Failure::Served(format!(
                "cannot open the bench to XCP ({error}). Another program may listen there: name another address behind \
                 --xcp-udp or --xcp-tcp, port 0 takes a free one."
            ))
        })?;
        for (transport, door) in [("UDP", doors.udp), ("TCP", doors.tcp)] {
            if let Some(address) = door {
                self.shown
                    .say(out, &format!("XCP on {transport}: {address}, for whoever reaches it; there is no token."))?;
            }
        }
        for warning in refused {
            self.shown.say(out, &format!("Note: {warning}"))?;
        }
        let project = self.project.display();
        self.shown.say(out, &format!("Another terminal: stickslip status --project {project}. Ctrl-C ends it."))?;
        let looks = self.seconds.map_or(u64::MAX, |seconds| (seconds / LOOK.as_secs_f64()).max(0.0) as u64);
        for _ in 0..looks {
            if watch.check().is_err() {
                break;
            }
            thread::sleep(LOOK);
        }
        let Some(clocked) = server.stop() else { return Ok(()) };
        let mut summary = stickslip::Summary::new("serve");
        clocked.tell(&mut summary);
        self.shown.show(out, &summary, |out| {
            for line in clocked.table().lines() {
                writeln!(out, "  {line}")?;
            }
            for warning in clocked.warnings() {
                writeln!(out, "Note: {warning}")?;
            }
            Ok(())
        })
    }
}

/// The file that is to be in the loop, of one for each role.
fn loaded(
    files: [Option<PathBuf>; Role::ALL.len()],
    how: HowLoaded,
    values: &[Setting],
) -> Result<Option<ExternalFile>, Failure> {
    let mut named = Role::ALL.into_iter().zip(files).filter_map(|(role, file)| Some((role, file?)));
    let Some((role, file)) = named.next() else {
        if how.is_said() || !values.is_empty() {
            let told = "--trust, --map and --loaded-set say how a file is opened. Name one: --controller FILE, --friction \
                        FILE or --law FILE.";
            return Err(Failure::Served(told.into()));
        }
        return Ok(None);
    };
    if let Some((other, _)) = named.next() {
        return Err(Failure::Served(format!(
            "--{role} and --{other}: one file at a time is in the loop. Leave one of them out; what the preset has in its \
             place is in the loop beside the other."
        )));
    }
    Ok(Some(how.of(file, role, values)?))
}

/// Where it listens unless it is told: the first that is free.
const LISTEN: [SocketAddr; 2] = [address(9740), address(0)];
/// From look to look at Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

const fn address(port: u16) -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}
