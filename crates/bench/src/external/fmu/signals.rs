//! Mapping of variables of an FMU to signals of the bench, with units.

use super::super::{ModuleSample, Role, Signal};
use super::description::{Model, Variable};
use super::units::Quantity;
use stickslip_base::parameters::schema::nearest;

/// Maximum number of names in a message.
const LISTED: usize = 12;

/// A signal of the bench.
struct SignalDefinition {
    name: &'static str,
    quantity: Quantity,
    /// Names of its variable, in order of precedence; also used by the FMUs that stickslip generates.
    variables: &'static [&'static str],
    /// Its value in a sample with this torque limit; `None` for the torque, which is an output.
    value: Option<fn(&ModuleSample, f64) -> f64>,
    /// Additional names in a friction or law; `None` if only a controller reads it.
    additional: Option<&'static [&'static str]>,
    /// Whether it is a signal of a controller.
    of_controller: bool,
}

impl SignalDefinition {
    fn is_of(&self, role: Role) -> bool {
        if role == Role::Controller { self.of_controller } else { self.additional.is_some() }
    }

    /// Names of its variable.
    fn variables(&self, role: Role) -> impl Iterator<Item = &'static str> {
        let additional = self.additional.filter(|_| role != Role::Controller).unwrap_or_default();
        self.variables.iter().chain(additional).copied()
    }
}

const SIGNALS: [SignalDefinition; 11] = [
    SignalDefinition {
        name: "time",
        quantity: Quantity::Time,
        variables: &["time", "input.time"],
        value: Some(|sample, _| sample.time),
        additional: Some(&[]),
        of_controller: true,
    },
    SignalDefinition {
        name: "reference_position",
        quantity: Quantity::Angle,
        variables: &["reference_position", "input.reference_position", "input.reference.position"],
        value: Some(|sample, _| sample.reference_position),
        additional: None,
        of_controller: true,
    },
    SignalDefinition {
        name: "reference_velocity",
        quantity: Quantity::Velocity,
        variables: &["reference_velocity", "input.reference_velocity", "input.reference.velocity"],
        value: Some(|sample, _| sample.reference_velocity),
        additional: None,
        of_controller: true,
    },
    SignalDefinition {
        name: "reference_acceleration",
        quantity: Quantity::Acceleration,
        variables: &["reference_acceleration", "input.reference_acceleration", "input.reference.acceleration"],
        value: Some(|sample, _| sample.reference_acceleration),
        additional: None,
        of_controller: true,
    },
    SignalDefinition {
        name: "measured_angle",
        quantity: Quantity::Angle,
        variables: &["measured_angle", "input.measured_angle"],
        value: Some(|sample, _| sample.measured_angle),
        additional: Some(&["angle", "input.angle"]),
        of_controller: true,
    },
    SignalDefinition {
        name: "measured_velocity",
        quantity: Quantity::Velocity,
        variables: &["measured_velocity", "input.measured_velocity"],
        value: Some(|sample, _| sample.measured_velocity),
        additional: Some(&[]),
        of_controller: true,
    },
    SignalDefinition {
        name: "torque_limit",
        quantity: Quantity::Torque,
        variables: &["torque_limit", "input.torque_limit"],
        value: Some(|_, limit| limit),
        additional: Some(&[]),
        of_controller: true,
    },
    SignalDefinition {
        name: "estimated_velocity",
        quantity: Quantity::Velocity,
        variables: &["estimated_velocity", "input.estimated_velocity"],
        value: Some(|sample, _| sample.estimated_velocity),
        additional: Some(&["velocity", "input.velocity"]),
        of_controller: false,
    },
    SignalDefinition {
        name: "measured_load_torque",
        quantity: Quantity::Torque,
        variables: &["measured_load_torque", "input.measured_load_torque"],
        value: Some(|sample, _| sample.measured_load_torque),
        additional: Some(&[]),
        of_controller: false,
    },
    SignalDefinition {
        name: "commanded_torque",
        quantity: Quantity::Torque,
        variables: &["commanded_torque", "input.commanded_torque"],
        value: Some(|sample, _| sample.commanded_torque),
        additional: Some(&[]),
        of_controller: false,
    },
    SignalDefinition {
        name: "torque",
        quantity: Quantity::Torque,
        variables: &["torque", "output.torque"],
        value: None,
        additional: Some(&[]),
        of_controller: true,
    },
];

/// An input with its source.
pub(super) struct Input {
    value: fn(&ModuleSample, f64) -> f64,
    factor: f64,
    offset: f64,
}

impl Input {
    /// Value in the unit of its variable.
    pub(super) fn value(&self, sample: &ModuleSample, torque_limit: f64) -> f64 {
        ((self.value)(sample, torque_limit) - self.offset) / self.factor
    }
}

/// Mapped variables.
pub(super) struct Mapped {
    /// Value references of the inputs, and their sources.
    pub(super) references: Vec<u32>,
    pub(super) inputs: Vec<Input>,
    /// Value reference of the torque; factor and offset of its unit.
    pub(super) torque: (u32, f64, f64),
    /// Signals for the description.
    pub(super) signals: Vec<Signal>,
}

