//! Where the sensor stands, of an identification that has ended.

use super::found::Identification;
use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::judge::placement::{Placed, is_held};
use crate::identify::sensor::Extra;
use crate::identify::settings::{Model, Settings};
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::task::Task;
use crate::robot::Robot;

impl Identification {
    /// The placements of the chosen robot. A robot that was found by distances, or kept nominal, is placed by a fit of points to it; `None` of
    /// readings that are no points.
    pub fn placed(&self, set: &Dataset, nominal: &Robot, settings: &Settings) -> Result<Option<Placed>, Error> {
        if set.kind != Kind::Positions {
            return Ok(None);
        }
        let found = self.candidates[self.chosen].found.as_ref();
        let of_points = found.filter(|(f, _)| matches!(f.model, Model::Position | Model::Pose));
        let anew;
        let (formulation, of_robot) = match (of_points, found) {
            (Some((f, solution)), _) => (f, f.offsets_at(&solution.x)),
            (None, found) => {
                anew = self.by_points(set, nominal, settings)?;
                (&anew, found.map_or(Vec::new(), |(f, solution)| f.offsets_at(&solution.x)))
            }
        };
        let count = formulation.parameters().len();
        let joints = nominal.joints.len();
        let shared = formulation.offsets_covariance(&|parameter| is_held(parameter, joints));
        // A placement is for readings as they are read: the sensor's own errors stay in them. Where targets stand is none of these.
        let (mut offsets, mut sensor) = (of_robot[..count].to_vec(), vec![0.0; count]);
        for (extra, value) in formulation.rows.extras.iter().zip(formulation.extras()) {
            let of_target = match extra {
                Extra::Target(_) => true,
                Extra::Shared(_) => set.are_on_flange(),
                Extra::Zero | Extra::Warp(_) => false,
            };
            offsets.push(if of_target { *value } else { 0.0 });
            sensor.push(if of_target { 0.0 } else { *value });
        }
        let parameters = formulation.parameters();
        let load_chain = nominal.shifted(parameters, &offsets[..count]);
        let plain = Task::plain(set, nominal, parameters, &self.fitted, settings);
        let task = Task { extras: &formulation.rows.extras, model: formulation.model, ..plain };
        let rows = task.rows_at(formulation.rows.scatter, &load_chain);
        Ok(Placed::new(set, &rows, &offsets, &sensor, &shared, formulation.common))
    }

    /// The chosen terms with the points of all groups in frames of their own.
    fn by_points(&self, set: &Dataset, nominal: &Robot, settings: &Settings) -> Result<Formulation, Error> {
        let oriented = set.has_rotations() && settings.model.is_none();
        let turned = set.target_unknowns(oriented);
        let mut extras: Vec<Extra> = self.extras.iter().map(|(extra, _)| *extra).collect();
        extras.extend(turned.iter().filter(|t| !self.extras.iter().any(|(e, _)| e == *t)));
        let parameters = self.terms.parameters(nominal);
        let plain = Task::plain(set, nominal, &parameters, &self.fitted, settings);
        let (model, smooth) =
            (if oriented { Model::Pose } else { Model::Position }, self.smooth.map(|told| told.error));
        Formulation::new(&Task { extras: &extras, model, smooth, ..plain })
    }
}

#[cfg(test)]
mod tests;
