//! A controller, friction or law as an FMU: archive, description, variables, and the calls of a sample.

mod archive;
mod description;
mod signals;
#[cfg(all(test, unix))]
mod tests;
mod units;

use std::path::{Path, PathBuf};
use std::time::Instant;

pub(super) use archive::is_fmu;
use archive::{Archive, Limits};
use description::{Model, Variable};
use signals::{Mapped, listed, mapped};
use stickslip_codegen::fmu::Version;
use stickslip_rt::{FloatingPoint, FmiVersion, Fmu, FmuLibrary, MOST_PARAMETERS};
use stickslip_software::supervise::{ExternalFault, Role};
use tempfile::TempDir;

use super::{Answer, Caller, Description, ModuleParameter, ModuleSample};

/// An open FMU with its folder.
pub(super) struct Controller {
    fmu: Fmu,
    description: Description,
    mapped: Mapped,
    /// Value references of the parameters, their values, and buffers for the changed ones.
    parameters: Vec<u32>,
    values: Vec<f64>,
    changed: (Vec<u32>, Vec<f64>),
    /// Inputs of this sample, in their units.
    inputs: Vec<f64>,
    period: f64,
    torque_limit: f64,
    samples: u64,
    /// The instance is unused.
    fresh: bool,
    /// Folder of the unpacked files; declared after the library, which is closed first.
    _folder: TempDir,
}

impl Controller {
    /// Opens an FMU; `map` assigns variables to signals, `messages` is a file for a copy of its messages.
    pub(super) fn open(
        path: &Path,
        role: Role,
        map: &[(String, String)],
        messages: Option<PathBuf>,
    ) -> Result<Self, String> {
        Self::open_within(path, role, map, messages, Limits::default())
    }

    fn open_within(
        path: &Path,
        role: Role,
        map: &[(String, String)],
        messages: Option<PathBuf>,
        limits: Limits,
    ) -> Result<Self, String> {
        let mut archive = Archive::open(path, limits)?;
        let model = description::read(&archive.description()?)?;
        let mapped = mapped(&model, role, map)?;
        let settable = settable(&model, &mapped);
        if settable.len() > MOST_PARAMETERS {
            return Err(format!("it has {} parameters; the maximum is {MOST_PARAMETERS}", settable.len()));
        }
        let library = library(&model, archive.names())?;
        let (platform, _) = library.rsplit_once('/').unwrap_or_default();
        let folder = archive.unpack(&[format!("{platform}/"), "resources/".into(), "extra/".into()])?;
        let files = FmuLibrary {
            version: model.version,
            library: folder.path().join(&library),
            token: model.token.clone(),
            resources: folder.path().join("resources"),
            messages,
        };
        let mut fmu = Fmu::open(&files).map_err(|error| error.to_string())?;
        if !fmu.instantiate() {
            let reason =
                fmu.message().map_or_else(|| "No message".into(), |(message, _)| format!("Message: {message}"));
            return Err(format!("it cannot be instantiated. {}", reason.trim_end_matches('.')));
        }
        let description = describe(&model, role, &mapped, &settable);
        let parameters: Vec<u32> = settable.iter().map(|variable| variable.reference).collect();
        let values = vec![f64::NAN; parameters.len()];
        let changed = (Vec::with_capacity(parameters.len()), Vec::with_capacity(parameters.len()));
        let inputs = Vec::with_capacity(mapped.inputs.len());
        let (period, torque_limit, samples) = (0.0, 0.0, 0);
        Ok(Controller {
            fmu,
            description,
            mapped,
            parameters,
            values,
            changed,
            inputs,
            period,
            torque_limit,
            samples,
            fresh: true,
            _folder: folder,
        })
    }

    pub(super) fn description(&self) -> &Description {
        &self.description
    }

    fn initialize(&mut self, values: &[f64]) -> Result<(), i32> {
        if !std::mem::take(&mut self.fresh) && !self.fmu.instantiate() {
            return Err(-1);
        }
        self.values.copy_from_slice(values);
        // Only changed values are set, since some tools reject setting a start value again.
        let changed = self.description.parameters.iter().zip(&self.parameters).zip(values);
        let changed = changed.filter(|((parameter, _), value)| parameter.initial.to_bits() != value.to_bits());
        let (references, values): (Vec<u32>, Vec<f64>) =
            changed.map(|((_, reference), value)| (*reference, *value)).unzip();
        self.fmu.initialize(&references, &values)
    }

    /// Sets new values of tunable parameters between two steps.
    fn set_values(&mut self, values: &[f64]) -> Result<(), i32> {
        let (references, numbers) = &mut self.changed;
        references.clear();
        numbers.clear();
        let entries = self.description.parameters.iter().zip(&self.parameters).zip(self.values.iter_mut().zip(values));
        for ((parameter, reference), (present, value)) in entries {
            if !parameter.fixed && present.to_bits() != value.to_bits() {
                *present = *value;
                references.push(*reference);
                numbers.push(*value);
            }
        }
        if references.is_empty() { Ok(()) } else { self.fmu.set(references, numbers) }
    }

