//! Progress on stderr: a line that counts on a terminal, one plain line a stage elsewhere. Ctrl-C cancels.

use std::io::{self, IsTerminal, Write};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use stickslip::Watch;

/// The watch of a command: shows its stages on stderr and cancels at the first Ctrl-C; the second ends at once.
pub(crate) fn watch() -> Watch {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    let handler = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            process::exit(1);
        }
    });
    if let Err(error) = handler {
        // The work is possible without it: Ctrl-C then ends at once, unfinished files are not left behind.
        let _ = writeln!(io::stderr(), "note: Ctrl-C will not wait for a good place to stop ({error})");
    }
    let progress = Mutex::new(Progress::new(io::stderr(), io::stderr().is_terminal()));
    Watch::new(cancelled, move |stage, fraction| {
        progress.lock().unwrap_or_else(PoisonError::into_inner).report(stage, fraction);
    })
}

/// Shows one stage after the other.
struct Progress<W: Write> {
    sink: W,
    terminal: bool,
    stage: String,
    percent: u32,
}

impl<W: Write> Progress<W> {
    fn new(sink: W, terminal: bool) -> Self {
        Progress { sink, terminal, stage: String::new(), percent: 0 }
    }

    fn report(&mut self, stage: &str, fraction: f64) {
        let percent = (fraction * 100.0) as u32;
        let new = self.stage != stage;
        if !new && (!self.terminal || percent == self.percent) {
            return;
        }
        // Progress is a courtesy: work goes on where nobody takes it.
        let _ = match (self.terminal, new) {
            (false, _) => writeln!(self.sink, "{stage} …"),
            (true, true) if !self.stage.is_empty() => write!(self.sink, "\n{stage} {percent} %"),
            (true, _) => write!(self.sink, "\r{stage} {percent} %"),
        };
        let _ = self.sink.flush();
        self.stage = stage.into();
        self.percent = percent;
    }
}

impl<W: Write> Drop for Progress<W> {
    /// What comes next on the terminal begins a line of its own.
    fn drop(&mut self) {
        if self.terminal && !self.stage.is_empty() {
            let _ = writeln!(self.sink);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(terminal: bool) -> String {
        let mut out = Vec::new();
        let mut progress = Progress::new(&mut out, terminal);
        for (stage, fraction) in [("measure", 0.0), ("measure", 0.001), ("measure", 0.5), ("fit", 1.0)] {
            progress.report(stage, fraction);
        }
        drop(progress);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn a_terminal_counts_on_one_line_a_stage() {
        assert_eq!(shown(true), "\rmeasure 0 %\rmeasure 50 %\nfit 100 %\n");
    }

    #[test]
    fn a_file_gets_one_plain_line_a_stage() {
        assert_eq!(shown(false), "measure …\nfit …\n");
    }
}
