//! Sets of which only the corners are made: the true ones with Gaussian noise.

use std::path::Path;

use super::super::series::Exposure;
use nalgebra::{Matrix2, Vector2};
use stereocal::imaging::input::corners_csv::to_csv;
use stereocal::imaging::{Corner, Corners, PairCorners};
use stereocal::simulate::draws::{Draws, Purpose};

use super::super::said::{self, Said};
use super::super::set::{Plan, Set};

/// Widths of the pictures: the paper's, and a webcam's.
pub const SIZES_PX: [u32; 2] = [5120, 1280];

/// Worlds of each size.
const SEEDS: [u64; 2] = [4, 3];

/// A rig, a board and how corners scatter.
pub struct World {
    pub px: u32,
    pub plan: Plan,
    /// Standard deviation of a corner's coordinate that the corners say of themselves, px.
    pub stated_px: f64,
    /// The true one, px.
    pub sigma_px: f64,
    pub tolerance_mm: f64,
}

impl World {
    /// The paper's rig and board with well measured corners, or a small one with corners as webcams give them.
    pub fn new(px: u32, seed: u64) -> World {
        let large = px == SIZES_PX[0];
        let (plan, sigma_px, tolerance_mm) = match large {
            true => (Plan::ceramic(seed, px), 0.005, 0.05),
            false => (Plan::usual(seed, px), 0.05, 0.2),
        };
        World { px, plan, stated_px: sigma_px, sigma_px, tolerance_mm }
    }

    /// The corners of a set.
    pub fn corners(&self, set: &Set) -> Corners {
        let mut draws = Draws::new(self.plan.settings.seed, Purpose::Points, 17);
        let columns = set.typed.columns();
        let mut of = |exposure: &Exposure| -> Vec<Corner> {
            let (width, height) = (f64::from(exposure.camera.width), f64::from(exposure.camera.height));
            let mut list = Vec::new();
            for (k, true_px) in exposure.corners_px().into_iter().enumerate() {
                // Drawn for corners outside of the picture too: what one pair shows changes nothing in another.
                let px = true_px + Vector2::new(draws.normal(), draws.normal()) * self.sigma_px;
                if px.x > 0.0 && px.y > 0.0 && px.x < width - 1.0 && px.y < height - 1.0 {
                    let covariance_px2 = Some(Matrix2::identity() * self.stated_px * self.stated_px);
                    let (col, row) = (k % columns, k / columns);
                    list.push(Corner { col, row, px, covariance_px2, blur_px: None, reach: None, used: true });
                }
            }
            list
        };
        let pairs = set.pairs.iter().map(|pair| PairCorners {
            pair: pair.name.clone(),
            left: of(&pair.sides[0]),
            right: of(&pair.sides[1]),
        });
        let pairs = pairs.collect();
        let size = (self.px, self.px);
        Corners {
            board: set.typed,
            left_size: size,
            right_size: size,
            pairs,
            skipped: Vec::new(),
            blind: Vec::new(),
            open: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// What the program says of them.
    pub fn check(&self, program: &Path, corners: &Corners) -> Said {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("corners.csv"), to_csv(corners)).expect("a file");
        said::camera_check_of_corners(program, folder.path(), &corners.board, self.tolerance_mm)
    }
}

/// The worlds in which every fault is planted.
pub fn worlds(seed: u64) -> Vec<World> {
    let of = |(px, count): (u32, u64)| (0..count).map(move |k| World::new(px, seed + 400 + k));
    SIZES_PX.into_iter().zip(SEEDS).flat_map(of).collect()
}
