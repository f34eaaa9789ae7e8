//! Markers for RViz and Foxglove: members by role, links by strain, targets, obstacles.

use parry2d::math::Vector;
use parry2d::shape::TriMesh;

use crate::flock::vectors::distance;
use crate::messages::builtin_interfaces::Duration;
use crate::messages::geometry_msgs::{Point, Pose, Vector3};
use crate::messages::std_msgs::{ColorRGBA, Header};
use crate::messages::visualization_msgs::{Marker, MarkerArray};
use crate::scene::swarm::raw::{RawObstacle, RawSwarm};
use crate::swarm::control::Control;

/// Markers that are not renewed vanish after this long \[s\].
const LIFETIME: f64 = 2.0;
/// Strain at which a link has its full colour \[1\].
const FULL_STRAIN: f64 = 0.3;
/// Height of what stands on the plane \[m\].
const HEIGHT: f64 = 0.1;
/// Width of a link over the radius of the smallest robot \[1\], and its least \[m\]: thinner lines look dotted from afar.
const LINK: (f64, f64) = (0.4, 0.02);
/// Corners of an obstacle that is filled; one of more is drawn as its outline, so that no frame waits for its triangles.
const MOST_CORNERS: usize = 250;

const LEADER: ColorRGBA = colour(0.91, 0.13, 0.11, 1.0);
const FOLLOWER: ColorRGBA = colour(0.13, 0.38, 0.75, 1.0);
const LOST: ColorRGBA = colour(0.6, 0.63, 0.65, 0.6);
const TARGET: ColorRGBA = colour(0.0, 0.62, 0.45, 0.8);
const OBSTACLE: ColorRGBA = colour(0.42, 0.44, 0.47, 1.0);

const fn colour(r: f32, g: f32, b: f32, a: f32) -> ColorRGBA {
    ColorRGBA { r, g, b, a }
}

pub fn message(control: &Control, raw: &RawSwarm, header: &Header) -> MarkerArray {
    let mut markers = vec![links(control, header), targets(control, header)];
    markers.extend((0..control.formation().count()).filter_map(|m| member(control, m, header)));
    let moved = raw.obstacles.iter().zip(control.filter().obstacles().moved());
    markers.extend(moved.enumerate().map(|(k, (one, by))| obstacle(one, by, k, header)));
    markers.extend(raw.limits.geofence.as_ref().map(|fence| outline("fence", 0, fence, header)));
    MarkerArray { markers }
}

fn marker(header: &Header, ns: &str, id: usize, kind: i32) -> Marker {
    Marker {
        header: header.clone(),
        ns: ns.into(),
        id: id as i32,
        r#type: kind,
        lifetime: Duration::from_seconds(LIFETIME),
        ..Marker::default()
    }
}

pub(crate) fn point([x, y]: [f64; 2]) -> Point {
    Point { x, y, z: 0.0 }
}

/// The colour of a link: blue where it is too short, red where it is too long.
pub(crate) fn of_strain(strain: f64) -> ColorRGBA {
    let part = (strain / FULL_STRAIN).clamp(-1.0, 1.0) as f32;
    let grey = 0.6 * (1.0 - part.abs());
    let (long, short) = (0.6 + 0.3 * part, 0.6 - 0.3 * part);
    let (r, b) = if part >= 0.0 { (long, grey) } else { (grey, short) };
    colour(r, grey, b, 0.9)
}

fn member(control: &Control, m: usize, header: &Header) -> Option<Marker> {
    let formation = control.formation();
    let place = control.position(m)?;
    let width = 2.0 * formation.radii[m];
    Some(Marker {
        pose: Pose::planar(place, control.yaw(m).unwrap_or(0.0)),
        scale: Vector3 { x: width, y: width, z: HEIGHT },
        color: match (control.health(m).is_usable(), formation.leads(m)) {
            (false, _) => LOST,
            (true, true) => LEADER,
            (true, false) => FOLLOWER,
        },
        text: formation.names[m].clone(),
        ..marker(header, "members", m, Marker::CYLINDER)
    })
}

