//! A change as a line of text in a record: a word and its numbers, which are read back exactly.

use std::fmt::Write as _;

use stickslip_software::cycle::Change;
use stickslip_software::supervise::{ExternalFault, HomingFault, MachineFault, Request, Role};

use super::numbers::{from_numbers, numbers};
use crate::tap::ChangeKind;

const REQUESTS: [(&str, Request); 6] = [
    ("home", Request::Home),
    ("arm", Request::Arm),
    ("start", Request::Start),
    ("stop", Request::Stop),
    ("off", Request::Off),
    ("acknowledge", Request::Acknowledge),
];

/// Text of a change.
pub(super) fn line(what: &ChangeKind) -> String {
    match what {
        ChangeKind::Preload(preload) => format!("preload {preload}"),
        ChangeKind::Fault(injection) => format!("fault {injection}"),
        ChangeKind::Software(Change::Request(request), _) => {
            let name = REQUESTS.iter().find(|(_, other)| other == request).map_or("", |(name, _)| name);
            format!("request {name}")
        }
        ChangeKind::Software(Change::Homed(index), _) => format!("homed {index}"),
        ChangeKind::Software(Change::HomingFailed(fault), _) => match *fault {
            HomingFault::NoIndex { travel } => format!("no_index {travel}"),
            HomingFault::IndexLost { expected } => format!("index_lost {expected}"),
            HomingFault::IndexMoved { first, second } => format!("index_moved {first} {second}"),
            HomingFault::NotANumber => "index_not_a_number".into(),
        },
        ChangeKind::Software(Change::MachineFailed(fault), _) => match *fault {
            MachineFault::Silent { ticks } => format!("machine_silent {ticks}"),
            MachineFault::Restarted => "machine_anew".into(),
            MachineFault::Device { position, error, status } => format!("machine_device {position} {error} {status}"),
            MachineFault::WorkingCounter { counter, due } => format!("machine_counter {counter} {due}"),
        },
        ChangeKind::Software(Change::ForeignFailed(role, fault), _) => match *fault {
            ExternalFault::Crashed { signal } => format!("{role}_crashed {signal}"),
            ExternalFault::Ended { code } => format!("{role}_ended {code}"),
            ExternalFault::Silent { time } => format!("{role}_silent {time}"),
            ExternalFault::NotANumber => format!("{role}_not_a_number"),
            ExternalFault::Failed { code } => format!("{role}_failed {code}"),
            ExternalFault::FloatingPoint => format!("{role}_floating_point"),
            ExternalFault::Late { time } => format!("{role}_late {time}"),
        },
        ChangeKind::Software(Change::Parameters(parameters), _) => {
            let mut text = String::from("parameters");
            for number in numbers(parameters) {
                // Writing to a string never fails.
                let _ = write!(text, " {number}");
            }
            text
        }
    }
}

/// The change of a line; `None` for an invalid line. A refused change is refused again in a replay.
pub(super) fn parse(line: &str) -> Option<ChangeKind> {
    let mut words = line.split(' ');
    let kind = words.next()?;
    if kind == "request" {
        let name = words.next()?;
        let (_, request) = REQUESTS.iter().find(|(other, _)| *other == name)?;
        return words.next().is_none().then_some(ChangeKind::Software(Change::Request(*request), None));
    }
    if kind == "fault" {
        let injection = words.next()?.parse().ok()?;
        return words.next().is_none().then_some(ChangeKind::Fault(injection));
    }
    let numbers = words.map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>()?;
    let change = match (kind, &numbers[..]) {
        ("preload", [preload]) => return Some(ChangeKind::Preload(*preload)),
        ("homed", [index]) => Change::Homed(*index),
        ("no_index", [travel]) => Change::HomingFailed(HomingFault::NoIndex { travel: *travel }),
        ("index_lost", [expected]) => Change::HomingFailed(HomingFault::IndexLost { expected: *expected }),
        ("index_moved", [first, second]) => {
            Change::HomingFailed(HomingFault::IndexMoved { first: *first, second: *second })
        }
        ("index_not_a_number", []) => Change::HomingFailed(HomingFault::NotANumber),
        ("machine_silent", [ticks]) => Change::MachineFailed(MachineFault::Silent { ticks: *ticks as u64 }),
        ("machine_anew", []) => Change::MachineFailed(MachineFault::Restarted),
        ("machine_device", [position, error, status]) => Change::MachineFailed(MachineFault::Device {
            position: *position as u16,
            error: *error as u16,
            status: *status as u16,
        }),
        ("machine_counter", [counter, due]) => {
            Change::MachineFailed(MachineFault::WorkingCounter { counter: *counter as u16, due: *due as u16 })
        }
        ("parameters", numbers) => Change::Parameters(from_numbers(numbers)?),
        _ => {
            let (role, fault) = kind.split_once('_')?;
            let role = Role::find(role)?;
            Change::ForeignFailed(role, external_fault(fault, &numbers)?)
        }
    };
    Some(ChangeKind::Software(change, None))
}

