//! The figure of a parameter sweep: lines over one key, a heat map over two, parallel coordinates over more.

use super::axes::{Axes, Measure};
use super::bands::Bands;
use super::chart::{Axis, Chart, Series, Style, draw_below_each_other, room};
use super::colour::{SERIES, viridis};
use super::heading::Heading;
use super::letters::text_width;
use super::page;
use super::svg::{Anchor, INK, Path, Svg};
use super::ticks::Ticks;
use crate::study::design::{Factor, Level};

/// Charts below each other over one key; more would be read on a screen at once.
const MOST_CHARTS: usize = 4;
/// Height of a heat map and of parallel axes \[px\].
const HEIGHT: f64 = 430.0;
const TEXT: f64 = 12.0;
/// Runs without a value \[colour\].
const ABSENT: &str = "#d9dce0";
/// How they are shown where there are no cells for them.
const LEFT_OUT: &str = "left out";

/// A varied key or an output, with its value in each run.
#[derive(Clone, Debug)]
pub struct Column {
    pub name: String,
    /// Whether it is shown by its logarithm.
    pub is_log: bool,
    pub values: Vec<Option<f64>>,
    /// The words that the values count from 1, where they are no numbers.
    pub categories: Vec<String>,
}

impl Column {
    /// The levels of a key; words count from 1 in the order in which they come.
    pub fn of_levels(factor: &Factor, levels: &[&Level]) -> Self {
        let (name, is_log) = (factor.key.clone(), factor.is_log);
        if levels.iter().all(|level| level.number.is_some()) {
            let values = levels.iter().map(|level| level.number).collect();
            return Self { name, is_log, values, categories: Vec::new() };
        }
        let mut categories: Vec<String> = Vec::new();
        let values = levels.iter().map(|level| {
            let known = categories.iter().position(|word| *word == level.text);
            let new = || {
                categories.push(level.text.clone());
                categories.len() - 1
            };
            Some(1.0 + known.unwrap_or_else(new) as f64)
        });
        let values = values.collect();
        Self { name, is_log: false, values, categories }
    }

    pub fn has_numbers(&self) -> bool {
        self.values.iter().flatten().any(|value| value.is_finite())
    }

    /// Whether two of its values differ.
    pub fn varies(&self) -> bool {
        let [low, high] = self.ends();
        high > low
    }

    /// The value of a run as it is shown.
    fn shown(&self, run: usize) -> Option<f64> {
        let value = self.values[run]?;
        Some(if self.is_log { value.log10() } else { value }).filter(|value| value.is_finite())
    }

    /// The least and the greatest value shown; of none, 0 and 0.
    fn ends(&self) -> [f64; 2] {
        let shown = || (0..self.values.len()).filter_map(|run| self.shown(run));
        [shown().reduce(f64::min).unwrap_or(0.0), shown().reduce(f64::max).unwrap_or(0.0)]
    }

    fn label(&self) -> String {
        if self.is_log { format!("log10 {}", self.name) } else { self.name.clone() }
    }

    /// The words that stand for numbers, for the note of a figure.
    fn words(&self) -> Option<String> {
        let numbered = self.categories.iter().enumerate().map(|(n, word)| format!("{} {word}", n + 1));
        let numbered: Vec<String> = numbered.collect();
        (!numbered.is_empty()).then(|| format!("{}: {}", self.name, numbered.join(", ")))
    }
}

/// The runs of a sweep, column by column.
pub struct Swept<'a> {
    pub title: &'a str,
    /// Whether each value of a key meets each of the others.
    pub is_grid: bool,
    pub keys: Vec<Column>,
    /// Those to show; the first alone over two keys and more.
    pub outputs: Vec<Column>,
    /// The number of runs that diverged, which have no values.
    pub diverged: usize,
}

