//! Which variable of an FMU is which signal of the bench, and in which unit.

use super::super::{ModuleSample, Role, Signal};
use super::description::{Model, Variable};
use super::units::Quantity;
use stickslip_base::parameters::schema::nearest;

/// Names that a message lists at most.
const LISTED: usize = 12;

/// A signal of the bench.
struct Known {
    name: &'static str,
    quantity: Quantity,
    /// How variables are called that are it, the first one that there is; so do the FMUs that stickslip writes.
    variables: &'static [&'static str],
    /// Its value in a sample, under this limit of torque; the torque comes back.
    value: Option<fn(&ModuleSample, f64) -> f64>,
    /// How they are called besides in a friction or a law; `None` where a controller alone reads it.
    beside: Option<&'static [&'static str]>,
    /// Whether a controller has it.
    of_controller: bool,
}

impl Known {
    fn is_of(&self, role: Role) -> bool {
        if role == Role::Controller { self.of_controller } else { self.beside.is_some() }
    }

    /// How variables are called that are it.
    fn variables(&self, role: Role) -> impl Iterator<Item = &'static str> {
        let beside = self.beside.filter(|_| role != Role::Controller).unwrap_or_default();
        self.variables.iter().chain(beside).copied()
    }
}

const KNOWN: [Known; 11] = [
    Known {
        name: "time",
        quantity: Quantity::Time,
        variables: &["time", "input.time"],
        value: Some(|sample, _| sample.time),
        beside: Some(&[]),
        of_controller: true,
    },
    Known {
        name: "reference_position",
        quantity: Quantity::Angle,
        variables: &["reference_position", "input.reference_position", "input.reference.position"],
        value: Some(|sample, _| sample.reference_position),
        beside: None,
        of_controller: true,
    },
    Known {
        name: "reference_velocity",
        quantity: Quantity::Velocity,
        variables: &["reference_velocity", "input.reference_velocity", "input.reference.velocity"],
        value: Some(|sample, _| sample.reference_velocity),
        beside: None,
        of_controller: true,
    },
    Known {
        name: "reference_acceleration",
        quantity: Quantity::Acceleration,
        variables: &["reference_acceleration", "input.reference_acceleration", "input.reference.acceleration"],
        value: Some(|sample, _| sample.reference_acceleration),
        beside: None,
        of_controller: true,
    },
    Known {
        name: "measured_angle",
        quantity: Quantity::Angle,
        variables: &["measured_angle", "input.measured_angle"],
        value: Some(|sample, _| sample.measured_angle),
        beside: Some(&["angle", "input.angle"]),
        of_controller: true,
    },
    Known {
        name: "measured_velocity",
        quantity: Quantity::Velocity,
        variables: &["measured_velocity", "input.measured_velocity"],
        value: Some(|sample, _| sample.measured_velocity),
        beside: Some(&[]),
        of_controller: true,
    },
    Known {
        name: "torque_limit",
        quantity: Quantity::Torque,
        variables: &["torque_limit", "input.torque_limit"],
        value: Some(|_, limit| limit),
        beside: Some(&[]),
        of_controller: true,
    },
    Known {
        name: "estimated_velocity",
        quantity: Quantity::Velocity,
        variables: &["estimated_velocity", "input.estimated_velocity"],
        value: Some(|sample, _| sample.estimated_velocity),
        beside: Some(&["velocity", "input.velocity"]),
        of_controller: false,
    },
    Known {
        name: "measured_load_torque",
        quantity: Quantity::Torque,
        variables: &["measured_load_torque", "input.measured_load_torque"],
        value: Some(|sample, _| sample.measured_load_torque),
        beside: Some(&[]),
        of_controller: false,
    },
    Known {
        name: "commanded_torque",
        quantity: Quantity::Torque,
        variables: &["commanded_torque", "input.commanded_torque"],
        value: Some(|sample, _| sample.commanded_torque),
        beside: Some(&[]),
        of_controller: false,
    },
    Known {
        name: "torque",
        quantity: Quantity::Torque,
        variables: &["torque", "output.torque"],
        value: None,
        beside: Some(&[]),
        of_controller: true,
    },
];

/// An input: what it gets.
pub(super) struct Input {
    value: fn(&ModuleSample, f64) -> f64,
    factor: f64,
    offset: f64,
}

impl Input {
    /// In the unit of its variable.
    pub(super) fn value(&self, sample: &ModuleSample, torque_limit: f64) -> f64 {
        ((self.value)(sample, torque_limit) - self.offset) / self.factor
    }
}

/// Variables that are signals.
pub(super) struct Mapped {
    /// Value references of the inputs, and what they get.
    pub(super) references: Vec<u32>,
    pub(super) inputs: Vec<Input>,
    /// Value reference of the torque, factor and offset of its unit.
    pub(super) torque: (u32, f64, f64),
    /// For a reader.
    pub(super) signals: Vec<Signal>,
}

