//! Curves and points over two axes, each linear or logarithmic: what a solver, a trade or a threshold
//! looks like. Drawn here and not by a crate of charts: axes, ticks, fonts and colours are those of the figures of bodies.

use serde::Serialize;

use super::axes::Axes;
use super::heading::{Heading, Key, Mark};
use super::page;
use super::svg::{Anchor, INK, Path, Svg};
use super::ticks::{Ticks, power_of_ten};
use crate::scene::text::counted;

const HEIGHT: f64 = 430.0;
const PANEL_HEIGHT: f64 = 190.0;
const PANEL_GAP: f64 = 16.0;
const RIGHT: f64 = 26.0;
const TEXT: f64 = 12.0;
const TICK: f64 = 5.0;
/// Radius of a point of a line between two gaps \[px\].
const LONE: f64 = 2.0;
const GRID: &str = "#e6e8eb";

/// Points of a line that a page or a sheet can show; a longer one keeps the extremes of each stretch.
const MOST_POINTS: usize = 1500;

/// The quantity of an axis, and its scale.
#[derive(Clone, Debug, Serialize)]
pub struct Axis {
    pub quantity: String,
    pub unit: String,
    #[serde(rename = "log")]
    pub is_log: bool,
}

impl Axis {
    pub fn new(quantity: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { quantity: quantity.into(), unit: unit.into(), is_log: false }
    }

    pub fn log(quantity: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { is_log: true, ..Self::new(quantity, unit) }
    }
}

/// The style of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    Line,
    Dots,
    Rings,
    /// Large rings on a line: those that matter among many.
    Front,
    /// Large, ringed dots alone.
    Beads,
}

/// A set of points, in the legend if it has a name; those that an axis cannot show (no number, zero on a logarithmic one) are left
/// out, gaps in its line.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    pub name: String,
    pub colour: &'static str,
    pub style: Style,
    pub points: Vec<[f64; 2]>,
    /// A label of each point on a page; empty where its coordinates suffice.
    pub labels: Vec<String>,
}

impl Series {
    pub fn new(name: impl Into<String>, colour: &'static str, style: Style, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), colour, style, points, labels: Vec::new() }
    }
}

/// A value on the horizontal axis that deserves a line and a word.
#[derive(Clone, Debug, Serialize)]
pub struct Landmark {
    pub x: f64,
    /// Of one line or several.
    pub name: String,
    #[serde(skip)]
    pub colour: &'static str,
}

/// A chart as a figure, and as data that a page draws.
#[derive(Clone, Debug, Serialize)]
pub struct Chart {
    pub title: String,
    pub note: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    pub landmarks: Vec<Landmark>,
    /// Whether the horizontal axis is the clock of the page's animation.
    pub follows_clock: bool,
}

impl Chart {
    pub fn new(
        title: impl Into<String>,
        note: impl Into<String>,
        [x, y]: [Axis; 2],
        series: Vec<Series>,
    ) -> Self {
        let (title, note) = (title.into(), note.into());
        Self { title, note, x, y, series, landmarks: Vec::new(), follows_clock: false }
    }

    /// As a page shows it: of long lines what can be seen, landmarks in one line.
    pub(crate) fn on_page(&self) -> Self {
        let mut chart = self.clone();
        for series in chart.series.iter_mut().filter(|series| series.style == Style::Line) {
            let lines = series.points.split_inclusive(|point| !point[1].is_finite());
            let gap = |line: &[[f64; 2]]| line.last().copied().filter(|last| !last[1].is_finite());
            series.points = lines.flat_map(|line| thinned(line).into_iter().chain(gap(line))).collect();
        }
        chart.landmarks.iter_mut().for_each(|mark| mark.name = mark.name.replace('\n', ", "));
        chart
    }
}

/// Draws a chart.
pub fn draw(chart: &Chart) -> String {
    let mut svg = Svg::new(page::WIDTH, height(chart));
    draw_on(&mut svg, chart);
    svg.finish()
}

