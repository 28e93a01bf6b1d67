//! How the board moved between two pairs, as the rig measures it.

use nalgebra::{Matrix6, Matrix6xX, SMatrix, Vector3};

use crate::statistics::chi_square_quantile;
use crate::stereo::calibrate::Calibration;
use crate::stereo::judge::verdict::{COVERAGE, Expansion};

/// Quantile of the normal distribution at whose level of chi-square a turn is more than chance: one slide in a hundred.
const MORE_THAN_CHANCE: f64 = 2.3263;

/// A pair's board: its own covariance, and how it follows the shared numbers.
struct Place {
    own: Matrix6<f64>,
    through: Matrix6xX<f64>,
}

/// The boards of all pairs that were used.
pub(super) struct Places<'a> {
    pub calibration: &'a Calibration,
    places: Vec<Place>,
    /// Coverage of what few pairs say of the rig, over that of many.
    widened: f64,
}

/// How the board moved between two pairs.
pub(super) struct Slide {
    /// Places of the pairs among those that were used.
    pub ends: [usize; 2],
    /// How far its middle moved, mm.
    pub length_mm: f64,
    /// Standard deviation of that through the corners of both pairs and the rig, mm.
    pub sigma_mm: f64,
    pub turn_rad: f64,
    /// Whether that is more than chance.
    pub is_turned: bool,
    /// How far its corners moved in the direction of its middle, the least and the most, mm.
    pub corners_mm: [f64; 2],
}

impl<'a> Places<'a> {
    /// `None` where the corners of a pair do not determine its board.
    pub fn new(calibration: &'a Calibration) -> Option<Places<'a>> {
        let equations = calibration.problem().equations(&calibration.layout)?;
        // What pairs scatter beyond their corners' noise is in single poses as it is in the rig.
        let factor = calibration.inflation * calibration.pair_scatter.ratio.unwrap_or(1.0).max(1.0);
        let place = |block: &crate::stereo::solve::normal_equations::Block| {
            let inverse = block.pose_inverse(0.0)?;
            Some(Place { own: inverse * factor, through: inverse * block.mixed.transpose() })
        };
        let places = equations.blocks.iter().map(place).collect::<Option<Vec<_>>>()?;
        let widened = Expansion::new(calibration.pair_scatter.groups, None).calibration / COVERAGE;
        Some(Places { calibration, places, widened })
    }

    pub fn names(&self, ends: [usize; 2]) -> [String; 2] {
        ends.map(|i| self.calibration.views[i].pair.clone())
    }

    /// The move from one pair's board to another's. The covariance of both poses' small turns and shifts: their own,
    /// and what both owe to the rig.
    pub fn slide(&self, ends: [usize; 2]) -> Slide {
        let [from, to] = ends.map(|i| &self.calibration.values.poses[i]);
        let shift = to.translation.vector - from.translation.vector;
        let along = shift.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::z);
        let rotation = to.rotation * from.rotation.inverse();
        let turn = rotation.scaled_axis();
        let [a, b] = ends.map(|i| &self.places[i]);
        let through = &b.through - &a.through;
        let by_rig = &through * &self.calibration.covariance * through.transpose() * self.widened.powi(2);
        let covariance = a.own + b.own + Matrix6::from_fn(|i, j| by_rig[(i, j)]);
        let part = |at| covariance.fixed_view::<3, 3>(at, at).into_owned();
        let [of_turn, of_shift]: [SMatrix<f64, 3, 3>; 2] = [part(0), part(3)];
        let chi_square = of_turn.cholesky().map_or(f64::INFINITY, |c| turn.dot(&c.solve(&turn)));
        let arm = |at: nalgebra::Point3<f64>| from.rotation * at.coords;
        let moved = |at| along.dot(&(rotation * arm(at) - arm(at) + shift));
        let range = |[least, most]: [f64; 2], mm: f64| [least.min(mm), most.max(mm)];
        Slide {
            ends,
            length_mm: shift.norm(),
            sigma_mm: along.dot(&(of_shift * along)).max(0.0).sqrt(),
            turn_rad: turn.norm(),
            is_turned: chi_square > chi_square_quantile(3.0, MORE_THAN_CHANCE),
            corners_mm: self.calibration.board.corners_mm().map(moved).fold([shift.norm(); 2], range),
        }
    }
}

impl Slide {
    /// Half of the range over which the corners' moves lie, mm.
    pub fn half_range_mm(&self) -> f64 {
        0.5 * (self.corners_mm[1] - self.corners_mm[0])
    }
}
