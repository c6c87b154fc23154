//! Interrupt coalescing, from the text of `ethtool -c`.

use super::{Coalescing, Finding};
use crate::doctor::Verdict;

pub(super) fn finding(interface: &str, text: &Coalescing) -> Finding {
    let (what, costs) = (
        "interrupt coalescing",
        "The card collects frames before it reports them: each frame is late by up to this time.",
    );
    let unknown = |found: String| Finding { what, found, verdict: Verdict::Unknown, costs, remedy: None };
    let text = match text {
        Ok(text) => text,
        Err(reason) => return unknown(format!("{reason}; `ethtool -c {interface}` shows it")),
    };
    let Settings { adaptive, times } = Settings::of(text);
    if times.is_empty() && adaptive.is_empty() {
        return unknown("not reported by the driver".into());
    }
    let late: Vec<_> = times.iter().filter(|(_, time)| *time > 0).collect();
    if late.is_empty() && adaptive.is_empty() {
        return Finding::good(what, "off", costs);
    }
    let found = adaptive.iter().map(|name| format!("{name} on"));
    let found: Vec<String> = found.chain(late.iter().map(|(name, time)| format!("{name} {time} µs"))).collect();
    let off = adaptive.iter().map(|name| format!("{name} off")).chain(late.iter().map(|(name, _)| format!("{name} 0")));
    let remedy = format!("sudo ethtool -C {interface} {}", off.collect::<Vec<_>>().join(" "));
    Finding::costs(what, found.join(", "), costs, Some(remedy))
}

/// Settings that delay frames.
#[derive(Debug, Default, PartialEq)]
struct Settings {
    /// Directions with adaptive coalescing.
    adaptive: Vec<&'static str>,
    /// Names and times [µs].
    times: Vec<(&'static str, u64)>,
}

impl Settings {
    fn of(text: &str) -> Self {
        let mut settings = Settings::default();
        for line in text.lines() {
            if let Some(adaptive) = line.strip_prefix("Adaptive ") {
                let words: Vec<&str> = adaptive.split_whitespace().collect();
                for (key, name) in [("RX:", "adaptive-rx"), ("TX:", "adaptive-tx")] {
                    if words.windows(2).any(|pair| pair == [key, "on"]) {
                        settings.adaptive.push(name);
                    }
                }
            }
            for name in ["rx-usecs", "tx-usecs"] {
                let value = line.strip_prefix(name).and_then(|rest| rest.strip_prefix(':'));
                if let Some(time) = value.and_then(|value| value.trim().parse().ok()) {
                    settings.times.push((name, time));
                }
            }
        }
        settings
    }
}
