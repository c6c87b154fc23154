//! The report of an identification: results, their errors, and the limits of the recording.

use super::limits::percent;
use super::parameters::{BEST, ParameterLine, lines, parameter_lines};
use super::recorded::{DONE, done};
use super::results::unit;
use super::{Candidate, Identification};
use crate::machine::{Axis, Machine};
use stickslip_base::Summary;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_base::report::{Cell, Provenance, Report, Section, Table};
use stickslip_fit::{Choice, StribeckFit};
use stickslip_recording::Recording;

/// The whole report. `command` is its command line.
pub fn report(
    found: &Identification,
    machine: &Machine,
    recording: &Recording,
    summary: &Summary,
    command: &str,
) -> Report {
    let provenance = Provenance::new(command, None, machine.text.clone());
    let file = recording.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let [directions, alike] = parameter_lines(summary, machine);
    let mut report = Report::new(format!("{}: inertia and friction from {file}", machine.name), provenance)
        .summary(main_result(found, summary));
    for line in &directions {
        report = report.key(line.name, line.identified.clone());
    }
    let findings = findings(found, summary);
    for line in &findings {
        report = report.key(line.name, line.identified.clone());
    }
    report = report.key("error of prediction, unseen", Estimate::new(100.0 * found.best().held_out, "%"));
    if let Some(position) = summary.estimate("prediction.position_rms") {
        report = report.key("error of the position, rms", position);
    }
    let mut intervals = "A friction for each direction by least squares, on rows away from standstill and reversals. \
                         Intervals are for 95\u{a0}% and count that residuals are correlated."
        .to_owned();
    if !machine.published.is_empty() {
        intervals.push_str(
            " Published values come from the machine file and were not used; their intervals are 1.96 published \
             standard deviations, which treat every sample as independent and are therefore narrower.",
        );
    }
    let [position, command_figure, friction, predicted, missed] =
        found.figures().map(|(_, figure, caption)| Section::Figure { figure: Box::new(figure), caption });
    let sentences = found.findings.sentences(found.axis);
    if !sentences.is_empty() {
        report = report.heading("Found in this recording").list(sentences);
    }
    if !findings.is_empty() {
        report = report.table(table(&findings).caption("Findings beside mass and friction."));
    }
    report = report
        .heading("The recording")
        .section(position)
        .section(command_figure)
        .heading(DONE)
        .list(done(&found.signals))
        .heading("Friction in each direction")
        .paragraph(balance(found))
        .section(friction)
        .table(table(&directions).caption(intervals))
        .heading("Not identifiable from this recording")
        .list(found.limits())
        .heading("Comparison of models")
        .paragraph(format!("{} {}", why(found), prediction(found, summary)))
        .table(candidates(found))
        .section(predicted)
        .section(missed);
    let refined = lines(&BEST, "", summary, machine);
    if !refined.is_empty() {
        report = report.heading("Parameters of the best model").table(table(&refined).caption(
            "Fitted to the recorded command in the simulated closed loop; each ± is half of the width of the 95\u{a0}% \
             interval. The intervals themselves, which are not symmetric, are in summary.json.",
        ));
    }
    report
        .heading("Feedforward")
        .table(feedforward(found, machine))
        .heading("One friction for both directions, and an offset")
        .table(table(&alike).caption("The same balance of forces with one Coulomb and one viscous friction."))
}

/// The findings that have a number.
fn findings(found: &Identification, summary: &Summary) -> Vec<ParameterLine> {
    let all = [
        ("delay of the position", "delay"),
        ("lag of first order in it", "delay.lag"),
        ("friction by load, share of the force", "friction.load_share"),
        ("torque of one period per turn", "weight.amplitude"),
        ("periodic force, period", "periodic.period"),
        ("periodic force, amplitude", "periodic.amplitude"),
        ("vibration of the residuals", "resonance.frequency"),
    ];
    let shown = |place: &str| place != "delay" || found.findings.delay.is_significant;
    let line = |(name, place)| Some(ParameterLine { name, identified: summary.estimate(place)?, published: None });
    all.into_iter().filter(|(_, place)| shown(place)).filter_map(line).collect()
}

