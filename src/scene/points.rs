//! The particles of a body from a CSV file.

use super::rows::Rows;
use crate::flock::vectors::Vectors;

/// Particles in the order of their rows.
#[derive(Clone, Debug, PartialEq)]
pub struct PointTable {
    /// \[length\], shape \[count\]; finite, and no two the same.
    pub points: Vectors,
    /// The ids given, or the numbers of the rows from 1, shape \[count\]; no two the same.
    pub ids: Vec<u32>,
}

impl PointTable {
    /// Reads the text of a CSV file with the columns `x` and `y`, and `id` if the particles have names of their own;
    /// every coordinate is multiplied by `scale`.
    ///
    /// # Errors
    /// A sentence that names the line and what is wrong with it.
    pub fn parse(text: &str, scale: f64) -> Result<Self, String> {
        let rows = Rows::of(text)?;
        let id = rows.column("id");
        let (Some(x), Some(y), true) =
            (rows.column("x"), rows.column("y"), rows.header.len() == 2 + usize::from(id.is_some()))
        else {
            return Err(format!("line 1: the header is `{}`, not `x,y` or `id,x,y`", rows.header_line()));
        };
        let (mut points, mut ids, mut lines) = (Vectors::default(), Vec::new(), Vec::new());
        rows.each(|row| {
            points.push([row.number(x, scale)?, row.number(y, scale)?]);
            ids.push(id.map_or(Ok(ids.len() as u32 + 1), |id| row.id(id))?);
            lines.push(row.line);
            Ok(())
        })?;
        if points.is_empty() {
            return Err("there is no point below the header".into());
        }
        require_different(&points, &ids, &lines)?;
        Ok(Self { points, ids })
    }
}

/// Refuses two points in one place and two of one name; of several pairs it names the first in the file.
fn require_different(points: &Vectors, ids: &[u32], lines: &[u64]) -> Result<(), String> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_unstable_by_key(|&i| (ids[i], i));
    if let Some([a, b]) = first_pair(&order, |a, b| ids[a] == ids[b]) {
        return Err(format!("lines {} and {}: both have `id` = {}", lines[a], lines[b], ids[a]));
    }
    order.sort_unstable_by(|&a, &b| {
        let by_axis = |values: &[f64]| values[a].total_cmp(&values[b]);
        by_axis(&points.x).then_with(|| by_axis(&points.y)).then(a.cmp(&b))
    });
    match first_pair(&order, |a, b| points.get(a) == points.get(b)) {
        None => Ok(()),
        Some([a, b]) => {
            let [x, y] = points.get(a);
            Err(format!("lines {} and {}: both are at ({x}, {y})", lines[a], lines[b]))
        }
    }
}

/// Of those beside each other in an order that are the same, the two whose second comes first.
fn first_pair(order: &[usize], same: impl Fn(usize, usize) -> bool) -> Option<[usize; 2]> {
    let pairs = order.windows(2).filter(|pair| same(pair[0], pair[1]));
    pairs.map(|pair| [pair[0], pair[1]]).min_by_key(|pair| pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_the_ids_given_or_the_numbers_of_their_rows() {
        let plain = PointTable::parse("x,y\n1,2\n\n 3.5 ,-0\n", 2.0).expect("reads");
        assert_eq!(plain.points, [[2.0, 4.0], [7.0, 0.0]].into_iter().collect());
        assert!(plain.points.y[1].is_sign_positive(), "no two zeros");
        assert_eq!(plain.ids, [1, 2]);
        let named = PointTable::parse("id,y,x\n9,1,2\n4,0,0\n", 1.0).expect("reads");
        assert_eq!((named.points.get(0), named.ids), ([2.0, 1.0], vec![9, 4]));
    }

    #[test]
    fn a_bad_file_is_refused_by_its_line() {
        let error = |text| PointTable::parse(text, 1.0).expect_err("refused");
        assert_eq!(error("a,b\n1,2\n"), "line 1: the header is `a,b`, not `x,y` or `id,x,y`");
        assert_eq!(error("x,y,z\n1,2,3\n"), "line 1: the header is `x,y,z`, not `x,y` or `id,x,y`");
        assert_eq!(error("x,x\n1,2\n"), "line 1: the header is `x,x`, not `x,y` or `id,x,y`");
        assert_eq!(error("x,y\n1,2\n3,NaN\n"), "line 3: `y` = `NaN` is not a finite number");
        assert_eq!(error("x,y\n1,inf\n"), "line 2: `y` = `inf` is not a finite number");
        let scaled = PointTable::parse("x,y\n1,1e300\n", 1e10).unwrap_err();
        assert_eq!(scaled, "line 2: `y` = `1e300` is not a number that is finite also times the scale");
        assert_eq!(error("id,x,y\n0,1,1\n"), "line 2: `id` = `0` is not a whole number from 1 to 4294967295");
        assert_eq!(error("id,x,y\n1,1,1\n2,0,1\n1,2,2\n"), "lines 2 and 4: both have `id` = 1");
        assert_eq!(error("x,y\n5,5\n0,1\n-0,1\n5,5\n"), "lines 3 and 4: both are at (0, 1)");
        assert_eq!(error("x,y\n"), "there is no point below the header");
        assert_eq!(error("x,y\n\n1\n"), "line 3: 1 values below a header of 2");
    }
}
