//! Leaders and their programs, with the tracks that leaders follow from a file.

use std::path::Path;

use super::raw::*;
use super::{Leaders, Picked, Program, Shape, Track};
use crate::flock::motion::{Interpolation, Keyframe, Motion};
use crate::scene::document::problem::SceneError;
use crate::scene::rows::Rows;
use crate::scene::text;
use crate::scene::validate::{Refuse, roles};

pub fn leaders(
    raw: &RawSwarm,
    shape: &Shape,
    folder: Option<&Path>,
    refuse: Refuse<'_>,
) -> Result<Vec<Leaders>, SceneError> {
    require_one_program(raw, refuse)?;
    let entry = |(k, entry): (usize, &RawLeaders)| {
        let key = format!("leaders[{k}]");
        let picked = match (&entry.robots[..], &entry.region) {
            ([], Some(region)) if matches!(shape, Shape::Body(_)) => {
                Picked::Region(roles::region(&key, region, refuse)?)
            }
            ([], Some(_)) => {
                let message =
                    "regions pick particles of a lattice, and the robots are given one by one".into();
                return Err(refuse(&format!("{key}.region"), message, "name the robots: robots = [\"r1\"]"));
            }
            ([], None) => {
                let help = "name the robots (robots = [\"r1\"]) or give a region";
                return Err(refuse(&key, "this entry names no leader".into(), help));
            }
            (names, None) => Picked::Names(names.to_vec()),
            (_, Some(_)) => {
                let message = "both names and a region are given".into();
                return Err(refuse(&format!("{key}.region"), message, "keep one of them"));
            }
        };
        Ok(Leaders { robots: picked, program: program(&key, &entry.program, raw, folder, refuse)? })
    };
    raw.leaders.iter().enumerate().map(entry).collect()
}

/// Refuses robots that are named as leaders more than once.
fn require_one_program(raw: &RawSwarm, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let all = raw.leaders.iter().enumerate();
    let named: Vec<([usize; 2], &String)> = all
        .flat_map(|(k, entry)| entry.robots.iter().enumerate().map(move |(n, name)| ([k, n], name)))
        .collect();
    for (place, &([k, n], name)) in named.iter().enumerate() {
        if let Some(([before, _], _)) = named[..place].iter().find(|(_, other)| *other == name) {
            let message = format!("`{name}` leads by leaders[{before}] already");
            let help = "name each leader once, and give it one program";
            return Err(refuse(&format!("leaders[{k}].robots[{n}]"), message, help));
        }
    }
    Ok(())
}

fn program(
    key: &str,
    program: &RawProgram,
    raw: &RawSwarm,
    folder: Option<&Path>,
    refuse: Refuse<'_>,
) -> Result<Program, SceneError> {
    Ok(match program {
        RawProgram::External {} => Program::External,
        RawProgram::Path { points, interpolation } => {
            let frames: Vec<Keyframe> = points
                .iter()
                .map(|point| Keyframe { step: point.at, displacement: point.displacement })
                .collect();
            if let Some(k) = (1..frames.len()).find(|&k| frames[k].step <= frames[k - 1].step) {
                let message = format!("is not later than the point before it, at {} s", frames[k - 1].step);
                let help = "give the points in the order of their times";
                return Err(refuse(&format!("{key}.program.points[{k}].at"), message, help));
            }
            Program::Motion(Motion::Keyframes { frames, interpolation: (*interpolation).into() })
        }
        RawProgram::File { path, scale } => {
            let key = format!("{key}.program.path");
            let place = folder.unwrap_or(Path::new("")).join(path);
            let text = text::read(&place).map_err(|error| {
                refuse(&key, format!("cannot be read: {error}"), "give a path relative to the swarm file")
            })?;
            track(&text, *scale).map_err(|message| {
                refuse(&key, message, "give the columns t,dx,dy or t,name,dx,dy in order of time")
            })?
        }
        RawProgram::Manoeuvre { name } => {
            let number = raw.manoeuvres.iter().position(|manoeuvre| manoeuvre.name == *name);
            Program::Manoeuvre(number.ok_or_else(|| {
                let known: Vec<&str> = raw.manoeuvres.iter().map(|m| m.name.as_str()).collect();
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                let message = format!("there is no manoeuvre `{name}`; there are: {known}");
                refuse(&format!("{key}.program.name"), message, "add it as [[manoeuvres]]")
            })?)
        }
    })
}

