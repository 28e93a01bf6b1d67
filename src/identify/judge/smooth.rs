//! Whether the points of a placement share a smooth error, and how large and how smooth it is.
//!
//! In: rows of points, white and linearised where a rich model fits them. Out: the smooth error that makes them most
//! probable, where it makes them more probable than independent noise does. For each length the rows become the product
//! of all their columns (parameters, transform, the error's functions, residual) with themselves; every size of error
//! and noise is then algebra on small matrices. The transforms are integrated out (restricted likelihood: Patterson and
//! Thompson, Biometrika 58, 1971), the parameters have their prior. What goes wrong: an error that the robot's
//! parameters can follow, or that is small beside the noise, is not seen.

use nalgebra::{Cholesky, DMatrix};

use crate::identify::model::prior::evidence_of_all;
use crate::identify::residuals::eliminate::Block;
use crate::identify::residuals::rows::Rows;
use crate::identify::residuals::smooth::{functions, white};
use crate::identify::sensor::SmoothError;
use crate::identify::solve::linearised::{Linearised, Placement};

/// A smooth error that the points tell of, and by how much it makes them more probable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detected {
    pub error: SmoothError,
    /// Logarithm of the evidence for it.
    pub evidence: f64,
}

/// Logarithm of the evidence that a smooth error must bring. It only makes the result less certain: more would be asked
/// of something that changes what is said of the robot.
const ENOUGH: f64 = 2.0;

/// A smooth error of less than this is rounding, mm: data without noise have one.
const SMALLEST_MM: f64 = 1e-5;

/// Lengths that are tried, in root mean square distances of a placement's points from their middle.
const LENGTHS: [f64; 4] = [0.4, 0.7, 1.2, 2.5];

/// Sizes that are tried, over the noise.
const SIZES: [f64; 9] = [0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0];

/// Factors of the noise that are tried beside it.
const NOISES: [f64; 8] = [0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2];

/// Fewest points of a placement by which to tell, and fewest such placements: in a single one the robot's own errors
/// are as smooth.
const FEWEST: usize = 8;
const PLACEMENTS: usize = 2;

/// Columns of a placement: parameters and extras, residual, transform, functions.
struct Products {
    normal: DMatrix<f64>,
    functions: usize,
    numbers: f64,
}

