//! Faults of emulated drives on request, from standard input.

use std::io;
use std::sync::mpsc;
use std::thread;

/// A fault: position of the device, entry of its object 0x2020, value.
pub(super) type FaultRequest = (usize, u8, u16);

/// Requests from the lines of standard input; `Err` for a line that is none.
pub(super) fn requests() -> mpsc::Receiver<Result<FaultRequest, String>> {
    let (sender, requests) = mpsc::channel();
    // It ends with the program.
    thread::spawn(move || {
        for line in io::stdin().lines().map_while(Result::ok) {
            if sender.send(request(&line).ok_or(line)).is_err() {
                return;
            }
        }
    });
    requests
}

/// A line such as `0 1 0x4210`.
fn request(line: &str) -> Option<FaultRequest> {
    let mut words = line.split_whitespace();
    let mut number = || {
        let word = words.next()?;
        match word.strip_prefix("0x") {
            Some(digits) => u16::from_str_radix(digits, 16).ok(),
            None => word.parse().ok(),
        }
    };
    let request = (number()?.into(), number()?.try_into().ok()?, number()?);
    words.next().is_none().then_some(request)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_a_position_an_entry_and_a_value() {
        assert_eq!(request("0 1 0x4210"), Some((0, 1, 0x4210)));
        assert_eq!(request(" 1\t5 1500 "), Some((1, 5, 1500)));
        for line in ["", "0 1", "0 1 2 3", "0 1 0x12345", "0 300 1", "fault 1 1"] {
            assert_eq!(request(line), None, "{line}");
        }
    }
}