impl Swept<'_> {
    fn runs(&self) -> usize {
        self.keys.first().map_or(0, |key| key.values.len())
    }

    /// `absent` says how runs without a value are shown.
    fn heading(&self, output: &Column, absent: &str) -> Heading {
        let runs = self.runs();
        let diverged = (self.diverged > 0).then(|| format!("{} of {runs} diverged: {absent}", self.diverged));
        let words = self.keys.iter().filter_map(Column::words);
        let note: Vec<String> =
            [format!("{}, {runs} runs", output.name)].into_iter().chain(diverged).chain(words).collect();
        let note = note.join("; ");
        Heading { title: self.title.to_owned(), note, ..Heading::default() }
    }
}

/// Draws the figure; `None` without runs or without an output that is a number.
pub fn draw(swept: &Swept<'_>) -> Option<String> {
    let first = swept.outputs.first().filter(|_| swept.runs() > 0)?;
    Some(match &swept.keys[..] {
        [key] => lines(swept, key),
        [x, y] => heat_map(swept, [x, y], first),
        _ => parallel(swept, first),
    })
}

/// Each output over the key, in charts below each other.
fn lines(swept: &Swept<'_>, key: &Column) -> String {
    let style = if swept.is_grid && key.categories.is_empty() { Style::Line } else { Style::Dots };
    let charts = swept.outputs.iter().take(MOST_CHARTS).enumerate().map(|(n, output)| {
        let pairs = key.values.iter().zip(&output.values);
        let points = pairs.filter_map(|(&x, &y)| Some([x?, y.unwrap_or(f64::NAN)]));
        let mut points: Vec<[f64; 2]> = points.collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let heading = swept.heading(output, LEFT_OUT);
        let series = |style| Series::new("", SERIES[n], style, points.clone());
        // The line shows how it goes, the dots where it is known.
        let series =
            if style == Style::Line { vec![series(style), series(Style::Dots)] } else { vec![series(style)] };
        let x = Axis { is_log: key.is_log, ..Axis::new(&key.name, "") };
        let title = if n == 0 { heading.title } else { String::new() };
        Chart::new(title, heading.note, [x, Axis::new(&output.name, "")], series)
    });
    draw_below_each_other(&charts.collect::<Vec<_>>())
}

/// The output as colour over two keys: cells of a grid, or dots where the runs were drawn.
fn heat_map(swept: &Swept<'_>, keys: [&Column; 2], output: &Column) -> String {
    let heading = swept.heading(output, "grey");
    let [low, high] = output.ends();
    let bands = Bands::around(low, high, 0.0).named(&output.name, "");
    let edges = keys.map(|key| if swept.is_grid { cell_edges(key) } else { around(key) });
    let end = |k: usize| [edges[k][0], edges[k][edges[k].len() - 1]];
    let mut axes = Axes {
        corner: [0.0; 2],
        size: [page::WIDTH, HEIGHT],
        low: [end(0)[0], end(1)[0]],
        high: [end(0)[1], end(1)[1]],
    };
    let left = axes.left_of_plot();
    axes.corner = [left, heading.height(page::WIDTH)];
    axes.size[0] = page::WIDTH - left - bands.bar_room();
    let mut svg = Svg::new(page::WIDTH, axes.corner[1] + HEIGHT + Axes::BELOW);
    heading.draw(&mut svg, page::WIDTH);
    for run in 0..swept.runs() {
        let (Some(x), Some(y)) = (keys[0].shown(run), keys[1].shown(run)) else { continue };
        let colour = output.shown(run).map_or(ABSENT.to_owned(), |value| bands.colour(bands.of(value)));
        match swept.is_grid {
            true => {
                let [[left, right], [bottom, top]] = [cell(&edges[0], x), cell(&edges[1], y)];
                let (corner, opposite) = (axes.place([left, top]), axes.place([right, bottom]));
                let size = [opposite[0] - corner[0], opposite[1] - corner[1]];
                svg.rect(corner, size, format_args!("fill=\"{colour}\" stroke=\"{colour}\""));
            }
            false => {
                svg.group(format_args!("fill=\"{colour}\" stroke=\"{INK}\" stroke-width=\"0.6\""), |svg| {
                    svg.circle(axes.place([x, y]), 6.0);
                })
            }
        }
    }
    let names = keys.map(Column::label);
    axes.draw(
        &mut svg,
        [Measure { quantity: &names[0], unit: "" }, Measure { quantity: &names[1], unit: "" }],
    );
    bands.draw_bar(&mut svg, &axes);
    svg.finish()
}

