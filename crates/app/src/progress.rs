//! Progress on stderr: one updated line on a terminal, otherwise nothing, or lines with `--progress`. Ctrl-C cancels.

use std::io::{self, IsTerminal, Write};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use stickslip::Watch;

use crate::failure::CANCELLED;
use crate::output_options::OutputOptions;

/// The watch of a command: shows its stages on stderr. The first Ctrl-C cancels, the second ends the program at once.
pub(crate) fn watch(options: OutputOptions) -> Watch {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    let handler = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            process::exit(i32::from(CANCELLED));
        }
    });
    if let Err(error) = handler {
        // Not fatal: Ctrl-C then ends the program at once. Files are written atomically.
        let _ = writeln!(io::stderr(), "Note: Ctrl-C ends the program at once, without partial results ({error}).");
    }
    let form = match (options.quiet, io::stderr().is_terminal(), options.progress) {
        (true, ..) | (false, false, false) => Form::Silent,
        (false, true, _) => Form::Terminal,
        (false, false, true) => Form::Lines,
    };
    let progress = Mutex::new(Progress::new(io::stderr(), form));
    Watch::new(cancelled, move |stage, fraction| {
        progress.lock().unwrap_or_else(PoisonError::into_inner).report(stage, fraction);
    })
}

/// Form of the progress output.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    /// A terminal: one updated line.
    Terminal,
    /// A line for each 10 %.
    Lines,
    /// No output.
    Silent,
}

/// Output of the progress of successive stages.
struct Progress<W: Write> {
    sink: W,
    form: Form,
    stage: String,
    percent: u32,
    start: Instant,
    width: usize,
}

impl<W: Write> Progress<W> {
    fn new(sink: W, form: Form) -> Self {
        Progress { sink, form, stage: String::new(), percent: 0, start: Instant::now(), width: 0 }
    }

    fn report(&mut self, stage: &str, fraction: f64) {
        let step = if self.form == Form::Lines { 10 } else { 1 };
        let percent = (fraction * 100.0) as u32 / step * step;
        let new = self.stage != stage;
        if self.form == Form::Silent || (!new && percent == self.percent) {
            return;
        }
        if new {
            self.start = Instant::now();
        }
        let text = format!("{stage} {percent} %{}", time_left(self.start.elapsed().as_secs_f64(), fraction));
        // A failed write of progress does not stop the work.
        let _ = match (self.form, new && !self.stage.is_empty()) {
            (Form::Lines, _) => writeln!(self.sink, "{stage} {percent} %"),
            (_, true) => write!(self.sink, "\n{text}"),
            // Spaces overwrite the rest of a longer line.
            (_, false) => write!(self.sink, "\r{text:width$}", width = self.width),
        };
        let _ = self.sink.flush();
        self.stage = stage.into();
        self.percent = percent;
        self.width = text.chars().count();
    }
}

/// Estimate of the remaining time of a stage; empty during the first second and below 2 %.
fn time_left(elapsed: f64, fraction: f64) -> String {
    if elapsed < 1.0 || !(0.02..1.0).contains(&fraction) {
        return String::new();
    }
    let seconds = elapsed * (1.0 - fraction) / fraction;
    if seconds < 90.0 { format!(", {seconds:.0} s left") } else { format!(", {:.0} min left", seconds / 60.0) }
}

impl<W: Write> Drop for Progress<W> {
    /// Ends the line on a terminal.
    fn drop(&mut self) {
        if self.form == Form::Terminal && !self.stage.is_empty() {
            let _ = writeln!(self.sink);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn output(form: Form) -> String {
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
    fn a_terminal_has_one_updated_line_for_each_stage() {
        assert_eq!(output(Form::Terminal), "\rmeasure 0 %\rmeasure 50 %\rmeasure 51 %\nfit 100 %\n");
    }

    #[test]
    fn the_option_progress_prints_a_line_for_each_10_percent() {
        assert_eq!(output(Form::Lines), "measure 0 %\nmeasure 50 %\nfit 100 %\n");
        assert_eq!(output(Form::Silent), "");
    }

    #[test]
    fn the_remaining_time_is_extrapolated_from_the_elapsed_time() {
        assert_eq!(time_left(10.0, 0.25), ", 30 s left");
        assert_eq!(time_left(60.0, 0.1), ", 9 min left");
        for (elapsed, fraction) in [(0.5, 0.5), (10.0, 0.0), (10.0, 1.0)] {
            assert_eq!(time_left(elapsed, fraction), "");
        }
    }
}
