//! Displacements of leaders from a CSV file.

use super::rows::Rows;
use crate::flock::body::Body;
use crate::flock::vectors::distance;

/// Rows of a displacement file, and how they name their particle.
#[derive(Clone, Debug, PartialEq)]
pub enum DisplacementTable {
    /// `x,y,ux,uy`: by reference position \[length\], in order of x.
    ByPlace(Vec<([f64; 2], Displaced)>),
    /// `id,ux,uy`: by id, counted from 1, in their order.
    ById(Vec<(usize, Displaced)>),
}

/// What a row says of its particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displaced {
    line: u64,
    /// \[length\]
    by: [f64; 2],
}

impl DisplacementTable {
    /// Reads the text of a CSV file with the header `x,y,ux,uy` or `id,ux,uy`; every displacement is
    /// multiplied by `scale`.
    ///
    /// # Errors
    /// A sentence that names the line and what is wrong with it.
    pub fn parse(text: &str, scale: f64) -> Result<Self, String> {
        let rows = Rows::of(text)?;
        let header: Vec<&str> = rows.header.iter().map(String::as_str).collect();
        let by_id = match header[..] {
            ["id", "ux", "uy"] => true,
            ["x", "y", "ux", "uy"] => false,
            _ => {
                let header = rows.header_line();
                return Err(format!("line 1: the header is `{header}`, not `x,y,ux,uy` or `id,ux,uy`"));
            }
        };
        let (mut places, mut ids) = (Vec::new(), Vec::new());
        rows.each(|row| {
            let displaced = |column: usize| -> Result<Displaced, String> {
                let by = [row.number(column, scale)?, row.number(column + 1, scale)?];
                Ok(Displaced { line: row.line, by })
            };
            if by_id {
                ids.push((row.id(0)? as usize, displaced(1)?));
            } else {
                places.push(([row.number(0, 1.0)?, row.number(1, 1.0)?], displaced(2)?));
            }
            Ok(())
        })?;
        // Rows of one particle stay in the order of the file.
        ids.sort_by_key(|row| row.0);
        places.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        Ok(if by_id { Self::ById(ids) } else { Self::ByPlace(places) })
    }

    /// Whether a row goes along this axis, 0 or 1.
    pub fn go_along(&self, axis: usize) -> bool {
        let goes = |row: &Displaced| row.by[axis] != 0.0;
        match self {
            Self::ByPlace(rows) => rows.iter().any(|(_, row)| goes(row)),
            Self::ById(rows) => rows.iter().any(|(_, row)| goes(row)),
        }
    }

    /// Displacement of each of `particles` (indices), in their order.
    ///
    /// # Errors
    /// A sentence that names the first particle without a row, or with two that differ.
    pub fn of(&self, particles: &[usize], body: &Body) -> Result<Vec<[f64; 2]>, String> {
        let near = 1e-6 * body.lattice.spacing();
        particles
            .iter()
            .map(|&i| {
                let (place, id) = (body.reference.get(i), body.id(i));
                let is_at = |at: [f64; 2]| distance(at, place) <= near;
                let rows: Vec<Displaced> = match self {
                    Self::ById(rows) => {
                        let from = rows.partition_point(|row| row.0 < id);
                        rows[from..].iter().take_while(|row| row.0 == id).map(|row| row.1).collect()
                    }
                    Self::ByPlace(rows) => {
                        let from = rows.partition_point(|row| row.0[0] < place[0] - near);
                        let beside = rows[from..].iter().take_while(|row| row.0[0] <= place[0] + near);
                        let mut found: Vec<Displaced> =
                            beside.filter(|row| is_at(row.0)).map(|row| row.1).collect();
                        found.sort_by_key(|row| row.line);
                        found
                    }
                };
                let particle = || format!("particle {id} at ({}, {})", place[0], place[1]);
                let first = rows.first().ok_or_else(|| format!("no row for {}", particle()))?;
                match rows.iter().find(|row| row.by != first.by) {
                    Some(other) => {
                        let [line, other] = [first.line, other.line];
                        Err(format!("lines {line} and {other}: both are of {}, and differ", particle()))
                    }
                    None => Ok(first.by),
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_matched_by_place_or_by_id() {
        let body = Body::of_places([[10.0, 10.0], [11.0, 10.0]].into_iter().collect(), 1.0);
        let by_place = DisplacementTable::parse("x,y,ux,uy\n11,10,0.5,-1\n10,10,0,0\n", 2.0).expect("reads");
        assert_eq!(by_place.of(&[0, 1], &body), Ok(vec![[0.0, 0.0], [1.0, -2.0]]));
        let by_id = DisplacementTable::parse("id,ux,uy\n2,3,4\n", 1.0).expect("reads");
        assert_eq!(by_id.of(&[1], &body), Ok(vec![[3.0, 4.0]]));
        assert_eq!(by_id.of(&[0], &body), Err("no row for particle 1 at (10, 10)".into()));
    }

    #[test]
    fn two_rows_of_a_particle_that_differ_are_refused() {
        let body = Body::of_places([[10.0, 10.0], [11.0, 10.0]].into_iter().collect(), 1.0);
        let of = |text: &str| DisplacementTable::parse(text, 1.0).expect("reads").of(&[0], &body);
        let differ = Err("lines 2 and 4: both are of particle 1 at (10, 10), and differ".into());
        assert_eq!(of("id,ux,uy\n1,3,4\n2,0,0\n1,3,5\n"), differ);
        assert_eq!(of("x,y,ux,uy\n10,10,3,4\n11,10,0,0\n10,10,0,0\n"), differ);
        assert_eq!(of("id,ux,uy\n1,3,4\n1,3,4\n"), Ok(vec![[3.0, 4.0]]));
    }

    #[test]
    fn a_bad_row_is_named() {
        let error = |text| DisplacementTable::parse(text, 1.0).expect_err("refused");
        assert_eq!(error("x,y,ux,uy\n1,2,nan,0\n"), "line 2: `ux` = `nan` is not a finite number");
        assert_eq!(error("a,b\n"), "line 1: the header is `a,b`, not `x,y,ux,uy` or `id,ux,uy`");
        assert_eq!(
            error("id,ux,uy\n0,1,1\n"),
            "line 2: `id` = `0` is not a whole number from 1 to 4294967295"
        );
    }
}
