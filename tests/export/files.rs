//! What a run leaves behind: the folder, the tables, the frames and the figures.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flockform::continuum::record::{ProbeSeries, Snapshot};
use flockform::continuum::run::{Outcome, run};
use flockform::export::{
    Drawing, ExportError, OutputFolder, Records, Results, Timings, VtkSeries, figures, write_all,
};
use flockform::flock::role::Role;
use flockform::scene::Scene;
use resvg::tiny_skia::Pixmap;
use resvg::usvg::roxmltree::{Document, Node};

use crate::folders::{names_in, temporary};
use crate::json::json;
use crate::scenes::{load, planned};

/// A finished run with what was kept of it.
pub struct Run {
    scene: Scene,
    outcome: Outcome,
    records: Records,
}

impl Run {
    pub fn of(name: &str, overrides: &[&str]) -> Self {
        let scene = load(name, overrides);
        let plan = planned(&scene);
        let probes = plan.probes.iter().map(|&p| ProbeSeries::new(p)).collect();
        let mut records = Records { probes, ..Records::default() };
        let outcome = run(plan, &mut |engine, _| {
            records.probes.iter_mut().for_each(|probe| probe.record(engine));
            if scene.record.figures.contains(&engine.step()) {
                records.snapshots.push(Snapshot::of(engine));
            }
            ControlFlow::Continue(())
        });
        Self { scene, outcome, records }
    }

    fn subject(&self) -> figures::Subject<'_> {
        figures::Subject::of(&self.scene, &self.outcome.engine)
    }

    /// Writes everything to a folder of this name and commits it.
    fn write_to(&self, out: &Path) -> Result<(), ExportError> {
        let folder = OutputFolder::create(out, true)?;
        self.write_into(&folder)?;
        folder.commit().map(|_| ())
    }

    pub fn write_into(&self, folder: &OutputFolder) -> Result<(), ExportError> {
        let results = Results {
            scene: &self.scene,
            outcome: &self.outcome,
            records: &self.records,
            timings: Timings::default(),
        };
        let (written, _) = write_all(folder, &results, Drawing::default())?;
        assert!(written.iter().all(|path| path.is_file()), "{written:?}");
        Ok(())
    }

    /// The list of frames and its files, of which there is one of the last step, in a folder of this parent.
    fn frame(&self, parent: &Path) -> (OutputFolder, Vec<PathBuf>) {
        let folder = OutputFolder::create(&parent.join("out"), false).expect("created");
        let mut series = VtkSeries::create(&folder).expect("created");
        series.write(&self.outcome.engine).expect("written");
        let files = series.finish().expect("finished");
        (folder, files)
    }
}

/// The list of what flockform wrote.
pub const LIST: &str = "flockform-files.txt";

