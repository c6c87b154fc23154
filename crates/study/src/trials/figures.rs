//! The figures of a trial: position with its set-point, deviation and torque over time.

use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_experiment::trial::Repetition;

/// Number of repetitions in a figure.
const DRAWN: usize = 3;
/// Intervals of time in a curve, of each of which the extremes are drawn.
const PARTS: usize = 1000;

/// Position, deviation and torque of the first repetitions, with captions.
pub(super) fn figures(repetitions: &[Repetition]) -> [(Figure, String); 3] {
    let drawn = &repetitions[..repetitions.len().min(DRAWN)];
    let start = drawn.first().and_then(|first| first.setpoint.first()).copied().unwrap_or_default();
    let setpoint = drawn.first().map(|first| {
        let values = first.setpoint.iter().map(|setpoint| setpoint - start);
        Series::line(Role::Reference, "set-point", over_time(first.course.period, values)).dashed()
    });
    let all = |value: fn(&Repetition, usize) -> f64, offset: f64, factor: f64| {
        drawn.iter().enumerate().map(move |(index, repetition)| {
            let values = (0..repetition.setpoint.len()).map(|k| factor * (value(repetition, k) - offset));
            let name = if drawn.len() == 1 { "measured".into() } else { format!("repetition {}", index + 1) };
            Series::line(Role::Trace(index), name, over_time(repetition.course.period, values))
        })
    };
    let figure = |title: &str, quantity: &str, unit: &str| {
        Figure::new(title).x(Axis::new("time", "s")).y(Axis::new(quantity, unit))
    };
    let position = all(|it, k| it.setpoint[k] - it.course.deviation[k], start, 1.0).chain(setpoint);
    let deviation = all(|it, k| it.course.deviation[k], 0.0, 1e3);
    let torque = all(|it, k| it.course.torque[k], 0.0, 1.0);
    [
        (
            position.fold(figure("Position", "angle from the start", "rad"), Figure::series),
            "Measured angle of the screw and its set-point.".into(),
        ),
        (
            deviation.fold(figure("Deviation", "deviation", "mrad"), Figure::series),
            "Set-point minus measured angle.".into(),
        ),
        (
            torque.fold(figure("Torque", "commanded torque", "N m"), Figure::series),
            "Torque that the position controller commands.".into(),
        ),
    ]
}

/// Values over time [s]: of long courses the smallest and the largest one of each interval, which keep every spike.
pub(crate) fn over_time(period: f64, values: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    let values: Vec<(f64, f64)> = values.enumerate().map(|(k, value)| (k as f64 * period, value)).collect();
    let each = values.len().div_ceil(PARTS).max(1);
    if each <= 2 {
        return values;
    }
    let extremes = |part: &[(f64, f64)]| {
        let by_value = |one: &&(f64, f64), other: &&(f64, f64)| one.1.total_cmp(&other.1);
        let ends =
            [part.iter().min_by(by_value), part.iter().max_by(by_value)].map(|end| end.copied().unwrap_or_default());
        if ends[0].0 <= ends[1].0 { ends } else { [ends[1], ends[0]] }
    };
    values.chunks(each).flat_map(extremes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::Preset;
    use stickslip_base::figure::panels;
    use stickslip_base::parameters::presets;
    use stickslip_simulate::manoeuvre::{Course, Scores};

    #[test]
    fn a_spike_of_the_deviation_is_in_the_picture_and_positions_begin_at_zero() {
        let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        let count = 50_000;
        let mut deviation = vec![1e-3; count];
        deviation[12_345] = 0.5;
        let course = Course { period: 1e-3, deviation, velocity: vec![0.0; count], torque: vec![0.2; count] };
        let scores = Scores::of(None, &course, &preset, 0.5);
        let one = Repetition { chance: 0.5, setpoint: vec![7.0; count], course, scores };
        let drawn = figures(&[one.clone(), one]).map(|(figure, _)| figure);
        let text = panels("A trial", &drawn);
        // The descriptions list the ranges of the values.
        assert!(text.contains("repetition 2 (line): 2000 values from 1.00 to 500 mrad."), "{text}");
        assert!(text.contains("set-point (line): 2000 values from 0.00 to 0.00 rad."));
        assert!(text.contains("repetition 1 (line): 2000 values from 0.200 to 0.200 N·m."));
        // The files stay small however many samples there are.
        assert!(text.len() < 150_000, "{}", text.len());
        assert!(panels("None", &figures(&[]).map(|(figure, _)| figure)).contains("no data"));
    }
}
