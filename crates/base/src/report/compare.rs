//! Several reports as one: their key numbers side by side, figures of the same title and axes overlaid, then each
//! report.

use std::collections::BTreeSet;

use super::{Cell, Report, Section, Table};
use crate::figure::{Data, Figure, Role, Series};

impl Report {
    /// One report of several, each under its name.
    pub fn together(reports: Vec<(String, Report)>) -> Report {
        let names: Vec<&str> = reports.iter().map(|(name, _)| name.as_str()).collect();
        let title = format!("Comparison of {}", names.join(", "));
        let mut sections = Vec::new();
        sections.extend(keys(&reports).map(Section::Table));
        sections.extend(overlays(&reports));
        let mut provenance = Vec::new();
        for (name, report) in reports {
            sections.push(Section::Part(format!("{name}: {}", report.title)));
            sections.extend((!report.summary.is_empty()).then_some(Section::Paragraph(report.summary)));
            sections.extend(report.sections);
            provenance.extend(report.provenance);
        }
        Report { title, summary: String::new(), key: Vec::new(), sections, provenance }
    }
}

/// The key numbers of all reports, one column per report; `None` without key numbers.
fn keys(reports: &[(String, Report)]) -> Option<Table> {
    let mut names: Vec<&str> = Vec::new();
    for key in reports.iter().flat_map(|(_, report)| &report.key) {
        if !names.contains(&key.name.as_str()) {
            names.push(&key.name);
        }
    }
    let head = std::iter::once("").chain(reports.iter().map(|(name, _)| name.as_str()));
    let row = |name: &str| {
        let number = |(_, report): &(String, Report)| {
            let key = report.key.iter().find(|key| key.name == name);
            key.map_or_else(|| Cell::from(""), |key| key.number.clone().into())
        };
        std::iter::once(Cell::from(name)).chain(reports.iter().map(number)).collect::<Vec<_>>()
    };
    let table = Table::new(head).caption("Key numbers side by side.");
    let table = names.iter().fold(table, |table, name| table.row(row(name)));
    (!names.is_empty()).then_some(table)
}

/// A figure for each title and pair of axes that at least two reports share, in the order of the first.
fn overlays(reports: &[(String, Report)]) -> Vec<Section> {
    let mut drawn_figures: Vec<&Figure> = Vec::new();
    let mut sections = Vec::new();
    for (_, figure) in figures(reports) {
        if drawn_figures.iter().any(|other| alike(other, figure)) {
            continue;
        }
        drawn_figures.push(figure);
        let same: Vec<_> = figures(reports).filter(|(_, other)| alike(figure, other)).collect();
        let sharing: BTreeSet<usize> = same.iter().map(|(report, _)| *report).collect();
        let overlay = overlay(reports, figure, &same);
        if sharing.len() >= 2 && !overlay.series.is_empty() {
            let names: Vec<_> = sharing.iter().map(|report| reports[*report].0.as_str()).collect();
            let caption = format!(
                "{}, overlaid. Common curves are drawn once; clouds and bands are in the figures of each report below.",
                names.join(", ")
            );
            sections.push(Section::Figure { figure: Box::new(overlay), caption });
        }
    }
    sections
}

/// All figures with the index of their report.
fn figures(reports: &[(String, Report)]) -> impl Iterator<Item = (usize, &Figure)> {
    reports.iter().enumerate().flat_map(|(index, (_, report))| {
        report.sections.iter().filter_map(move |section| match section {
            Section::Figure { figure, .. } => Some((index, figure.as_ref())),
            _ => None,
        })
    })
}

fn alike(one: &Figure, other: &Figure) -> bool {
    let axes = |figure: &Figure| [&figure.x, &figure.y].map(|axis| (axis.quantity.clone(), axis.unit.clone()));
    one.title == other.title && axes(one) == axes(other)
}

/// Curves and single values of all, one colour per report; a common curve keeps its colour.
fn overlay(reports: &[(String, Report)], first: &Figure, same: &[(usize, &Figure)]) -> Figure {
    let mut overlay = first.emptied();
    let drawn = |series: &&Series| matches!(series.data, Data::Line(_) | Data::Bars(_));
    let common = |series: &Series| same.iter().all(|(_, figure)| figure.series.iter().any(|other| other == series));
    for (place, (report, figure)) in same.iter().enumerate() {
        for series in figure.series.iter().filter(drawn) {
            if !common(series) {
                let name = format!("{}, {}", reports[*report].0, series.name);
                let other = series.clone().renamed(Role::Trace(*report), name);
                // Dashed over the first one, so that both of two equal curves are visible.
                overlay.series.push(if place > 0 { other.dashed() } else { other });
            } else if !overlay.series.contains(series) {
                overlay.series.push(series.clone());
            }
        }
    }
    overlay
}

#[cfg(test)]
mod tests {
    use super::super::Provenance;
    use super::*;
    use crate::figure::Axis;
    use crate::quantity::Estimate;

    fn report(torque: f64) -> Report {
        let line = |role, name, height: f64| Series::line(role, name, [(0.0, height), (1.0, height)]);
        let figure = Figure::new("Friction")
            .x(Axis::new("speed Ω", "rad/s"))
            .y(Axis::new("torque", "N m"))
            .series(Series::points(Role::Measured, "cloud", [(0.5, torque)]))
            .series(line(Role::Fitted, "fit", torque))
            .series(line(Role::Desired, "desired", 0.3));
        Report::new("One axis", Provenance::new("stickslip demo", None, ""))
            .summary("Measured.")
            .key("kinetic torque M_K", Estimate::new(torque, "N m"))
            .figure(figure, "Its friction.")
    }

    fn together(reports: [(&str, Report); 2]) -> Report {
        Report::together(reports.map(|(name, report)| (name.to_owned(), report)).into())
    }

    #[test]
    fn curves_of_several_runs_are_overlaid_and_equal_ones_are_drawn_once() {
        let both = together([("old", report(0.18)), ("new", report(0.2))]);
        let (_, overlay) = figures(&[(String::new(), both.clone())]).next().map(|(k, f)| (k, f.clone())).unwrap();
        let names: Vec<_> = overlay.series.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names, ["old, fit", "desired", "new, fit"]);
        assert_eq!([0, 1, 2].map(|k| overlay.series[k].role), [Role::Trace(0), Role::Desired, Role::Trace(1)]);
        let page = both.html();
        assert!(page.contains("<th scope=\"col\" class=\"value\" colspan=\"3\">new</th>"), "key numbers side by side");
        assert!(page.contains("<h2 class=\"part\">old: One axis</h2>") && page.contains("<b>Figure 3.</b>"));
    }

    #[test]
    fn figures_of_other_axes_stay_apart() {
        let mut other = report(0.2);
        let Some(Section::Figure { figure, .. }) = other.sections.last_mut() else { panic!("it ends with a figure") };
        **figure = figure.clone().y(Axis::new("force", "N"));
        let both = together([("old", report(0.18)), ("new", other)]);
        assert_eq!(figures(&[(String::new(), both)]).count(), 2);
    }
}