/// Reads the text of a CSV file with the header `t,dx,dy` or `t,name,dx,dy`.
///
/// # Errors
/// A sentence that names the line and what is wrong with it.
fn track(text: &str, scale: f64) -> Result<Program, String> {
    let rows = Rows::of(text)?;
    let header: Vec<&str> = rows.header.iter().map(String::as_str).collect();
    let (name, [dx, dy]) = match header[..] {
        ["t", "dx", "dy"] => (None, [1, 2]),
        ["t", "name", "dx", "dy"] => (Some(1), [2, 3]),
        _ => return Err(format!("line 1: the header is `{}`", rows.header_line())),
    };
    let mut tracks: Vec<(String, u64, Vec<Keyframe>)> = Vec::new();
    rows.each(|row| {
        let displacement = [row.number(dx, scale)?, row.number(dy, scale)?];
        let frame = Keyframe { step: row.number(0, 1.0)?, displacement };
        let name = name.map_or("", |name| row.text(name));
        let place = tracks.iter().position(|(known, ..)| known == name).unwrap_or_else(|| {
            tracks.push((name.to_owned(), row.line, Vec::new()));
            tracks.len() - 1
        });
        let frames = &mut tracks[place].2;
        let fault = match frames.last() {
            _ if frame.step < 0.0 => Some("is negative: a program begins at t = 0"),
            Some(before) if before.step >= frame.step => Some("is not later than the row before it"),
            _ => None,
        };
        if let Some(fault) = fault {
            return Err(format!("line {}: t = {} {fault}", row.line, frame.step));
        }
        frames.push(frame);
        Ok(())
    })?;
    let motion = |frames| Motion::Keyframes { frames, interpolation: Interpolation::Linear };
    if name.is_some() {
        let track = |(name, line, frames)| Track { name, line, motion: motion(frames) };
        return Ok(Program::Individual(tracks.into_iter().map(track).collect()));
    }
    tracks
        .pop()
        .map(|(.., frames)| Program::Motion(motion(frames)))
        .ok_or_else(|| "the file has no rows".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_moves_all_alike_or_each_by_name() {
        let at = |program: &Program, t: f64| match program {
            Program::Motion(motion) => motion.displacement(t, 0, [0.0; 2]),
            Program::Individual(tracks) => tracks[1].motion.displacement(t, 0, [0.0; 2]),
            _ => unreachable!("a track is a motion"),
        };
        let alike = track("t,dx,dy\n0,0,0\n2,1,-1\n", 2.0).expect("reads");
        assert_eq!(at(&alike, 1.0), [1.0, -1.0]);
        let named = track("t,name,dx,dy\n1,a,5,5\n1,b,3,4\n2,b,4,4\n", 1.0).expect("reads");
        assert_eq!(at(&named, 1.5), [3.5, 4.0]);
    }

    #[test]
    fn a_bad_row_of_a_track_is_named() {
        let error = |text| track(text, 1.0).expect_err("refused");
        assert_eq!(error("t,dx,dy\n0,nan,0\n"), "line 2: `dx` = `nan` is not a finite number");
        assert_eq!(error("t,dx,dy\n1,0,0\n1,0,0\n"), "line 3: t = 1 is not later than the row before it");
        assert_eq!(error("t,dx,dy\n-3,0,0\n"), "line 2: t = -3 is negative: a program begins at t = 0");
        assert_eq!(error("t,dx,dy\n"), "the file has no rows");
        assert_eq!(error("x,y\n"), "line 1: the header is `x,y`");
        assert_eq!(error("t,dx,dy\n0,0,0\n\n\n1,oops,0"), "line 5: `dx` = `oops` is not a finite number");
    }
}