    fn compute(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, i32> {
        let Mapped { references, inputs, .. } = &self.mapped;
        self.inputs.clear();
        self.inputs.extend(inputs.iter().map(|input| input.value(sample, self.torque_limit)));
        if self.samples == 0 {
            // It starts with the measured values, not with the start values of its inputs.
            self.fmu.set(references, &self.inputs)?;
            self.fmu.start()?;
        }
        values.map_or(Ok(()), |values| self.set_values(values))?;
        let Mapped { references, torque: (torque, factor, offset), .. } = &self.mapped;
        let mut computed = [f64::NAN];
        let begin = Instant::now();
        self.fmu.set(references, &self.inputs)?;
        self.fmu.step(self.samples as f64 * self.period, self.period)?;
        self.fmu.get(&[*torque], &mut computed)?;
        let time = begin.elapsed().as_nanos() as u64;
        self.samples += 1;
        Ok(Answer { torque: factor * computed[0] + offset, time, refused: 0 })
    }
}

impl Caller for Controller {
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ExternalFault> {
        (self.period, self.torque_limit, self.samples) = (sample_time, torque_limit, 0);
        let done = self.initialize(values);
        checked(done)
    }

    fn step(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, ExternalFault> {
        let answer = self.compute(sample, values);
        checked(answer)
    }

    fn message(&self) -> Option<String> {
        self.fmu.message().map(|message| message.0)
    }
}

/// The result of calls, unless they changed the floating-point mode.
fn checked<T>(done: Result<T, i32>) -> Result<T, ExternalFault> {
    if !FloatingPoint::set_standard() {
        return Err(ExternalFault::FloatingPoint);
    }
    done.map_err(|code| ExternalFault::Failed { code })
}

/// Variables that can be set before the start: parameters, and inputs that are not signals.
fn settable<'a>(model: &'a Model, mapped: &Mapped) -> Vec<&'a Variable> {
    let settable = |variable: &&Variable| {
        let parameter =
            variable.causality == "parameter" && ["fixed", "tunable"].contains(&variable.variability.as_str());
        let input = variable.causality == "input" && !mapped.references.contains(&variable.reference);
        variable.number() && variable.start.is_some() && (parameter || input)
    };
    model.variables.iter().filter(settable).collect()
}

/// The library for this computer in its archive.
fn library(model: &Model, names: &[String]) -> Result<String, String> {
    let (version, number) = match model.version {
        FmiVersion::Two => (Version::Two, "2.0"),
        FmiVersion::Three => (Version::Three, "3.0"),
    };
    let Some((platform, ending)) = version.platform() else {
        return Err(format!("FMI {number} has no platform name for this computer"));
    };
    let library = format!("binaries/{platform}/{}.{ending}", model.identifier);
    if names.contains(&library) {
        return Ok(library);
    }
    let mut has: Vec<&str> = names
        .iter()
        .filter_map(|name| name.strip_prefix("binaries/")?.split_once('/').filter(|(_, rest)| !rest.is_empty()))
        .map(|(platform, _)| platform)
        .collect();
    has.sort_unstable();
    has.dedup();
    let sources = names.iter().any(|name| name.starts_with("sources/") && name.ends_with(".c"));
    Err(match (has.is_empty(), sources) {
        (true, true) => format!(
            "it has C sources and no library; this computer requires {library}. Compile it: pip install fmpy; python \
             -m fmpy compile FILE.fmu"
        ),
        (true, false) => format!("it has no library; this computer requires {library}. Export it with a binary"),
        (false, sources) => {
            let compile = if sources { ", or compile its sources: python -m fmpy compile FILE.fmu" } else { "" };
            format!(
                "it has libraries for {}; this computer requires {library}. Export it on this computer{compile}",
                has.join(", ")
            )
        }
    })
}

/// Description for the user.
fn describe(model: &Model, role: Role, mapped: &Mapped, settable: &[&Variable]) -> Description {
    let parameter = |variable: &&Variable| ModuleParameter {
        name: variable.name.clone(),
        unit: variable.unit.clone().unwrap_or_else(|| "1".into()),
        help: variable.help.clone(),
        minimum: variable.minimum.unwrap_or(f64::MIN),
        maximum: variable.maximum.unwrap_or(f64::MAX),
        initial: variable.start.unwrap_or_default(),
        fixed: variable.causality == "parameter" && variable.variability == "fixed",
    };
    let mut notes = Vec::new();
    let without_unit: Vec<&str> =
        mapped.signals.iter().filter(|signal| signal.unit.is_empty()).map(|signal| signal.variable.as_str()).collect();
    if !without_unit.is_empty() {
        notes.push(format!("No unit is stated for {}: SI is assumed.", without_unit.join(", ")));
    }
    let inputs = settable.iter().filter(|variable| variable.causality == "input");
    let inputs: Vec<String> =
        inputs.map(|input| format!("{} = {:?}", input.name, input.start.unwrap_or_default())).collect();
    if !inputs.is_empty() {
        notes.push(format!("Inputs without a signal keep their start values: {}.", listed(inputs.into_iter())));
    }
    if role == Role::Controller && !mapped.signals.iter().any(|signal| signal.name.starts_with("reference_")) {
        notes.push("None of its inputs is a set-point.".into());
    }
    Description {
        name: model.name.clone(),
        parameters: settable.iter().map(parameter).collect(),
        kind: match model.version {
            FmiVersion::Two => "FMU 2.0".into(),
            FmiVersion::Three => "FMU 3.0".into(),
        },
        tool: model.tool.clone(),
        step: model.step,
        signals: mapped.signals.clone(),
        notes,
    }
}
