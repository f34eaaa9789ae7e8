//! Small parts join their neighbours, particles that nothing needs any more go, short sides shrink to one particle.

use std::collections::HashMap;

use super::faces::{Face, Faces};
use super::{LEAST_AREA, LEAST_SIDE, LEAST_WIDTH, ROUNDING, Scale};
use crate::flock::vectors::distance;
use crate::geometry::lists::{distinct, sides};
use crate::geometry::point;

/// One makes work for the other: after a few rounds nothing is left to do.
const ROUNDS: usize = 4;

/// A side that shrinks may change the area of what is around it by this part: its chord cuts an arc shorter.
const AREA_CHANGE: f64 = 0.02;

/// A size in steps of another that are larger than rounding, which is not to decide what becomes of equal cells.
fn steps(size: f64, of: f64) -> i64 {
    (size / of / ROUNDING).round() as i64
}

pub fn tidy(faces: &mut Faces, scale: &Scale) {
    for _ in 0..ROUNDS {
        let merged = merge(faces, scale);
        drop_idle(faces);
        let shrunk = shrink(faces, LEAST_SIDE * scale.altitude);
        if merged + shrunk == 0 {
            break;
        }
    }
    faces.note_whole();
}

fn area(faces: &Faces, corners: &[u32]) -> f64 {
    point::area(corners.iter().map(|&k| &faces.nodes[k as usize].point))
}

