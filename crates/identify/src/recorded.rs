//! The recording as understood, for reports: figures, and the list of what was done to it.

use crate::machine::{Axis, Recorded, Signals};
use stickslip_base::figure::{Axis as FigureAxis, Figure, Role, Series};

/// Heading of the list of findings.
pub const DONE: &str = "What was done to the recording";

/// What was done to a recording, one sentence or more for each finding.
pub fn done(signals: &Signals) -> Vec<String> {
    if signals.findings.is_empty() {
        vec!["Nothing: all rows were used as read.".into()]
    } else {
        signals.findings.clone()
    }
}

/// Figures of position and command with file names and captions.
pub(crate) fn figures(
    signals: &Signals,
    axis: Axis,
    command_unit: &'static str,
) -> [(&'static str, Figure, String); 2] {
    let recorded = &signals.recorded;
    let length = axis.position().si_unit();
    let quantity = if axis == Axis::Linear { "position" } else { "angle" };
    let caption = "The recording as it was used. Rows in grey were left out; corrected rows are marked.";
    [
        (
            "figure-recording.svg",
            figure(recorded, "Recorded position", FigureAxis::new(quantity, length), &recorded.position),
            caption.into(),
        ),
        (
            "figure-recorded-command.svg",
            figure(recorded, "Recorded command", FigureAxis::new("command", command_unit), &recorded.command),
            "The command in the same rows.".into(),
        ),
    ]
}

fn figure(recorded: &Recorded, title: &str, y: FigureAxis, values: &[f64]) -> Figure {
    let at = |row: usize| (recorded.time[row], values[row]);
    let mut figure = Figure::new(title).x(FigureAxis::new("time t", "s")).y(y).series(Series::line(
        Role::Measured,
        "recorded",
        (0..values.len()).map(at),
    ));
    let corrected = recorded.corrected.iter().flat_map(Clone::clone).map(at);
    if !recorded.corrected.is_empty() {
        figure = figure.series(Series::points(Role::Reference, "corrected", corrected));
    }
    for range in &recorded.left_out {
        figure = figure.interval(recorded.time[range.start], recorded.time[range.end - 1], "left out");
    }
    figure
}
