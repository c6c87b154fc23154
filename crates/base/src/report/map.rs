//! A map on the page: the drawing, its caption, its cells as a table, and as numbers for the script.

use serde::Serialize;

use crate::figure::Map;
use crate::figure::symbol;
use crate::parameters::number;

/// Cells in the table on the page; CSV has all.
const CELLS: usize = 400;

/// Data of a map for the script.
#[derive(Serialize)]
struct Shown {
    /// Quantity and unit of both axes and of the numbers.
    heads: [[String; 2]; 3],
    cells: Vec<[Option<f64>; 3]>,
}

/// The map as HTML, with its number among the figures.
pub(super) fn html(map: &Map, caption: &str, number: usize) -> String {
    let head: String =
        map.titles().iter().map(|title| format!("<th scope=\"col\">{}</th>", symbol::html(title))).collect();
    let text = |value: Option<f64>| value.map_or_else(|| "unknown".into(), number::text);
    let cell = |cell: [Option<f64>; 3]| {
        let [x, y, value] = cell.map(text);
        format!("<tr><td>{x}</td><td>{y}</td><td>{value}</td></tr>\n")
    };
    let count = map.cells().count();
    let thinned = if count > CELLS { format!(", {CELLS} of {count} cells") } else { String::new() };
    let cells: String = map.cells().take(CELLS).map(cell).collect();
    // `</script>` or `<!--` within a name must not end the block.
    let shown = Shown { heads: map.heads(), cells: map.cells().collect() };
    let numbers = serde_json::to_string(&shown).expect("strings and numbers").replace('<', "\\u003c");
    format!(
        "<div role=\"figure\" class=\"map\" id=\"figure-{number}\">\n<div class=\"plot\" tabindex=\"0\">\n{}</div>\n\
         <p><b>Figure {number}.</b> {}</p>\n<details class=\"data\"><summary>Figure {number} as a table{thinned}</summary>\n\
         <div class=\"table\" tabindex=\"0\"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{cells}</tbody></table></div>\n\
         </details>\n<script type=\"application/json\">{numbers}</script>\n</div>\n",
        map.svg(),
        symbol::html(caption),
    )
}

#[cfg(test)]
mod tests {
    use super::super::{Provenance, Report};
    use super::*;
    use crate::figure::Axis;

    #[test]
    fn a_map_has_a_number_a_table_and_a_saved_form() {
        let axes = [Axis::new("inertia", "kg m^2"), Axis::new("belief", "1"), Axis::new("deviation", "rad")];
        let map = Map::new("Deviation", axes, [vec![1e-3, 2e-3], vec![0.7]], vec![Some(0.25), None]);
        let report = Report::new("Study", Provenance::new("stickslip study", None, "")).map(map, "A map.");
        let page = report.html();
        assert!(page.contains("<b>Figure 1.</b> A map.") && page.contains("<th scope=\"col\">deviation, rad</th>"));
        assert!(page.contains("<tr><td>0.001</td><td>0.7</td><td>0.25</td></tr>"), "{page}");
        assert!(page.contains("<td>unknown</td>"));
        let numbers = r#"{"heads":[["inertia","kg·m²"],["belief",""],["deviation","rad"]],"cells":[[0.001,0.7,0.25],[0.002,0.7,null]]}"#;
        assert!(page.contains(numbers), "{page}");
        assert_eq!(Report::from_json(&report.to_json()).unwrap(), report);
    }
}
