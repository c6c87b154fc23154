//! `stickslip design`: the desired friction from reference points or single values.

use std::io::Write;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use stickslip::Preset;
use stickslip::design::{Passage, Region};
use stickslip::parameters::{self, presets};
use stickslip::workflow::design::{Design, Weighted, through_points};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Own friction, bench and reference points of the design.
#[derive(Args)]
pub(crate) struct DesignCommand {
    /// Own friction: the fit.toml of a fit, or a preset. The desired friction starts from its [bench.desired] if present,
    /// otherwise from that of --preset.
    #[arg(long, value_name = "FILE|NAME")]
    from: String,
    /// Bench whose load motor renders the friction: name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Reference point: speed in rad/s and torque in N m. The desired curve is a least-squares fit to all points;
    /// parameters that they do not determine keep their start values.
    #[arg(long, value_name = "SPEED=TORQUE")]
    point: Vec<Point>,
    /// Change a value of the desired friction (desired.stribeck_velocity=1.5), after the points, or of the bench.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Acceleration of the drive under the law [rad/s²]; delay and current limit the rendered torque during it.
    #[arg(long, value_name = "RAD/S²", default_value_t = Passage::default().acceleration)]
    acceleration: f64,
    /// Folder for desired.toml, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/design")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

/// Speed [rad/s] and torque [N m].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point([f64; 2]);

impl FromStr for Point {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (speed, torque) = text.split_once('=').ok_or("write it as SPEED=TORQUE, for example 1.5=0.2")?;
        let number = |text: &str| text.trim().parse().map_err(|_| format!("{text:?} is not a number"));
        Ok(Point([number(speed)?, number(torque)?]))
    }
}

impl DesignCommand {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let is_desired = |setting: &&Setting| setting.path.starts_with("desired.");
        let bench = self.set.iter().filter(|setting| !is_desired(setting));
        let mut preset = source::preset(&self.preset, bench.map(|s| (s.path.as_str(), s.value.as_str())))?;
        let remedy = "Give the fit.toml that `stickslip fit` or `stickslip friction` wrote, or a preset.";
        let from = presets::find(&self.from)?.stating("model.own", remedy)?;
        let source: Preset<f64> = from.read()?;
        if from.states("bench.desired") {
            preset.bench.desired = source.bench.desired;
        }
        let points: Vec<Weighted> = self.point.iter().map(|Point([speed, torque])| [*speed, *torque, 1.0]).collect();
        if !points.is_empty() {
            preset.bench.desired = through_points(&points, &preset.bench.desired, None)?;
        }
        let mut text = parameters::write_commented(&preset);
        for Setting { path, value } in self.set.iter().filter(is_desired) {
            text = parameters::set::<Preset<f64>>(&text, "--set", &format!("bench.{path}"), value)?;
        }
        let preset: Preset<f64> = parameters::read(&text, "--set").map_err(stickslip::Error::from)?;
        let passage = Passage { acceleration: self.acceleration, ..Passage::default() };
        let region = Region::of(&preset.model, &preset.bench, passage)?;
        let design = Design { own: source.model.own, desired: preset.bench.desired, points, region };
        let summary = design.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for line in design.table().lines() {
                writeln!(out, "  {line}")?;
            }
            if let Some(distance) = summary.estimate("design.distance_from_points") {
                writeln!(out, "The curve lies {distance} rms from its reference points.")?;
            }
            for remark in design.remarks() {
                writeln!(out, "{remark}")?;
            }
            writeln!(out, "Desired friction for render: {}", self.out.join("desired.toml").display())?;
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_point_consists_of_two_numbers() {
        assert_eq!("1.5=0.2".parse(), Ok(Point([1.5, 0.2])));
        assert!("1.5".parse::<Point>().unwrap_err().contains("SPEED=TORQUE"));
        assert!("1.5=x".parse::<Point>().unwrap_err().contains("\"x\" is not a number"));
    }
}
