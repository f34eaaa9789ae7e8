use super::*;

const PLACES: [[f64; 2]; 5] = [[0.0, 0.0], [1.1, 0.2], [0.9, 1.0], [-0.1, 0.8], [0.7, -0.9]];
/// Turned by 80 degrees, shifted and strained.
const NOW: [[f64; 2]; 5] = [[3.1, 1.0], [3.05, 2.2], [2.25, 2.0], [2.3, 0.85], [4.1, 1.7]];

/// A quadrilateral and a triangle that share a side, by particles.
const CELLS: [&[usize]; 2] = [&[0, 1, 2, 3], &[0, 4, 1]];

fn element(corners: &[usize]) -> Element {
    let n = corners.len();
    let at = |k: usize| PLACES[corners[k % n]];
    let twice: f64 = (0..n).map(|k| at(k)[0] * at(k + 1)[1] - at(k)[1] * at(k + 1)[0]).sum();
    let gradient = |k: usize| {
        let ([x0, y0], [x1, y1]) = (at(k + n - 1), at(k + 1));
        [(y1 - y0) / twice, (x0 - x1) / twice]
    };
    Element { stiffness: vec![Block::default(); n * n], gradients: (0..n).map(gradient).collect() }
}

/// Looks at a patch as a particle sees it: its cells, and its neighbours by the numbers of particles.
type Look<'a> = &'a dyn Fn(&[PatchCell<'_>], &dyn Fn(usize) -> Corner);

/// Weights of a dilatation, of one in stretched and turned axes, and of a shear.
const WEIGHTS: [[f64; 3]; 3] = [[1.0, 1.0, 0.0], [1.2, 0.6, 0.3], [0.2, -0.2, 0.96]];

/// Shows the patch of a strain of these weights to `look` as the particle `own` sees it when all stand at `now`.
fn felt((weights, own): ([f64; 3], usize), now: &[[f64; 2]; 5], look: Look<'_>) {
    let elements = CELLS.map(element);
    let slots =
        CELLS.map(|cell| cell.iter().map(|&i| if i == own { OWN } else { i as u32 }).collect::<Vec<_>>());
    let cell =
        |k: usize| PatchCell { element: &elements[k], share: [0.4, 0.3][k], weights, slots: &slots[k] };
    let cells = [0, 1].map(cell);
    let corner = |i: usize| {
        let from = |places: &[[f64; 2]; 5]| [0, 1].map(|d| places[i][d] - places[own][d]);
        let (reference, now) = (from(&PLACES), from(now));
        Corner { reference, displacement: [now[0] - reference[0], now[1] - reference[1]] }
    };
    look(&cells, &corner);
}

fn force(own: ([f64; 3], usize), now: &[[f64; 2]; 5]) -> [f64; 2] {
    let found = std::cell::Cell::new([0.0; 2]);
    felt(own, now, &|cells, corner| {
        found.set(pull(7.0, cells.iter().copied(), corner).expect("has directions").0);
    });
    found.get()
}

fn energy(own: ([f64; 3], usize), now: &[[f64; 2]; 5]) -> f64 {
    let found = std::cell::Cell::new(0.0);
    felt(own, now, &|cells, corner| {
        found.set(row(7.0, cells.iter().copied(), corner).expect("has directions").energy);
    });
    found.get()
}

#[test]
fn forces_balance_and_change_as_the_tangent_says() {
    for weights in WEIGHTS {
        let (mut sum, mut moment) = ([0.0; 2], 0.0);
        for (own, place) in NOW.iter().enumerate() {
            let here = force((weights, own), &NOW);
            sum = [sum[0] + here[0], sum[1] + here[1]];
            moment += place[0] * here[1] - place[1] * here[0];
            felt((weights, own), &NOW, &|cells, corner| {
                let row = row(7.0, cells.iter().copied(), corner).expect("has directions");
                assert!((0..2).all(|d| (row.force[d] - here[d]).abs() < 1e-14));
                for d in 0..2 {
                    let stored = |by: f64| {
                        let mut now = NOW;
                        now[own][d] += by;
                        energy((weights, own), &now)
                    };
                    let gradient = (stored(1e-5) - stored(-1e-5)) / 2e-5;
                    assert!((here[d] + gradient).abs() < 1e-8, "{own}: {here:?} {gradient}");
                }
                for (slot, block) in row.tangent {
                    let other = if slot == OWN { own } else { slot as usize };
                    for e in 0..2 {
                        let shifted = |by: f64| {
                            let mut now = NOW;
                            now[other][e] += by;
                            force((weights, own), &now)
                        };
                        let (ahead, behind) = (shifted(1e-5), shifted(-1e-5));
                        for d in 0..2 {
                            let numeric = (behind[d] - ahead[d]) / 2e-5;
                            assert!((block[d][e] - numeric).abs() < 1e-8, "{own} {other}: {block:?}");
                        }
                    }
                }
            });
        }
        let size = force((weights, 0), &NOW);
        assert!(size[0].hypot(size[1]) > 0.1, "{size:?}");
        assert!(sum[0].hypot(sum[1]) < 1e-13 && moment.abs() < 1e-12, "{sum:?} {moment}");
    }
}

#[test]
fn the_tangent_is_symmetric() {
    for weights in WEIGHTS {
        let blocks = std::cell::RefCell::new(vec![[[[0.0; 2]; 2]; 5]; 5]);
        for own in 0..5 {
            felt((weights, own), &NOW, &|cells, corner| {
                for (slot, block) in row(7.0, cells.iter().copied(), corner).expect("has directions").tangent
                {
                    blocks.borrow_mut()[own][if slot == OWN { own } else { slot as usize }] = block;
                }
            });
        }
        let blocks = blocks.into_inner();
        for (i, j) in (0..5).flat_map(|i| (0..5).map(move |j| (i, j))) {
            assert!((0..4).all(|k| (blocks[i][j][k / 2][k % 2] - blocks[j][i][k % 2][k / 2]).abs() < 1e-14));
        }
    }
}