/// Every link once.
fn links(control: &Control, header: &Header) -> Marker {
    let formation = control.formation();
    let mut marker = Marker {
        scale: Vector3 { x: (LINK.0 * smallest_radius(control)).max(LINK.1), y: 0.0, z: 0.0 },
        color: LOST,
        ..marker(header, "links", 0, Marker::LINE_LIST)
    };
    for m in 0..formation.count() {
        for k in formation.neighbours(m).filter(|&k| k > m || !formation.neighbours(k).any(|back| back == m))
        {
            let (Some(a), Some(b)) = (control.position(m), control.position(k)) else { continue };
            let rest = distance(formation.places.get(m), formation.places.get(k));
            marker.points.extend([point(a), point(b)]);
            marker.colors.extend([of_strain(distance(a, b) / rest - 1.0); 2]);
        }
    }
    marker
}

fn smallest_radius(control: &Control) -> f64 {
    control.formation().radii.iter().copied().fold(f64::INFINITY, f64::min)
}

fn targets(control: &Control, header: &Header) -> Marker {
    let size = smallest_radius(control);
    Marker {
        scale: Vector3 { x: size, y: size, z: size },
        color: TARGET,
        points: (0..control.formation().count()).filter_map(|m| control.target(m)).map(point).collect(),
        ..marker(header, "targets", 0, Marker::SPHERE_LIST)
    }
}

fn obstacle(obstacle: &RawObstacle, by: [f64; 2], id: usize, header: &Header) -> Marker {
    let moved = |&[x, y]: &[f64; 2]| [x + by[0], y + by[1]];
    match obstacle {
        RawObstacle::Disc { centre, radius } => Marker {
            pose: Pose::planar(moved(centre), 0.0),
            scale: Vector3 { x: 2.0 * radius, y: 2.0 * radius, z: HEIGHT },
            color: OBSTACLE,
            ..marker(header, "obstacles", id, Marker::CYLINDER)
        },
        RawObstacle::Polygon { vertices } => {
            let corners: Vec<_> = vertices.iter().map(moved).collect();
            match triangles(&corners) {
                Some(corners) => Marker {
                    scale: Vector3 { x: 1.0, y: 1.0, z: 1.0 },
                    color: OBSTACLE,
                    points: corners.into_iter().map(point).collect(),
                    ..marker(header, "obstacles", id, Marker::TRIANGLE_LIST)
                },
                None => outline("obstacles", id, &corners, header),
            }
        }
    }
}

/// Corners of triangles that fill a polygon, three each.
fn triangles(corners: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
    if corners.len() > MOST_CORNERS {
        return None;
    }
    let mut corners: Vec<Vector> = corners.iter().map(|&[x, y]| Vector::new(x, y)).collect();
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    // Clockwise ones have no ears.
    if pairs.map(|(a, b)| a.x * b.y - a.y * b.x).sum::<f64>() < 0.0 {
        corners.reverse();
    }
    let mesh = TriMesh::from_polygon(corners)?;
    Some(mesh.triangles().flat_map(|one| one.vertices().map(|corner| [corner.x, corner.y])).collect())
}

fn outline(ns: &str, id: usize, corners: &[[f64; 2]], header: &Header) -> Marker {
    Marker {
        scale: Vector3 { x: 0.05, y: 0.0, z: 0.0 },
        color: OBSTACLE,
        points: corners.iter().chain(corners.first()).copied().map(point).collect(),
        ..marker(header, ns, id, Marker::LINE_STRIP)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_obstacle_is_filled_whichever_way_round_its_corners_go() {
        let mut corners = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        for _ in 0..2 {
            let filled = triangles(&corners).expect("a simple polygon");
            let areas = filled.chunks_exact(3).map(|one| {
                let [[ax, ay], [bx, by], [cx, cy]] = [one[0], one[1], one[2]];
                ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2.0
            });
            assert!((areas.sum::<f64>() - 4.0).abs() < 1e-12, "{filled:?}");
            corners.reverse();
        }
        let comb: Vec<_> = (0..MOST_CORNERS + 1).map(|k| [k as f64, (k % 2) as f64]).collect();
        assert_eq!(triangles(&comb), None);
    }
}
