//! Where residuals are taken: the robot's places, the sensor's unknowns and the scatter.

use crate::identify::model::kinematics::Place;
use crate::identify::sensor::Scatter;

/// What residuals of all placements are taken at.
#[derive(Debug, Clone)]
pub struct State<'a> {
    pub places: Vec<Place>,
    /// Values of the sensor's unknowns.
    pub extras: &'a [f64],
    pub scatter: &'a Scatter,
}

impl State<'_> {
    /// Columns of the robot's parameters; none unless the places have derivatives.
    pub fn of_robot(&self) -> usize {
        self.places.first().map_or(0, |place| place.point_columns.ncols())
    }

    /// Those and one an unknown of the sensor.
    pub fn columns(&self) -> usize {
        self.of_robot() + self.extras.len()
    }
}