/// Finds the variables by their names, or as `map` says: a signal, a variable.
pub(super) fn mapped(model: &Model, role: Role, map: &[(String, String)]) -> Result<Mapped, String> {
    let of_role = || KNOWN.iter().filter(|known| known.is_of(role));
    for (name, _) in map {
        if !of_role().any(|known| known.name == name) {
            let names: Vec<&str> = of_role().map(|known| known.name).collect();
            let did =
                nearest(name, names.iter().copied()).map_or(String::new(), |name| format!("Did you mean {name}? "));
            return Err(format!("a {role} has no signal {name}. {did}There are: {}", names.join(", ")));
        }
        if map.iter().filter(|other| other.0 == *name).count() > 1 {
            return Err(format!("{name} is mapped twice. Map it once"));
        }
    }
    let (mut references, mut inputs, mut torque, mut signals) = (Vec::new(), Vec::new(), None, Vec::new());
    for known in of_role() {
        let Some(variable) = found(known, model, role, map)? else { continue };
        let (factor, offset) = conversion(known, variable, model)?;
        match known.value {
            Some(_) if references.contains(&variable.reference) => {
                return Err(format!(
                    "{} would be two signals, {} one of them. Map each to its own",
                    variable.name, known.name
                ));
            }
            Some(value) => {
                references.push(variable.reference);
                inputs.push(Input { value, factor, offset });
            }
            None => torque = Some((variable.reference, factor, offset)),
        }
        let unit = variable.unit.clone().unwrap_or_default();
        signals.push(Signal { name: known.name.into(), variable: variable.name.clone(), unit });
    }
    let Some(torque) = torque else {
        let outputs = names(model, "output");
        return Err(format!(
            "none of its outputs is the torque. Say which one is: --map torque=NAME. Its outputs: {outputs}"
        ));
    };
    let (motion, words): (&[&str], _) = match role {
        Role::Controller => (&["measured_angle", "measured_velocity"], "measured angle or velocity"),
        Role::Friction => (&["estimated_velocity", "measured_velocity"], "estimated or measured velocity"),
        Role::Law => (&["estimated_velocity", "measured_velocity", "measured_angle"], "velocity or the angle"),
    };
    if !signals.iter().any(|signal| motion.contains(&signal.name.as_str())) {
        return Err(format!(
            "none of its inputs is the {words}. Say which one is: --map {}=NAME. Its inputs: {}",
            motion[0],
            names(model, "input")
        ));
    }
    Ok(Mapped { references, inputs, torque, signals })
}

/// The variable of a signal.
fn found<'a>(
    known: &Known,
    model: &'a Model,
    role: Role,
    map: &[(String, String)],
) -> Result<Option<&'a Variable>, String> {
    let causality = if known.value.is_some() { "input" } else { "output" };
    let variable = match map.iter().find(|(name, _)| name == known.name) {
        Some((_, wanted)) => {
            let variable = model.variables.iter().find(|variable| variable.name == *wanted).ok_or_else(|| {
                let all = model.variables.iter().filter(|it| it.causality == causality).map(|it| it.name.as_str());
                let did = nearest(wanted, all).map_or(String::new(), |name| format!("Did you mean {name}? "));
                format!("it has no variable {wanted}. {did}Its {causality}s: {}", names(model, causality))
            })?;
            if variable.causality != causality {
                let (name, is) = (known.name, &variable.causality);
                return Err(format!("{name} is an {causality} of a {role}, and {wanted} has the causality {is}"));
            }
            Some(variable)
        }
        None => known.variables(role).find_map(|name| {
            model.variables.iter().find(|variable| variable.name == name && variable.causality == causality)
        }),
    };
    match variable {
        Some(variable) if !variable.number() => {
            let what = if variable.scalar { variable.kind.as_str() } else { "array" };
            Err(format!(
                "{} has the type {what}, and {} is one number (Real in FMI 2.0, Float64 in FMI 3.0)",
                variable.name, known.name
            ))
        }
        variable => Ok(variable),
    }
}

/// Factor and offset from the unit of a variable to that of the signal.
fn conversion(known: &Known, variable: &Variable, model: &Model) -> Result<(f64, f64), String> {
    let Some(unit) = &variable.unit else { return Ok((1.0, 0.0)) };
    let (si, words) = known.quantity.words();
    known.quantity.convert(unit, model.units.get(unit).copied().flatten()).ok_or_else(|| {
        format!(
            "{} has the unit {unit}, which is not that of {words}, or is defined nowhere; {} is given in {si}. State a \
             unit of {words}, with its BaseUnit",
            variable.name, known.name
        )
    })
}

/// Names of the numbers of a causality, the first ones.
fn names(model: &Model, causality: &str) -> String {
    let numbers = model.variables.iter().filter(|it| it.causality == causality && it.number());
    listed(numbers.map(|it| it.name.clone()))
}

/// The first of many, and how many there are besides.
pub(super) fn listed(all: impl Iterator<Item = String>) -> String {
    let all: Vec<String> = all.collect();
    match all.len() {
        0 => "none".into(),
        count if count <= LISTED => all.join(", "),
        count => format!("{} and {} more", all[..LISTED].join(", "), count - LISTED),
    }
}
