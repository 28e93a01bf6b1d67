//! `plan.json`: a plan as a file.

use serde::Serialize;
use serde_json::{Value, json};

use crate::geometry::rotation_matrix;
use crate::linear_algebra::rows;
use crate::plan::Plan;
use crate::plan::predict::Accuracy;
use crate::plan::scene::Placement;

/// The accuracy with so many samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Expected {
    /// Samples; the centres come on top.
    pub poses: usize,
    /// Position error of the target over the spheres, root mean square, mm.
    pub rms_mm: f64,
}

/// What poses determine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Determined {
    /// Of the parameters.
    #[serde(flatten)]
    pub accuracy: Accuracy,
    /// Accuracy to expect.
    pub expected: Vec<Expected>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanFile {
    #[serde(flatten)]
    pub plan: Determined,
    /// Standard deviation of a coordinate that was reckoned with, mm.
    pub noise_mm: f64,
    /// The paper's plan for this robot and rig.
    pub paper: Option<Determined>,
    /// Candidates that were chosen from.
    pub pool: usize,
    /// The placement of the cameras that each group was planned for.
    groups: Vec<Value>,
    /// What is not checked or only assumed.
    pub warnings: Vec<String>,
}

impl PlanFile {
    pub fn new(plan: &Plan) -> PlanFile {
        let group = |(k, placement): (usize, &Placement)| {
            let from_base = &placement.left_from_base;
            json!({
                "group": placement.name,
                // Middle of its sphere, base frame.
                "center_mm": placement.center_mm.as_slice(),
                // Where the left camera was assumed.
                "cam_from_base": {
                    "rotation": rows(&rotation_matrix(from_base)),
                    "translation_mm": from_base.translation.vector.as_slice(),
                },
                "poses": plan.poses.iter().filter(|p| p.group == k).count(),
            })
        };
        PlanFile {
            plan: determined(&plan.accuracy, &plan.expected),
            noise_mm: plan.noise_mm,
            paper: plan.paper.as_ref().map(|(accuracy, expected)| determined(accuracy, expected)),
            pool: plan.pool,
            groups: plan.placements.iter().enumerate().map(group).collect(),
            warnings: plan.warnings.clone(),
        }
    }
}

fn determined(accuracy: &Accuracy, expected: &[(usize, f64)]) -> Determined {
    let expected = expected.iter().map(|&(poses, rms_mm)| Expected { poses, rms_mm }).collect();
    Determined { accuracy: accuracy.clone(), expected }
}