/// Draws charts of the same series against the same quantity as panels of one sheet, under this title and one legend.
pub fn draw_panels(title: &str, charts: &[Chart]) -> String {
    let heading = Heading { title: title.into(), ..charts.first().map(heading).unwrap_or_default() };
    let top = heading.height(page::WIDTH) + 4.0;
    let below = |n: usize| n as f64 * (PANEL_HEIGHT + PANEL_GAP);
    let mut svg = Svg::new(page::WIDTH, top + below(charts.len()) - PANEL_GAP + Axes::BELOW);
    heading.draw(&mut svg, page::WIDTH);
    let windows: Vec<Axes> = charts.iter().map(|chart| window(chart, PANEL_HEIGHT)).collect();
    let rooms = charts.iter().zip(&windows).map(|(chart, axes)| room_on_the_left(chart, axes));
    let left = rooms.fold(0.0, f64::max);
    for (n, (chart, axes)) in charts.iter().zip(windows).enumerate() {
        draw_plot(&mut svg, chart, axes, [left, top + below(n)], n + 1 == charts.len());
    }
    svg.finish()
}

/// Draws several charts on one sheet, in this order from the top.
pub fn draw_below_each_other(charts: &[Chart]) -> String {
    let mut svg = Svg::new(page::WIDTH, charts.iter().map(height).sum());
    let mut top = 0.0;
    for chart in charts {
        svg.group(format_args!("transform=\"translate(0 {top:.2})\""), |svg| draw_on(svg, chart));
        top += height(chart);
    }
    svg.finish()
}

fn height(chart: &Chart) -> f64 {
    heading(chart).height(page::WIDTH) + 4.0 + HEIGHT + Axes::BELOW
}

fn heading(chart: &Chart) -> Heading {
    let mark = |style: Style| match style {
        Style::Line => Mark::Line,
        Style::Dots | Style::Beads => Mark::Dot,
        Style::Rings | Style::Front => Mark::Ring,
    };
    let key = |series: &Series| Key::new(series.name.clone(), series.colour, mark(series.style));
    let legend = chart.series.iter().filter(|series| !series.name.is_empty()).map(key).collect();
    Heading { title: chart.title.clone(), note: chart.note.clone(), legend, ..Heading::default() }
}

fn draw_on(svg: &mut Svg, chart: &Chart) {
    let (heading, axes) = (heading(chart), window(chart, HEIGHT));
    heading.draw(svg, page::WIDTH);
    let corner = [room_on_the_left(chart, &axes), heading.height(page::WIDTH) + 4.0];
    draw_plot(svg, chart, axes, corner, true);
}

/// The chart without its heading, and without what its horizontal axis says if that stands elsewhere.
fn draw_plot(svg: &mut Svg, chart: &Chart, mut axes: Axes, corner: [f64; 2], has_labels: bool) {
    axes.corner = corner;
    axes.size[0] = page::WIDTH - corner[0] - RIGHT;
    draw_horizontal(svg, &chart.x, &axes, has_labels);
    draw_vertical(svg, chart, &axes);
    for landmark in &chart.landmarks {
        draw_landmark(svg, chart, &axes, landmark);
    }
    for series in &chart.series {
        draw_series(svg, chart, &axes, series);
    }
    svg.rect(axes.corner, axes.size, format_args!("fill=\"none\" stroke=\"{INK}\""));
}

/// A value as the axes count it; `None` where they cannot show it.
fn on_axis(axis: &Axis, value: f64) -> Option<f64> {
    let value = if axis.is_log { value.log10() } else { value };
    value.is_finite().then_some(value)
}

fn on_axes(chart: &Chart, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    Some([on_axis(&chart.x, x)?, on_axis(&chart.y, y)?])
}

/// The axes around everything shown, so high \[px\], their place still to be given.
fn window(chart: &Chart, height: f64) -> Axes {
    let points = || chart.series.iter().flat_map(|series| &series.points);
    let marked: Vec<f64> = chart.landmarks.iter().filter_map(|m| on_axis(&chart.x, m.x)).collect();
    let range = |k: usize| {
        // A line that comes to zero goes on, where the axis of its values has none.
        let axis = [&chart.x, &chart.y][k];
        let values = points().filter(|p| !p[1 - k].is_nan()).filter_map(|p| on_axis(axis, p[k]));
        let values = values.chain(if k == 0 { marked.clone() } else { Vec::new() });
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        match (low.is_finite(), high - low) {
            (false, _) => [0.0, 1.0],
            (true, extent) if extent > 1e-9 * low.abs().max(1e-300) => {
                let margin = if k == 0 && chart.follows_clock { 0.0 } else { 0.05 * extent };
                [low - margin, high + margin]
            }
            _ => [low - room(low, axis.is_log), high + room(low, axis.is_log)],
        }
    };
    let [x, y] = [range(0), range(1)];
    Axes { corner: [0.0; 2], size: [page::WIDTH, height], low: [x[0], y[0]], high: [x[1], y[1]] }
}