pub fn fill(folder: &OutputFolder, file: &str) {
    fs::write(folder.path(file), r#"{"program": "flockform"}"#).expect("writable");
}

#[test]
fn outputs_stand_in_their_place_only_when_committed() {
    let parent = temporary();
    let out = parent.path().join("runs/out");
    let folder = OutputFolder::create(&out, false).expect("created");
    fill(&folder, "summary.json");
    assert!(!out.exists());
    folder.commit().expect("committed");
    assert_eq!(names_in(&parent.path().join("runs")), ["out"]);
    assert_eq!(names_in(&out), [LIST, "summary.json"]);
}

#[test]
fn outputs_that_are_not_committed_leave_nothing_behind() {
    let parent = temporary();
    let folder = OutputFolder::create(&parent.path().join("out"), false).expect("created");
    fill(&folder, "final.csv");
    let hidden = names_in(parent.path());
    assert_eq!(hidden, [".out.partial"]);
    drop(folder);
    assert!(names_in(parent.path()).is_empty());
    // Nor the folders made for them, but for those in which somebody has put something meanwhile.
    let deep = OutputFolder::create(&parent.path().join("runs/today/out"), false).expect("created");
    std::fs::write(parent.path().join("runs/note"), "mine").expect("written");
    drop(deep);
    assert_eq!(names_in(&parent.path().join("runs")), ["note"]);
}

#[test]
fn a_folder_that_is_not_empty_is_refused_and_the_refusal_names_the_remedy() {
    let parent = temporary();
    let out = parent.path().join("out");
    fs::create_dir(&out).expect("created");
    OutputFolder::create(&out, false).expect("an empty folder is welcome").commit().expect("committed");
    fs::write(out.join("notes.txt"), "mine").expect("writable");
    let refusal = OutputFolder::create(&out, false).expect_err("refused");
    assert!(matches!(refusal, ExportError::NotEmpty(_)));
    assert!(refusal.to_string().contains("--force"), "{refusal}");
    // With force too: nothing says that this program wrote it.
    let refusal = OutputFolder::create(&out, true).expect_err("refused");
    assert!(refusal.to_string().contains("did not write"), "{refusal}");
    assert_eq!(names_in(parent.path()), ["out"]);
}

#[test]
fn with_force_former_outputs_stay_until_the_new_ones_take_their_place() {
    let parent = temporary();
    let out = parent.path().join("out");
    let former = OutputFolder::create(&out, false).expect("created");
    fill(&former, "summary.json");
    fill(&former, "former.csv");
    former.commit().expect("committed");
    let folder = OutputFolder::create(&out, true).expect("may be replaced");
    fill(&folder, "summary.json");
    assert_eq!(names_in(&out), [LIST, "former.csv", "summary.json"]);
    folder.commit().expect("committed");
    assert_eq!(names_in(&out), [LIST, "summary.json"]);
    assert_eq!(names_in(parent.path()), ["out"]);
}

#[test]
fn outputs_are_kept_where_somebody_took_their_place_meanwhile() {
    let parent = temporary();
    let out = parent.path().join("out");
    let folder = OutputFolder::create(&out, false).expect("created");
    fill(&folder, "summary.json");
    fs::create_dir(&out).expect("created");
    fs::write(out.join("notes.txt"), "mine").expect("writable");
    let error = folder.commit().expect_err("refused");
    let ExportError::NotMoved { kept, .. } = &error else { panic!("{error}") };
    assert_eq!(names_in(kept), [LIST, "summary.json"]);
    assert_eq!(kept.file_name().expect("a name"), "out-2", "the next program removes hidden folders");
    assert!(error.to_string().contains(&kept.display().to_string()));
    assert_eq!(names_in(&out), ["notes.txt"]);
}

#[test]
fn a_place_that_cannot_be_a_folder_is_refused_with_its_path() {
    let parent = temporary();
    let file = parent.path().join("file");
    fs::write(&file, "mine").expect("writable");
    let refusal = |path: &Path| OutputFolder::create(path, true).expect_err("refused");
    assert!(matches!(refusal(&file), ExportError::NotAFolder(_)));
    let below = refusal(&file.join("out"));
    assert!(matches!(below, ExportError::Io { .. }));
    assert!(below.to_string().contains("file"), "{below}");
    assert!(matches!(refusal(Path::new("/")), ExportError::Unnamed(_)));
    assert!(matches!(refusal(Path::new("..")), ExportError::Unnamed(_)));
}

#[test]
fn the_tables_of_the_tension_test_use_the_papers_numbering_and_read_back_exactly() {
    let parent = temporary();
    let out = parent.path().join("out");
    let run = Run::of("tension", &["stop.steps=25", "record.figures=[]"]);
    run.write_to(&out).expect("written");

    let mut table = csv::Reader::from_path(out.join("final.csv")).expect("readable");
    let header: Vec<String> = table.headers().expect("a header").iter().map(str::to_owned).collect();
    let places = ["id", "column", "row", "role", "X", "Y", "x", "y"];
    let measures = ["pe1", "pe2", "strain_xx", "strain_yy", "strain_xy", "rotation"];
    assert_eq!(header, [&places[..], &measures].concat());
    let rows: Vec<csv::StringRecord> = table.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 144);
    // The paper: j = 67 stands in the sixth column, seventh row; j = 115 beside the leaders.
    let start = |id: usize| rows[id - 1].iter().take(4).collect::<Vec<_>>();
    assert_eq!(start(67), ["67", "6", "7", "follower"]);
    assert_eq!(start(115), ["115", "10", "7", "follower"]);
    assert_eq!(start(14), ["14", "2", "2", "clamped"]);
    assert_eq!(start(144), ["144", "12", "12", "frame"]);
    let engine = &run.outcome.engine;
    for (i, row) in rows.iter().enumerate() {
        let number = |column: usize| row[column].parse::<f64>().expect("a number");
        assert_eq!([number(4), number(5)], engine.body().reference.get(i));
        assert_eq!([number(6), number(7)], engine.present().get(i));
        assert_eq!([number(8), number(9)], [engine.pe1(i), engine.pe2(i)]);
        let strain = row[10].parse::<f64>().ok().map(|xx| ([xx, number(11), number(12)], number(13)));
        assert_eq!(strain, engine.strain(i).map(|strain| (strain.components, strain.rotation)));
    }

    let mut table = csv::Reader::from_path(out.join("probes.csv")).expect("readable");
    let rows: Vec<(usize, usize, f64, f64, f64, f64)> =
        table.deserialize().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 26 * 2);
    assert_eq!((rows[51].0, rows[51].1), (25, 115));
    assert_eq!(rows[51].2, engine.present().x[114]);
}

