//! `stickslip identify`: inertia and friction of an axis from a recording.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use stickslip::identify::servo::{self, ServoIdentification, identify_servo};
use stickslip::identify::{DONE, Identification, ParameterLine, done, identify, parameter_lines, write};
use stickslip::machine::Machine;
use stickslip::quantity::number;
use stickslip::{Summary, Watch, shell};

use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Recording and machine of the identification.
#[derive(Args)]
pub(crate) struct Identify {
    /// Recording: CSV (a header, then one row for each sample; may be gzipped), MAT, Parquet or MDF 4.
    recording: PathBuf,
    /// Machine file: columns, units, drive, controller. `stickslip machine init` writes one.
    #[arg(long, value_name = "FILE")]
    machine: PathBuf,
    /// Group (raster) of a recording with several [default: of the machine file, or the fastest one with its columns].
    #[arg(long, value_name = "NAME")]
    group: Option<String>,
    /// Folder for report.html, figures, model.toml, feedforward.csv and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/identify")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl Identify {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        watch.stage("read", 0.0)?;
        let machine = Machine::read(&self.machine)?;
        let recording = machine.recording(&self.recording, self.group.as_deref())?;
        let group = self.group.as_ref().map_or(String::new(), |group| format!(" --group {}", shell::word(group)));
        let (file, machine_file) = (shell::path(&self.recording), shell::path(&self.machine));
        let command = format!("stickslip identify {file} --machine {machine_file}{group}");
        if machine.pendulum.is_some() {
            let identification = identify_servo(&recording, &machine, watch)?;
            watch.stage("write", 0.0)?;
            let summary = servo::write(&identification, &machine, &recording, &command, &self.out)?;
            show_servo(&identification, &summary, &machine, out)?;
            return Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?);
        }
        let identification = identify(&recording, &machine, watch)?;
        watch.stage("write", 0.0)?;
        let summary = write(&identification, &machine, &recording, &command, &self.out)?;
        self.shown.show(out, &summary, |out| {
            show(&identification, &summary, &machine, out)?;
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}

fn show(identification: &Identification, summary: &Summary, machine: &Machine, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{DONE}:")?;
    for finding in done(&identification.signals) {
        writeln!(out, "  {}", finding.replace('\u{a0}', " "))?;
    }
    let heads = ["A friction for each direction:", "One friction for both directions, and an offset:"];
    for (head, lines) in heads.into_iter().zip(parameter_lines(summary, machine)) {
        writeln!(out, "{head}")?;
        for ParameterLine { name, identified, published } in lines {
            let published = published.map_or(String::new(), |p| format!("   published {p}"));
            writeln!(out, "  {name:36} {identified}{published}")?;
        }
    }
    let found = identification.findings.sentences(identification.axis);
    if !found.is_empty() {
        writeln!(out, "Found in this recording:")?;
    }
    for finding in found {
        writeln!(out, "  {}", finding.replace('\u{a0}', " "))?;
    }
    writeln!(out, "Not identifiable from this recording:")?;
    for limit in identification.limits() {
        writeln!(out, "  {limit}")?;
    }
    writeln!(out, "Error in cross-validation on halves of the recording, and its square above the least:")?;
    for (index, candidate) in identification.candidates.iter().enumerate() {
        let best = if candidate.kind == identification.best().kind { "   best" } else { "" };
        let behind = identification.behind(index).map_or_else(|| "least".into(), |behind| behind.to_string());
        let error = number(100.0 * candidate.held_out, 2);
        writeln!(out, "  {:44} {error} %   {behind}{best}", candidate.kind.title())?;
    }
    Ok(())
}

fn show_servo(
    identification: &ServoIdentification,
    summary: &Summary,
    machine: &Machine,
    out: &mut dyn Write,
) -> io::Result<()> {
    let best = identification.best().fitted.kind;
    writeln!(out, "Best model: {}", best.title())?;
    for field in servo::fields().iter().filter(|field| best.has(field.name)) {
        let Some(estimate) = summary.estimate(&servo::result_name(field)) else { continue };
        writeln!(out, "  {:28} {estimate}", field.name.replace('_', " "))?;
    }
    writeln!(out, "Not identifiable from these runs:")?;
    for limit in identification.limits(machine) {
        writeln!(out, "  {limit}")?;
    }
    writeln!(out, "Error of the angle on the runs excluded from the fits:")?;
    for candidate in &identification.candidates {
        let degrees = |rms: f64| format!("{} °", number(rms.to_degrees(), 2));
        let published = candidate.published.map_or(String::new(), |(_, rms)| format!("   published {}", degrees(rms)));
        let mark = if candidate.fitted.kind == best { "   best" } else { "" };
        writeln!(out, "  {:28} {}{published}{mark}", candidate.fitted.kind.title(), degrees(candidate.held_out_rms))?;
    }
    Ok(())
}
