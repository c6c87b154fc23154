//! Progress on stderr: a line that counts on a terminal, nothing elsewhere unless it is asked for. Ctrl-C cancels.

use std::io::{self, IsTerminal, Write};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use stickslip::Watch;

use crate::failure::CANCELLED;
use crate::shown::Shown;

/// The watch of a command: shows its stages on stderr and cancels at the first Ctrl-C; the second ends at once.
pub(crate) fn watch(shown: Shown) -> Watch {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    let handler = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            process::exit(i32::from(CANCELLED));
        }
    });
    if let Err(error) = handler {
        // The work is possible without it: Ctrl-C then ends at once, unfinished files are not left behind.
        let _ = writeln!(io::stderr(), "note: Ctrl-C will not wait for a good place to stop ({error})");
    }
    let form = match (shown.quiet, io::stderr().is_terminal(), shown.progress) {
        (true, ..) | (false, false, false) => Form::Silent,
        (false, true, _) => Form::Terminal,
        (false, false, true) => Form::Lines,
    };
    let progress = Mutex::new(Progress::new(io::stderr(), form));
    Watch::new(cancelled, move |stage, fraction| {
        progress.lock().unwrap_or_else(PoisonError::into_inner).report(stage, fraction);
    })
}

/// Where progress goes.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    /// A terminal: a line that counts.
    Terminal,
    /// A line each tenth.
    Lines,
    /// Nowhere.
    Silent,
}

/// Shows one stage after the other.
struct Progress<W: Write> {
    sink: W,
    form: Form,
    stage: String,
    percent: u32,
    begin: Instant,
    width: usize,
}

impl<W: Write> Progress<W> {
    fn new(sink: W, form: Form) -> Self {
        Progress { sink, form, stage: String::new(), percent: 0, begin: Instant::now(), width: 0 }
    }

    fn report(&mut self, stage: &str, fraction: f64) {
        let step = if self.form == Form::Lines { 10 } else { 1 };
        let percent = (fraction * 100.0) as u32 / step * step;
        let new = self.stage != stage;
        if self.form == Form::Silent || (!new && percent == self.percent) {
            return;
        }
        if new {
            self.begin = Instant::now();
        }
        let text = format!("{stage} {percent} %{}", left(self.begin.elapsed().as_secs_f64(), fraction));
        // Progress is a courtesy: work goes on where nobody takes it.
        let _ = match (self.form, new && !self.stage.is_empty()) {
            (Form::Lines, _) => writeln!(self.sink, "{stage} {percent} %"),
            (_, true) => write!(self.sink, "\n{text}"),
            // What was longer is wiped out.
            (_, false) => write!(self.sink, "\r{text:width$}", width = self.width),
        };
        let _ = self.sink.flush();
        self.stage = stage.into();
        self.percent = percent;
        self.width = text.chars().count();
    }
}

/// The time that a stage still takes, at the pace so far; nothing before that means something.
fn left(elapsed: f64, fraction: f64) -> String {
    if elapsed < 1.0 || !(0.02..1.0).contains(&fraction) {
        return String::new();
    }
    let seconds = elapsed * (1.0 - fraction) / fraction;
    if seconds < 90.0 { format!(", {seconds:.0} s left") } else { format!(", {:.0} min left", seconds / 60.0) }
}

impl<W: Write> Drop for Progress<W> {
    /// What comes next on the terminal begins a line of its own.
    fn drop(&mut self) {
        if self.form == Form::Terminal && !self.stage.is_empty() {
            let _ = writeln!(self.sink);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(form: Form) -> String {
        let mut out = Vec::new();
        let mut progress = Progress::new(&mut out, form);
        for (stage, fraction) in
            [("measure", 0.0), ("measure", 0.001), ("measure", 0.5), ("measure", 0.51), ("fit", 1.0)]
        {
            progress.report(stage, fraction);
        }
        drop(progress);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn a_terminal_counts_on_one_line_a_stage() {
        assert_eq!(shown(Form::Terminal), "\rmeasure 0 %\rmeasure 50 %\rmeasure 51 %\nfit 100 %\n");
    }

    #[test]
    fn a_file_gets_a_line_each_tenth_where_that_is_asked_for() {
        assert_eq!(shown(Form::Lines), "measure 0 %\nmeasure 50 %\nfit 100 %\n");
        assert_eq!(shown(Form::Silent), "");
    }

    #[test]
    fn the_time_left_follows_from_the_pace() {
        assert_eq!(left(10.0, 0.25), ", 30 s left");
        assert_eq!(left(60.0, 0.1), ", 9 min left");
        assert_eq!((left(0.5, 0.5), left(10.0, 0.0), left(10.0, 1.0)), (String::new(), String::new(), String::new()));
    }
}
