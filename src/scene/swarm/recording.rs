//! A recorded continuum run: the places of some of its particles at every step, from `probes.csv`.

use std::path::Path;

use super::Recording;
use crate::scene::document::problem::SceneError;
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
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| error.to_string())?.clone();
    let column = |name: &str| {
        header
            .iter()
            .position(|known| known == name)
            .ok_or_else(|| format!("line 1: there is no column `{name}`"))
    };
    let (step, id, x, y) = (column("step")?, column("id")?, column("x")?, column("y")?);
    let mut recording = Recording { ids: Vec::new(), places: Vec::new() };
    for (row, record) in reader.records().enumerate() {
        let line = row + 2;
        let record = record.map_err(|error| format!("line {line}: {error}"))?;
        let wrong = |column: usize| format!("line {line}: `{}` = `{}`", &header[column], &record[column]);
        let whole = |column: usize| record[column].parse::<usize>().map_err(|_| wrong(column));
        let coordinate = |column: usize| {
            record[column].parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| wrong(column))
        };
        let (step, id, at) = (whole(step)?, whole(id)?, [coordinate(x)?, coordinate(y)?]);
        if step == recording.places.len() {
            recording.places.push(Vec::new());
        }
        if step + 1 != recording.places.len() {
            return Err(format!(
                "line {line}: step {step} does not follow step {}",
                recording.places.len() - 1
            ));
        }
        let number = recording.places[step].len();
        if step == 0 {
            recording.ids.push(id);
        } else if recording.ids.get(number) != Some(&id) {
            return Err(format!("line {line}: particle {id} was not in the step before at this place"));
        }
        recording.places[step].push(at);
    }
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
        assert_eq!(error("step,id,x,y\n0,1,inf,2\n"), "line 2: `x` = `inf`");
        assert_eq!(
            error("step,id,x,y\n0,1,1,2\n1,2,1,2\n"),
            "line 3: particle 2 was not in the step before at this place"
        );
    }
}
