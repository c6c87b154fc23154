//! A report as a whole.

use super::*;
use crate::figure::{Axis, Role, Series, theme};
use expect_test::expect_file;

pub(super) fn report(text: &str) -> Report {
    let provenance = Provenance {
        command: format!("stickslip demo --out {text}"),
        version: "0.1.0".into(),
        commit: Some(text.into()),
        seed: Some(7),
        parameters: format!("# {text}\n[model.load.friction]\nbreakaway_torque = 0.3\n"),
    };
    let figure = Figure::new(text)
        .x(Axis::new("speed Ω", "rad/s").stretched())
        .y(Axis::new("friction torque", "N m"))
        .interval(-0.3, 0.3, "fade-out")
        .series(Series::bars(Role::Measured, text, [(-20.0, -0.186, 0.004), (20.0, 0.185, 0.003)]))
        .series(Series::band(Role::Fitted, "95 %", [(1.0, 0.2, 0.21), (50.0, 0.18, 0.2)]))
        .series(Series::line(
            Role::Fitted,
            "fit",
            [(-50.0, -0.19), (0.0, -0.3), (0.0, f64::NAN), (0.0, 0.3), (50.0, 0.19)],
        ));
    let table = Table::new(["scenario", "difference", text])
        .caption(text)
        .row(["sine 0.5 Hz".into(), Estimate::new(0.031, "1").into(), text.into()])
        .row(["Stribeck velocity Ω_Strib".into(), Estimate::new(f64::NAN, "rad/s").with_half_width(0.1).into()])
        .row([Cell::from("sine 2 Hz")]);
    Report::new(text, provenance)
        .summary(format!("The axis breaks away at M_S = 0.299 N·m: {text}."))
        .key(text, Estimate::new(0.299_4, "N m").with_half_width(0.004))
        .key("viscous friction b", Estimate::new(0.000_206, "N m s/rad").with_half_width(0.000_007))
        .key("speed against real time", Estimate::new(1234.0, "1"))
        .paragraph("The axis was measured at 16 speeds in both directions.")
        .heading("Own friction")
        .figure(figure, text)
        .list([text, "Slower speeds would tell."])
        .table(table)
}

#[test]
fn a_report_looks_as_it_did() {
    // Style and script are separate files and reviewed there.
    let page = report("Friction of the bench").html();
    let without = page.replace(include_str!("style.css"), "STYLE\n").replace(include_str!("script.js"), "SCRIPT\n");
    assert!(without.contains("STYLE\n") && without.contains("SCRIPT\n"));
    expect_file!["../golden/report.html"].assert_eq(&without);
}

#[test]
fn text_from_outside_is_escaped_everywhere() {
    let page = report("<img src=x onerror=\"alert(1)\">&</style></script>").html();
    assert!(!page.contains("<img"), "{page}");
    assert!(page.contains("&lt;img src=x onerror=&quot;alert(1)&quot;&gt;&amp;"));
    assert_eq!(page.matches("</style>").count(), 1);
    assert_eq!(page.matches("</script>").count(), 2, "the numbers of the figure and the script");
}

#[test]
fn a_report_loads_nothing_from_outside() {
    let page = report("Alone").html().replace("http://www.w3.org/2000/svg", "");
    for reach in ["http", "src=", "href=", "url(", "@import", "fetch(", "import(", "XMLHttpRequest", "eval("] {
        assert!(!page.contains(reach), "{reach}");
    }
}

#[test]
fn every_colour_of_a_figure_has_its_dark_one() {
    let page = report("Dark").html();
    let (_, figure) = page.split_once("<svg").expect("there is a figure");
    let (figure, _) = figure.split_once("<figcaption>").expect("a figure has a caption");
    let classes = figure.split("class=\"").skip(1).filter_map(|rest| rest.split('"').next());
    for class in classes.flat_map(|classes| classes.split(' ')) {
        assert!(page.contains(&format!("svg .{class}{{")), "{class}");
    }
    assert!(page.contains("@media screen and (prefers-color-scheme:dark){:root{--surface:#13171E;"));
}

/// Contrast of two colours by WCAG 2.2.
fn contrast(one: &str, other: &str) -> f64 {
    let luminance = |colour: &str| -> f64 {
        let channel = |k: usize| {
            let value = u8::from_str_radix(&colour[1 + 2 * k..3 + 2 * k], 16).expect("two digits");
            let share = f64::from(value) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * channel(0) + 0.7152 * channel(1) + 0.0722 * channel(2)
    };
    let (one, other) = (luminance(one) + 0.05, luminance(other) + 0.05);
    if one > other { one / other } else { other / one }
}

#[test]
fn text_has_a_contrast_of_4_5_and_drawings_of_3() {
    assert!((contrast("#000000", "#FFFFFF") - 21.0).abs() < 1e-9);
    let mut judged = 0;
    for colour in theme::COLOURS {
        let needed = match colour.class {
            "ink" | "text-2" | "text-3" => 4.5,
            // Backgrounds and guide lines are not text.
            "surface" | "grid" | "axis" | "interval" => continue,
            _ => 3.0,
        };
        let [light, dark] = [contrast(colour.light, "#FFFFFF"), contrast(colour.dark, "#13171E")];
        assert!(light >= needed && dark >= needed, "{}: {light} {dark}", colour.class);
        judged += 1;
    }
    assert_eq!(judged, 12);
}

#[test]
fn a_report_is_written_as_data_and_as_a_page_and_errors_have_the_path() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let names = report("Written").write(folder.path()).expect("the folder takes files");
    assert_eq!(names, ["report.json", "report.html"]);
    let page = std::fs::read_to_string(folder.path().join("report.html")).expect("it was written");
    assert_eq!(page, Report::read(folder.path()).expect("it was written").html());
    let refusal = report("Refused").write(&folder.path().join("nowhere")).expect_err("no such folder").to_string();
    assert!(refusal.contains("nowhere/report.json: cannot write it"), "{refusal}");
}
