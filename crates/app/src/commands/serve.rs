//! `stickslip serve`: the bench in real time, for terminals, scripts and browsers.

use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use clap::Args;
use stickslip::Watch;
use stickslip::bench::remote::Address;
use stickslip::bench::{Cpu, TimingReport, keep_off};
use stickslip::external::{ExternalFile, Role};
use stickslip::live::{Live, RECORD_LIMIT, Start};

use super::load::ExternalOptions;
use super::xcp::XcpDoors;
use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::serve::{Client, HostName, Known, Origin, Place, Server, Timeouts};
use crate::source::{self, Setting};

/// Bench, address and project.
#[derive(Args)]
pub(crate) struct ServeCommand {
    /// Address of the server; port 0 selects a free one. Anyone who can reach the address and has the token can move the
    /// axis [default: 127.0.0.1:9740, or a free port if that is in use].
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Name of this computer by which a browser or tunnel reaches the bench; may be given several times. Names that are
    /// not given are refused, except localhost.
    #[arg(long, value_name = "NAME")]
    host: Vec<HostName>,
    /// Address of a proxy, for example with TLS, by which a browser reaches the bench; may be given several times.
    #[arg(long, value_name = "URL")]
    origin: Vec<Origin>,
    /// Project folder for runs and parameter sets; other commands find the running bench by it.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT)]
    project: PathBuf,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Address of a machine in another process or on a board (see `stickslip plant`), or of two servo drives on EtherCAT
    /// with a file that describes them; the preset is the controller's model of the machine.
    #[arg(
        long,
        value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT|ethercat:INTERFACE[,FILE]",
        conflicts_with = "seed"
    )]
    io: Option<Address>,
    /// External controller, as for `stickslip load`: a shared library, an FMU, or a function in Python. It is active at
    /// the start; the parameter position_controller selects it or the preset's controller. Its own parameters are
    /// loaded.NAME.
    #[arg(long, value_name = "FILE")]
    controller: Option<PathBuf>,
    /// External friction: the load motor renders its torque; the preset's law compensates the friction of the load. The
    /// parameter rendered_friction selects it or the preset's desired friction.
    #[arg(long, value_name = "FILE")]
    friction: Option<PathBuf>,
    /// External rendering law: it gives the whole torque of the load motor. The parameter rendering_law selects it or the
    /// preset's law.
    #[arg(long, value_name = "FILE")]
    law: Option<PathBuf>,
    /// Value of a parameter of the external file; may be given several times.
    #[arg(long, value_name = "NAME=VALUE", visible_alias = "controller-set")]
    loaded_set: Vec<Setting>,
    #[command(flatten)]
    external: ExternalOptions,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Run the loop alone on this CPU, awake shortly before each deadline, and all other threads of the program on the
    /// others.
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    /// Record every cycle into this file (MDF 4), for other tools and `stickslip replay`.
    #[arg(long, value_name = "FILE.mf4")]
    record: Option<PathBuf>,
    /// Limit of the records of measurements in the project [GB]: every measurement is recorded, and the oldest records
    /// are removed first; results stay. 0 records none.
    #[arg(long, value_name = "GB", default_value_t = RECORD_LIMIT as f64 * 1e-9)]
    record_limit: f64,
    #[command(flatten)]
    xcp: XcpDoors,
    /// Stop the running motion or measurement after this time without a call of the operator [s].
    #[arg(long, value_name = "S")]
    operator_time: Option<f64>,
    /// End after this time [s] instead of at Ctrl-C.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl ServeCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let source = source::read(&self.preset, settings)?;
        check_free(&self.project)?;
        let loaded = external_file([self.controller, self.friction, self.law], self.external, &self.loaded_set)?;
        let (record, operator_time) = (self.record.clone(), self.operator_time);
        let new = Start::new(source, &self.project);
        // Negative numbers and NaN become 0.
        let record_limit = (self.record_limit * 1e9) as u64;
        let fieldbus = super::open_fieldbus();
        let mut start =
            Start { seed: self.seed, io: self.io, fieldbus, loaded, record, record_limit, operator_time, ..new };
        if let Some(cpu) = self.cpu {
            // Threads that are started later inherit it.
            keep_off(cpu).map_err(|error| {
                Failure::Served(format!("cannot reserve CPU {cpu} for the loop ({error}). Omit --cpu."))
            })?;
            start.thread_settings.cpu = Cpu::Number(cpu);
        }
        let live = Live::start(start)?;
        let warnings = live.refused();
        let listen = self.listen.map_or(LISTEN.to_vec(), |address| vec![address]);
        let known = Known { hosts: self.host, origins: self.origin };
        let mut server = Server::start(live, &listen, known, &self.project, Timeouts::default()).map_err(|error| {
            Failure::Served(format!(
                "cannot listen at {} for {} ({error}). If another bench uses this address, choose another one with \
                 --listen; port 0 selects a free one.",
                listen[0],
                self.project.display()
            ))
        })?;
        // Scripts read this line: it is printed also with --quiet and --json.
        writeln!(out, "{}", server.place.url())?;
        out.flush()?;
        let doors = server.open_xcp(self.xcp.doors()).map_err(|error| {
            Failure::Served(format!(
                "cannot open the address for XCP ({error}). If another program uses it, choose another one with \
                 --xcp-udp or --xcp-tcp; port 0 selects a free one."
            ))
        })?;
        for (transport, door) in [("UDP", doors.udp), ("TCP", doors.tcp)] {
            if let Some(address) = door {
                self.shown.print_line(
                    out,
                    &format!(
                        "XCP on {transport}: {address}, open to anyone who can reach this address: XCP has no token."
                    ),
                )?;
            }
        }
        for warning in warnings {
            self.shown.print_line(out, &format!("Note: {warning}"))?;
        }
        let project = self.project.display();
        self.shown.print_line(
            out,
            &format!("In another terminal: stickslip status --project {project}. Ctrl-C ends the bench."),
        )?;
        let polls = self.seconds.map_or(u64::MAX, |seconds| (seconds / POLL_INTERVAL.as_secs_f64()).max(0.0) as u64);
        for _ in 0..polls {
            if watch.check().is_err() || server.closed() {
                break;
            }
            thread::sleep(POLL_INTERVAL);
        }
        let Some(timing) = server.stop() else { return Ok(()) };
        show_timing(&timing, &self.shown, out)
    }
}

