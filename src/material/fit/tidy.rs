//! Small parts join their neighbours, short sides shrink to one particle.

use std::collections::HashMap;

use super::cut::Faces;
use super::{LEAST_AREA, LEAST_SIDE, LEAST_WIDTH, Scale};
use crate::flock::points::distance;

/// One makes work for the other: after a few rounds nothing is left to do.
const ROUNDS: usize = 4;

/// A side that shrinks may change the area of what is around it by this part: its chord cuts an arc shorter.
const AREA_CHANGE: f64 = 0.02;

pub fn tidy(faces: &mut Faces, scale: &Scale) {
    for _ in 0..ROUNDS {
        let merged = merge(faces, scale);
        let shrunk = shrink(faces, LEAST_SIDE * scale.altitude);
        if merged + shrunk == 0 {
            break;
        }
    }
    faces.note_whole();
}

fn area(faces: &Faces, corners: &[u32]) -> f64 {
    let at = |k: usize| faces.nodes[corners[k % corners.len()] as usize].point;
    let o = at(0);
    let from = |p: [f64; 2]| [p[0] - o[0], p[1] - o[1]];
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    (1..corners.len()).map(|k| 0.5 * cross(from(at(k)), from(at(k + 1)))).sum()
}

/// Least extent of a face across one of its sides \[length\].
fn width(faces: &Faces, corners: &[u32]) -> f64 {
    let at = |k: usize| faces.nodes[corners[k % corners.len()] as usize].point;
    let across = |k: usize| {
        let (a, b) = (at(k), at(k + 1));
        let length = distance(a, b);
        let off = |p: [f64; 2]| ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / length;
        let (low, high) =
            (0..corners.len()).map(|k| off(at(k))).fold((0.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    (0..corners.len()).map(across).fold(f64::INFINITY, f64::min)
}

/// Joins faces that are too small or too narrow with the neighbour along the longest common line.
fn merge(faces: &mut Faces, scale: &Scale) -> usize {
    let (least, narrow) = (LEAST_AREA * scale.area, LEAST_WIDTH * scale.altitude);
    let whole = 1.01 * scale.area;
    let mut owner: HashMap<[u32; 2], usize> = HashMap::new();
    for (number, face) in faces.faces.iter().enumerate() {
        ways(face).for_each(|way| {
            owner.insert(way, number);
        });
    }
    let mut small: Vec<(f64, usize)> = (0..faces.faces.len())
        .filter(|&face| !faces.faces[face].is_empty())
        .map(|face| (area(faces, &faces.faces[face]), face))
        .filter(|&(area, face)| area < least || width(faces, &faces.faces[face]) < narrow)
        .collect();
    small.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut merged = 0;
    for (_, face) in small {
        let is_fine = |corners: &[u32]| area(faces, corners) >= least && width(faces, corners) >= narrow;
        if faces.faces[face].is_empty() || is_fine(&faces.faces[face]) {
            continue;
        }
        let mut common: Vec<(usize, f64)> = Vec::new();
        for [a, b] in ways(&faces.faces[face]) {
            let Some(&other) = owner.get(&[b, a]) else { continue };
            let length = distance(faces.nodes[a as usize].point, faces.nodes[b as usize].point);
            match common.iter_mut().find(|(known, _)| *known == other) {
                Some((_, sum)) => *sum += length,
                None => common.push((other, length)),
            }
        }
        // Cells that have taken in another one already come last, or a row of small parts would end in one cell.
        let is_large = |other: usize| area(faces, &faces.faces[other]) > whole;
        let mut common: Vec<(bool, usize, f64)> =
            common.into_iter().map(|(other, length)| (is_large(other), other, length)).collect();
        common.sort_by(|a, b| a.0.cmp(&b.0).then(b.2.total_cmp(&a.2)).then(a.1.cmp(&b.1)));
        let joined = common.into_iter().find_map(|(_, other, _)| {
            let joined = join(&faces.faces[face], &faces.faces[other])?;
            is_simple(faces, &joined).then_some((other, joined))
        });
        if let Some((other, joined)) = joined {
            for number in [face, other] {
                ways(&faces.faces[number]).for_each(|way| {
                    owner.remove(&way);
                });
            }
            ways(&joined).for_each(|way| {
                owner.insert(way, other);
            });
            faces.faces[face].clear();
            faces.faces[other] = joined;
            faces.whole[other] = None;
            merged += 1;
        }
    }
    merged
}

fn ways(face: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..face.len()).map(|k| [face[k], face[(k + 1) % face.len()]])
}

/// The loop around two faces; `None` where they touch in more than one line.
fn join(a: &[u32], b: &[u32]) -> Option<Vec<u32>> {
    let all: Vec<[u32; 2]> = ways(a).chain(ways(b)).collect();
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
    let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
    for (number, face) in faces.faces.iter().enumerate() {
        for [a, b] in ways(face) {
            around.entry(a).or_default().push(number);
            *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let length = |faces: &Faces, [a, b]: [u32; 2]| {
        distance(faces.nodes[a as usize].point, faces.nodes[b as usize].point)
    };
    let mut short: Vec<(f64, [u32; 2])> = sides
        .into_iter()
        // A side with cells on both sides joins two strands of the outline, or a particle inside with it.
        .filter(|&(_, cells)| cells == 1)
        .map(|(side, _)| (length(faces, side), side))
        .filter(|(length, _)| *length < least)
        .collect();
    short.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut shrunk = 0;
    for (_, [a, b]) in short {
        let rank = |node: u32| {
            let node = &faces.nodes[node as usize];
            2 * u8::from(node.is_corner) + u8::from(node.site.is_some())
        };
        let (gone, kept) = if rank(a) > rank(b) { (b, a) } else { (a, b) };
        let is_side = around.get(&gone).is_some_and(|cells| {
            cells.iter().any(|&cell| ways(&faces.faces[cell]).any(|w| w == [a, b] || w == [b, a]))
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
    let (mut before, mut after) = (0.0, 0.0);
    let mut changed = Vec::new();
    for &cell in &cells {
        let old = &faces.faces[cell];
        let mut new: Vec<u32> = old.iter().map(|&node| if node == gone { kept } else { node }).collect();
        new.dedup();
        if new.len() > 1 && new.first() == new.last() {
            new.pop();
        }
        let vanishes = new.len() <= 2;
        if (vanishes && old.len() > 3) || (!vanishes && !is_simple(faces, &new)) {
            return false;
        }
        before += area(faces, old);
        after += if vanishes { 0.0 } else { area(faces, &new) };
        changed.push((cell, if vanishes { Vec::new() } else { new }));
    }
    if (after - before).abs() > AREA_CHANGE * before {
        return false;
    }
    for (cell, new) in changed {
        if new.is_empty() {
            for node in std::mem::take(&mut faces.faces[cell]) {
                around.entry(node).or_default().retain(|&other| other != cell);
            }
            continue;
        }
        faces.faces[cell] = new;
        faces.whole[cell] = None;
        let known = around.entry(kept).or_default();
        if !known.contains(&cell) {
            known.push(cell);
        }
    }
    around.remove(&gone);
    true
}