#[test]
fn the_summary_tells_how_the_run_went() {
    let parent = temporary();
    let out = parent.path().join("out");
    let run = Run::of("fracture", &["stop.steps=60", "record.figures=[]"]);
    run.write_to(&out).expect("written");
    let text = fs::read_to_string(out.join("summary.json")).expect("readable");
    let summary = json(&text);
    assert_eq!(summary["program"], "flockform");
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!((&summary["name"], &summary["stop_reason"]), (&"fracture".into(), &"steps".into()));
    assert_eq!((&summary["steps"], &summary["divergence"]), (&60.into(), &serde_json::Value::Null));
    assert_eq!(summary["scene"]["stop"]["steps"], 60, "overrides are part of the echo");
    let engine = &run.outcome.engine;
    assert_eq!(summary["counts"]["particles"], engine.roles().len());
    assert_eq!(
        summary["counts"]["clamped"],
        engine.roles().iter().filter(|&&role| role == Role::Clamped).count()
    );
    // As text: the reader here rounds, the writer does not.
    let residual = format!("\"residual\": {}", run.outcome.residual);
    assert!(text.contains(&residual), "{residual}");
    let broken = &summary["broken_bonds"];
    assert_eq!(broken["count"], engine.breaks().len());
    assert_eq!(broken["first"]["step"], engine.breaks()[0].step);
    assert_eq!(broken["first"]["pair"][0], engine.breaks()[0].pair[0] + 1);
    let along = broken["first"]["along"].as_f64().expect("a number");
    let body = engine.body();
    let length = body.reference.y.iter().copied().fold(0.0, f64::max);
    assert!((along - engine.breaks()[0].place[1] / length).abs() < 1e-12, "{along}");
    assert!(summary["timings"]["output_s"].as_f64().expect("a number") > 0.0);
}

#[test]
fn a_run_without_a_step_has_no_residual_but_a_valid_summary() {
    let parent = temporary();
    let out = parent.path().join("out");
    let mut never_started = Run::of("tension", &["stop.steps=1", "record.figures=[]"]);
    let plan = planned(&never_started.scene);
    never_started.outcome = run(plan, &mut |_, _| ControlFlow::Break(()));
    never_started.write_to(&out).expect("written");
    let text = fs::read_to_string(out.join("summary.json")).expect("readable");
    let summary = json(&text);
    assert_eq!((&summary["residual"], &summary["stop_reason"]), (&().into(), &"interrupted".into()));
}

/// Decodes the array of this name; the first eight bytes tell how many follow.
fn array<const SIZE: usize>(frame: Node<'_, '_>, name: &str) -> Vec<[u8; SIZE]> {
    let node = frame.descendants().find(|node| node.attribute("Name") == Some(name)).expect("there");
    let bytes = STANDARD.decode(node.text().expect("contents").trim()).expect("base64");
    let (length, values) = bytes.split_at(8);
    assert_eq!(u64::from_le_bytes(length.try_into().expect("eight")), values.len() as u64);
    values.chunks_exact(SIZE).map(|value| value.try_into().expect("whole")).collect()
}