/// Refuses a project that a running bench uses.
fn check_free(project: &Path) -> Result<(), Failure> {
    match Place::find(project) {
        Ok(place) if Client::at(place.clone()).status().is_ok() => Err(Failure::Served(format!(
            "a bench is already running for {}, at {}. Stop it, or choose another folder with --project.",
            project.display(),
            place.address
        ))),
        _ => Ok(()),
    }
}

/// Prints the timing of a bench that has ended.
fn show_timing(timing: &TimingReport, shown: &OutputOptions, out: &mut dyn Write) -> Result<(), Failure> {
    let mut summary = stickslip::Summary::new("serve");
    timing.add_to(&mut summary);
    shown.show(out, &summary, |out| {
        for line in timing.table().lines() {
            writeln!(out, "  {line}")?;
        }
        for warning in timing.warnings() {
            writeln!(out, "Note: {warning}")?;
        }
        Ok(())
    })
}

/// The external file in the loop; at most one of the files, which are given for each role.
fn external_file(
    files: [Option<PathBuf>; Role::ALL.len()],
    options: ExternalOptions,
    values: &[Setting],
) -> Result<Option<ExternalFile>, Failure> {
    let mut given = Role::ALL.into_iter().zip(files).filter_map(|(role, file)| Some((role, file?)));
    let Some((role, file)) = given.next() else {
        if options.is_set() || !values.is_empty() {
            let message = "--trust, --map and --loaded-set require an external file: --controller FILE, --friction FILE or \
                           --law FILE.";
            return Err(Failure::Served(message.into()));
        }
        return Ok(None);
    };
    if let Some((other, _)) = given.next() {
        return Err(Failure::Served(format!(
            "--{role} and --{other}: one file at a time can be in the loop. Leave one of them out; the preset then supplies \
             this part."
        )));
    }
    Ok(Some(options.file(file, role, values)?))
}

/// Default addresses; the first free one is used.
const LISTEN: [SocketAddr; 2] = [address(9740), address(0)];
/// Interval of the checks for Ctrl-C.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

const fn address(port: u16) -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}
