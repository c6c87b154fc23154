//! The commands, one file each.

mod bench;
mod benchmark;
mod calibrate;
mod capture;
mod completions;
mod demo;
mod design;
mod doctor;
#[cfg(target_os = "linux")]
mod ethercat;
mod export;
mod fidelity;
mod fit;
mod friction;
mod generate;
mod hunting;
mod identify;
mod load;
mod machine;
mod measure;
mod params;
mod plant;
mod position_loop;
mod render;
mod replay;
mod report;
mod runs;
mod serve;
mod status;
mod study;
mod validate;
mod xcp;

use std::io::Write;

use clap::{Args, Subcommand};
use stickslip::bench::remote::Address;
use stickslip::bench::tap::Tap;
use stickslip::bench::{ClockedBench, OpenFieldbus, ThreadSettings};
use stickslip::{Error, Preset, Watch};

use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Default folder of the project; it contains the address of the running bench.
const PROJECT: &str = "stickslip-out/project";

/// Opens servo drives, if the program has the main device.
fn open_fieldbus() -> Option<OpenFieldbus> {
    #[cfg(target_os = "linux")]
    return stickslip_fieldbus::MAIN_DEVICE.map(|functions| functions.open);
    #[cfg(not(target_os = "linux"))]
    return None;
}

/// A bench in real time with the machine at an address.
fn clocked_bench(preset: &Preset<f64>, address: &Address, tap: Option<Tap>) -> Result<ClockedBench, Error> {
    ClockedBench::connect(preset, address, open_fieldbus(), ThreadSettings::default(), tap)
}