#[test]
fn a_frame_holds_every_particle_and_every_bond_with_its_state() {
    let parent = temporary();
    let run = Run::of("notched-plate", &["stop.steps=30", "record.figures=[]"]);
    let engine = &run.outcome.engine;
    let (folder, files) = run.frame(parent.path());
    let text = fs::read_to_string(folder.path("steps/step_000030.vtu")).expect("readable");
    let document = Document::parse(&text).expect("well-formed");
    let piece = document.descendants().find(|node| node.has_tag_name("Piece")).expect("a piece");
    let count = |name: &str| piece.attribute(name).expect("there").parse::<usize>().expect("a number");
    let (points, cells) = (count("NumberOfPoints"), count("NumberOfCells"));
    assert_eq!(points, engine.roles().len());
    // Every pair is seen from both ends here.
    let pairs = engine.flock().neighbours.index.len() / 2;
    let lines = pairs;
    assert!(!engine.breaks().is_empty());
    let broken = array::<1>(piece, "broken").iter().filter(|state| **state == [1]).count();
    assert_eq!(broken, engine.breaks().len());
    assert_eq!(cells, points + lines);
    let integers = |name| array::<8>(piece, name).into_iter().map(i64::from_le_bytes).collect::<Vec<_>>();
    let floats = |name| array::<8>(piece, name).into_iter().map(f64::from_le_bytes).collect::<Vec<_>>();
    assert_eq!(integers("connectivity").len(), points + 2 * lines);
    assert!(integers("connectivity").iter().all(|&i| (0..points as i64).contains(&i)));
    assert_eq!(
        (integers("offsets").len(), integers("offsets")[cells - 1]),
        (cells, (points + 2 * lines) as i64)
    );
    assert_eq!(array::<1>(piece, "types").iter().filter(|kind| **kind == [3]).count(), lines);
    assert_eq!(integers("id")[points - 1], points as i64);
    let places = floats("Points");
    assert_eq!((places.len(), places[3 * points - 2]), (3 * points, engine.present().y[points - 1]));
    assert_eq!(floats("displacement").len(), 3 * points);
    assert_eq!(floats("pe1")[points / 2], engine.pe1(points / 2));
    let strain = engine.strain(points / 2).expect("inside the body");
    assert_eq!(floats("strain")[3 * (points / 2)..][..3], strain.components);
    assert_eq!(floats("stretch").len(), cells);
    let leaders = engine.roles().iter().filter(|&&role| role == Role::Leader).count();
    assert_eq!(array::<1>(piece, "role").iter().filter(|role| **role == [1]).count(), leaders);

    let list = fs::read_to_string(&files[0]).expect("readable");
    let document = Document::parse(&list).expect("well-formed");
    let entry = document.descendants().find(|node| node.has_tag_name("DataSet")).expect("a frame");
    assert_eq!(entry.attribute("timestep"), Some("30"));
    assert!(folder.path(entry.attribute("file").expect("a file")).is_file());
}

#[test]
fn a_frame_of_a_material_has_its_cells_filled_with_stress() {
    let parent = temporary();
    let run = Run::of("beam-loaded", &["lattice={kind=\"hexagonal\",spacing=1.0}"]);
    let (_folder, files) = run.frame(parent.path());
    let text = fs::read_to_string(&files[1]).expect("readable");
    let document = Document::parse(&text).expect("well-formed");
    let piece = document.descendants().find(|node| node.has_tag_name("Piece")).expect("a piece");
    let cells = run.outcome.engine.cells().expect("a material");
    assert_eq!(piece.attribute("NumberOfCells"), Some(cells.count().to_string().as_str()));
    let types: Vec<u8> = array::<1>(piece, "types").into_iter().flatten().collect();
    let expected = |corners: &[u32]| match corners.len() {
        3 => 5,
        4 => 9,
        _ => 7,
    };
    assert_eq!(types, cells.iter().map(expected).collect::<Vec<u8>>());
    let corners: Vec<i64> = array::<8>(piece, "connectivity").into_iter().map(i64::from_le_bytes).collect();
    assert_eq!(corners, cells.index.iter().map(|&i| i64::from(i)).collect::<Vec<_>>());
    let data = piece.descendants().find(|node| node.has_tag_name("CellData")).expect("cell data");
    let stress: Vec<f64> = array::<8>(data, "von_mises").into_iter().map(f64::from_le_bytes).collect();
    assert!(stress.len() == cells.count() && stress.iter().all(|stress| stress.is_finite()), "{stress:?}");
}