/// The best model, its lead over the others, and the data of the comparison.
fn why(found: &Identification) -> String {
    let Choice { best, chosen, behind, folds, .. } = &found.choice;
    let title = |candidate: usize| found.candidates[candidate].kind.title();
    let behind_by = |candidate: usize| found.behind(candidate).map_or_else(String::new, |behind| tied(&behind));
    let perhaps = |candidate: usize| {
        let holds_zero = |[share, half_width]: [f64; 2]| share <= half_width;
        let chance = found.choice.share_behind(candidate).is_some_and(holds_zero);
        if chance { ", which may be chance since the interval contains 0" } else { "" }
    };
    // Where a simpler model is chosen, its difference is the relevant one.
    let others = (0..found.candidates.len()).filter(|candidate| candidate != best);
    let second = others.min_by(|a, b| behind[*a][0].total_cmp(&behind[*b][0]));
    let verdict = match second {
        _ if chosen != best => format!(
            "{} is simpler, and its squared error there is greater by only {}, which is not more than the standard error \
             of the difference",
            title(*chosen),
            behind_by(*chosen)
        ),
        Some(second) => format!(
            "The squared error of the next, {}, is greater by {}{}; no simpler model is within the standard error of its \
             difference",
            title(second),
            behind_by(second),
            perhaps(second)
        ),
        None => "There is no other model".into(),
    };
    format!(
        "Each model was fitted to one half of the recording and validated on the other half, in {folds} \
         blocks of time together: a richer model that only follows the noise loses there. The smallest error there, {}, \
         has {}. {verdict}. The selected model is in model.toml.",
        percent(found.candidates[*best].held_out),
        title(*best),
    )
}

/// Force and command at constant speeds in both directions.
fn feedforward(found: &Identification, machine: &Machine) -> Table {
    const STEPS: i32 = 5;
    let (quantity, force) = found.force();
    let table = Table::new(["velocity", quantity, "command"]).caption(
        "Drive force or torque and command at constant speed, by the best model; the whole table is feedforward.csv. The band \
         of the figure is its uncertainty.",
    );
    let fastest = found.motion.velocity.iter().fold(0.0f64, |most, velocity| most.max(velocity.abs()));
    (-STEPS..=STEPS).filter(|step| *step != 0).fold(table, |table, step| {
        // Finer towards rest, where the curve bends.
        let share = f64::from(step) / f64::from(STEPS);
        let velocity = fastest * share * share.abs();
        let needed = found.best().model.steady_force(velocity);
        let numbers = [(velocity, unit(found.axis, "velocity")), (needed, force), (needed / machine.gain, "V")];
        table.row(numbers.map(|(value, unit)| Estimate::new(value, unit).into()))
    })
}

fn table(lines: &[ParameterLine]) -> Table {
    let published = lines.iter().any(|line| line.published.is_some());
    let head: &[&str] = if published { &["", "identified", "published"] } else { &["", "identified"] };
    lines.iter().fold(Table::new(head.iter().copied()), |table, line| {
        let cells = [Some(Cell::from(line.name)), Some(line.identified.clone().into())];
        table.row(cells.into_iter().chain([line.published.clone().map(Cell::from)]).flatten())
    })
}

/// Main result in a sentence: inertia, the friction of each direction, the prediction error.
fn main_result(found: &Identification, summary: &Summary) -> String {
    let read = |name: &str| summary.estimate(name).map_or_else(|| "unknown".to_owned(), |e| tied(&e));
    let inertia = match found.axis {
        Axis::Linear => "The moving mass",
        Axis::Rotary => "The moment of inertia",
    };
    let side = |side: &str| {
        let [coulomb, viscous] = ["coulomb", "viscous"].map(|name| read(&format!("friction.{side}.{name}")));
        format!("{coulomb} plus {viscous} times the speed against {side} velocity")
    };
    let friction = match found.findings.only {
        Some(only) => side(if only > 0 { "positive" } else { "negative" }),
        None => format!("{} and {}", side("positive"), side("negative")),
    };
    format!(
        "{inertia} is {}, friction is {friction}, and the error of the best model is {} of the {} on data that its fit did not use.",
        read("inertia.mass"),
        percent(found.best().held_out),
        predicted(found),
    )
}

