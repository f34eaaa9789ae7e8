//! Films: what a frame shows is what the run's own table says, and nothing half-made is left.

use std::fs::File;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::command::{assert_refused, command, done, failed, refused_in, text};
use crate::folders::{names_in, temporary};

const STEPS: usize = 26;
/// Of the leaders at the end \[length\].
const PULLED: f64 = 1.3;
const SPACING: f64 = 1.0;

/// A sheet that is pulled to the right, evenly, and not let go.
const SHEET: &str = r#"
title = "A sheet"

[lattice]
kind = "square"
spacing = 1.0

[body]
shape = { kind = "grid", columns = 8, rows = 5 }

[rule]
mean = { kind = "barycentre" }

[neighbours]
kind = "first"

[[roles]]
region = { kind = "edge", side = "left" }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right" }
role = "leader"
motion = { kind = "velocity", per_step = [0.05, 0.0] }

[stop]
steps = 26
"#;

type Colour = [u8; 3];

/// A frame as it is seen.
#[derive(Clone)]
struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
}

impl Picture {
    fn at(&self, [x, y]: [f64; 2]) -> Colour {
        self.pixels[y as usize * self.width + x as usize]
    }

    /// Darker than a bond: a line of the frame may be shared by two pixels.
    fn is_ink(&self, x: usize, y: usize) -> bool {
        self.pixels[y * self.width + x].iter().all(|&channel| channel < 0xa8)
    }

    /// Left, top, right and bottom of the frame around the plot: the long dark lines. Beside it is that of the bar.
    fn plot(&self) -> [f64; 4] {
        let is_row = |y: &usize| 2 * (0..self.width).filter(|&x| self.is_ink(x, *y)).count() > self.width;
        let is_column =
            |x: &usize| 2 * (0..self.height).filter(|&y| self.is_ink(*x, y)).count() > self.height;
        let rows = lines((0..self.height).filter(is_row));
        let columns = lines((0..self.width).filter(is_column));
        assert!(rows.len() == 2 && columns.len() >= 2, "{rows:?} {columns:?}");
        [columns[0], rows[0], columns[1], rows[1]]
    }
}

/// Middles of runs of pixels.
fn lines(pixels: impl Iterator<Item = usize>) -> Vec<f64> {
    let pixels: Vec<usize> = pixels.collect();
    let runs = pixels.chunk_by(|a, b| a + 1 == *b);
    runs.map(|run| 0.5 * (run[0] + run[run.len() - 1] + 1) as f64).collect()
}

/// The frames of a GIF, and the time of each \[s/100\].
fn decoded(path: &Path) -> Vec<(Picture, u16)> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(File::open(path).expect("a film")).expect("a GIF");
    let (width, height) = (usize::from(decoder.width()), usize::from(decoder.height()));
    let mut seen = Picture { width, height, pixels: vec![[0; 3]; width * height] };
    let mut frames = Vec::new();
    while let Some(frame) = decoder.read_next_frame().expect("a whole GIF") {
        let [left, top, across] = [frame.left, frame.top, frame.width].map(usize::from);
        for (n, pixel) in frame.buffer.chunks(4).enumerate().filter(|(_, pixel)| pixel[3] > 0) {
            seen.pixels[(top + n / across) * width + left + n % across] = [pixel[0], pixel[1], pixel[2]];
        }
        frames.push((seen.clone(), frame.delay));
    }
    frames
}

/// A row of final.csv.
struct Particle {
    role: String,
    then: [f64; 2],
    now: [f64; 2],
}

impl Particle {
    fn displacement(&self) -> f64 {
        f64::hypot(self.now[0] - self.then[0], self.now[1] - self.then[1])
    }
}

fn particles(path: &Path) -> Vec<Particle> {
    let mut table = csv::Reader::from_path(path).expect("a table");
    let number = |row: &csv::StringRecord, n: usize| -> f64 { row[n].parse().expect("a number") };
    let rows = table.records().map(|row| row.expect("a row"));
    rows.map(|row| Particle {
        role: row[3].to_owned(),
        then: [number(&row, 4), number(&row, 5)],
        now: [number(&row, 6), number(&row, 7)],
    })
    .collect()
}

/// The command that films the sheet, which is written to a folder.
fn sheet<'a>(folder: &Path, more: &[&'a str]) -> Vec<&'a str> {
    std::fs::write(folder.join("sheet.toml"), SHEET).expect("writable");
    [&["run", "sheet.toml", "--out", "o", "--figures", "none"], more].concat()
}

fn filmed(folder: &Path, more: &[&str]) -> String {
    done(&sheet(folder, more), folder)
}

