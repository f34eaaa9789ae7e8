//! Whether this program was started as one of several, and by whose variables that is known.

/// A program's place among those that a launcher has started together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The number of this rank, from 0.
    pub rank: usize,
    /// How many ranks there are.
    pub count: usize,
    /// The variable of the environment that says how many.
    pub variable: &'static str,
    /// Ranks on this machine, this one among them; 1 where the launcher does not say.
    pub here: usize,
}

/// Variables that a launcher gives to each rank: how many there are, which one it is, and how many there are on its machine,
/// which Slurm gives as a list. The launcher nearest to the program
/// comes first: within a Slurm job, `mpirun` has a number of its own. Slurm's `SLURM_NTASKS` is not among them: it describes a
/// job, and a batch script that runs once has it too.
const VARIABLES: [[&str; 3]; 4] = [
    ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_LOCAL_SIZE"],
    ["MV2_COMM_WORLD_SIZE", "MV2_COMM_WORLD_RANK", "MV2_COMM_WORLD_LOCAL_SIZE"],
    ["PMI_SIZE", "PMI_RANK", "MPI_LOCALNRANKS"],
    ["SLURM_STEP_NUM_TASKS", "SLURM_PROCID", "SLURM_STEP_TASKS_PER_NODE"],
];

/// This program's place, where a launcher has given it one; `variable` looks a variable of the environment up.
pub fn place(variable: &dyn Fn(&str) -> Option<String>) -> Option<Place> {
    let number = |name: &str| variable(name)?.trim().parse::<usize>().ok();
    VARIABLES.iter().find_map(|&[size, own, local]| {
        let (count, rank) = (number(size)?, number(own)?);
        let here = number(local).map_or(1, |here| here.clamp(1, count.max(1)));
        (rank < count).then_some(Place { rank, count, variable: size, here })
    })
}

/// The same by the environment of this process.
pub fn place_here() -> Option<Place> {
    place(&|name| std::env::var(name).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn among(variables: &[(&str, &str)]) -> Option<(usize, usize)> {
        let of =
            |name: &str| variables.iter().find(|(known, _)| *known == name).map(|(_, v)| (*v).to_owned());
        place(&of).map(|place| (place.rank, place.count))
    }

    #[test]
    fn each_launcher_says_how_many_it_has_started() {
        assert_eq!(among(&[("OMPI_COMM_WORLD_SIZE", "4"), ("OMPI_COMM_WORLD_RANK", "2")]), Some((2, 4)));
        assert_eq!(among(&[("PMI_SIZE", "8"), ("PMI_RANK", "7")]), Some((7, 8)));
        assert_eq!(among(&[("SLURM_STEP_NUM_TASKS", "3"), ("SLURM_PROCID", "0")]), Some((0, 3)));
        assert_eq!(among(&[("MV2_COMM_WORLD_SIZE", "1"), ("MV2_COMM_WORLD_RANK", "0")]), Some((0, 1)));
    }

    #[test]
    fn a_job_that_has_several_tasks_but_no_step_of_them_is_one_program() {
        // In a batch script of Slurm.
        assert_eq!(among(&[("SLURM_NTASKS", "16"), ("SLURM_PROCID", "0")]), None);
        assert_eq!(among(&[]), None);
    }

    #[test]
    fn the_launcher_nearest_to_the_program_counts() {
        let within_slurm = [
            ("SLURM_STEP_NUM_TASKS", "2"),
            ("SLURM_PROCID", "1"),
            ("OMPI_COMM_WORLD_SIZE", "1"),
            ("OMPI_COMM_WORLD_RANK", "0"),
        ];
        assert_eq!(among(&within_slurm), Some((0, 1)));
    }

    #[test]
    fn ranks_on_one_machine_are_counted_where_the_launcher_says_so() {
        let here = |local: &[(&str, &str)]| {
            let variables = [&[("PMI_SIZE", "8"), ("PMI_RANK", "7")], local].concat();
            let of =
                |name: &str| variables.iter().find(|(known, _)| *known == name).map(|(_, v)| (*v).to_owned());
            place(&of).map(|place| place.here)
        };
        assert_eq!(here(&[("MPI_LOCALNRANKS", "4")]), Some(4));
        for unclear in [&[][..], &[("MPI_LOCALNRANKS", "2(x3),1")], &[("OMPI_COMM_WORLD_LOCAL_SIZE", "4")]] {
            assert_eq!(here(unclear), Some(1));
        }
    }

    #[test]
    fn what_is_no_place_is_none() {
        for (count, rank) in [("x", "0"), ("4", ""), ("4", "4"), ("0", "0"), ("-1", "0"), ("1e3", "1")] {
            assert_eq!(among(&[("PMI_SIZE", count), ("PMI_RANK", rank)]), None, "{count} {rank}");
        }
        assert_eq!(among(&[("PMI_SIZE", "4")]), None);
    }
}