/// Edges of cells that meet half way between the values of a key.
fn cell_edges(key: &Column) -> Vec<f64> {
    let mut values: Vec<f64> = (0..key.values.len()).filter_map(|run| key.shown(run)).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let [Some(&first), Some(&last)] = [values.first(), values.last()] else { return vec![0.0, 1.0] };
    let middles: Vec<f64> = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    let [before, after] = match (middles.first(), middles.last()) {
        (Some(&next), Some(&before)) => [2.0 * first - next, 2.0 * last - before],
        _ => [first - room(first, key.is_log), last + room(first, key.is_log)],
    };
    [vec![before], middles, vec![after]].concat()
}

/// The edges of the cell that holds a value.
fn cell(edges: &[f64], value: f64) -> [f64; 2] {
    let above = edges.partition_point(|&edge| edge <= value).clamp(1, edges.len() - 1);
    [edges[above - 1], edges[above]]
}

/// The ends of an axis that shows all values of a key, with room for dots.
fn around(key: &Column) -> Vec<f64> {
    let [low, high] = key.ends();
    let room = if high > low { 0.04 * (high - low) } else { room(low, key.is_log) };
    vec![low - room, high + room]
}

/// An upright axis for each key and for the output, and each run as a line through its values.
fn parallel(swept: &Swept<'_>, output: &Column) -> String {
    let mut heading = swept.heading(output, LEFT_OUT);
    heading.note += "; dark lines are low, bright lines high";
    let top = heading.height(page::WIDTH) + 12.0;
    let mut svg = Svg::new(page::WIDTH, top + HEIGHT + Axes::BELOW);
    heading.draw(&mut svg, page::WIDTH);
    let columns: Vec<&Column> = swept.keys.iter().chain([output]).collect();
    let (left, apart) = (70.0, (page::WIDTH - 140.0) / (columns.len() - 1) as f64);
    let x = |k: usize| left + k as f64 * apart;
    let part = |column: &Column, value: f64| {
        let [low, high] = column.ends();
        if high > low { (value - low) / (high - low) } else { 0.5 }
    };
    let y = |column: &Column, value: f64| top + HEIGHT * (1.0 - part(column, value));
    // Bright lines over dark ones.
    let mut order: Vec<(f64, usize)> =
        (0..swept.runs()).filter_map(|run| Some((output.shown(run)?, run))).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (value, run) in order {
        let points: Option<Vec<[f64; 2]>> = columns
            .iter()
            .enumerate()
            .map(|(k, column)| Some([x(k), y(column, column.shown(run)?)]))
            .collect();
        let Some(points) = points else { continue };
        let mut path = Path::default();
        path.polyline(points);
        let colour = viridis(part(output, value));
        svg.path(
            &path,
            format_args!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.2\" stroke-opacity=\"0.8\""),
        );
    }
    for (k, column) in columns.iter().enumerate() {
        let [low, high] = column.ends();
        svg.group(format_args!("stroke=\"{INK}\""), |svg| svg.line([x(k), top], [x(k), top + HEIGHT]));
        let ticks = if high > low { Ticks::within(low, high, 8.0) } else { Ticks::single(low) };
        for &value in &ticks.values {
            let at = [x(k), y(column, value)];
            svg.group(format_args!("stroke=\"{INK}\""), |svg| svg.line([at[0] - 4.0, at[1]], at));
            // Lines end under the label, which would not be read on them.
            let label = ticks.label(value);
            let (width, height) = (text_width(&label, TEXT) + 4.0, TEXT + 2.0);
            let corner = [at[0] - 9.0 - text_width(&label, TEXT), at[1] - 0.5 * height];
            svg.rect(corner, [width, height], "fill=\"#ffffff\" class=\"paper\"");
            svg.text([at[0] - 7.0, at[1]], Anchor::End, TEXT, INK, &label);
        }
        // Long names in two rows do not meet.
        let below = top + HEIGHT + if k % 2 == 0 { 16.0 } else { 34.0 };
        let name = ticks.axis_name(&column.label(), "");
        let half = (0.5 * text_width(&name, TEXT) + 4.0).min(0.5 * page::WIDTH);
        let middle = x(k).clamp(half, page::WIDTH - half);
        svg.text([middle, below], Anchor::Middle, TEXT, INK, &name);
    }
    svg.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, values: &[f64]) -> Column {
        let values = values.iter().map(|&value| Some(value)).collect();
        Column { name: name.to_owned(), is_log: false, values, categories: Vec::new() }
    }

    fn swept(keys: Vec<Column>, output: &[f64]) -> Swept<'static> {
        Swept { title: "T", is_grid: true, keys, outputs: vec![column("pe1", output)], diverged: 0 }
    }

    #[test]
    fn one_key_is_a_line_with_a_dot_for_each_run() {
        let svg = draw(&swept(vec![column("a", &[3.0, 1.0, 2.0])], &[1.0, 2.0, 4.0])).expect("drawn");
        assert_eq!((svg.matches("<circle").count(), svg.matches("class=\"series\"").count()), (3, 1));
    }

    #[test]
    fn two_keys_are_cells_that_meet_and_fill_the_map() {
        let keys = vec![column("a", &[0.0, 0.0, 1.0, 1.0]), column("b", &[0.0, 10.0, 0.0, 10.0])];
        assert_eq!(cell_edges(&keys[1]), [-5.0, 5.0, 15.0]);
        assert_eq!(
            (cell(&[-5.0, 5.0, 15.0], 0.0), cell(&[-5.0, 5.0, 15.0], 10.0)),
            ([-5.0, 5.0], [5.0, 15.0])
        );
        let map = swept(keys, &[1.0, 2.0, 3.0, f64::NAN]);
        let svg = draw(&map).expect("drawn");
        assert_eq!(svg.matches(ABSENT).count(), 2, "the run without a value");
        assert!(svg.contains(&viridis(0.0)) && svg.contains(&viridis(1.0)) && !svg.contains("NaN"), "{svg}");
        let dots = draw(&Swept { is_grid: false, ..map }).expect("drawn");
        assert_eq!(dots.matches("<circle").count(), 4);
    }

    #[test]
    fn more_keys_are_a_line_for_each_run_and_words_are_numbered_in_the_note() {
        let word = |text: &str| Level { text: text.to_owned(), number: None };
        let (lagged, mirror) = (word("lagged"), word("mirror"));
        let frame = "frame=[lagged, mirror]".parse().expect("a factor");
        let words = Column::of_levels(&frame, &[&lagged, &mirror, &lagged]);
        let keys = vec![column("a", &[1.0, 2.0, 3.0]), column("b", &[5.0; 3]), words];
        let svg = draw(&swept(keys, &[1.0, 2.0, 3.0])).expect("drawn");
        assert_eq!(svg.matches("<path").count(), 3);
        assert!(svg.contains("frame: 1 lagged, 2 mirror") && !svg.contains("NaN"), "{svg}");
        // Under every number is paper that ends the lines.
        let labels = svg.matches("text-anchor=\"end\"").count();
        assert!(labels > 8 && svg.matches("class=\"paper\"").count() == labels, "{svg}");
        assert!(svg.rfind("<path") < svg.find("class=\"paper\""), "over the lines");
    }

    #[test]
    fn nothing_is_drawn_of_nothing() {
        assert!(draw(&swept(vec![column("a", &[])], &[])).is_none());
        assert!(draw(&Swept { outputs: Vec::new(), ..swept(vec![column("a", &[1.0])], &[1.0]) }).is_none());
    }
}