#[test]
fn a_frame_of_the_paper_s_rule_with_a_material_has_particles_bonds_and_cells() {
    let parent = temporary();
    let run = Run::of("grips", &["stop.steps=1", "rule={}"]);
    let (_folder, files) = run.frame(parent.path());
    let text = fs::read_to_string(&files[1]).expect("readable");
    let document = Document::parse(&text).expect("well-formed");
    let piece = document.descendants().find(|node| node.has_tag_name("Piece")).expect("a piece");
    let types: Vec<u8> = array::<1>(piece, "types").into_iter().flatten().collect();
    let engine = &run.outcome.engine;
    let count = |kind: u8| types.iter().filter(|one| **one == kind).count();
    assert_eq!(count(1), engine.roles().len());
    assert_eq!(count(3), engine.flock().neighbours.index.len() / 2);
    assert_eq!(count(9), engine.cells().expect("a material").count());
    assert_eq!(array::<8>(piece, "von_mises").len(), engine.roles().len());
}

fn groups<'a, 'input>(
    figure: &'a Document<'input>,
    class: &'a str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    figure.descendants().filter(move |node| node.attribute("class") == Some(class))
}

#[test]
fn a_configuration_shows_every_particle_in_the_colour_of_its_role() {
    let run = Run::of("tension", &["stop.steps=20", "record.figures=[20]", "title=\"a < b\""]);
    let svg = figures::configuration(&run.subject(), &run.records.snapshots[0]);
    let figure = Document::parse(&svg).expect("well-formed");
    for (role, count) in [("leader", 10), ("clamped", 10), ("follower", 80), ("frame", 44), ("ghost", 0)] {
        // Those that do not follow are told by their shape too, without their colour.
        let shape = if ["leader", "clamped"].contains(&role) { "path" } else { "circle" };
        let marks = |node: Node<'_, '_>| node.children().filter(|n| n.has_tag_name(shape)).count();
        assert_eq!(groups(&figure, role).map(marks).sum::<usize>(), count, "{role}");
    }
    let texts: Vec<&str> =
        figure.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
    for text in ["a < b", "step 20", "x [unit]", "y [unit]", "leader", "frame"] {
        assert!(texts.contains(&text), "{text} is not in {texts:?}");
    }
    assert!(!texts.contains(&"ghost"), "only roles that are present are in the legend");
    assert_eq!(groups(&figure, "broken").count(), 0);
    let torn = Run::of("notched-plate", &["stop.steps=20", "record.figures=[20]"]);
    let svg = figures::configuration(&torn.subject(), &torn.records.snapshots[0]);
    let figure = Document::parse(&svg).expect("well-formed");
    let cuts = groups(&figure, "broken").next().expect("cuts are drawn").attribute("d").expect("a path");
    assert!(cuts.matches('M').count() >= torn.records.snapshots[0].broken.len());
}

