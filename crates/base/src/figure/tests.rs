//! Figures as a whole: golden files, hostile input, order.

use expect_test::expect_file;

use super::*;

fn stribeck(speed: f64, [breakaway, kinetic, velocity, viscous]: [f64; 4]) -> f64 {
    speed.signum() * (kinetic + (breakaway - kinetic) * (-speed.abs() / velocity).exp() + viscous * speed.abs())
}

const OWN: [f64; 4] = [0.299, 0.1812, 2.94, 0.000_206];
const DESIRED: [f64; 4] = [0.300, 0.120, 1.5, 0.0012];

/// Both directions, with a gap at standstill.
fn curve(parameters: [f64; 4]) -> impl Iterator<Item = (f64, f64)> {
    (-200..=200).map(move |index| {
        let speed = 50.0 * (f64::from(index) / 200.0).powi(3);
        (speed, if index == 0 { f64::NAN } else { stribeck(speed, parameters) })
    })
}

/// A cloud around a curve, of the same numbers each time.
fn cloud(parameters: [f64; 4], count: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..count).map(move |index| {
        let speed = 50.0 * (2.0 * f64::from(index) / f64::from(count) - 1.0).powi(3);
        let sum: f64 = (0..6).map(|draw| uniform(u64::from(index) * 6 + draw)).sum();
        (speed, stribeck(speed, parameters) + 0.008 * sum)
    })
}

/// −½ … ½ from a counter: the finaliser of SplitMix64 (Steele, Lea, Flood 2014).
fn uniform(counter: u64) -> f64 {
    let mixed = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

fn friction(title: &str) -> Figure {
    Figure::new(title).x(Axis::new("speed Ω", "rad/s").stretched()).y(Axis::new("friction torque", "N m"))
}

#[test]
fn a_measured_characteristic_with_its_fit_looks_as_it_did() {
    let band = curve(OWN).map(|(speed, torque)| (speed, torque - 0.006, torque + 0.006));
    let figure = friction("Own and desired characteristic")
        .series(Series::points(Role::Measured, "measured", cloud(OWN, 1200)))
        .series(Series::band(Role::Fitted, "95 %", band))
        .series(Series::line(Role::Fitted, "fit", curve(OWN)))
        .series(Series::line(Role::Desired, "desired", curve(DESIRED)));
    expect_file!["golden/own-and-desired.svg"].assert_eq(&figure.svg());
}

#[test]
fn a_difference_torque_with_its_fade_out_looks_as_it_did() {
    let difference =
        |(speed, torque): (f64, f64)| (speed, if speed.abs() < 0.3 { 0.0 } else { torque - stribeck(speed, OWN) });
    let measured = cloud(DESIRED, 1200).map(|(speed, torque)| difference((speed, torque)));
    let figure = Figure::new("Load motor torque")
        .x(Axis::new("speed Ω", "rad/s").stretched())
        .y(Axis::new("load torque", "N m"))
        .interval(-0.3, 0.3, "fade-out")
        .series(Series::points(Role::Measured, "measured", measured))
        .series(Series::line(Role::Desired, "difference torque", curve(DESIRED).map(difference)));
    expect_file!["golden/load-torque.svg"].assert_eq(&figure.svg());
}

#[test]
fn a_signal_over_time_looks_as_it_did() {
    let time = |index: u32| f64::from(index) * 0.01;
    let angle = |lag: f64| (0..=400).map(move |index| (time(index), 0.2 * (3.0 * (time(index) - lag)).sin()));
    let figure = Figure::new("Position under the rendered friction, and under the friction that it renders")
        .x(Axis::new("time t", "s").range(0.0, 4.0))
        .y(Axis::new("angle φ", "rad"))
        .series(Series::line(Role::Reference, "reference", angle(0.0)))
        .series(Series::line(Role::Rendered, "rendered friction", angle(0.04)))
        .series(Series::line(Role::Own, "own friction", angle(0.08)))
        .series(Series::line(Role::Trace(1), "real friction", angle(0.05)).dashed());
    expect_file!["golden/position.svg"].assert_eq(&figure.svg());
}

#[test]
fn text_from_outside_is_escaped() {
    let hostile = "<script>\"a\" & b</script>";
    let series = Series::line(Role::Own, hostile, [(0.0, 0.0), (1.0, 1.0)]);
    let axis = || Axis::new(hostile, "N m");
    let svg = Figure::new(hostile).x(axis()).y(axis()).interval(0.0, 1.0, hostile).series(series).svg();
    assert!(!svg.contains("<script"), "{svg}");
    assert_eq!(svg.matches("&lt;script&gt;&quot;a&quot; &amp; b").count(), 10);
}

#[test]
fn odd_data_gives_a_figure_without_odd_numbers() {
    let odd: [Vec<(f64, f64)>; 5] = [
        vec![],
        vec![(f64::NAN, 1.0), (1.0, f64::INFINITY)],
        vec![(0.0, 0.0)],
        vec![(1.0, f64::NAN), (2.0, 5.0), (3.0, f64::NEG_INFINITY), (4.0, 6.0)],
        vec![(1e300, -1e300), (-1e-300, 1e-300)],
    ];
    for data in odd {
        for stretched in [false, true] {
            let axis = Axis::new("speed", "rad/s");
            let band = data.iter().map(|&(x, y)| (x, y, y));
            let svg = Figure::new("Odd")
                .x(if stretched { axis.stretched() } else { axis })
                .series(Series::points(Role::Measured, "points", data.clone()))
                .series(Series::line(Role::Fitted, "line", data.clone()))
                .series(Series::band(Role::Fitted, "band", band))
                .svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{data:?}: {svg}");
        }
    }
}

#[test]
fn a_figure_without_data_states_it() {
    assert!(Figure::new("Nothing").svg().contains(">no data</text>"));
    assert!(!friction("Something").series(Series::line(Role::Own, "own", curve(OWN))).svg().contains("no data"));
}

#[test]
fn a_line_breaks_at_standstill_and_no_cloud_hides_a_curve() {
    let svg = friction("Order")
        .series(Series::line(Role::Desired, "desired", curve(DESIRED)))
        .series(Series::points(Role::Measured, "measured", cloud(OWN, 100)))
        .svg();
    let place = |pattern: &str| svg.find(pattern).expect(pattern);
    assert!(place("class=\"measured\"") < place("class=\"desired\""));
    let path = &svg[place("stroke-width=\"2.6\"")..];
    let path = &path[..path.find("/>").expect("a path ends")];
    assert_eq!(path.matches('M').count(), 2, "two pieces");
}

#[test]
fn the_summary_describes_the_figure() {
    let svg = friction("Described")
        .interval(-0.5, 0.5, "fade-out")
        .series(Series::line(Role::Desired, "desired", [(-2.0, -0.25), (2.0, 0.25)]))
        .svg();
    assert!(svg.contains("<title>Described</title>"));
    assert!(svg.contains("desired (line): 2 values from −0.250 to 0.250 N·m. fade-out: from −0.500 to 0.500 rad/s."));
}