/// The smooth error; `None` where nothing tells of one. `offsets` are where the rows are linearised, `sds` the standard
/// deviations of parameters and extras before the data.
pub fn most_probable(rows: &Rows, offsets: &[f64], sds: &[f64]) -> Option<Detected> {
    let size_mm = size_mm(rows)?;
    let unit_mm = rows.unit_variance_mm2().sqrt();
    let best = |products: &[Products], ratio: f64| {
        let weighed = Weighed::new(products, sds.len() + 1, ratio * unit_mm)?;
        NOISES.iter().map(|&noise| (weighed.evidence(sds, noise), noise)).max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let problem = Linearised::new(rows, offsets);
    let mut found: Option<(f64, SmoothError)> = None;
    let mut without = f64::INFINITY;
    for length in LENGTHS {
        let length_mm = length * size_mm;
        let products = products(rows, &problem, length_mm);
        without = best(&products, 0.0)?.0;
        for ratio in SIZES {
            let (evidence, noise) = best(&products, ratio)?;
            if found.is_none_or(|(most, _)| evidence > most) {
                found = Some((evidence, SmoothError { sd_mm: ratio * noise * unit_mm, length_mm }));
            }
        }
    }
    found
        .map(|(evidence, error)| Detected { error, evidence: evidence - without })
        .filter(|detected| detected.evidence > ENOUGH && detected.error.sd_mm > SMALLEST_MM)
}

/// Root mean square distance of points from the middle of their placement, mm; `None` where there are too few points or
/// placements.
fn size_mm(rows: &Rows) -> Option<f64> {
    let (mut square, mut count, mut placements) = (0.0, 0, 0);
    for block in &rows.blocks {
        let Block::Points(points) = block else { return None };
        if points.spots.len() < FEWEST {
            continue;
        }
        let middle =
            points.spots.iter().map(|s| s.point_mm.coords).sum::<nalgebra::Vector3<f64>>() / points.spots.len() as f64;
        square += points.spots.iter().map(|s| (s.point_mm.coords - middle).norm_squared()).sum::<f64>();
        count += points.spots.len();
        placements += 1;
    }
    (placements >= PLACEMENTS && square > 0.0).then(|| (square / count as f64).sqrt())
}

fn products(rows: &Rows, problem: &Linearised, length_mm: f64) -> Vec<Products> {
    let of_block = |(block, placement): (&Block, &Placement)| {
        let Block::Points(points) = block else { return None };
        let spots: Vec<_> = points.spots.iter().map(|s| s.point_mm).collect();
        let whiteners: Vec<_> = points.spots.iter().map(|s| s.whitener).collect();
        let functions = white(&functions(&spots, length_mm), &whiteners, points.rows_a_spot());
        let all: Vec<usize> = (0..placement.poses.len()).collect();
        let normal = placement.normal(&all, Some(&functions));
        Some(Products { normal, functions: functions.ncols(), numbers: all.len() as f64 })
    };
    rows.blocks.iter().zip(&problem.placements).filter_map(of_block).collect()
}

/// The products of all placements with an error of one size, its functions and the transforms eliminated.
struct Weighed {
    /// Of parameters, extras and residual, at the noise of the rows.
    normal: DMatrix<f64>,
    /// Half the logarithm of the determinants of what was eliminated.
    log_determinant: f64,
    /// Numbers that are left, less the transforms.
    numbers: f64,
}

impl Weighed {
    /// With an error of so many mm a unit of noise. `kept` columns stay; `None` where the others are not determined.
    fn new(products: &[Products], kept: usize, ratio_mm: f64) -> Option<Weighed> {
        let mut all = Weighed { normal: DMatrix::zeros(kept, kept), log_determinant: 0.0, numbers: 0.0 };
        for block in products {
            let own = block.normal.nrows() - block.functions;
            let mut rest = block.normal.view((0, 0), (own, own)).into_owned();
            if ratio_mm > 0.0 {
                let at = (own, own);
                let inner = block.normal.view(at, (block.functions, block.functions)) * (ratio_mm * ratio_mm)
                    + DMatrix::identity(block.functions, block.functions);
                let inner = Cholesky::new(inner)?;
                let cross = block.normal.view((own, 0), (block.functions, own)) * ratio_mm;
                rest -= cross.tr_mul(&inner.solve(&cross));
                all.log_determinant += half_log_determinant(&inner);
            }
            let frame = own - kept;
            let inner = Cholesky::new(rest.view((kept, kept), (frame, frame)).into_owned())?;
            let cross = rest.view((kept, 0), (frame, kept));
            all.normal += rest.view((0, 0), (kept, kept)) - cross.tr_mul(&inner.solve(&cross));
            all.log_determinant += half_log_determinant(&inner);
            all.numbers += block.numbers - frame as f64;
        }
        Some(all)
    }

    /// Logarithm of the data's probability with noise of so many times that of the rows.
    fn evidence(&self, sds: &[f64], noise: f64) -> f64 {
        let normal = &self.normal / (noise * noise);
        let last = sds.len();
        let gradient = normal.view((0, last), (last, 1)).column(0).into_owned();
        let of_parameters = normal.view((0, 0), (last, last)).into_owned();
        evidence_of_all(sds, &of_parameters, &gradient)
            - 0.5 * normal[(last, last)]
            - self.log_determinant
            - self.numbers * noise.ln()
    }
}

fn half_log_determinant(cholesky: &Cholesky<f64, nalgebra::Dyn>) -> f64 {
    cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum()
}