#[test]
fn each_frame_shows_the_particles_in_their_places_and_in_the_colours_of_their_displacements() {
    let folder = temporary();
    let said = filmed(folder.path(), &["--film", "sheet.gif"]);
    assert!(said.contains(&format!("film of {} frames", STEPS + 1)) && said.contains("GIF"), "{said}");
    let frames = decoded(&folder.path().join("sheet.gif"));
    assert_eq!(frames.len(), STEPS + 1);
    assert!(frames.iter().all(|(picture, _)| picture.width % 2 == 0 && picture.height % 2 == 0));
    let particles = particles(&folder.path().join("o/final.csv"));
    let (first, last) = (&frames[0].0, &frames[STEPS].0);
    assert_eq!(first.plot(), last.plot(), "nothing moves but the body");
    let [left, top, right, bottom] = last.plot();
    // The window is around the body at rest and pulled, with a margin.
    let all = || particles.iter().flat_map(|one| [one.then, one.now]);
    let low = [0, 1].map(|k| all().map(|place| place[k]).fold(f64::INFINITY, f64::min));
    let high = [0, 1].map(|k| all().map(|place| place[k]).fold(f64::NEG_INFINITY, f64::max));
    let margin = f64::max(0.6 * SPACING, 0.02 * (high[0] - low[0]));
    let scale = (right - left) / (high[0] - low[0] + 2.0 * margin);
    let on_sheet =
        |[x, y]: [f64; 2]| [left + scale * (x - low[0] + margin), bottom - scale * (y - low[1] + margin)];
    // The bar beside the plot has bands of 0.1 from nothing to the leaders' displacement.
    let of_bar = |value: f64| last.at([right + 26.0, bottom - (bottom - top) * (value / PULLED).min(0.98)]);
    assert_eq!([of_bar(0.05), of_bar(PULLED)], [[0x44, 0x01, 0x54], [0xfd, 0xe7, 0x25]]);
    let mut checked = 0;
    for particle in particles.iter().filter(|one| one.role != "frame") {
        let value = particle.displacement();
        assert_eq!(first.at(on_sheet(particle.then)), of_bar(0.05), "at rest {:?}", particle.then);
        let from_edge = (value / 0.1 - (value / 0.1).round()).abs();
        if from_edge > 0.02 || particle.role != "follower" {
            let middle = if particle.role == "clamped" { 0.05 } else { value.min(PULLED - 0.05) };
            let wanted = of_bar(0.1 * (middle / 0.1).floor() + 0.05);
            assert_eq!(last.at(on_sheet(particle.now)), wanted, "{:?}, moved {value}", particle.now);
            checked += 1;
        }
    }
    assert!(checked > 30, "{checked}");
}

#[test]
fn a_film_of_a_flight_ends_with_the_robots_in_their_last_places() {
    let folder = temporary();
    let arguments = ["swarm", "square", "--set", "flight.duration=3.0", "--out", "o", "--film", "square.gif"];
    // So short a flight breaks a bound.
    let said = failed(&arguments, folder.path());
    assert!(said.contains("film of"), "{said}");
    let frames = decoded(&folder.path().join("square.gif"));
    let count =
        |picture: &Picture, colour: Colour| picture.pixels.iter().filter(|&&one| one == colour).count();
    // Followers are blue, in the legend and on the map; their places at the end are another frame than the first.
    let blue = [0x20, 0x60, 0xc0];
    let (first, last) = (&frames[0].0, &frames[frames.len() - 1].0);
    assert!(count(first, blue) > 100 && count(last, blue) > 100);
    assert_ne!(first.pixels, last.pixels);
    assert!(frames.len() > 20, "{}", frames.len());
}

#[test]
fn what_cannot_become_a_film_is_refused_before_the_run() {
    let folder = temporary();
    std::fs::write(folder.path().join("notes.gif"), "not a film").expect("writable");
    let refusals: [(&[&str], &str); 12] = [
        (&["--film", "sheet.avi"], ".gif, .mp4 or .webm"),
        (&["--film", "sheet"], ".gif, .mp4 or .webm"),
        (&["--film", "notes.gif"], "--force"),
        (&["--film", "notes.gif", "--force"], "is no film"),
        (&["--film", "nowhere/sheet.gif"], "no folder"),
        (&["--film", "o/sheet.gif"], "results alone"),
        (&["--film", "nowhere/../o/sheet.gif"], "results alone"),
        (&["--record", "o/sheet.mcap"], "results alone"),
        (&["--record", "o"], "results alone"),
        (&["--film", "sheet.gif", "--film-colour", "von-mises"], "no material"),
        (
            &["--film", "sheet.gif", "--film-colour", "clearance"],
            "possible values: role, displacement, pe1, pe2, strain, von-mises",
        ),
        (&["--film-colour", "pe1"], "--film"),
    ];
    for (more, word) in refusals {
        refused_in(&sheet(folder.path(), more), folder.path(), &[word]);
        assert_eq!(names_in(folder.path()), ["notes.gif", "sheet.toml"], "{more:?}");
    }
    let colours = "possible values: role, displacement, clearance, away, speed, acceleration, pe1, strain";
    let film = ["swarm", "square", "--film", "a.gif", "--film-colour", "pe2"];
    refused_in(&film, folder.path(), &[colours]);
}