/// Quantity that the best model predicts.
fn predicted(found: &Identification) -> String {
    found.closed_loop.as_ref().map_or_else(|| format!("drive {}", found.force().0), |_| "recorded command".into())
}

/// Explained share of inertia and friction, and the verdict on a Stribeck drop.
fn balance(found: &Identification) -> String {
    let drop = |fit: &&Option<StribeckFit>| fit.as_ref().is_some_and(|fit| fit.drop.is_identified());
    let drops = match found.stribeck.iter().filter(drop).count() {
        0 => "No Stribeck drop is identifiable",
        1 => "A Stribeck drop is identifiable in one direction only",
        _ => "Both directions show a Stribeck drop",
    };
    format!(
        "Inertia and a Coulomb and a viscous friction for each direction explain {} of drive {} with an error of {}. \
         {drops}.",
        tied(&Estimate::new(found.motion.samples() as f64 * found.motion.period, "s")),
        found.force().0,
        percent(found.asymmetric.fit.relative_error),
    )
}

/// Errors of the best model over the whole recording.
fn prediction(found: &Identification, summary: &Summary) -> String {
    let best = found.best();
    let title = best.kind.title();
    match (&best.prediction, summary.estimate("prediction.position_rms")) {
        (Some(prediction), Some(position)) => format!(
            "Simulated over the whole recording with the known controller, it predicts the recorded command with an error \
             of {} and the position within {} rms.",
            percent(prediction.voltage_error),
            tied(&position),
        ),
        _ => format!(
            "The controller is not known, so no closed loop is simulated. The error is that with which {title}, fitted to one \
             half, explains the drive {} of the other.",
            found.force().0,
        ),
    }
}

