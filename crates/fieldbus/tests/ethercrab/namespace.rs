//! A network namespace for each test, with a pair of virtual interfaces.

use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Set in the namespace.
const INSIDE: &str = "STICKSLIP_IN_NAMESPACE";

/// One bench in real time at a time.
static RUNNING: Mutex<()> = Mutex::new(());

/// Whether the test is in its namespace. Outside, it is started there and must succeed.
pub(crate) fn is_inside(test: &str) -> bool {
    if std::env::var_os(INSIDE).is_some() {
        return true;
    }
    let permitted = |options: &&str| {
        let mut probe = Command::new("unshare");
        probe.args([*options, "ip", "link", "add", "ec0", "type", "veth", "peer", "name", "ec1"]);
        probe.output().is_ok_and(|output| output.status.success())
    };
    // As root, so that the threads have a real-time priority; otherwise with a user namespace.
    let Some(options) = ["-n", "-rn"].into_iter().find(|options| permitted(options)) else {
        println!("NOT RUN: this computer permits no network namespace with virtual interfaces, or iproute2 is missing");
        return false;
    };
    let _running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    let program = std::env::current_exe().unwrap();
    let mut command = Command::new("unshare");
    command.arg(options).arg(program).args(["--exact", test, "--nocapture"]).env(INSIDE, "1");
    assert!(command.status().unwrap().success());
    false
}

/// Runs `ip` with these arguments.
pub(crate) fn ip(arguments: &str) {
    assert!(Command::new("ip").args(arguments.split(' ')).status().unwrap().success(), "ip {arguments}");
}

/// Interfaces `main` and `sub`, connected.
pub(crate) fn pair_of_interfaces() {
    ip("link add main type veth peer name sub");
    ip("link set main up");
    ip("link set sub up");
}

/// Ends the server also when an assertion fails.
pub(crate) struct End<'a>(pub(crate) &'a AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}
