//! A report as a whole.

use super::*;
use crate::figure::{Axis, Role, Series};
use expect_test::expect_file;

fn report(text: &str) -> Report {
    let provenance = Provenance {
        command: format!("stickslip demo --out {text}"),
        version: "0.1.0".into(),
        seed: Some(7),
        parameters: format!("# {text}\n[model.load.friction]\nbreakaway_torque = 0.3\n"),
    };
    let figure = Figure::new(text)
        .x(Axis::new("speed Ω", "rad/s").stretched())
        .y(Axis::new("friction torque", "N m"))
        .interval(-0.3, 0.3, "fade-out")
        .series(Series::line(
            Role::Fitted,
            "fit",
            [(-50.0, -0.19), (0.0, -0.3), (0.0, f64::NAN), (0.0, 0.3), (50.0, 0.19)],
        ));
    let estimates = [
        (text, Estimate::new(0.299_4, "N m").with_half_width(0.004)),
        ("kinetic torque M_K", Estimate::new(0.181_23, "N m").with_half_width(0.000_61)),
        ("viscous friction b", Estimate::new(0.000_206, "N m s/rad").with_half_width(0.000_007)),
        ("Stribeck velocity Ω_Strib", Estimate::new(f64::NAN, "rad/s").with_half_width(0.1)),
        ("speed against real time", Estimate::new(1234.0, "1")),
    ];
    let wide = Table::new(["scenario", "difference", text])
        .row(["sine 0.5 Hz".into(), Estimate::new(0.031, "1").into(), text.into()])
        .row([Cell::from("sine 2 Hz")]);
    Report::new(text, provenance)
        .paragraph("The axis was measured at 16 speeds in both directions.")
        .table(Table::of_estimates(estimates))
        .heading("Own friction")
        .figure(figure, text)
        .table(wide)
}

#[test]
fn a_report_looks_as_it_did() {
    expect_file!["../golden/report.html"].assert_eq(&report("Friction of the bench").html());
}

#[test]
fn text_from_outside_is_escaped_everywhere() {
    let page = report("<img src=x onerror=\"alert(1)\">&").html();
    assert!(!page.contains("<img"), "{page}");
    assert!(page.contains("&lt;img src=x onerror=&quot;alert(1)&quot;&gt;&amp;"));
}

#[test]
fn a_report_reaches_for_nothing_outside() {
    let page = report("Alone").html().replace("http://www.w3.org/2000/svg", "");
    for reach in ["http", "src=", "href=", "url(", "@import", "<script"] {
        assert!(!page.contains(reach), "{reach}");
    }
}

#[test]
fn every_colour_of_a_figure_has_its_dark_one() {
    let page = report("Dark").html();
    let (_, figure) = page.split_once("<svg").expect("there is a figure");
    let classes = figure.split("class=\"").skip(1).filter_map(|rest| rest.split('"').next());
    for class in classes.flat_map(|classes| classes.split(' ')) {
        let table = ["value", "half-width", "unit", "table"].contains(&class);
        assert!(table || page.contains(&format!("svg .{class}{{")), "{class}");
    }
    assert!(page.contains("@media (prefers-color-scheme:dark){:root{--surface:#13171E;"));
}

#[test]
fn every_row_has_the_cells_of_the_head() {
    let cells = |html: &str| {
        html.lines().filter(|line| line.contains("<tr>")).map(|line| line.matches("</t").count()).collect::<Vec<_>>()
    };
    let table = Table::new(["scenario", "difference", "note"])
        .row(["sine".into(), Estimate::new(1.0, "1").into(), "good".into()])
        .row(["chirp".into(), "not run".into()])
        .row([]);
    // Five cells and the end of the row; in the head also the end of the head.
    assert_eq!(cells(&html_of_table(&table)), [7, 6, 6, 6]);
    assert!(html_of_table(&table).contains("<th scope=\"col\" class=\"value\">difference</th><td></td><td></td>"));
    assert_eq!(cells(&html_of_table(&Table::new(["a"]).row(["1".into(), "2".into()]))), [4, 3]);
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("report.html");
    report("Written").write(&path).expect("the folder takes a file");
    assert_eq!(std::fs::read_to_string(&path).expect("it was written"), report("Written").html());
    let nowhere = folder.path().join("nowhere/report.html");
    let refusal = report("Refused").write(&nowhere).expect_err("the folder does not exist").to_string();
    assert!(refusal.contains("nowhere/report.html: cannot write it"), "{refusal}");
}