/// What an axis has on either side of a single value, as it counts.
pub(super) fn room(value: f64, is_log: bool) -> f64 {
    if is_log || value == 0.0 { 0.5 } else { 0.5 * value.abs() }
}

/// Positions of ticks as the axes count, with their labels (none for a minor tick).
fn ticks(axis: &Axis, low: f64, high: f64, most: f64) -> (Vec<(f64, String)>, String) {
    if !axis.is_log || high - low < 1.0 {
        // Within less than a decade there may be no power of ten.
        let exponential = |value: f64| if axis.is_log { 10f64.powf(value) } else { value };
        let ticks = Ticks::within(exponential(low), exponential(high), most);
        let at = |value: f64| Some((on_axis(axis, value)?, ticks.label(value)));
        let name = ticks.axis_name(&axis.quantity, &axis.unit);
        return (ticks.values.iter().filter_map(|&value| at(value)).collect(), name);
    }
    let (first, last) = (low.ceil() as i32, high.floor() as i32);
    let every = (f64::from(last - first + 1) / most).ceil().max(1.0) as i32;
    let mut marks: Vec<(f64, String)> = Vec::new();
    for decade in first - 1..=last {
        let labelled = decade.rem_euclid(every) == 0;
        let label = if labelled { power_of_ten(decade) } else { String::new() };
        marks.push((f64::from(decade), label));
        if last - first < 5 {
            marks.extend((2..10).map(|m| (f64::from(decade) + f64::from(m).log10(), String::new())));
        }
    }
    marks.retain(|(at, _)| (low..=high).contains(at));
    let name = match &axis.unit[..] {
        "" => axis.quantity.clone(),
        unit => format!("{} [{unit}]", axis.quantity),
    };
    (marks, name)
}

fn vertical_ticks(chart: &Chart, axes: &Axes) -> (Vec<(f64, String)>, String) {
    ticks(&chart.y, axes.low[1], axes.high[1], (axes.size[1] / 34.0).min(9.0))
}

fn room_on_the_left(chart: &Chart, axes: &Axes) -> f64 {
    let (marks, _) = vertical_ticks(chart, axes);
    let widest = marks.iter().map(|(_, label)| super::letters::text_width(label, TEXT)).fold(0.0, f64::max);
    widest + TICK + 36.0
}

fn draw_horizontal(svg: &mut Svg, axis: &Axis, axes: &Axes, has_labels: bool) {
    let (marks, name) = ticks(axis, axes.low[0], axes.high[0], 10.0);
    let bottom = axes.corner[1] + axes.size[1];
    for (value, label) in &marks {
        let x = axes.place([*value, axes.low[1]])[0];
        let long = if label.is_empty() { 0.5 * TICK } else { TICK };
        if !label.is_empty() {
            svg.group(format_args!("stroke=\"{GRID}\""), |svg| svg.line([x, axes.corner[1]], [x, bottom]));
            if has_labels {
                svg.text([x, bottom + 15.0], Anchor::Middle, TEXT, INK, label);
            }
        }
        svg.group(format_args!("stroke=\"{INK}\""), |svg| svg.line([x, bottom], [x, bottom + long]));
    }
    let middle = axes.corner[0] + axes.size[0] / 2.0;
    if has_labels {
        svg.text([middle, bottom + 37.0], Anchor::Middle, TEXT + 1.0, INK, &name);
    }
}

fn draw_vertical(svg: &mut Svg, chart: &Chart, axes: &Axes) {
    let (marks, name) = vertical_ticks(chart, axes);
    let [left, right] = [axes.corner[0], axes.corner[0] + axes.size[0]];
    for (value, label) in &marks {
        let y = axes.place([axes.low[0], *value])[1];
        let long = if label.is_empty() { 0.5 * TICK } else { TICK };
        if !label.is_empty() {
            svg.group(format_args!("stroke=\"{GRID}\""), |svg| svg.line([left, y], [right, y]));
            svg.text([left - TICK - 4.0, y], Anchor::End, TEXT, INK, label);
        }
        svg.group(format_args!("stroke=\"{INK}\""), |svg| svg.line([left - long, y], [left, y]));
    }
    svg.upward_text([14.0, axes.corner[1] + axes.size[1] / 2.0], TEXT + 1.0, &name);
}

