//! Meaning of states and codes of EtherCAT and CiA 402.

/// State of a device that does not answer, and what to do.
pub(super) const NO_ANSWER: &str = "no answer";
pub(super) const ABSENT: &str = "check supply and cable; when it answers, it is brought to OP while the bench is off or has a \
                                 fault";

/// Name of an AL state.
pub(super) fn al_state(state: u8) -> &'static str {
    match state & 0x0F {
        0 => NO_ANSWER,
        1 => "INIT",
        2 => "PRE-OP",
        3 => "BOOT",
        4 => "SAFE-OP",
        8 => "OP",
        _ => "unknown",
    }
}

/// An error code (0x603F) with its meaning, of CiA 402 as far as it is a common one.
pub(super) fn error_code(code: u16) -> String {
    let meaning = match code {
        0x2310..=0x2313 => "over-current",
        0x2320..=0x234F => "short circuit or earth leakage",
        0x3110..=0x3114 => "supply voltage too high",
        0x3120..=0x3124 => "supply voltage too low",
        0x3130..=0x3134 => "phase of the supply missing",
        0x3210..=0x3219 => "voltage of the DC link too high; check the brake resistor",
        0x3220..=0x3229 => "voltage of the DC link too low",
        0x4210..=0x421F => "drive too hot",
        0x4310..=0x431F => "motor or drive too hot",
        0x5441..=0x5444 => "contactor or safe torque off",
        0x6320..=0x632F => "parameter",
        0x7100..=0x71FF => "brake or power section",
        0x7300..=0x73FF => "encoder",
        0x7500..=0x75FF | 0x8100..=0x81FF => "communication",
        0x8400..=0x84FF => "velocity control",
        0x8611 => "following error",
        0x2000..=0x2FFF => "current",
        0x3000..=0x3FFF => "voltage",
        0x4000..=0x4FFF => "temperature",
        0x5000..=0x5FFF => "hardware of the drive",
        _ => "see the manual of the drive",
    };
    format!("error code 0x{code:04X}: {meaning}")
}

/// An AL status code with its meaning.
pub(super) fn al_status_code(code: u16) -> String {
    let meaning = match code {
        0x0011 => "invalid change of state",
        0x0016 => "mailbox differs from the EEPROM",
        0x0019 => "no valid outputs",
        0x001A => "synchronisation: too many set-points missed",
        0x001B => "watchdog: no set-points in time",
        0x001D => "length or address of the outputs",
        0x001E => "length or address of the inputs",
        0x002C => "SYNC0 lost",
        0x002D => "no SYNC0",
        0x0030 | 0x0035 => "period of SYNC0",
        0x0032 => "distributed clock not synchronised",
        _ => "see the manual of the device",
    };
    format!("AL status code 0x{code:04X}: {meaning}")
}
