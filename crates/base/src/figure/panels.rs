//! Several figures in one file, below each other.

use std::fmt::Write as _;

use super::Figure;
use super::draw::{draw, head};
use super::layout::{Layout, PANEL};
use super::symbol::escape;

/// Figures as the panels of one SVG file, the first at the top. Axes that start at the same pixel make equal times
/// stand below each other.
pub fn panels(title: &str, figures: &[Figure]) -> String {
    let layouts: Vec<Layout> = figures.iter().map(|figure| Layout::of(figure, PANEL)).collect();
    let mut text = head(layouts.iter().map(|layout| layout.height).sum(), "");
    put!(text, "<title>{}</title>", escape(title));
    let mut top = 0.0;
    for (figure, layout) in figures.iter().zip(&layouts) {
        text += &head(layout.height, &format!(" y=\"{top}\""));
        draw(&mut text, figure, layout);
        put!(text, "</svg>");
        top += layout.height;
    }
    put!(text, "</svg>");
    text
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Role, Series};
    use super::*;

    #[test]
    fn panels_are_below_each_other_and_do_not_overlap() {
        let figure = |title: &str, scale: f64| {
            let line = (0..=100).map(|k| (0.01 * f64::from(k), scale * f64::from(k)));
            Figure::new(title).x(Axis::new("time", "s")).series(Series::line(Role::Measured, "measured", line))
        };
        let text = panels("Two & more", &[figure("position", 1.0), figure("torque", 1e-3)]);
        let numbers = |name: &str| -> Vec<f64> {
            let parts = text.lines().filter(|line| line.starts_with("<svg xmlns")).map(|line| {
                let rest = line.split_once(&format!(" {name}=\"")).map_or("0", |(_, rest)| rest);
                rest.split('"').next().unwrap().parse().unwrap()
            });
            parts.collect()
        };
        let (tops, heights) = (numbers("y"), numbers("height"));
        assert_eq!(tops, [0.0, 0.0, heights[1]]);
        assert_eq!(heights[0], heights[1] + heights[2]);
        assert!(text.starts_with("<svg ") && text.contains("<title>Two &amp; more</title>"));
        assert_eq!(text.matches("<svg ").count(), text.matches("</svg>").count());
    }
}