fn external_fault(kind: &str, numbers: &[f64]) -> Option<ExternalFault> {
    Some(match (kind, numbers) {
        ("crashed", [signal]) => ExternalFault::Crashed { signal: *signal as i32 },
        ("ended", [code]) => ExternalFault::Ended { code: *code as i32 },
        ("silent", [time]) => ExternalFault::Silent { time: *time },
        ("not_a_number", []) => ExternalFault::NotANumber,
        ("failed", [code]) => ExternalFault::Failed { code: *code as i32 },
        ("floating_point", []) => ExternalFault::FloatingPoint,
        ("late", [time]) => ExternalFault::Late { time: *time },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use stickslip_software::cycle::Parameters;

    use super::*;

    #[test]
    fn every_change_is_read_back_from_its_line() {
        let mut parameters = Parameters::default();
        parameters.tick.control_period = 0.1 + 0.2;
        parameters.safety.speed = f64::INFINITY;
        let requests = REQUESTS.map(|(_, request)| Change::Request(request));
        let others = [
            Change::Homed(-1.0 / 3.0),
            Change::HomingFailed(HomingFault::NoIndex { travel: 9.5 }),
            Change::HomingFailed(HomingFault::IndexLost { expected: 1e-300 }),
            Change::HomingFailed(HomingFault::IndexMoved { first: 1.0, second: -2.0 }),
            Change::HomingFailed(HomingFault::NotANumber),
            Change::MachineFailed(MachineFault::Silent { ticks: 9 }),
            Change::MachineFailed(MachineFault::Restarted),
            Change::MachineFailed(MachineFault::Device { position: 1, error: 0x2310, status: 0x1A }),
            Change::MachineFailed(MachineFault::WorkingCounter { counter: 4, due: 7 }),
            Change::ForeignFailed(Role::Controller, ExternalFault::Crashed { signal: 11 }),
            Change::ForeignFailed(Role::Controller, ExternalFault::Ended { code: -3 }),
            Change::ForeignFailed(Role::Controller, ExternalFault::Silent { time: 0.1 }),
            Change::ForeignFailed(Role::Controller, ExternalFault::NotANumber),
            Change::ForeignFailed(Role::Controller, ExternalFault::Failed { code: 7 }),
            Change::ForeignFailed(Role::Controller, ExternalFault::FloatingPoint),
            Change::ForeignFailed(Role::Friction, ExternalFault::Late { time: 7.5e-4 }),
            Change::ForeignFailed(Role::Law, ExternalFault::NotANumber),
            Change::Parameters(parameters),
        ];
        let software = requests.into_iter().chain(others).map(|change| ChangeKind::Software(change, None));
        let fault = ChangeKind::Fault("counts-lost=0.03@1.25s".parse().unwrap());
        for what in software.chain([ChangeKind::Preload(0.28), fault]) {
            assert_eq!(parse(&line(&what)), Some(what), "{}", line(&what));
        }
    }

    #[test]
    fn an_invalid_line_is_refused() {
        for line in [
            "",
            "homed",
            "homed one",
            "homed 1 2",
            "request",
            "request fly",
            "request home 1",
            "fault dragon@1s",
            "parameters 1",
            "no",
        ] {
            assert_eq!(parse(line), None, "{line}");
        }
    }
}