/// The commands of the program.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Run the paper's experiment on the virtual bench: measure, fit, design, render, measure again.
    #[command(after_help = "Example: stickslip demo --out results --seed 7")]
    Demo(demo::DemoCommand),
    /// Measure friction, breakaway, presliding, frequency response, learning or tracking.
    #[command(subcommand, after_help = "Example: stickslip measure friction --linings pressed --seed 7")]
    Measure(measure::Measure),
    /// Calibrate the bench: scales, masses, coupling, lags, load motor and own friction.
    #[command(after_help = "Example: stickslip calibrate --preset clm-real --seed 7")]
    Calibrate(calibrate::CalibrateCommand),
    /// Fit a Stribeck curve to a measured friction curve.
    #[command(after_help = "Example: stickslip fit stickslip-out/measure-friction\n\
                            Example: stickslip fit data/direct_drive_joint/friction_curve.csv --side each")]
    Fit(fit::Fit),
    /// Design the desired friction, and check whether the load motor can render it.
    #[command(
        after_help = "Example: stickslip design --from stickslip-out/fit/fit.toml --set desired.stribeck_velocity=1.5\n\
                            Example: stickslip design --from clm-bench --point 0=0.3 --point 2=0.17 --point 12=0.13"
    )]
    Design(design::DesignCommand),
    /// Show friction identified on physical machines, or write a preset with it.
    #[command(after_help = "Example: stickslip friction\n\
                            Example: stickslip friction dc-servo --onto prototype --as desired")]
    Friction(friction::FrictionCommand),
    /// Analyse the robustness of a position loop: margins, sensitivity, noise, load sliding and stuck.
    #[command(name = "loop", after_help = "Example: stickslip loop\nExample: stickslip loop --control pid --tune")]
    Loop(position_loop::LoopCommand),
    /// Predict whether a controller hunts at a constant set-point, with amplitude and frequency.
    #[command(
        after_help = "Example: stickslip hunting --preset prototype --set model.own.breakaway_torque=0.45 --set model.own.kinetic_torque=0.2 --set model.own.stribeck_velocity=0.5\n\
                            Example: stickslip hunting --set bench.hold.kind=stiction --set bench.hold.dead_zone=1.2e-3"
    )]
    Hunting(hunting::HuntingCommand),
    /// Render the desired friction with the load motor, and measure it.
    #[command(
        after_help = "Example: stickslip render --own stickslip-out/fit/fit.toml --desired stickslip-out/design/desired.toml"
    )]
    Render(render::RenderCommand),
    /// Compare trajectories with rendered friction to those of a machine that has this friction.
    #[command(after_help = "Example: stickslip fidelity --quick\n\
                            Example: stickslip fidelity --preset clm-bench --law residual --scenario sine_2hz --seeds 1")]
    Fidelity(fidelity::Fidelity),
    /// Run an external position controller, friction or rendering law on the virtual bench.
    #[command(after_help = "Example: stickslip load --header .\n\
                            Example: stickslip load fmu/position_controller-fmi3.fmu --map torque=output.torque --duration 2\n\
                            Example: stickslip load fmu/friction-fmi3.fmu --as friction --preset-set bench.law.kind=residual --duration 2 --out stickslip-out/load-friction")]
    Load(load::LoadCommand),
    /// Run an external file in a separate process.
    #[command(hide = true, after_help = "Example: stickslip load my_controller.so")]
    Host(load::HostCommand),
    /// Rank controllers and compensations for each friction on the virtual bench.
    #[command(after_help = "Example: stickslip benchmark --quick\n\
                            Example: stickslip benchmark --quick --controller pid --controller my-bench.toml --friction vicious")]
    Benchmark(benchmark::Benchmark),
    /// Vary parameters of machine, model or controller: grids, samples, sensitivities.
    #[command(after_help = "A study is a file:\n\n\
                            preset = \"prototype\"\n\
                            manoeuvres = [\"reversal\"]\n\n\
                            [[axis]]\n\
                            path = [\"model.own.breakaway_torque\", \"model.own.kinetic_torque\"]\n\
                            factor = true\n\
                            range = [0.7, 1.3]\n\
                            points = 7\n\n\
                            Example: stickslip study examples/study/model.toml")]
    Study(study::Study),
    /// Identify inertia and friction of an axis from a recording.
    #[command(
        after_help = "Example: stickslip identify data/emps/emps.csv.gz --machine data/emps/emps-machine.toml --out emps"
    )]
    Identify(identify::Identify),
    /// Validate an identified model on another recording: simulate the closed loop and report the error.
    #[command(
        after_help = "Example: stickslip validate other.csv --model emps/model.toml --machine data/emps/emps-machine.toml"
    )]
    Validate(validate::Validate),
    /// Generate C, an FMU, an A2L or a diagram of a block.
    #[command(after_help = "Example: stickslip generate --list\n\
                            Example: stickslip generate c velocity_observer --out observer")]
    Generate(generate::Generate),
    /// Create a file that describes a machine: columns, units, drive.
    #[command(subcommand, after_help = "Example: stickslip machine init axis.csv --yes")]
    Machine(machine::Machine),
    /// Serve the virtual machine to a bench in another process.
    #[command(after_help = "Example: stickslip plant --io udp:127.0.0.1:9750 --preset clm-real --seed 7\n\
                            Example: stickslip plant --io shm:axis\n\
                            Example: stickslip plant --ethercat eth1 --analog 1")]
    Plant(plant::PlantCommand),
    /// Servo drives on EtherCAT.
    #[cfg(target_os = "linux")]
    #[command(subcommand, after_help = "Example: stickslip ethercat scan eth0")]
    Ethercat(ethercat::EthercatCommand),
    /// Run the bench in real time and serve it to terminals, scripts and browsers.
    #[command(after_help = "Example: stickslip serve --seconds 1 --listen 127.0.0.1:0\n\
                            Example: stickslip serve --preset clm-real --project real --listen 127.0.0.1:0 --seconds 2\n\
                            Example: stickslip serve --xcp-udp 0 --xcp-tcp 0 --listen 127.0.0.1:0 --seconds 1")]
    Serve(Box<serve::ServeCommand>),
    /// Control the running bench: home, move, measure, stop.
    #[command(after_help = "Example: stickslip bench home")]
    Bench(bench::BenchCommand),
    /// Show the status of the running bench.
    #[command(after_help = "Example: stickslip status")]
    Status(status::StatusCommand),
    /// Capture signals of the running bench around a trigger.
    #[command(
        after_help = "Example: stickslip capture --signal setpoint.velocity,software.estimated_velocity --after 0.2"
    )]
    Capture(capture::CaptureCommand),
    /// Replay a recorded run and compare every bit.
    #[command(after_help = "Example: stickslip replay results")]
    Replay(replay::ReplayCommand),
    /// Export a recorded run to CSV, Parquet, MATLAB or MCAP.
    #[command(
        after_help = "Example: stickslip export results --out run.mat --signal setpoint.velocity,angle --until 10\n\
                            Example: stickslip export results/run.mf4 --out run.parquet --every 10"
    )]
    Export(export::ExportCommand),
    /// Recover an interrupted recording in place, so that other tools can read it.
    #[command(after_help = "Example: stickslip recover results")]
    Recover(export::RecoverCommand),
    /// Check the real-time settings of this computer, and measure how late cycles start.
    #[command(after_help = "Example: stickslip doctor --seconds 1 --rate 1000")]
    Doctor(doctor::DoctorCommand),
    /// Show, check, compare and change parameters.
    #[command(after_help = "Example: stickslip params list\nExample: stickslip params diff clm-bench live")]
    Params(params::ParamsCommand),
    /// Search, name, tag and delete runs in the catalogue.
    #[command(after_help = "Example: stickslip runs\n\
                            Example: stickslip runs 'M_S>0.2 law:paper -tag:bad'\n\
                            Example: stickslip runs --rebuild")]
    Runs(runs::RunsCommand),
    /// Write the report of saved results again, or one report that compares several.
    #[command(after_help = "Example: stickslip report stickslip-out/demo other/demo --out comparison.html")]
    Report(report::ReportCommand),
    /// Print the command-line completions for a shell.
    #[command(after_help = "Example: stickslip completions bash")]
    Completions(completions::Completions),
}

