//! The von Mises stress by a rule beside the true one, as in the paper's figures 12, 14, 16 and 18.

use super::comparison::{Pair, scale_note};
use super::heading::Heading;
use super::page;
use super::panels::{MOST_CELLS, Panel, Scale, Sheet, arranged};

/// Name of the third panel and of its scale.
const DIFFERENCE: &str = "|rule \u{2212} truth|";
/// The scale ends at the largest true stress times this if the rule has more.
const HEADROOM: f64 = 1.25;

/// Rule and truth at the centres of the cells on one scale, and the size of their difference on its own; `rule` and
/// `truth` are \[force / length^2\], shape \[cells\].
pub fn von_mises(pair: &Pair<'_>, rule: &[f64], truth: &[f64]) -> String {
    let factor = pair.factor();
    let [by_rule, in_truth] = [pair.rule, pair.truth].map(|u| pair.displaced(u, factor));
    let apart: Vec<f64> = rule.iter().zip(truth).map(|(rule, truth)| (rule - truth).abs()).collect();
    let panels = [
        Panel { name: "rule", stress: rule, places: &by_rule, scale: 0 },
        Panel { name: "truth", stress: truth, places: &in_truth, scale: 0 },
        Panel { name: DIFFERENCE, stress: &apart, places: &in_truth, scale: 1 },
    ];
    let scales = vec![scale_of(rule, truth), Scale::from_zero(DIFFERENCE, largest(&apart), 5.0)];
    let bounds = pair.bounds([&by_rule, &in_truth]);
    let (axes, is_row) = arranged(|room| page::within(bounds, pair.spacing, room));
    let heading = Heading {
        title: pair.title.into(),
        note: format!("von Mises stress at the centres of the cells{}", scale_note(factor)),
        ..Heading::default()
    };
    let Pair { cells, unit, stress_unit, spacing, .. } = *pair;
    let is_raster = cells.count() > MOST_CELLS;
    Sheet { axes, is_row, scales, heading, cells, is_raster, team: None, unit, stress_unit, spacing }
        .draw(&panels)
}

fn largest(stress: &[f64]) -> f64 {
    stress.iter().copied().filter(|s| s.is_finite()).fold(0.0, f64::max)
}

fn scale_of(rule: &[f64], truth: &[f64]) -> Scale {
    let (by_rule, in_truth) = (largest(rule), largest(truth));
    let end = if in_truth == 0.0 { by_rule } else { by_rule.min(HEADROOM * in_truth).max(in_truth) };
    let scale = Scale::from_zero("von Mises stress", end, 10.0);
    scale.with_values_above(by_rule)
}
