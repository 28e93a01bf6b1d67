//! Touches: at many poses the target was at one fixed point that is unknown (a ball in a socket), three numbers a pose.
//!
//! Sockets whose distance is known stand in one block: the distance is the only thing that sees the robot's scale.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::state::State;
use crate::geometry::direction;
use crate::identify::data::dataset::KnownDistance;
use crate::identify::sensor::{Raw, Scatter};

/// A pose at which a socket was touched.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Index of the pose among the places.
    pub pose: usize,
    /// Index of the socket in the block.
    pub socket: usize,
    /// Variance of a coordinate, mm^2.
    pub variance_mm2: f64,
    /// Root of the row's weight, 0 to 1.
    pub weight: f64,
}

/// Sockets that belong together, and when they were touched.
#[derive(Debug, Clone)]
pub struct Touch {
    /// Where the search for each socket starts, base frame, mm.
    pub sockets: Vec<Vector3<f64>>,
    pub contacts: Vec<Contact>,
    /// The known distances between sockets of the block, each with which of the data set's it is.
    pub known: Vec<(usize, KnownDistance)>,
}

impl Touch {
    pub(super) fn row_count(&self) -> usize {
        3 * self.contacts.len() + self.known.len()
    }

    pub(super) fn row_poses(&self) -> Vec<Option<usize>> {
        let contacts = self.contacts.iter().flat_map(|c| [Some(c.pose); 3]);
        contacts.chain(self.known.iter().map(|_| None)).collect()
    }

    fn by(contact: &Contact, scatter: &Scatter) -> f64 {
        let variance = contact.variance_mm2 * scatter.stated + scatter.point_mm * scatter.point_mm;
        contact.weight / variance.max(f64::MIN_POSITIVE).sqrt()
    }

    pub(super) fn inner(&self, state: &State, sockets: &[Vector3<f64>]) -> (DVector<f64>, DMatrix<f64>) {
        let mut residuals = DVector::zeros(self.row_count());
        let mut design = DMatrix::zeros(self.row_count(), 3 * sockets.len());
        for (i, contact) in self.contacts.iter().enumerate() {
            let by = Touch::by(contact, state.scatter);
            let residual = state.places[contact.pose].point_mm.coords - sockets[contact.socket];
            residuals.fixed_rows_mut::<3>(3 * i).copy_from(&(residual * by));
            design.fixed_view_mut::<3, 3>(3 * i, 3 * contact.socket).copy_from(&(-by * Matrix3::identity()));
        }
        for (k, (_, known)) in self.known.iter().enumerate() {
            let row = 3 * self.contacts.len() + k;
            let (u, distance) = direction(&(sockets[known.b] - sockets[known.a]));
            residuals[row] = (distance - known.distance_mm) / known.sigma_mm();
            design.fixed_view_mut::<1, 3>(row, 3 * known.a).copy_from(&(-u.transpose() / known.sigma_mm()));
            design.fixed_view_mut::<1, 3>(row, 3 * known.b).copy_from(&(u.transpose() / known.sigma_mm()));
        }
        (residuals, design)
    }

    pub(super) fn outer(&self, state: &State) -> DMatrix<f64> {
        let robot = state.of_robot();
        let mut jacobian = DMatrix::zeros(self.row_count(), state.columns());
        for (i, contact) in self.contacts.iter().enumerate() {
            let columns = &state.places[contact.pose].point_columns * Touch::by(contact, state.scatter);
            jacobian.view_mut((3 * i, 0), (3, robot)).copy_from(&columns);
        }
        jacobian
    }

    pub(super) fn raw(&self, state: &State, sockets: &[Vector3<f64>]) -> Vec<(usize, f64, Raw)> {
        let raw = |c: &Contact| {
            let residual = state.places[c.pose].point_mm.coords - sockets[c.socket];
            (c.pose, c.weight, Raw::Point(residual, Matrix3::identity() * c.variance_mm2))
        };
        self.contacts.iter().map(raw).collect()
    }
}
