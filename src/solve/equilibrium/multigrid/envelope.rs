//! The coarsest grid is solved outright: Cholesky's factorisation within the envelope, in double precision.

use crate::flock::lattice::Site;
use crate::solve::operator::Matrix;

/// Pivots below this share of their diagonal are rounding: what they stand for moves nothing that the
/// others do not move already, and stays put.
const NOTHING: f64 = 1e-11;
/// The same below particles along an outline, where nodes at the edge share few of them and hardly differ; those that
/// rounding has made negative are nothing too.
const NOTHING_AT_OUTLINE: f64 = 1e-9;

/// `L` of `K = L L'` by rows, each from its first entry that is not zero to the diagonal.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// Node at each place of the order of elimination.
    order: Vec<u32>,
    /// First column of each row, shape \[unknowns\].
    first: Vec<u32>,
    /// Where each row begins in `values`, shape \[unknowns + 1\].
    starts: Vec<usize>,
    values: Vec<f64>,
    /// The unknowns at work, shape \[unknowns\].
    x: Vec<f64>,
}

/// An order of elimination and the envelope that it leads to.
struct Plan {
    nodes: Vec<(Site, u32)>,
    /// Place of each node in the order, shape \[count\].
    place: Vec<u32>,
    first: Vec<u32>,
    starts: Vec<usize>,
}

impl Plan {
    /// Column by column or row by row: whichever is shorter makes the narrower envelope.
    fn new(matrix: &Matrix) -> Self {
        let mut nodes: Vec<(Site, u32)> = sites(matrix);
        let [across, along] = matrix.columns.extent();
        if matrix.outliers.is_empty() {
            if across < along {
                nodes.sort_unstable_by_key(|&([column, row], _)| [row, column]);
            }
        } else {
            // Particles along an outline belong among those beside them.
            let place = |&(site, _): &(Site, u32)| {
                let [i, j] = matrix.outliers.place(site);
                if across < along { [j, i] } else { [i, j] }
            };
            nodes.sort_by(|a, b| {
                let (p, q) = (place(a), place(b));
                p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1]))
            });
        }
        let mut place = vec![0; matrix.count()];
        nodes.iter().enumerate().for_each(|(at, &(_, node))| place[node as usize] = at as u32);
        let (mut first, mut starts) = (Vec::new(), vec![0]);
        for (at, &(site, node)) in nodes.iter().enumerate() {
            let entries = matrix.rows.of(matrix.class[node as usize]).entries.iter();
            let places = entries.map(|&(offset, _)| place[index(matrix, site, offset)]);
            let before = 2 * places.fold(at as u32, u32::min);
            for row in 2 * at..2 * at + 2 {
                first.push(before);
                starts.push(starts[row] + row + 1 - before as usize);
            }
        }
        Self { nodes, place, first, starts }
    }
}

fn sites(matrix: &Matrix) -> Vec<(Site, u32)> {
    let followers = matrix.columns.sites();
    let of = |site: Site| matrix.columns.find(site).map(|(node, _)| (site, node as u32));
    followers.filter_map(of).collect()
}

fn index(matrix: &Matrix, site: Site, offset: Site) -> usize {
    let there = [site[0] + offset[0], site[1] + offset[1]];
    matrix.columns.find(there).expect("rows lead to followers").0
}

impl Envelope {
    /// Factorises a matrix, its rows multiplied by `scale`; `None` if it is not positive. `has_outline` says whether the
    /// finest level has particles at no site.
    pub fn new(matrix: &Matrix, scale: f64, has_outline: bool) -> Option<Self> {
        let plan = Plan::new(matrix);
        let unknowns = plan.first.len();
        let mut factor = Self {
            values: vec![0.0; plan.starts[unknowns]],
            order: plan.nodes.iter().map(|&(_, node)| node).collect(),
            first: plan.first,
            starts: plan.starts,
            x: vec![0.0; unknowns],
        };
        for (here, &(site, node)) in plan.nodes.iter().enumerate() {
            let row = matrix.rows.of(matrix.class[node as usize]);
            let others = row.entries.iter().map(|(offset, block)| {
                let there = plan.place[index(matrix, site, *offset)] as usize;
                (there, block.map(|row| row.map(|v| -v)))
            });
            for (there, block) in others.chain([(here, *row.diagonal)]) {
                for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    if 2 * there + b <= 2 * here + a {
                        *factor.entry(2 * here + a, 2 * there + b) = block[a][b] * scale;
                    }
                }
            }
        }
        factor.eliminate(if has_outline { NOTHING_AT_OUTLINE } else { NOTHING }).then_some(factor)
    }

    fn entry(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.values[self.starts[row] + column - self.first[row] as usize]
    }

    /// The columns `from..to` of a row.
    fn stretch(&self, row: usize, from: usize, to: usize) -> &[f64] {
        let begin = self.starts[row] - self.first[row] as usize;
        &self.values[begin + from..begin + to]
    }

    fn eliminate(&mut self, nothing: f64) -> bool {
        for i in 0..self.first.len() {
            let first = self.first[i] as usize;
            for j in first..=i {
                let from = first.max(self.first[j] as usize);
                let sum = product(self.stretch(i, from, j), self.stretch(j, from, j));
                let pivot = if j < i { *self.entry(j, j) } else { 1.0 };
                let entry = self.entry(i, j);
                let rest = *entry - sum;
                if j < i {
                    *entry = rest / pivot;
                } else if rest > nothing * *entry {
                    *entry = rest.sqrt();
                } else if rest >= -10.0 * nothing * entry.abs() {
                    // Divided by infinity, the unknown and its part in all others vanish.
                    *entry = f64::INFINITY;
                } else {
                    return false;
                }
            }
        }
        true
    }

    /// Solves for single-precision forces; both are numbered like the nodes.
    pub fn solve(&mut self, f: (&[f32], &[f32]), u: (&mut [f32], &mut [f32])) {
        let mut x = std::mem::take(&mut self.x);
        for (place, &node) in self.order.iter().enumerate() {
            x[2 * place] = f64::from(f.0[node as usize]);
            x[2 * place + 1] = f64::from(f.1[node as usize]);
        }
        for i in 0..x.len() {
            let first = self.first[i] as usize;
            let sum = product(self.stretch(i, first, i), &x[first..i]);
            x[i] = (x[i] - sum) / self.stretch(i, i, i + 1)[0];
        }
        for i in (0..x.len()).rev() {
            let first = self.first[i] as usize;
            let value = x[i] / self.stretch(i, i, i + 1)[0];
            x[i] = value;
            x[first..i].iter_mut().zip(self.stretch(i, first, i)).for_each(|(x, l)| *x -= l * value);
        }
        for (place, &node) in self.order.iter().enumerate() {
            u.0[node as usize] = x[2 * place] as f32;
            u.1[node as usize] = x[2 * place + 1] as f32;
        }
        self.x = x;
    }
}

/// `sum a b`, in lanes that a processor can add side by side.
fn product(a: &[f64], b: &[f64]) -> f64 {
    let (whole_a, rest_a) = a.as_chunks::<8>();
    let (whole_b, rest_b) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in whole_a.iter().zip(whole_b) {
        (0..8).for_each(|k| sums[k] += a[k] * b[k]);
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}