/// Least extent of a face across one of its sides \[length\].
fn width(faces: &Faces, corners: &[u32]) -> f64 {
    let at = |k: usize| faces.nodes[corners[k % corners.len()] as usize].point;
    let across = |k: usize| {
        let off = (0..corners.len()).map(|l| off_line([at(k), at(k + 1)], at(l)));
        let (low, high) = off.fold((0.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    (0..corners.len()).map(across).fold(f64::INFINITY, f64::min)
}

/// Distance of a point to the left of the line from `a` to `b` \[length\].
fn off_line([a, b]: [[f64; 2]; 2], p: [f64; 2]) -> f64 {
    ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / distance(a, b)
}

/// Whether a face is a quadrilateral with a dent: its corner there has little mass and much to hold it, up to 25 times the
/// highest frequency squared of whole cells.
fn is_dart(faces: &Faces, corners: &[u32]) -> bool {
    let at = |k: usize| faces.nodes[corners[k % 4] as usize].point;
    let is_dent = |k: usize| {
        let line = [at(k), at(k + 2)];
        off_line(line, at(k + 1)) > ROUNDING * distance(line[0], line[1])
    };
    corners.len() == 4 && (0..4).any(is_dent)
}

/// Length of a side \[length\].
fn length(faces: &Faces, [a, b]: [u32; 2]) -> f64 {
    distance(faces.nodes[a as usize].point, faces.nodes[b as usize].point)
}

/// How compact a face is: its area over the square of its circumference \[1\].
fn compactness(faces: &Faces, corners: &[u32]) -> f64 {
    area(faces, corners) / sides(corners).map(|side| length(faces, side)).sum::<f64>().powi(2)
}

/// Joins each face that is too small, too narrow or dented with the neighbour of its region that makes the most compact face with it. By
/// the longest common line rows of small parts would join each other to long strips, whose particles move against each
/// other at next to no cost.
fn merge(faces: &mut Faces, scale: &Scale) -> usize {
    let (least, narrow) = (LEAST_AREA * scale.area, LEAST_WIDTH * scale.altitude);
    let mut owner = faces.owners();
    let is_fine = |faces: &Faces, corners: &[u32]| {
        area(faces, corners) >= least * (1.0 - ROUNDING)
            && width(faces, corners) >= narrow * (1.0 - ROUNDING)
            && !is_dart(faces, corners)
    };
    let mut small: Vec<(i64, usize)> = (0..faces.faces.len())
        .filter(|&face| {
            let corners = &faces.faces[face].corners;
            !corners.is_empty() && !is_fine(faces, corners)
        })
        .map(|face| (steps(area(faces, &faces.faces[face].corners), scale.area), face))
        .collect();
    small.sort_unstable();
    let mut merged = 0;
    for (_, face) in small {
        let Face { corners, region, .. } = &faces.faces[face];
        if corners.is_empty() || is_fine(faces, corners) {
            continue;
        }
        let beside = sides(corners).filter_map(|[a, b]| owner.get(&[b, a]).copied());
        let beside = distinct(beside.filter(|&other| faces.faces[other].region == *region));
        let joined = beside.into_iter().filter_map(|other| {
            let joined = join(corners, &faces.faces[other].corners)?;
            is_simple(faces, &joined).then(|| (compactness(faces, &joined), other, joined))
        });
        if let Some((_, other, joined)) =
            joined.reduce(|a, b| if b.0 > a.0 * (1.0 + ROUNDING) { b } else { a })
        {
            for number in [face, other] {
                sides(&faces.faces[number].corners).for_each(|way| {
                    owner.remove(&way);
                });
            }
            owner.extend(sides(&joined).map(|way| (way, other)));
            faces.faces[face].corners.clear();
            let region = faces.faces[other].region;
            faces.faces[other] = Face { corners: joined, whole: None, region };
            merged += 1;
        }
    }
    merged
}

/// Takes particles out of the middle of straight sides along the outline, once all cells there have joined to one:
/// they would move along the side at next to no cost, which takes an equilibrium many iterations to find.
fn drop_idle(faces: &mut Faces) {
    let mut cells = vec![0u32; faces.nodes.len()];
    faces.cells().flat_map(|face| &face.corners).for_each(|&node| cells[node as usize] += 1);
    for Face { corners: face, whole, .. } in &mut faces.faces {
        let mut k = 0;
        while k < face.len() && face.len() > 3 {
            let beside = [face[(k + face.len() - 1) % face.len()], face[(k + 1) % face.len()]];
            let node = &faces.nodes[face[k] as usize];
            let line = beside.map(|node| faces.nodes[node as usize].point);
            let is_needed = cells[face[k] as usize] > 1 || node.is_corner || node.place.is_none();
            if is_needed || off_line(line, node.point).abs() > ROUNDING * distance(line[0], line[1]) {
                k += 1;
            } else {
                face.remove(k);
                *whole = None;
            }
        }
    }
}

/// The loop around two faces; `None` where they touch in more than one line.
fn join(a: &[u32], b: &[u32]) -> Option<Vec<u32>> {
    let all: Vec<[u32; 2]> = sides(a).chain(sides(b)).collect();
    let outer: Vec<[u32; 2]> =
        all.iter().filter(|[from, to]| !all.contains(&[*to, *from])).copied().collect();
    let mut joined = vec![outer.first()?[0]];
    loop {
        let at = *joined.last()?;
        let mut leaving = outer.iter().filter(|[from, _]| *from == at);
        let (next, other) = (leaving.next()?[1], leaving.next());
        if other.is_some() || joined.len() > outer.len() {
            return None;
        }
        if next == joined[0] {
            break;
        }
        joined.push(next);
    }
    (joined.len() == outer.len()).then_some(joined)
}

/// Whether no two sides of a face cross or touch but at common ends, and it runs counter-clockwise.
fn is_simple(faces: &Faces, face: &[u32]) -> bool {
    let count = face.len();
    if count < 3 || area(faces, face) <= 0.0 || (1..count).any(|k| face[..k].contains(&face[k])) {
        return false;
    }
    let at = |k: usize| faces.nodes[face[k % count] as usize].point;
    let apart = |k: usize, l: usize| l > k + 1 && !(k == 0 && l == count - 1);
    let crosses =
        |k: usize, l: usize| crate::geometry::shape::segments_cross(at(k), at(k + 1), at(l), at(l + 1));
    !(0..count).any(|k| (k + 1..count).any(|l| apart(k, l) && crosses(k, l)))
}

/// Shrinks sides along the outline that are shorter than `least` \[length\] to one of their ends.
fn shrink(faces: &mut Faces, least: f64) -> usize {
    let mut around: HashMap<u32, Vec<usize>> = HashMap::new();
    let mut cells_at: HashMap<[u32; 2], usize> = HashMap::new();
    for (number, face) in faces.faces.iter().enumerate() {
        for [a, b] in sides(&face.corners) {
            around.entry(a).or_default().push(number);
            *cells_at.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let mut short: Vec<(i64, [u32; 2])> = cells_at
        .into_iter()
        // Any other side with cells on both sides joins two strands of the outline, or a particle inside with it.
        .filter(|(side, cells)| *cells == 1 || faces.interfaces.contains(side))
        .filter(|(side, _)| length(faces, *side) < least * (1.0 - ROUNDING))
        .map(|(side, _)| (steps(length(faces, side), least), side))
        .collect();
    short.sort_unstable();
    let mut shrunk = 0;
    for (_, [a, b]) in short {
        let rank = |node: u32| {
            let node = &faces.nodes[node as usize];
            2 * u8::from(node.is_corner) + u8::from(node.site.is_some())
        };
        let (gone, kept) = if rank(a) > rank(b) { (b, a) } else { (a, b) };
        let is_side = around.get(&gone).is_some_and(|cells| {
            cells.iter().any(|&cell| sides(&faces.faces[cell].corners).any(|w| w == [a, b] || w == [b, a]))
        });
        if !is_side || faces.nodes[gone as usize].is_corner {
            continue;
        }
        shrunk += usize::from(replace(faces, &mut around, gone, kept));
    }
    shrunk
}

/// Puts one node in the place of another in all faces around it, unless that spoils one of them.
fn replace(faces: &mut Faces, around: &mut HashMap<u32, Vec<usize>>, gone: u32, kept: u32) -> bool {
    let cells = around.get(&gone).cloned().unwrap_or_default();
    // Of each region around: the area before, and by how much it changes.
    let mut areas: HashMap<usize, [f64; 2]> = HashMap::new();
    let mut changed = Vec::new();
    for &cell in &cells {
        let Face { corners: old, region, .. } = &faces.faces[cell];
        let mut new: Vec<u32> = old.iter().map(|&node| if node == gone { kept } else { node }).collect();
        new.dedup();
        if new.len() > 1 && new.first() == new.last() {
            new.pop();
        }
        let vanishes = new.len() <= 2;
        if (vanishes && old.len() > 3) || (!vanishes && !is_simple(faces, &new)) {
            return false;
        }
        let [before, change] = areas.entry(*region).or_default();
        *before += area(faces, old);
        *change += if vanishes { 0.0 } else { area(faces, &new) } - area(faces, old);
        changed.push((cell, if vanishes { Vec::new() } else { new }));
    }
    if areas.values().any(|[before, change]| change.abs() > AREA_CHANGE * before) {
        return false;
    }
    for (cell, new) in changed {
        for [a, b] in sides(&faces.faces[cell].corners) {
            let moved = [a, b].map(|node| if node == gone { kept } else { node });
            if moved != [a, b] && faces.interfaces.contains(&[a, b]) {
                faces.interfaces.extend([moved, [moved[1], moved[0]]]);
            }
        }
        if new.is_empty() {
            for node in std::mem::take(&mut faces.faces[cell].corners) {
                around.entry(node).or_default().retain(|&other| other != cell);
            }
            continue;
        }
        let region = faces.faces[cell].region;
        faces.faces[cell] = Face { corners: new, whole: None, region };
        let known = around.entry(kept).or_default();
        if !known.contains(&cell) {
            known.push(cell);
        }
    }
    around.remove(&gone);
    true
}
