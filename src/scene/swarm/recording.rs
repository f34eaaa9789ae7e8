//! A recorded continuum run: the places of some of its particles at every step, from `probes.csv`.

use std::collections::HashSet;
use std::path::Path;

use super::Recording;
use crate::scene::document::problem::SceneError;
use crate::scene::rows::Rows;
use crate::scene::text;
use crate::scene::validate::Refuse;

const KEY: &str = "scene.recording";

pub fn read(file: &str, folder: Option<&Path>, refuse: Refuse<'_>) -> Result<Recording, SceneError> {
    let place = folder.unwrap_or(Path::new("")).join(file);
    let text = text::read(&place).map_err(|error| {
        refuse(KEY, format!("cannot be read: {error}"), "give a path relative to the swarm file")
    })?;
    parse(&text)
        .map_err(|message| refuse(KEY, message, "give the probes.csv of a run whose scene has record.probes"))
}

/// # Errors
/// A sentence that names the line and what is wrong with it.
fn parse(text: &str) -> Result<Recording, String> {
    let rows = Rows::of(text)?;
    let column = |name| rows.column(name).ok_or_else(|| format!("line 1: there is no column `{name}`"));
    let (step, id, x, y) = (column("step")?, column("id")?, column("x")?, column("y")?);
    let mut recording = Recording { ids: Vec::new(), places: Vec::new() };
    let mut known = HashSet::new();
    rows.each(|row| {
        let (step, id, at) =
            (row.whole(step)? as usize, row.id(id)? as usize, [row.number(x, 1.0)?, row.number(y, 1.0)?]);
        let line = row.line;
        let begun = recording.places.len();
        if step == begun {
            recording.places.push(Vec::new());
        } else if step + 1 != begun {
            return Err(match begun {
                0 => format!("line {line}: the first step is {step}, not 0"),
                _ => format!("line {line}: step {step} does not follow step {}", begun - 1),
            });
        }
        let places = &mut recording.places[step];
        if step > 0 && recording.ids.get(places.len()) != Some(&id) {
            return Err(format!("line {line}: particle {id} was not in the step before at this place"));
        }
        if step == 0 {
            if !known.insert(id) {
                return Err(format!("line {line}: particle {id} is in this step already"));
            }
            recording.ids.push(id);
        }
        places.push(at);
        Ok(())
    })?;
    let whole = recording.places.iter().all(|places| places.len() == recording.ids.len());
    match recording.ids.len() {
        0 => Err("the file has no rows".into()),
        _ if !whole => Err("not every step has all particles".into()),
        _ => Ok(recording),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_and_particles_are_read_in_order_and_gaps_are_named() {
        let text = "step,id,x,y,pe1,pe2\n0,3,1,2,0,0\n0,7,2,2,0,0\n1,3,1.5,2,0,0\n1,7,2.5,2,0,0\n";
        let recording = parse(text).expect("reads");
        assert_eq!(recording.ids, [3, 7]);
        assert_eq!(recording.places[1], [[1.5, 2.0], [2.5, 2.0]]);
        let error = |text: &str| parse(text).expect_err("refused");
        assert_eq!(error("step,id,x,y\n0,3,1,2\n2,3,1,2\n"), "line 3: step 2 does not follow step 0");
        assert_eq!(error("step,id,x\n"), "line 1: there is no column `y`");
        assert_eq!(error("step,id,x,y\n0,1,inf,2\n"), "line 2: `x` = `inf` is not a finite number");
        assert_eq!(error("step,id,x,y\n\n1,1,0,0\n"), "line 3: the first step is 1, not 0");
        let far = "step,id,x,y\n18446744073709551615,1,0,0\n";
        assert_eq!(
            error(far),
            "line 2: `step` = `18446744073709551615` is not a whole number from 0 to 4294967295"
        );
        assert_eq!(error("step,id,x,y\n0,1,0,0\n0,1,0,0\n"), "line 3: particle 1 is in this step already");
        assert_eq!(
            error("step,id,x,y\n0,1,1,2\n1,2,1,2\n"),
            "line 3: particle 2 was not in the step before at this place"
        );
    }
}