#[test]
fn a_film_of_a_tall_body_is_no_higher_than_a_screen() {
    let folder = temporary();
    let shape = "body.shape={ kind = \"grid\", columns = 4, rows = 60 }";
    filmed(folder.path(), &["--film", "sheet.gif", "--set", shape, "--steps", "2", "--no-report"]);
    let film = decoded(&folder.path().join("sheet.gif"));
    let (width, height) = (film[0].0.width, film[0].0.height);
    assert!(height < 720 && width > 400, "{width} x {height}");
}

#[test]
fn a_video_without_ffmpeg_is_refused_before_the_run() {
    let folder = temporary();
    for film in ["tension.mp4", "tension.webm"] {
        let mut command = command(&["run", "tension", "--out", "o", "--film", film], folder.path());
        let output = command.env("PATH", folder.path()).output().expect("the program starts");
        assert_refused(&output, film, &["install ffmpeg", ".gif"]);
        assert_eq!(names_in(folder.path()), [""; 0]);
    }
}

#[test]
fn force_replaces_a_film_and_the_report_may_be_left_out() {
    let folder = temporary();
    let said = filmed(folder.path(), &["--film", "sheet.gif", "--no-report", "--quiet"]);
    assert!(said.is_empty(), "{said}");
    assert!(!folder.path().join("o/report.html").exists());
    let film = std::fs::read(folder.path().join("sheet.gif")).expect("a film");
    filmed(folder.path(), &["--film", "sheet.gif", "--film-colour", "pe1", "--force"]);
    assert_ne!(film, std::fs::read(folder.path().join("sheet.gif")).expect("a film"));
    assert_eq!(names_in(folder.path()), ["o", "sheet.gif", "sheet.toml"]);
}

#[test]
fn an_interrupt_leaves_no_half_film_and_whole_results() {
    let folder = temporary();
    let arguments = ["run", "tension", "--figures", "none", "--out", "o", "--film", "t.gif"];
    let mut child = command(&arguments, folder.path());
    let mut child = child.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let begun = Instant::now();
    // The results get their name before the first frame is drawn.
    while !folder.path().join("o").exists() {
        assert!(begun.elapsed() < Duration::from_secs(120), "it never wrote its results");
        assert!(child.try_wait().expect("a child").is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(2));
    }
    crate::signals::signal("INT", child.id());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("there is no film"), "{}", text(&output.stderr));
    assert_eq!(names_in(folder.path()), ["o"]);
    assert!(folder.path().join("o/summary.json").exists());
}

/// A run filmed by a script in the place of ffmpeg, which lists one encoder and then does this with the frames.
#[cfg(unix)]
fn filmed_by(script: &str, folder: &Path) -> std::process::Output {
    use std::os::unix::fs::PermissionsExt;
    let programs = folder.join("programs");
    std::fs::create_dir(&programs).expect("writable");
    let listed =
        "case \"$*\" in *-encoders*) echo ' V..... libx264 H.264'; exit;; esac; for film; do :; done";
    let ffmpeg = programs.join("ffmpeg");
    std::fs::write(&ffmpeg, format!("#!/bin/sh\n{listed}\n{script}\n")).expect("writable");
    std::fs::set_permissions(&ffmpeg, std::fs::Permissions::from_mode(0o755)).expect("ours");
    let path = format!("{}:/usr/bin:/bin", programs.display());
    command(&sheet(folder, &["--film", "sheet.mp4"]), folder)
        .env("PATH", path)
        .output()
        .expect("the program starts")
}

