//! A figure on the page: the drawing, its caption, its values as a table, and as numbers for the script.

use std::fmt::Write as _;

use crate::figure::symbol::{self, escape};
use crate::figure::{Figure, shown::ShownSeries};
use crate::parameters::number;

/// Rows of a series in the table on the page; CSV has all drawn values, `report.json` all values.
const ROWS: usize = 21;

/// The figure as HTML, with its number.
pub(super) fn html(figure: &Figure, caption: &str, number: usize) -> String {
    let shown = figure.shown();
    // `</script>` or `<!--` within a name must not end the block.
    let numbers = serde_json::to_string(&shown).expect("strings and numbers").replace('<', "\\u003c");
    let head = |[quantity, unit]: &[String; 2]| match unit.as_str() {
        "" => symbol::html(quantity),
        unit => format!("{}, {}", symbol::html(quantity), escape(unit)),
    };
    let bodies: String = shown.series.iter().map(body).collect();
    format!(
        "<figure id=\"figure-{number}\">\n<div class=\"plot\" tabindex=\"0\">\n{}</div>\n\
         <figcaption><b>Figure {number}.</b> {}</figcaption>\n\
         <details class=\"data\"><summary>Figure {number} as a table</summary>\n\
         <div class=\"table\" tabindex=\"0\"><table>\n<thead><tr><th scope=\"col\">{}</th><th scope=\"col\">{}</th>\
         <th scope=\"col\">95 %</th></tr></thead>\n{bodies}</table></div>\n</details>\n\
         <script type=\"application/json\">{numbers}</script>\n</figure>\n",
        figure.svg(),
        symbol::html(caption),
        head(&shown.x),
        head(&shown.y),
    )
}

/// A series as a part of the table, in plain ASCII so that a copy is numbers.
fn body(series: &ShownSeries) -> String {
    let count = series.rows.len();
    let step = count.saturating_sub(1).max(1) as f64 / (count.clamp(2, ROWS) - 1) as f64;
    let rows: Vec<&Vec<f64>> =
        (0..count.min(ROWS)).filter_map(|k| series.rows.get((k as f64 * step).round() as usize)).collect();
    let thinned = match rows.len() {
        kept if kept < count => format!(", {kept} of {count} values"),
        _ => String::new(),
    };
    let mut text = format!(
        "<tbody>\n<tr><th colspan=\"3\" scope=\"rowgroup\">{}{thinned}</th></tr>\n",
        symbol::html(&series.name)
    );
    for row in rows {
        let of = |index: usize| match row.get(index) {
            Some(value) if value.is_finite() => number::text(*value),
            _ => "unknown".to_owned(),
        };
        let [x, y, interval] = match series.kind {
            "band" => [of(2), String::new(), format!("{} to {}", of(3), of(4))],
            "bars" => [of(2), of(3), format!("+/- {}", of(4))],
            _ => [of(2), of(3), String::new()],
        };
        writeln!(text, "<tr><td>{x}</td><td>{y}</td><td>{interval}</td></tr>").expect("a String takes everything");
    }
    text + "</tbody>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Axis, Role, Series};

    #[test]
    fn the_table_has_both_ends_of_a_long_series_and_the_number_of_values() {
        let line = (0..=300).map(|k| (f64::from(k), -0.5 * f64::from(k)));
        let figure = Figure::new("Long").x(Axis::new("time t", "s")).series(Series::line(Role::Fitted, "fit", line));
        let page = html(&figure, "A line.", 4);
        assert!(page.contains("fit, 21 of 301 values") && page.contains("<b>Figure 4.</b> A line."));
        assert!(page.contains("<tr><td>0</td><td>0</td><td></td></tr>"), "{page}");
        assert!(page.contains("<tr><td>300</td><td>-150</td><td></td></tr>"), "{page}");
    }

    #[test]
    fn an_interval_is_in_the_table_in_plain_ascii() {
        let figure = Figure::new("Intervals")
            .series(Series::bars(Role::Measured, "measured", [(-1.0, -0.2, 0.01)]))
            .series(Series::band(Role::Fitted, "band", [(1.0, 0.1, 0.3)]));
        let page = html(&figure, "", 1);
        assert!(page.contains("<tr><td>-1</td><td>-0.2</td><td>+/- 0.01</td></tr>"), "{page}");
        assert!(page.contains("<tr><td>1</td><td></td><td>0.1 to 0.3</td></tr>"), "{page}");
        assert!(html(&Figure::new("Empty"), "", 1).contains("<thead>"));
    }

    #[test]
    fn no_name_ends_the_block_of_numbers() {
        let figure = Figure::new("x").series(Series::line(Role::Own, "</script><b>", [(0.0, 0.0), (1.0, 1.0)]));
        let page = html(&figure, "", 1);
        assert_eq!(page.matches("</script>").count(), 1, "{page}");
        assert!(!page.contains("<b>\""));
    }
}
