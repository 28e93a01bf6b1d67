//! How much a residual counts: the measurement's own covariance, the robot's scatter beyond it, and errors that poses
//! share.
//!
//! A measured number is `value + own noise + extra' e`, where the extra unknowns `e` are common to many poses: the
//! calibration of a rig, its scale, the zero of a wire. The fit finds them beside the robot.

use nalgebra::{Matrix3, Matrix3xX, Point3, RowDVector, Vector3};

/// An unknown of the sensor that all placements share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extra {
    /// Reading of a distance when the target is at the centre, mm.
    Zero,
    /// What else wrongly calibrated cameras do to space, which they see through a projective map (Hartley and
    /// Zisserman, "Multiple view geometry", section 10.2): thousandths of stretch along z and y (0, 1), of shear in xy,
    /// xz, yz (2 to 4), and of scale a metre along x, y, z (5 to 7).
    Warp(usize),
    /// Turn of the target on the flange about x, y or z (0, 1, 2), mrad.
    Target(usize),
    /// A parameter of the sensor's calibration, in units of its standard deviation (whitened).
    Shared(usize),
}

/// Names of [`Extra::Warp`].
pub const WARPS: [&str; 8] =
    ["stretch_z", "stretch_y", "shear_xy", "shear_xz", "shear_yz", "perspective_x", "perspective_y", "perspective_z"];

impl Extra {
    /// What the residual (predicted minus measured) of a point that was measured there gains with this unknown, mm;
    /// `shared` are the columns of its shared errors.
    pub fn of_point(self, point_mm: &Point3<f64>, shared: Option<&Matrix3xX<f64>>) -> Vector3<f64> {
        let p = point_mm.coords;
        let moved = match self {
            Extra::Zero | Extra::Target(_) => return Vector3::zeros(),
            Extra::Shared(k) => return shared.map_or(Vector3::zeros(), |s| s.column(k).into()),
            Extra::Warp(0) => Vector3::new(0.0, 0.0, p.z),
            Extra::Warp(1) => Vector3::new(0.0, p.y, 0.0),
            Extra::Warp(2) => Vector3::new(p.y, p.x, 0.0),
            Extra::Warp(3) => Vector3::new(p.z, 0.0, p.x),
            Extra::Warp(4) => Vector3::new(0.0, p.z, p.y),
            Extra::Warp(k) => p * (p[(k - 5).min(2)] / 1000.0),
        };
        -moved / 1000.0
    }

    /// Its name in files.
    pub fn name(self) -> String {
        match self {
            Extra::Zero => "distance_zero".to_owned(),
            Extra::Warp(k) => format!("sensor_{}", WARPS[k.min(WARPS.len() - 1)]),
            Extra::Target(axis) => format!("target_r{}", ["x", "y", "z"][axis.min(2)]),
            Extra::Shared(k) => format!("shared_{}", k + 1),
        }
    }
}

/// Logarithm of the evidence that an unknown of the sensor, or another reading of its covariances, must bring: one in
/// four hundred.
pub const EVIDENCE: f64 = 6.0;

/// A robot's repeatability where nothing says more of it, mm: that of a common arm's data sheet.
pub const REPEATABILITY_MM: f64 = 0.02;

/// Variance that singular covariances get on top, mm^2: a micrometre, the resolution of a good instrument.
pub const FLOOR_MM2: f64 = 1e-6;

/// A measured length, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Length {
    /// Index of the pose among the places.
    pub pose: usize,
    pub length_mm: f64,
    pub variance_mm2: f64,
    /// Root of the row's weight, 0 to 1.
    pub weight: f64,
    /// What the residual gains with each extra unknown, mm.
    pub extra: RowDVector<f64>,
}

impl Length {
    /// What the residual gains with extra unknowns of these values, mm.
    pub fn gained(&self, extras: &[f64]) -> f64 {
        self.extra.iter().zip(extras).map(|(x, e)| x * e).sum()
    }
}

/// A measured point in the sensor's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// Index of the pose among the places.
    pub pose: usize,
    pub point_mm: Point3<f64>,
    pub covariance_mm2: Matrix3<f64>,
    /// The matrix that makes white what it is off by: of its own covariance with the robot's scatter, times the weight.
    pub whitener: Matrix3<f64>,
    /// Where it stands on a body of several targets, in the body's frame, mm; `None` for the mark point.
    pub on_body_mm: Option<Vector3<f64>>,
    /// `sensor_from_target`, where the model uses it.
    pub rotation: Option<Matrix3<f64>>,
    /// Root of the row's weight, 0 to 1.
    pub weight: f64,
    /// What the residual gains with each extra unknown, mm.
    pub extra: Matrix3xX<f64>,
}

