//! Arrays of numpy: those that come in are checked and read, those that go out are moved.

use numpy::{Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::flock::vectors::Vectors;

/// Moves numbers into an array of this shape, without a copy.
pub(super) fn moved<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    PyArray1::from_vec(py, numbers).reshape(shape)
}

/// The vectors as an array of shape \[count, 2\].
pub(super) fn pairs<'py>(py: Python<'py>, vectors: &Vectors) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    moved(py, vectors.iter().flatten().collect(), &[vectors.len(), 2])
}

/// Of each of some rows, an array of shape \[rows, N\].
pub(super) fn rows<const N: usize>(
    py: Python<'_>,
    rows: impl ExactSizeIterator<Item = [f64; N]>,
) -> PyResult<Bound<'_, PyArrayDyn<f64>>> {
    let count = rows.len();
    moved(py, rows.flatten().collect(), &[count, N])
}

/// Real numbers of an argument called `name`, with their shape: any array or list of floats or integers that
/// doubles hold.
fn reals(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array = as_array(name, given, "fiu", "real numbers, best as float64", "float64")?;
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract()?;
    Ok((array.as_slice()?.to_vec(), array.shape().to_vec()))
}

/// As [`reals`], all of which have to be finite.
pub(super) fn numbers(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let (numbers, shape) = reals(name, given)?;
    if let Some(at) = numbers.iter().position(|number| !number.is_finite()) {
        let place = index_of(at, &shape);
        return Err(PyValueError::new_err(format!("{name}{place} is {}: give finite numbers", numbers[at])));
    }
    Ok((numbers, shape))
}

/// A number that is not negative for each pair of `count`, by rows; NaN where there is none.
pub(super) fn square(name: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
    let (numbers, shape) = reals(name, given)?;
    if let Some(at) = numbers.iter().position(|number| *number < 0.0 || number.is_infinite()) {
        let (place, number) = (index_of(at, &shape), numbers[at]);
        let message = format!("{name}{place} is {number}: give a finite number from 0 on, or NaN for none");
        return Err(PyValueError::new_err(message));
    }
    if shape == [count, count] { Ok(numbers) } else { Err(wrong_shape(name, &shape, &[count, count])) }
}

/// Rows of `width` numbers each, as many as `count` says.
pub(super) fn table(name: &str, given: &Bound<'_, PyAny>, count: usize, width: usize) -> PyResult<Vec<f64>> {
    let (numbers, shape) = numbers(name, given)?;
    if shape == [count, width] || (count == 1 && shape == [width]) {
        return Ok(numbers);
    }
    Err(wrong_shape(name, &shape, &[count, width]))
}

/// Places in the plane, one for each of `count`; a single one may be given without a list around it.
pub(super) fn places(name: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<[f64; 2]>> {
    Ok(table(name, given, count, 2)?.chunks_exact(2).map(|place| [place[0], place[1]]).collect())
}

/// A place for each of some particles, of all `count` unless they are given; one alone may be given without lists.
pub(super) fn placed(
    particles: Option<&Bound<'_, PyAny>>,
    places: &Bound<'_, PyAny>,
    count: usize,
) -> PyResult<Vec<(usize, [f64; 2])>> {
    let particles = match particles {
        Some(given) => indices("particles", given, count)?,
        None => (0..count).collect(),
    };
    let places = self::places("places", places, particles.len())?;
    Ok(particles.into_iter().zip(places).collect())
}

/// One number for each of `count`.
pub(super) fn column(name: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
    let (numbers, shape) = numbers(name, given)?;
    if shape == [count] { Ok(numbers) } else { Err(wrong_shape(name, &shape, &[count])) }
}

/// Indices below `count`: an integer or an array of them.
pub(super) fn indices(name: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<usize>> {
    let array = as_array(name, given, "iu", "indices, which are integers", "int64")?;
    let array: PyReadonlyArrayDyn<'_, i64> = array.extract()?;
    if array.shape().len() > 1 {
        let found = tuple(array.shape());
        return Err(PyValueError::new_err(format!(
            "{name} has shape {found}: give an integer or a list of them"
        )));
    }
    let within = |&index: &i64| {
        let found = usize::try_from(index).ok().filter(|&index| index < count);
        let message = || format!("{name} has index {index}: there are 0 to {}", count.saturating_sub(1));
        found.ok_or_else(|| PyIndexError::new_err(message()))
    };
    array.as_slice()?.iter().map(within).collect()
}

/// True or false for each of `count`.
pub(super) fn mask(name: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<bool>> {
    let array = as_array(name, given, "b", "True and False", "bool")?;
    let array: PyReadonlyArrayDyn<'_, bool> = array.extract()?;
    if array.shape() == [count] {
        return Ok(array.as_slice()?.to_vec());
    }
    Err(wrong_shape(name, array.shape(), &[count]))
}

/// The argument as a contiguous array of `dtype`, if it is one of the kinds of number that `kinds` names.
fn as_array<'py>(
    name: &str,
    given: &Bound<'py, PyAny>,
    kinds: &str,
    wanted: &str,
    dtype: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let numpy = given.py().import("numpy")?;
    // What is masked would be taken for a number.
    if given.is_instance(&numpy.getattr("ma")?.getattr("MaskedArray")?)? {
        let message = format!("{name} is a masked array: give its values, where all of them are known");
        return Err(PyTypeError::new_err(message));
    }
    let array = numpy.call_method1("asarray", (given,));
    let array = array.map_err(|error| PyTypeError::new_err(format!("{name} is no array: {error}")))?;
    let found = array.getattr("dtype")?;
    let kind: String = found.getattr("kind")?.extract()?;
    // An empty list is an array of floats, whatever was meant.
    if !kinds.contains(&kind) && array.len().unwrap_or(1) > 0 {
        return Err(PyTypeError::new_err(format!("{name} has dtype {found}: give {wanted}")));
    }
    let options = PyDict::new(given.py());
    options.set_item("dtype", dtype)?;
    options.set_item("order", "C")?;
    numpy.call_method("asarray", (array,), Some(&options))
}

fn wrong_shape(name: &str, found: &[usize], wanted: &[usize]) -> PyErr {
    PyValueError::new_err(format!("{name} has shape {}: give {}", tuple(found), tuple(wanted)))
}

/// A shape as Python writes it.
fn tuple(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// The place of a flat index in an array of this shape, as Python writes it.
fn index_of(mut at: usize, shape: &[usize]) -> String {
    let mut index: Vec<String> = Vec::new();
    for &size in shape.iter().rev() {
        index.push((at % size).to_string());
        at /= size;
    }
    index.reverse();
    if index.is_empty() { String::new() } else { format!("[{}]", index.join(", ")) }
}