/// The program without a command: the demo, then the bench in real time until Ctrl-C.
pub(crate) fn start(out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
    Command::Demo(with_defaults()).run(out, |_| watch.clone())?;
    writeln!(out, "\nBench in real time:")?;
    Command::Serve(Box::new(with_defaults())).run(out, |_| watch.clone())
}

/// A command without arguments.
fn with_defaults<C: Args>() -> C {
    let matches = C::augment_args(clap::Command::new("stickslip")).get_matches_from(["stickslip"]);
    C::from_arg_matches(&matches).expect("each argument has a default")
}

impl Command {
    /// Runs the command; results go to `out`. A long command calls `watch` first: from then on the first Ctrl-C cancels
    /// it instead of ending the program.
    pub(crate) fn run(self, out: &mut dyn Write, watch: impl FnOnce(OutputOptions) -> Watch) -> Result<(), Failure> {
        let entry = self.catalogue_entry();
        let result = self.carry_out(out, watch);
        // A cancelled run may have partial results.
        entry.into_iter().for_each(runs::PendingEntry::enter);
        result
    }

    /// The entry in the catalogue for the run that the command writes.
    fn catalogue_entry(&self) -> Option<runs::PendingEntry> {
        let (folder, preset) = match self {
            Command::Demo(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Measure(command) => {
                let (folder, preset) = command.destination();
                (folder, Some(preset))
            }
            Command::Calibrate(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Design(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Loop(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Hunting(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Render(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Friction(command) => (command.destination()?, None),
            Command::Fit(command) => (command.out.clone(), None),
            Command::Fidelity(command) => (command.out.clone(), None),
            Command::Benchmark(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Study(command) => (command.out.clone(), None),
            Command::Load(command) => (command.out.clone(), Some(command.preset.clone())),
            Command::Identify(command) => (command.out.clone(), None),
            Command::Validate(command) => (command.out.clone(), None),
            Command::Capture(command) => (command.out.clone(), None),
            _ => return None,
        };
        Some(runs::PendingEntry::new(folder, preset))
    }

    /// The form of the output of a command that can be watched; the default for the others.
    fn shown(&self) -> OutputOptions {
        match self {
            Command::Demo(command) => command.shown,
            Command::Measure(command) => command.shown(),
            Command::Calibrate(command) => command.shown,
            Command::Loop(command) => command.shown,
            Command::Hunting(command) => command.shown,
            Command::Render(command) => command.shown,
            Command::Fidelity(command) => command.shown,
            Command::Benchmark(command) => command.shown,
            Command::Study(command) => command.shown,
            Command::Identify(command) => command.shown,
            Command::Load(command) => command.shown,
            Command::Validate(command) => command.shown,
            Command::Doctor(command) => command.shown,
            Command::Plant(command) => command.shown,
            #[cfg(target_os = "linux")]
            Command::Ethercat(command) => command.shown(),
            Command::Replay(command) => command.shown,
            Command::Export(command) => command.shown,
            Command::Serve(command) => command.shown,
            Command::Capture(command) => command.shown,
            Command::Fit(_)
            | Command::Design(_)
            | Command::Friction(_)
            | Command::Host(_)
            | Command::Recover(_)
            | Command::Bench(_)
            | Command::Status(_)
            | Command::Generate(_)
            | Command::Machine(_)
            | Command::Params(_)
            | Command::Report(_)
            | Command::Runs(_)
            | Command::Completions(_) => OutputOptions::default(),
        }
    }

    fn carry_out(self, out: &mut dyn Write, watch: impl FnOnce(OutputOptions) -> Watch) -> Result<(), Failure> {
        let shown = self.shown();
        match self {
            Command::Demo(command) => command.run(out, &watch(shown)),
            Command::Measure(command) => command.run(out, &watch(shown)),
            Command::Calibrate(command) => command.run(out, &watch(shown)),
            Command::Fit(command) => command.run(out),
            Command::Design(command) => command.run(out),
            Command::Friction(command) => command.run(out),
            Command::Loop(command) => command.run(out, &watch(shown)),
            Command::Hunting(command) => command.run(out, &watch(shown)),
            Command::Render(command) => command.run(out, &watch(shown)),
            Command::Fidelity(command) => command.run(out, &watch(shown)),
            Command::Benchmark(command) => command.run(out, &watch(shown)),
            Command::Study(command) => command.run(out, &watch(shown)),
            Command::Identify(command) => command.run(out, &watch(shown)),
            Command::Load(command) => command.run(out, &watch(shown)),
            Command::Host(command) => command.run(),
            Command::Validate(command) => command.run(out, &watch(shown)),
            Command::Doctor(command) => command.run(out, &watch(shown)),
            Command::Plant(command) => command.run(out, &watch(shown)),
            #[cfg(target_os = "linux")]
            Command::Ethercat(command) => command.run(out),
            Command::Replay(command) => command.run(out, &watch(shown)),
            Command::Export(command) => command.run(out, &watch(shown)),
            Command::Recover(command) => command.run(out),
            Command::Serve(command) => command.run(out, &watch(shown)),
            Command::Bench(command) => command.run(out, || watch(shown)),
            Command::Status(command) => command.run(out, || watch(shown)),
            Command::Capture(command) => command.run(out, &watch(shown)),
            Command::Generate(command) => command.run(out),
            Command::Machine(command) => command.run(out),
            Command::Params(command) => command.run(out),
            Command::Report(command) => command.run(out),
            Command::Runs(command) => command.run(out),
            Command::Completions(command) => command.run(out),
        }
    }
}