fn draw_landmark(svg: &mut Svg, chart: &Chart, axes: &Axes, landmark: &Landmark) {
    let Some(x) = on_axis(&chart.x, landmark.x) else { return };
    let at = axes.place([x, axes.high[1]]);
    let stroke = format!("stroke=\"{}\" stroke-dasharray=\"5 3\"", landmark.colour);
    svg.group(stroke, |svg| svg.line(at, [at[0], axes.corner[1] + axes.size[1]]));
    let right = at[0] > axes.corner[0] + 0.6 * axes.size[0];
    let (anchor, beside) = if right { (Anchor::End, -5.0) } else { (Anchor::Start, 5.0) };
    for (row, line) in landmark.name.lines().enumerate() {
        let below = 14.0 + 15.0 * row as f64;
        svg.text([at[0] + beside, at[1] + below], anchor, TEXT, landmark.colour, line);
    }
}

fn draw_series(svg: &mut Svg, chart: &Chart, axes: &Axes, series: &Series) {
    let place = |&point: &[f64; 2]| on_axes(chart, point).map(|point| axes.place(point));
    let places: Vec<[f64; 2]> = series.points.iter().filter_map(place).collect();
    if matches!(series.style, Style::Line | Style::Front) {
        let mut path = Path::default();
        // What an axis cannot show, as a logarithmic one zeros, is a gap.
        for line in series.points.split(|point| on_axes(chart, *point).is_none()) {
            match &line.iter().filter_map(place).collect::<Vec<_>>()[..] {
                // A line of one point would not be seen.
                [at] if series.style == Style::Line => {
                    svg.group(format_args!("fill=\"{}\"", series.colour), |svg| svg.circle(*at, LONE));
                }
                line => path.polyline(thinned(line)),
            }
        }
        let width = if series.style == Style::Line { 1.7 } else { 1.0 };
        let stroke =
            format!("stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"", series.colour);
        svg.path(&path, format_args!("class=\"series\" fill=\"none\" {stroke}"));
    }
    let (radius, attributes) = match series.style {
        Style::Line => return,
        Style::Dots => (3.0, format!("fill=\"{}\" fill-opacity=\"0.75\"", series.colour)),
        Style::Rings => (2.8, format!("fill=\"none\" stroke=\"{}\" stroke-width=\"1.2\"", series.colour)),
        Style::Front => (5.5, format!("fill=\"none\" stroke=\"{}\" stroke-width=\"1.2\"", series.colour)),
        Style::Beads => (4.5, format!("fill=\"{}\" stroke=\"{INK}\" stroke-width=\"1.1\"", series.colour)),
    };
    svg.group(attributes, |svg| places.iter().for_each(|&place| svg.circle(place, radius)));
}

/// A solver's residual, iteration by iteration; `None` where nothing acts, which leaves none.
pub fn residuals(residuals: &[f64]) -> Option<Chart> {
    if !residuals.iter().any(|&residual| residual > 0.0) {
        return None;
    }
    let points = residuals.iter().enumerate().map(|(n, &residual)| [n as f64, residual]).collect();
    Some(Chart::new(
        "Convergence of the solver",
        "residual force over the load's",
        [Axis::new("iteration", ""), Axis::log("residual", "")],
        vec![Series::new("", super::colour::SERIES[0], Style::Line, points)],
    ))
}

/// The same for a figure that stands alone.
pub fn titled_residuals(title: &str, solver: &str, values: &[f64]) -> Option<Chart> {
    let mut chart = residuals(values)?;
    chart.title = title.to_owned();
    chart.note = format!("residual of {solver}, {}", counted(values.len().saturating_sub(1), "iteration"));
    chart.y.quantity = "residual force over load".into();
    chart.series[0].name = solver.to_owned();
    Some(chart)
}

/// Of a long line, the ends and extremes of each stretch.
fn thinned(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let finite: Vec<[f64; 2]> = line.iter().copied().filter(|point| point[1].is_finite()).collect();
    if finite.len() <= MOST_POINTS {
        return finite;
    }
    let mut kept = vec![finite[0]];
    for run in finite.chunks(finite.len().div_ceil(MOST_POINTS / 2)) {
        let by_height = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let mut extremes: Vec<[f64; 2]> = [run.iter().min_by(by_height), run.iter().max_by(by_height)]
            .into_iter()
            .flatten()
            .copied()
            .collect();
        extremes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        kept.extend(extremes);
    }
    kept.extend(finite.last());
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<[f64; 2]>) -> Chart {
        let series = Series::new("a < b", "#000000", Style::Front, points);
        Chart::new("T", "", [Axis::log("time", "s"), Axis::log("error", "s")], vec![series])
    }

    #[test]
    fn a_logarithmic_axis_counts_in_powers_of_ten_and_leaves_zeros_out() {
        let svg = draw(&chart(vec![[1e-3, 1e-1], [1.0, 1e-8], [0.0, 1.0], [1.0, f64::NAN]]));
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains(">10⁻³<") && svg.contains(">10⁻⁸<"), "{svg}");
        assert!(svg.contains("a &lt; b"));
    }

    #[test]
    fn a_line_has_a_gap_where_a_logarithmic_axis_cannot_show_it_and_goes_on_to_the_end_of_time() {
        let points = vec![[0.0, 1e-1], [1.0, 1e-8], [2.0, 0.0], [3.0, 1e-8], [4.0, 1e-7], [50.0, 0.0]];
        let series = Series::new("", "#000000", Style::Line, points);
        let svg = draw(&Chart::new("T", "", [Axis::new("time", "s"), Axis::log("error", "s")], vec![series]));
        let line = svg.split("class=\"series\"").nth(1).expect("drawn").split("/>").next().expect("ends");
        assert_eq!((line.matches('M').count(), line.matches('L').count()), (2, 2), "{line}");
        assert!(svg.contains(">50<"), "{svg}");
    }

    #[test]
    fn a_line_has_a_gap_where_there_is_no_number_and_a_point_between_two_is_seen() {
        let known = |from: u32| (from..from + 3).map(|n| [f64::from(n), 1.0]);
        let none = |at: f64| [[at, f64::NAN]].into_iter();
        let points = known(0).chain(none(3.0)).chain([[4.0, 2.0]]).chain(none(5.0)).chain(known(6)).collect();
        let series = Series::new("", "#123456", Style::Line, points);
        let chart = Chart::new("T", "", [Axis::new("time", "s"), Axis::new("error", "m")], vec![series]);
        let svg = draw(&chart);
        let line = svg.split("class=\"series\"").nth(1).expect("drawn").split("/>").next().expect("ends");
        assert_eq!((line.matches('M').count(), svg.matches("<circle").count()), (2, 1), "{line}");
        let on_page = &chart.on_page().series[0].points;
        assert_eq!(on_page.iter().filter(|point| point[1].is_nan()).count(), 2, "{on_page:?}");
    }

    #[test]
    fn a_single_value_of_any_size_is_in_the_middle_of_its_axis() {
        for value in [4e17, 4.2e-3, -7.0, 0.0] {
            let series = Series::new("", "#123456", Style::Dots, vec![[1.0, value], [2.0, value]]);
            let chart = Chart::new("T", "", [Axis::new("time", "s"), Axis::new("error", "m")], vec![series]);
            let axes = window(&chart, 100.0);
            assert!(axes.low[1] < value && axes.high[1] > value, "{value}: {axes:?}");
            assert!(axes.high[1] - axes.low[1] <= 1.0f64.max(1.1 * value.abs()), "{value}: {axes:?}");
        }
    }

    #[test]
    fn an_axis_of_less_than_a_decade_still_has_labels() {
        let svg = draw(&chart(vec![[1.5, 1.4], [8.5, 8.4]]));
        assert!(svg.matches(">4<").count() + svg.matches(">4.0<").count() >= 2, "{svg}");
        let svg = draw(&chart(vec![[1.0, 0.5], [1.2, 0.7]]));
        assert!(svg.contains(">0.50<") && svg.contains(">1.0") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn a_chart_of_nothing_is_drawn_all_the_same() {
        let svg = draw(&chart(Vec::new()));
        assert!(svg.ends_with("</svg>\n") || svg.ends_with("</svg>"), "{svg}");
        assert!(
            svg.contains(">time [s]<") && svg.contains(">error [s]<"),
            "its axes have their names: {svg}"
        );
        assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("<circle"), "{svg}");
    }

    #[test]
    fn a_thinned_line_keeps_its_ends_and_its_peaks() {
        let mut line: Vec<[f64; 2]> = (0..100_000).map(|n| [f64::from(n), 0.0]).collect();
        line[54_321][1] = -3.0;
        let kept = thinned(&line);
        assert!(kept.len() <= MOST_POINTS + 2, "{}", kept.len());
        assert!(kept.contains(&[54_321.0, -3.0]));
        assert_eq!([kept[0][0], kept[kept.len() - 1][0]], [0.0, 99_999.0]);
    }
}
