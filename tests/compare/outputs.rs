//! What a comparison leaves behind: tables, figures, the report.

use std::path::Path;

use flockform::export::comparison::{ComparisonReport, write_comparison};
use flockform::export::{ExportError, OutputFolder};
use flockform::study::compare::run::Compared;
use resvg::usvg::roxmltree::{Document, Node};

use crate::folders::temporary;
use crate::json::json_in;
use crate::scenes::load;
use crate::support::*;

fn write_to(out: &Path, name: &str, found: &Compared, force: bool) -> Result<(), ExportError> {
    let scene = load(name, &[]);
    let folder = OutputFolder::create(out, force)?;
    let written = write_comparison(&folder, &scene, found, &ComparisonReport::new(&scene, found))?;
    assert!(written.iter().all(|path| path.is_file()), "{written:?}");
    folder.commit().map(|_| ())
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect("written")
}

fn of_class<'a>(svg: &'a Document<'a>, class: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    svg.descendants().filter(move |node| node.attribute("class") == Some(class))
}

#[test]
fn a_comparison_leaves_its_report_its_tables_and_two_figures() {
    let folder = temporary();
    let (out, found) = (folder.path().join("out"), compared("beam-paper", &[]));
    write_to(&out, "beam-paper", &found, false).expect("written");
    let mut names: Vec<_> =
        std::fs::read_dir(&out).expect("there").map(|e| e.expect("read").file_name()).collect();
    names.sort();
    assert_eq!(
        names,
        [
            "cells.csv",
            "compare.csv",
            "compare.json",
            "flockform-files.txt",
            "overlay.png",
            "overlay.svg",
            "von_mises.png",
            "von_mises.svg"
        ]
    );
    let report = json_in(&out.join("compare.json"));
    assert_eq!(report["displacement_rel_l2"], found.comparison.displacement_rel_l2);
    assert!(report["truth"]["stated_error"].as_f64().is_some_and(|error| error < 1e-4));
    assert_eq!(report["rule"]["stop_reason"], "equilibrium");
    assert_eq!(report["scene"]["material"]["young"], 1000.0);
    // The frame is listed, and the truth does not know it.
    let particles = text(&out, "compare.csv");
    assert_eq!(particles.lines().count(), 1 + 14 * 14);
    assert!(particles.starts_with("id,x,y,role,ux_rule,uy_rule,ux_truth,uy_truth\n1,9.0,9.0,frame,"));
    assert!(particles.lines().nth(1).is_some_and(|line| line.ends_with(",,")), "{particles}");
    assert_eq!(text(&out, "cells.csv").lines().count(), 1 + 121);
    // A comparison of an earlier day may be replaced.
    assert!(matches!(write_to(&out, "beam-paper", &found, false), Err(ExportError::NotEmpty(_))));
    write_to(&out, "beam-paper", &found, true).expect("replaced");
}

#[test]
fn the_overlay_has_a_ring_for_every_true_particle_and_a_dot_for_every_particle_of_the_rule() {
    let folder = temporary();
    let out = folder.path().join("out");
    write_to(&out, "beam-paper", &compared("beam-paper", &[]), false).expect("written");
    let overlay = text(&out, "overlay.svg");
    let svg = Document::parse(&overlay).expect("XML");
    let circles = |class| of_class(&svg, class).flat_map(|g| g.children()).filter(Node::is_element).count();
    assert_eq!(["truth", "follower", "leader", "clamped"].map(circles), [144, 120, 12, 12]);
    assert_eq!(of_class(&svg, "outline").count(), 2);
    assert!(overlay.contains("displacements to scale"));
}

#[test]
fn the_von_mises_figure_fills_every_cell_three_times_and_marks_stress_above_its_scale() {
    let folder = temporary();
    for (name, exceeded) in [("beam", false), ("beam-hexagonal", false), ("beam-paper", true)] {
        let (out, found) = (folder.path().join(name), compared(name, &[]));
        write_to(&out, name, &found, false).expect("written");
        let drawn = text(&out, "von_mises.svg");
        let svg = Document::parse(&drawn).expect("XML");
        let filled: usize = of_class(&svg, "cells")
            .map(|path| path.attribute("d").map_or(0, |d| d.matches('Z').count()))
            .sum();
        assert_eq!(filled, 3 * found.cells.count(), "{name}");
        assert_eq!(drawn.contains(">up to "), exceeded, "{name}");
        for panel in [">rule<", ">truth<", ">|rule \u{2212} truth|", ">von Mises stress", "[unit of young]<"]
        {
            assert!(drawn.contains(panel), "{name}: {panel}");
        }
    }
}

#[test]
fn the_error_picture_has_a_scale_of_its_own() {
    let folder = temporary();
    let (out, found) = (folder.path().join("beam"), compared("beam", &[]));
    write_to(&out, "beam", &found, false).expect("written");
    let drawn = text(&out, "von_mises.svg");
    let svg = Document::parse(&drawn).expect("XML");
    // An error of some percent of the stress fills its scale from end to end: the last cells drawn are the third panel's largest.
    let fills: Vec<_> = of_class(&svg, "cells").filter_map(|path| path.attribute("fill")).collect();
    assert_eq!(fills.last(), Some(&"#fde725"), "{fills:?}");
    // Of the two scales the larger is the first.
    let apart = found.von_mises_rule.iter().zip(&found.von_mises_truth).map(|(a, b)| (a - b).abs());
    let (most, error) =
        (found.von_mises_truth.iter().copied().fold(0.0, f64::max), apart.fold(0.0, f64::max));
    assert!(error < 0.2 * most, "{error} of {most}: the scales can be told apart");
}