/// Horizontal extent of a path of absolute points.
fn extent(path: &str) -> [f64; 2] {
    let xs = path
        .split(['M', 'L', 'Z'])
        .filter(|point| !point.is_empty())
        .map(|point| point.split(' ').next().expect("x").parse::<f64>().expect("a number"));
    xs.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

fn band_paths(svg: &str) -> Vec<String> {
    let figure = Document::parse(svg).expect("well-formed");
    groups(&figure, "band").map(|node| node.attribute("d").expect("a path").to_owned()).collect()
}

#[test]
fn the_bands_of_a_linear_field_begin_where_it_reaches_their_levels() {
    for lattice in ["square", "centred-rectangular", "hexagonal", "oblique", "honeycomb"] {
        let run = Run::of(&format!("lattice-{lattice}"), &["stop.steps=1", "record.figures=[0]"]);
        let mut snapshot = run.records.snapshots[0].clone();
        snapshot.pe1 = snapshot.positions.x.iter().map(|x| x + 100.0).collect();
        let paths = band_paths(&figures::pe1(&run.subject(), &snapshot));
        let lefts: Vec<f64> = paths.iter().map(|path| extent(path)[0]).collect();
        assert!(paths.len() >= 7, "{lattice}: {}", paths.len());
        // Levels are evenly apart, and so are the left edges of the bands that start within the body.
        let apart = lefts[3] - lefts[2];
        assert!(apart > 10.0, "{lattice}: {lefts:?}");
        for pair in lefts[1..paths.len() - 1].windows(2) {
            assert!((pair[1] - pair[0] - apart).abs() < 0.03, "{lattice}: {lefts:?}");
        }
        // Each lies over all that is higher, to the body's edge.
        assert!(paths[..4].iter().all(|path| extent(path)[1] == extent(&paths[0])[1]), "{lattice}");
    }
}

#[test]
fn a_field_of_zeros_and_a_body_without_lattice_are_drawn() {
    let run = Run::of("drop", &["stop.steps=5", "record.figures=[0, 5]"]);
    let svg = figures::pe1(&run.subject(), &run.records.snapshots[1]);
    assert_eq!(svg.matches("<circle").count(), run.outcome.engine.roles().len());
    let run = Run::of("tension", &["stop.steps=1", "record.figures=[0]"]);
    let svg = figures::pe1(&run.subject(), &run.records.snapshots[0]);
    let bands = band_paths(&svg);
    assert_eq!(bands.len(), 1);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

#[test]
fn contours_leave_the_crack_out() {
    let run = Run::of("notched-plate", &["stop.steps=1", "record.figures=[0]"]);
    let mut whole = run.records.snapshots[0].clone();
    whole.broken.clear();
    let faces =
        |snapshot: &Snapshot| band_paths(&figures::pe1(&run.subject(), snapshot))[0].matches('Z').count();
    assert!(faces(&run.records.snapshots[0]) + 10 < faces(&whole));
}

#[test]
fn a_body_of_very_many_particles_makes_a_small_figure() {
    let overrides = [
        "body.shape={ kind = \"grid\", columns = 300, rows = 300 }",
        "stop.steps=1",
        "record.figures=[1]",
        "record.probes=[]",
    ];
    let run = Run::of("tension", &overrides);
    for svg in [
        figures::configuration(&run.subject(), &run.records.snapshots[0]),
        figures::pe1(&run.subject(), &run.records.snapshots[0]),
    ] {
        assert!(svg.len() < 200_000, "{} bytes", svg.len());
        assert!(svg.contains("particles drawn as squares"));
        Document::parse(&svg).expect("well-formed");
    }
}

#[test]
fn probes_are_drawn_as_one_line_each_in_the_panels_where_something_happens() {
    // Pulled along x alone, nothing happens along y; pulled obliquely, something does.
    for (pull, panels) in [("[0.6, 0.0]", 3), ("[0.6, 0.1]", 4)] {
        let pull = format!("roles[1].motion.per_step={pull}");
        let run = Run::of("tension", &["stop.steps=50", "record.figures=[]", &pull]);
        let svg = figures::probes(&run.subject(), &run.records.probes);
        let figure = Document::parse(&svg).expect("well-formed");
        assert_eq!(groups(&figure, "series").count(), 2 * panels);
        let labels = |id: &str| figure.descendants().filter(|node| node.text() == Some(id)).count();
        assert!(svg.contains("PE1 [unit²]") && svg.contains("PE2 [unit]"));
        // In the legend, an element and its text node each.
        assert_eq!((labels("67"), labels("115")), (2, 2));
    }
}

#[test]
fn the_png_is_the_svg_at_twice_its_size_with_its_text() {
    let parent = temporary();
    let run = Run::of("tension", &["stop.steps=1", "record.figures=[1]"]);
    let svg = figures::configuration(&run.subject(), &run.records.snapshots[0]);
    let folder = OutputFolder::create(&parent.path().join("out"), false).expect("created");
    let written = figures::write(&svg, &folder, "configuration_0001").expect("written");
    let [svg_path, png_path] = &written[..] else { panic!("{written:?}") };
    assert_eq!(fs::read_to_string(svg_path).expect("readable"), svg);
    let png = Pixmap::decode_png(&fs::read(png_path).expect("readable")).expect("a PNG");
    let figure = Document::parse(&svg).expect("well-formed");
    let size =
        |name: &str| figure.root_element().attribute(name).expect("there").parse::<f64>().expect("a number");
    let zoom = f64::from(figures::PNG_ZOOM);
    assert_eq!([png.width(), png.height()].map(f64::from), ["width", "height"].map(|name| zoom * size(name)));
    // The title's line holds ink: the font was found.
    let [begin, end] = [10.0, 26.0].map(|row| (zoom * row) as usize * png.width() as usize);
    let dark = png.pixels()[begin..end].iter().filter(|pixel| pixel.red() < 90).count();
    assert!(dark > 500, "{dark} dark pixels");
}
