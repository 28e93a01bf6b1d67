//! Lenses that are known before the pictures: those of another calibration, with the covariance that it states or with
//! a tolerance.
//!
//! In: a camera of each side whose lens is known, and their joint covariance where the calibration has one. Out: the
//! numbers that are known, what they are expected to be, and how surely. Goes wrong: a covariance that is singular;
//! then the cameras' own tolerance is taken.

use nalgebra::{DMatrix, DVector, Vector6};

use crate::imaging::{Corners, Side};
use crate::linear_algebra::to_unit_diagonal;
use crate::stereo::data::Noise;
use crate::stereo::model::parameters::{CAMERA_NAMES, Layout};
use crate::stereo::{Camera, Error, Lens, Rig};

/// What a lens is known to where its calibration states no covariance, as a share of the focal length, anywhere in the
/// picture: careful calibrations of one camera repeat to about this.
pub const TOLERANCE: f64 = 5e-4;

/// Cameras whose lenses are known.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownLenses {
    cameras: [Option<Camera>; 2],
    /// Of the known numbers, in the order of [`KnownLenses::numbers`].
    covariance: DMatrix<f64>,
    /// Whether the calibration states it.
    stated: [bool; 2],
    /// How far pairs scattered about the rig of that calibration beyond their corners' noise, as a variance; one where
    /// it does not say.
    pub pair_excess: f64,
    /// How many pairs with poses of their own say so; `None` where it does not say.
    pub pairs: Option<usize>,
    /// How corners scattered there, where it says so.
    pub noise: Option<Noise>,
    /// Variances of the six numbers of `right_from_left` from pair to pair there, rad^2 and mm^2, where both lenses are
    /// those of one rig that says so.
    pub pair_motion: Option<Vector6<f64>>,
}

impl KnownLenses {
    /// The lenses of these sides of a rig, with its covariance where it has one of them.
    pub fn of_rig(rig: &Rig, sides: &[Side]) -> KnownLenses {
        let camera = |side: Side| sides.contains(&side).then(|| *rig.camera(side));
        let mut known = KnownLenses::of_cameras(Side::BOTH.map(camera));
        let name = |(side, at): (Side, usize)| format!("{}.{}", side.name(), CAMERA_NAMES[at]);
        let names: Vec<String> = known.numbers().into_iter().map(name).collect();
        let covariance = rig.covariance.as_ref().and_then(|stated| stated.part(&names));
        if let Some(covariance) = covariance.filter(|covariance| root(covariance).is_some()) {
            known.covariance = covariance;
            known.stated = Side::BOTH.map(|side| sides.contains(&side));
        }
        known
    }

    /// Cameras without a covariance: each number is known to what moves a point by [`TOLERANCE`] at the corner of the
    /// picture.
    pub fn of_cameras(cameras: [Option<Camera>; 2]) -> KnownLenses {
        let mut known = KnownLenses {
            cameras,
            covariance: DMatrix::zeros(0, 0),
            stated: [false; 2],
            pair_excess: 1.0,
            pairs: None,
            noise: None,
            pair_motion: None,
        };
        let sigmas = known.numbers().into_iter().map(|(side, at)| {
            let camera = known.cameras[side as usize].as_ref();
            camera.map_or(1.0, |camera| tolerance(camera, at))
        });
        let variances: Vec<f64> = sigmas.map(|sigma| sigma * sigma).collect();
        known.covariance = DMatrix::from_diagonal(&DVector::from_vec(variances));
        known
    }

    /// Both sides' together; where both know a side, the other's.
    pub fn and(self, other: KnownLenses) -> KnownLenses {
        let from = |side: Side| if other.camera(side).is_some() { &other } else { &self };
        let stated = Side::BOTH.map(|side| from(side).stated[side as usize]);
        let cameras = Side::BOTH.map(|side| from(side).camera(side).copied());
        let mut both = KnownLenses { stated, ..KnownLenses::of_cameras(cameras) };
        let numbers = both.numbers();
        let place = |number: &(Side, usize)| from(number.0).numbers().iter().position(|n| n == number);
        for (i, a) in numbers.iter().enumerate() {
            for (j, b) in numbers.iter().enumerate() {
                // What two calibrations say is independent.
                let same = std::ptr::eq(from(a.0), from(b.0));
                let at = place(a).zip(place(b)).filter(|_| same);
                both.covariance[(i, j)] = at.map_or(0.0, |at| from(a.0).covariance[at]);
            }
        }
        both.pair_excess = self.pair_excess.max(other.pair_excess);
        both.pairs = other.pairs.or(self.pairs);
        both.noise = other.noise.or(self.noise);
        both.pair_motion = other.pair_motion;
        both
    }

    /// The camera of a side, where its lens is known.
    pub fn camera(&self, side: Side) -> Option<&Camera> {
        self.cameras[side as usize].as_ref()
    }