/// Finds the variables by their names, or by `map`: signal, variable.
pub(super) fn mapped(model: &Model, role: Role, map: &[(String, String)]) -> Result<Mapped, String> {
    let of_role = || SIGNALS.iter().filter(|signal| signal.is_of(role));
    for (name, _) in map {
        if !of_role().any(|signal| signal.name == name) {
            let names: Vec<&str> = of_role().map(|signal| signal.name).collect();
            let did =
                nearest(name, names.iter().copied()).map_or(String::new(), |name| format!("Did you mean {name}? "));
            return Err(format!("a {role} has no signal {name}. {did}Available: {}", names.join(", ")));
        }
        if map.iter().filter(|other| other.0 == *name).count() > 1 {
            return Err(format!("{name} is mapped twice. Map it once"));
        }
    }
    let (mut references, mut inputs, mut torque, mut signals) = (Vec::new(), Vec::new(), None, Vec::new());
    for signal in of_role() {
        let Some(variable) = variable(signal, model, role, map)? else { continue };
        let (factor, offset) = conversion(signal, variable, model)?;
        match signal.value {
            Some(_) if references.contains(&variable.reference) => {
                return Err(format!(
                    "{} is mapped to two signals, one of them {}. Map each signal to a separate variable",
                    variable.name, signal.name
                ));
            }
            Some(value) => {
                references.push(variable.reference);
                inputs.push(Input { value, factor, offset });
            }
            None => torque = Some((variable.reference, factor, offset)),
        }
        let unit = variable.unit.clone().unwrap_or_default();
        signals.push(Signal { name: signal.name.into(), variable: variable.name.clone(), unit });
    }
    let Some(torque) = torque else {
        let outputs = names(model, "output");
        return Err(format!("none of its outputs is the torque. Map it by --map torque=NAME. Its outputs: {outputs}"));
    };
    let (motion, words): (&[&str], _) = match role {
        Role::Controller => (&["measured_angle", "measured_velocity"], "measured angle or velocity"),
        Role::Friction => (&["estimated_velocity", "measured_velocity"], "estimated or measured velocity"),
        Role::Law => (&["estimated_velocity", "measured_velocity", "measured_angle"], "velocity or the angle"),
    };
    if !signals.iter().any(|signal| motion.contains(&signal.name.as_str())) {
        return Err(format!(
            "none of its inputs is the {words}. Map it by --map {}=NAME. Its inputs: {}",
            motion[0],
            names(model, "input")
        ));
    }
    Ok(Mapped { references, inputs, torque, signals })
}

/// The variable of a signal.
fn variable<'a>(
    signal: &SignalDefinition,
    model: &'a Model,
    role: Role,
    map: &[(String, String)],
) -> Result<Option<&'a Variable>, String> {
    let causality = if signal.value.is_some() { "input" } else { "output" };
    let variable = match map.iter().find(|(name, _)| name == signal.name) {
        Some((_, mapped_name)) => {
            let variable = model.variables.iter().find(|variable| variable.name == *mapped_name).ok_or_else(|| {
                let all = model.variables.iter().filter(|it| it.causality == causality).map(|it| it.name.as_str());
                let did = nearest(mapped_name, all).map_or(String::new(), |name| format!("Did you mean {name}? "));
                format!("it has no variable {mapped_name}. {did}Its {causality}s: {}", names(model, causality))
            })?;
            if variable.causality != causality {
                let (name, is) = (signal.name, &variable.causality);
                return Err(format!("{name} is an {causality} of a {role}, and {mapped_name} has the causality {is}"));
            }
            Some(variable)
        }
        None => signal.variables(role).find_map(|name| {
            model.variables.iter().find(|variable| variable.name == name && variable.causality == causality)
        }),
    };
    match variable {
        Some(variable) if !variable.number() => {
            let what = if variable.scalar { variable.kind.as_str() } else { "array" };
            Err(format!(
                "{} has the type {what}; {} requires a scalar number (Real in FMI 2.0, Float64 in FMI 3.0)",
                variable.name, signal.name
            ))
        }
        variable => Ok(variable),
    }
}

/// Factor and offset from the unit of a variable to that of the signal.
fn conversion(signal: &SignalDefinition, variable: &Variable, model: &Model) -> Result<(f64, f64), String> {
    let Some(unit) = &variable.unit else { return Ok((1.0, 0.0)) };
    let (si, words) = signal.quantity.words();
    signal.quantity.convert(unit, model.units.get(unit).copied().flatten()).ok_or_else(|| {
        format!(
            "{} has the unit {unit}, which is not a unit of {words} or is not defined; {} has the unit {si}. Set a \
             unit of {words}, with its BaseUnit",
            variable.name, signal.name
        )
    })
}

/// Names of the numbers with a causality, the first ones.
fn names(model: &Model, causality: &str) -> String {
    let numbers = model.variables.iter().filter(|it| it.causality == causality && it.number());
    listed(numbers.map(|it| it.name.clone()))
}

/// The first names, and the number of the others.
pub(super) fn listed(all: impl Iterator<Item = String>) -> String {
    let all: Vec<String> = all.collect();
    match all.len() {
        0 => "none".into(),
        count if count <= LISTED => all.join(", "),
        count => format!("{} and {} more", all[..LISTED].join(", "), count - LISTED),
    }
}