#[cfg(unix)]
#[test]
fn a_video_is_all_frames_of_one_size_through_the_encoder_that_is_there() {
    let folder = temporary();
    let output = filmed_by("echo \"$*\" > said; cat > \"$film\"", folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("(libx264, by ffmpeg)"), "{}", text(&output.stdout));
    let said = std::fs::read_to_string(folder.path().join("said")).expect("arguments");
    let after =
        |option: &str| said.split(option).nth(1).expect("given").split_whitespace().next().expect("a value");
    let size: Vec<u64> =
        after("-video_size").split('x').map(|side| side.parse().expect("a number")).collect();
    assert!(size.iter().all(|side| side % 2 == 0 && *side > 400), "{size:?}");
    let time: f64 = after("-framerate").strip_prefix("100/").expect("a time").parse().expect("a number");
    // The last frame stands for a second and a half more.
    let frames = STEPS as u64 + (1.0 + 150.0 / time).ceil() as u64;
    let film = std::fs::metadata(folder.path().join("sheet.mp4")).expect("a film");
    assert_eq!(film.len(), size[0] * size[1] * 4 * frames);
    assert_eq!(names_in(folder.path()), ["o", "programs", "said", "sheet.mp4", "sheet.toml"]);
}

#[cfg(unix)]
#[test]
fn an_encoder_that_fails_leaves_the_results_and_no_film() {
    for script in
        ["echo 'no room for it' >&2; exit 3", "head -c 100000 > \"$film\"; echo 'no room for it' >&2; exit 3"]
    {
        let folder = temporary();
        let output = filmed_by(script, folder.path());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("ffmpeg made no film") && said.contains("no room for it"), "{said}");
        assert_eq!(names_in(folder.path()), ["o", "programs", "sheet.toml"]);
        assert!(folder.path().join("o/summary.json").exists());
    }
}

#[test]
#[ignore = "takes ffmpeg with an H.264 and a VP9 encoder"]
fn ffmpeg_makes_videos_that_show_the_frames() {
    let folder = temporary();
    for film in ["sheet.mp4", "sheet.webm"] {
        let said = filmed(folder.path(), &["--film", film, "--force"]);
        assert!(said.contains("by ffmpeg"), "{said}");
        let probe = std::process::Command::new("ffprobe")
            .args(["-v", "error", "-count_frames", "-show_entries"])
            .args(["stream=width,height,color_range,color_space,nb_read_frames", "-of", "csv=p=0", film])
            .current_dir(folder.path())
            .output()
            .expect("ffprobe is there");
        // What does not say how its colours are encoded is shown in others by some players.
        let found = text(&probe.stdout).replace(",tv,bt709", "");
        assert!(found.len() < probe.stdout.len(), "{found}");
        let numbers: Vec<usize> = found.trim().split(',').map(|n| n.parse().expect("a number")).collect();
        assert!(
            numbers[2] > STEPS && numbers[0].is_multiple_of(2) && numbers[1].is_multiple_of(2),
            "{found}"
        );
        // What a GIF shows is held against the run's own table above; a video is larger by not quite twice.
        filmed(folder.path(), &["--film", "sheet.gif", "--force"]);
        let shown = decoded_coarsely(&folder.path().join("sheet.gif"));
        let frames = decoded_coarsely(&folder.path().join(film));
        assert!(shown.len() == STEPS + 1 && frames.len() >= shown.len(), "{} {}", shown.len(), frames.len());
        for (n, frame) in frames.iter().enumerate() {
            let errors: Vec<f64> = shown.iter().map(|still| mean_square(still, frame)).collect();
            let nearest = (0..=STEPS).min_by(|&a, &b| errors[a].total_cmp(&errors[b])).expect("frames");
            let own = n.min(STEPS);
            assert!(nearest.abs_diff(own) <= 1 && errors[own] < 64.0, "frame {n} of {film}: {errors:?}");
        }
    }
}

/// The frames of a film as ffmpeg decodes them, at the same small size, three bytes a pixel.
fn decoded_coarsely(film: &Path) -> Vec<Vec<u8>> {
    let output = std::process::Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(film)
        .args(["-vf", "scale=120:72:flags=area", "-fps_mode", "passthrough"])
        .args(["-pix_fmt", "rgb24", "-f", "rawvideo", "-"])
        .output()
        .expect("ffmpeg is there");
    assert!(output.status.success(), "{}", text(&output.stderr));
    output.stdout.chunks_exact(3 * 120 * 72).map(<[u8]>::to_vec).collect()
}

/// Mean square of the differences of the channels.
fn mean_square(one: &[u8], other: &[u8]) -> f64 {
    let square = |(&a, &b): (&u8, &u8)| (f64::from(a) - f64::from(b)).powi(2);
    one.iter().zip(other).map(square).sum::<f64>() / one.len() as f64
}