    /// The same for these pictures: a lens whose file says no size has theirs. Pictures of another size than the lens's
    /// were binned, cut or taken by another camera.
    pub fn of_pictures(self, corners: &Corners) -> Result<KnownLenses, Error> {
        let sizes = [corners.left_size, corners.right_size];
        let sized = |side: Side| {
            let (width, height) = sizes[side as usize];
            self.camera(side).filter(|camera| camera.width == 0).map(|camera| Camera { width, height, ..*camera })
        };
        let sized = Side::BOTH.map(sized);
        let known = if sized.iter().any(Option::is_some) { self.and(KnownLenses::of_cameras(sized)) } else { self };
        for side in Side::BOTH {
            known.camera(side).map_or(Ok(()), |camera| camera.check_picture_size(side, sizes[side as usize]))?;
        }
        Ok(known)
    }

    /// True where both are.
    pub fn both(&self) -> bool {
        self.cameras.iter().all(Option::is_some)
    }

    /// Whether the calibration of a side states a covariance.
    pub fn states_covariance(&self, side: Side) -> bool {
        self.stated[side as usize]
    }

    /// The known numbers: side, and place in [`CAMERA_NAMES`].
    pub fn numbers(&self) -> Vec<(Side, usize)> {
        let of = |side: Side| {
            let count = self.camera(side).map_or(0, |camera| 4 + camera.lens.free_count());
            (0..count).map(move |at| (side, at))
        };
        Side::BOTH.into_iter().flat_map(of).collect()
    }

    pub fn values(&self) -> DVector<f64> {
        let value = |(side, at): (Side, usize)| self.camera(side).map_or(0.0, |camera| camera.number(at));
        DVector::from_iterator(self.covariance.nrows(), self.numbers().into_iter().map(value))
    }

    /// Inverse of a square root of their covariance: what it makes of the deviations is independent with unit variance.
    pub fn whitener(&self) -> DMatrix<f64> {
        root(&self.covariance).unwrap_or_else(|| {
            DMatrix::from_diagonal(&self.covariance.diagonal().map(|variance| 1.0 / variance.sqrt()))
        })
    }

    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// How the known numbers change where a side's focal length changes by its whole. `None` where it is not known.
    pub fn focal_direction(&self, side: Side) -> Option<DVector<f64>> {
        let camera = self.camera(side)?;
        let numbers = self.numbers();
        let of = |(of, at): (Side, usize)| if of == side && at < 2 { camera.number(at) } else { 0.0 };
        Some(DVector::from_iterator(numbers.len(), numbers.into_iter().map(of)))
    }

    /// The same cameras, known so badly that pictures decide: a search that starts there does not run away where they
    /// say nothing.
    pub fn loosened(&self) -> KnownLenses {
        /// To a tenth of the focal length anywhere in the picture.
        const LOOSE: f64 = 0.1 / TOLERANCE;
        let loose = KnownLenses::of_cameras(self.cameras);
        KnownLenses { covariance: loose.covariance * (LOOSE * LOOSE), ..loose }
    }

    /// The same as it counts beside corners whose weights leave out that the numbers scatter by so much more, as a
    /// variance.
    pub fn weighing(&self, scatter: f64) -> KnownLenses {
        KnownLenses { covariance: &self.covariance / scatter, ..self.clone() }
    }

    /// What is free of a rig: the lenses that are known as they are, another one as it is asked for.
    pub fn layout(&self, lens: Lens, shape: bool) -> Layout {
        let of = |side: Side| self.camera(side).map_or(lens, |camera| camera.lens);
        Layout { left: Some(of(Side::Left)), right: Some(of(Side::Right)), ..Layout::rig(lens, shape) }
    }

    /// The same with the lenses of left and right exchanged.
    pub fn exchanged(&self) -> KnownLenses {
        let [left, right] = self.cameras;
        let swapped = KnownLenses::of_cameras([right, left]);
        let own = self.numbers();
        let places: Vec<Option<usize>> =
            swapped.numbers().iter().map(|(side, at)| own.iter().position(|n| *n == (side.other(), *at))).collect();
        let n = places.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| places[i].zip(places[j]).map_or(0.0, |at| self.covariance[at]));
        KnownLenses { covariance, cameras: swapped.cameras, stated: [self.stated[1], self.stated[0]], ..self.clone() }
    }
}

/// What moves a point at the corner of the picture by [`TOLERANCE`] times the focal length.
fn tolerance(camera: &Camera, at: usize) -> f64 {
    let corner = (0.5 * f64::from(camera.width) / camera.fx).hypot(0.5 * f64::from(camera.height) / camera.fy);
    // k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tauX, tauY: powers of the corner's distance from the middle.
    const POWERS: [i32; 14] = [3, 5, 2, 2, 7, 3, 5, 7, 2, 4, 2, 4, 2, 2];
    match at {
        0..4 => TOLERANCE * (camera.fx * camera.fy).sqrt(),
        _ => TOLERANCE / corner.powi(POWERS[(at - 4).min(13)]),
    }
}

/// Inverse of the lower Cholesky factor of a covariance with rows of different units.
fn root(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (unit, scale) = to_unit_diagonal(covariance)?;
    let lower = unit.cholesky()?.l();
    let inverse = lower.solve_lower_triangular(&DMatrix::identity(scale.len(), scale.len()))?;
    Some(inverse * DMatrix::from_diagonal(&scale))
}
