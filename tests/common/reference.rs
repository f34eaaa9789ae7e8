//! The paper's beam in the reference data of `tests/reference`.

#![allow(dead_code, reason = "each test program uses the part that it needs")]

use flockform::flock::vectors::Vectors;

/// Rows of the reference file of a beam of this aspect ratio: x, y, ux, uy.
pub fn beam_rows(aspect: u32) -> Vec<[f64; 4]> {
    let text = match aspect {
        1 => include_str!("../reference/beam_aspect1.csv"),
        5 => include_str!("../reference/beam_aspect5.csv"),
        10 => include_str!("../reference/beam_aspect10.csv"),
        other => panic!("there is no reference of aspect {other}"),
    };
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let rows: Vec<[f64; 4]> = table.deserialize().map(|row| row.expect("four numbers")).collect();
    assert_eq!(rows.len(), 12 * (11 * aspect as usize + 1), "aspect {aspect}");
    rows
}

/// Displacements of the reference at points of its lattice.
pub fn beam_displacements(aspect: u32, points: &Vectors) -> Vectors {
    let rows = beam_rows(aspect);
    let at = |p: [f64; 2]| rows.iter().find(|r| (r[0] - p[0]).hypot(r[1] - p[1]) < 1e-9).expect("listed");
    points.iter().map(|p| [at(p)[2], at(p)[3]]).collect()
}