impl Spot {
    /// What the residual gains with extra unknowns of these values, mm.
    pub fn gained(&self, extras: &[f64]) -> Vector3<f64> {
        self.extra.column_iter().zip(extras).map(|(column, e)| column * *e).sum()
    }
}

/// A residual before whitening, and the variance that the measurement gives it.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// A length; the scatter enters so many times.
    Length(f64, f64, f64),
    Point(Vector3<f64>, Matrix3<f64>),
    /// An orientation, rad.
    Turn(Vector3<f64>),
}

/// How large a smooth error is, and how smooth.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SmoothError {
    /// Standard deviation of a coordinate, mm.
    pub sd_mm: f64,
    /// Length over which it changes, mm.
    pub length_mm: f64,
}

/// How widely the robot scatters beyond the measurement's own covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// A coordinate of a point, mm.
    pub point_mm: f64,
    /// A component of the orientation, rad.
    pub rotation_rad: f64,
    /// What the stated covariances are multiplied by: one, where the residuals do not clearly say otherwise.
    pub stated: f64,
    /// Variance of a coordinate by which the robot may be expected to scatter beyond that, where the readings' own
    /// noise hides it, mm^2: it is in no weight, but in what is promised of fresh poses.
    pub hidden_mm2: f64,
    /// Standard deviation to which the residuals tell the variance of a fresh pose, mm^2, and degrees of freedom by
    /// which they tell that of a reading.
    pub fresh_sd_mm2: f64,
    pub freedom: f64,
    /// A smooth error that the points of a placement share, beside all these.
    pub smooth: Option<SmoothError>,
}

impl Scatter {
    /// Of a point, its covariance taken at its word.
    pub fn of_point(point_mm: f64) -> Scatter {
        let known = f64::INFINITY;
        let [hidden_mm2, fresh_sd_mm2] = [0.0; 2];
        Scatter { point_mm, rotation_rad: 1e-4, stated: 1.0, hidden_mm2, fresh_sd_mm2, freedom: known, smooth: None }
    }

    /// Mean square by which a coordinate of a fresh pose is to be expected off, mm^2.
    pub fn fresh_mm2(&self) -> f64 {
        self.point_mm * self.point_mm + self.hidden_mm2
    }

    /// Degrees of freedom of errors that are to be expected of fresh poses, by their covariances, mm^2: a share of them
    /// is the poses' own scatter, the rest follows from readings that are as large as the residuals say (Satterthwaite,
    /// 1946). What covariances state is known, and what they hide is there by its expectation already. At the least
    /// two, of which a mean can be told.
    pub fn freedom_of(&self, errors_mm2: &[Matrix3<f64>]) -> f64 {
        let fresh_mm2 = self.fresh_mm2().max(f64::MIN_POSITIVE);
        let total_mm2 = errors_mm2.iter().map(Matrix3::trace).sum::<f64>() / errors_mm2.len().max(1) as f64;
        let share_of_fresh = (3.0 * self.fresh_mm2() / total_mm2).min(1.0);
        let told = if self.stated == 1.0 { self.point_mm * self.point_mm / fresh_mm2 } else { 1.0 };
        let of_fresh = share_of_fresh * self.fresh_sd_mm2 / fresh_mm2;
        let of_rest = (1.0 - share_of_fresh) * (2.0 / self.freedom).sqrt();
        (2.0 / (told * (of_fresh + of_rest)).powi(2)).max(2.0)
    }

    /// Whole covariance of a point, mm^2.
    pub fn total(&self, covariance_mm2: &Matrix3<f64>) -> Matrix3<f64> {
        covariance_mm2 * self.stated + Matrix3::identity() * (self.point_mm * self.point_mm)
    }

    /// The matrix W with W C W' = I, C the whole covariance.
    pub fn whitener(&self, covariance_mm2: &Matrix3<f64>) -> Matrix3<f64> {
        let total = self.total(covariance_mm2);
        match total.cholesky().and_then(|c| c.l().try_inverse()) {
            Some(inverse) => inverse,
            None => Matrix3::identity() / (total.trace() / 3.0).max(f64::MIN_POSITIVE).sqrt(),
        }
    }

    /// Standard deviation of a length in which the scatter enters so many times, mm.
    pub fn sd(&self, length: &Length, times: f64) -> f64 {
        let variance = length.variance_mm2 * self.stated + times * self.point_mm * self.point_mm;
        variance.max(f64::MIN_POSITIVE).sqrt()
    }
}