fn candidates(found: &Identification) -> Table {
    let simulated = found.closed_loop.is_some();
    let head: &[&str] = if simulated {
        &["model", "parameters", "unseen halves", "squared, above the least", "whole", "position, rms"]
    } else {
        &["model", "parameters", "unseen halves", "squared, above the least"]
    };
    let share = |error: f64| Cell::from(Estimate::new(100.0 * error, "%"));
    let row = |(index, candidate): (usize, &Candidate)| {
        let best = if candidate.kind == found.best().kind { " (best)" } else { "" };
        let name = Cell::Text(format!("{}{best}", candidate.kind.title()));
        let parameters = Cell::Text(candidate.kind.parameters().to_string());
        let behind = found.behind(index).map_or_else(|| Cell::Text("least".into()), Cell::from);
        let mut cells = vec![name, parameters, share(candidate.held_out), behind];
        if let Some(prediction) = candidate.prediction {
            cells.push(share(prediction.voltage_error));
            cells.push(Estimate::new(prediction.position_rms, unit(found.axis, "position")).into());
        }
        cells
    };
    let table = Table::new(head.iter().copied()).caption(format!(
        "The candidates, from a rigid body to bristles: error of the {}, relative to its own rms. The excess of its square \
         above the least is computed block by block; the 95\u{a0}% intervals are lower bounds, since parts of one \
         recording are correlated.",
        predicted(found)
    ));
    found.candidates.iter().enumerate().fold(table, |table, candidate| table.row(row(candidate)))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{emps, found};
    use super::super::{Kind, results};
    use super::*;

    fn page(machine: &Machine) -> String {
        report(found(), machine, &emps().1, &results::summary(found()), "stickslip identify emps.csv.gz").html()
    }

    #[test]
    fn every_number_of_the_summary_is_on_the_page() {
        let page = page(&emps().0);
        let summary: serde_json::Value = serde_json::from_str(&results::summary(found()).to_json()).unwrap();
        let mut count = 0;
        for (name, result) in summary["results"].as_object().unwrap() {
            let (value, unit) = (result["value"].as_f64().unwrap(), result["unit"].as_str().unwrap());
            let share = name.starts_with("prediction.") && unit == "1";
            let mut estimate = Estimate::new(value, unit);
            if let Some(ci95) = result["ci95"].as_array() {
                estimate = estimate.with_half_width(0.5 * (ci95[1].as_f64().unwrap() - ci95[0].as_f64().unwrap()));
            } else if share {
                estimate = Estimate::new(100.0 * value, "%");
            } else if name != "prediction.position_rms" {
                continue;
            }
            let written = estimate.written();
            let half_width =
                if written.half_width.is_empty() { String::new() } else { format!("± {}", written.half_width) };
            let cells = format!(
                "<td class=\"value\">{}</td><td class=\"half-width\">{half_width}</td><td class=\"unit\">{}</td>",
                written.value, written.unit
            );
            assert!(page.contains(&cells), "{name}: {cells}");
            count += 1;
        }
        // 9 of the least squares, 12 of the closed loop, 3 of the prediction, and the findings: delay, period and
        // amplitude of the screw.
        assert_eq!(count, 27, "{:?}", found().findings);
    }

    #[test]
    fn published_values_are_listed_where_the_machine_file_has_them() {
        let mut machine = emps().0.clone();
        assert!(page(&machine).contains("<td class=\"value\">95.1</td><td class=\"half-width\">± 0.2</td>"));
        machine.published.clear();
        assert!(!page(&machine).contains("published</th>"));
    }

    #[test]
    fn a_simpler_model_that_is_not_significantly_worse_is_selected_with_the_reason() {
        let page = |found: &Identification| {
            report(found, &emps().0, &emps().1, &results::summary(found), "").html().replace('\u{a0}', " ")
        };
        let behind = found().behind(2).unwrap().to_string();
        let surely = page(found());
        assert!(
            surely.contains(&format!(
                "The squared error of the next, {}, is greater by {behind}",
                Kind::Stribeck.title()
            ))
        );
        assert!(!surely.contains("may be chance"));
        let mut perhaps = found().clone();
        perhaps.choice.behind[2][1] = 0.5 * perhaps.choice.behind[2][0];
        assert!(page(&perhaps).contains("which may be chance since the interval contains 0"));
        perhaps.choice.behind[2][1] = perhaps.choice.behind[2][0];
        perhaps.choice.chosen = 2;
        let perhaps = page(&perhaps);
        assert!(
            perhaps
                .contains("Stribeck curve, each direction is simpler, and its squared error there is greater by only")
        );
        assert!(perhaps.contains("Stribeck curve, each direction (best)"));
    }

    #[test]
    fn names_and_text_of_the_machine_file_are_escaped() {
        let mut machine = emps().0.clone();
        machine.name = "<b>Axis & co</b>".into();
        machine.text = "# <script>alert(1)</script>".into();
        let page = page(&machine);
        assert!(!page.contains("<b>Axis") && !page.contains("<script>alert"));
        assert!(page.contains("<h1>&lt;b&gt;Axis &amp; co&lt;/b&gt;: inertia and friction from emps.csv.gz</h1>"));
    }

    #[test]
    fn without_a_controller_the_report_speaks_of_forces_and_of_a_rotary_axis_in_torques() {
        let mut open = found().clone();
        open.closed_loop = None;
        open.candidates.truncate(2);
        let folds: Vec<_> = open.candidates.iter().map(|candidate| candidate.folds.clone()).collect();
        open.choice = stickslip_fit::choose(&folds).unwrap();
        for candidate in &mut open.candidates {
            (candidate.prediction, candidate.unseen) = (None, None);
        }
        open.axis = Axis::Rotary;
        let mut machine = emps().0.clone();
        machine.axis = Axis::Rotary;
        let summary = results::summary(&open);
        let page = report(&open, &machine, &emps().1, &summary, "").html();
        assert!(page.contains("moment of inertia <i>J</i>") && page.contains("<td class=\"unit\">kg·m²</td>"));
        assert!(
            page.contains("The controller is not known")
                && page.contains("Balance of forces")
                && page.contains("torque, N·m")
        );
        assert!(!page.contains("whole</th>") && !page.contains("bristle stiffness"));
    }
}
