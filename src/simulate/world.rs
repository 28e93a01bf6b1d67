//! A whole simulated world: rig, boards, robot and poses, and the files that hold its pictures and its truth.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use nalgebra::{Point2, Point3, Vector3};
use rayon::prelude::*;

use super::check_poses::{Holding, held};
use super::draws::{Draws, NormalTable, Purpose};
use super::physical_board::PhysicalBoard;
use super::picture::backdrop::Backdrop;
use super::picture::patch::Patch;
use super::picture::render::{Picture, Renderer};
use super::picture::scene::Scene;
use super::picture::sensor::Lighting;
use super::rig::{left_from_field, true_rig};
use super::robot_poses::{self, Arm, TruePose};
use super::settings::Settings;
use super::{Error, Result, clutter, true_robot};
use crate::files::{OutDir, is_temporary};
use crate::geometry::Transform;
use crate::imaging::{Corner, Corners, PairCorners, corners::Side};
use crate::progress;
use crate::robot::Robot;
use crate::stereo::{Camera, Rig};

/// A world whose every number is known.
#[derive(Debug, Clone)]
pub struct World {
    /// What it was made from.
    pub settings: Settings,
    /// The true cameras.
    pub rig: Rig,
    /// The check board as made.
    pub check_board: PhysicalBoard,
    /// The target as made.
    pub target: PhysicalBoard,
    /// `left_from_board` of each check pair.
    pub check_poses: Vec<Transform>,
    /// The robot, nominal and true.
    pub arm: Arm,
    /// Its poses, in the order of the run.
    pub poses: Vec<TruePose>,
}

/// A pair of pictures to be taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Folder and stem, as in `check/` and `01`.
    pub folder: &'static str,
    /// The stem of both files.
    pub stem: String,
    /// Whether the target is in it, or else the check board.
    pub shows_target: bool,
    pub left_from_board: Transform,
    /// Which placement of the cameras: what stands behind depends on it.
    pub placement: u64,
    /// Its number in the world.
    pub number: u64,
}

impl World {
    /// Draws a world. `true_robot` replaces the parameters drawn from the seed; effects beyond them are added to it.
    pub fn new(settings: Settings, true_robot: Option<Robot>) -> Result<World> {
        let rig = true_rig(settings.size_px);
        let check_board = PhysicalBoard::new(settings.check_board, settings.check_workmanship, settings.seed, 0);
        let target = PhysicalBoard::new(settings.target_board, settings.target_workmanship, settings.seed, 1);
        let nominal = true_robot::nominal();
        let drawn = || true_robot::deviated(&nominal, &settings.robot, settings.seed);
        let mut truth = true_robot.unwrap_or_else(drawn);
        true_robot::add_effects(&mut truth, &nominal, &settings.robot, settings.seed);
        if truth.joints.len() != nominal.joints.len() {
            return Err(Error::Joints { found: truth.joints.len(), needed: nominal.joints.len() });
        }
        let arm = Arm { nominal, truth };
        let (count, seed) = (settings.check_pairs, settings.seed);
        let check_poses = held(&rig, &left_from_field(), &check_board, &Holding::USUAL, count, seed)?;
        let poses = robot_poses::plan(&settings, &arm, &rig, &target)?;
        Ok(World { settings, rig, check_board, target, check_poses, arm, poses })
    }

    /// All pairs of pictures, check board first.
    pub fn shots(&self) -> Vec<Shot> {
        let check = self.check_poses.iter().enumerate().map(|(k, &left_from_board)| Shot {
            folder: "check",
            stem: format!("{:02}", k + 1),
            shows_target: false,
            left_from_board,
            placement: 0,
            number: k as u64,
        });
        let poses = self.poses.iter().enumerate().map(|(k, pose)| Shot {
            folder: "poses",
            stem: pose.commanded.pose.clone(),
            shows_target: true,
            left_from_board: pose.left_from_target,
            placement: 1 + pose.group as u64,
            number: (self.check_poses.len() + k) as u64,
        });
        check.chain(poses).collect()
    }

    /// A camera and `camera_from_left`.
    fn camera(&self, side: Side) -> (Camera, Transform) {
        match side {
            Side::Left => (self.rig.left, Transform::identity()),
            Side::Right => (self.rig.right, self.rig.right_from_left),
        }
    }

    /// What a camera sees behind the board from one placement.
    pub fn backdrop(&self, placement: u64, side: Side) -> Backdrop {
        let (camera, camera_from_left) = self.camera(side);
        let patches = clutter::behind(self.settings.seed, placement);
        Backdrop::new(&camera, &camera_from_left, &patches, self.settings.seed, of_side(placement, side))
    }

    /// What carries the board of a shot.
    pub fn holder(&self, shot: &Shot) -> Vec<Patch> {
        if shot.shows_target { clutter::arm(&self.target) } else { clutter::stand(&self.check_board) }
    }

    /// The scene of one side of a pair. `backdrop` is what stands behind ([`World::backdrop`]), `holder` what carries
    /// the board.
    pub fn scene<'a>(&'a self, shot: &Shot, side: Side, backdrop: &'a Backdrop, holder: &'a [Patch]) -> Scene<'a> {
        let (camera, camera_from_left) = self.camera(side);
        Scene {
            camera,
            optics: self.settings.optics,
            board: if shot.shows_target { &self.target } else { &self.check_board },
            camera_from_board: camera_from_left * shot.left_from_board,
            print: self.settings.print,
            holder,
            backdrop,
            lighting: lighting(&self.settings, shot.number, side),
            sensor: self.settings.sensor,
            seed: self.settings.seed,
            picture: of_side(shot.number, side),
        }
    }

    /// True corners of all check pairs.
    pub fn check_corners(&self) -> Corners {
        self.corners(false)
    }

    /// True corners of the target in all poses.
    pub fn pose_corners(&self) -> Corners {
        self.corners(true)
    }

    fn corners(&self, of_target: bool) -> Corners {
        let board = if of_target { self.target.drawing } else { self.check_board.drawing };
        let plain = Backdrop::plain(0.0);
        let list = |shot: &Shot, side: Side| -> Vec<Corner> {
            let at = self.scene(shot, side, &plain, &[]).corners_px();
            let columns = board.columns();
            let corner = |(k, px): (usize, Point2<f64>)| Corner::at(k % columns, k / columns, px);
            at.into_iter().enumerate().map(corner).collect()
        };
        let shots = self.shots();
        let pairs = shots.iter().filter(|shot| shot.shows_target == of_target).map(|shot| PairCorners {
            pair: shot.stem.clone(),
            left: list(shot, Side::Left),
            right: list(shot, Side::Right),
        });
        let size = (self.settings.size_px, self.settings.size_px);
        Corners {
            board,
            left_size: size,
            right_size: size,
            pairs: pairs.collect(),
            skipped: Vec::new(),
            blind: Vec::new(),
            open: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Refuses a folder that holds other pictures where this world's will stand: the commands would read them as well.
    pub fn check_unoccupied(&self, out: &OutDir) -> Result<(), Error> {
        let names: Vec<(&str, String)> =
            self.shots().iter().map(|shot| (shot.folder, format!("{}.png", shot.stem))).collect();
        for (folder, side) in ["check", "poses"].into_iter().flat_map(|f| Side::BOTH.map(|side| (f, side))) {
            let path = out.join(&format!("{folder}/{}", side.name()));
            let Ok(entries) = path.read_dir_utf8() else { continue };
            for entry in entries.flatten() {
                let name = entry.file_name().to_owned();
                // What a killed run had half written is swept away by the next one.
                if !is_temporary(&name) && !names.iter().any(|(f, n)| *f == folder && *n == name) {
                    return Err(Error::Occupied { name, folder: path });
                }
            }
        }
        Ok(())
    }

    /// Renders and writes all pictures, several at a time; each is on disk before the next of its thread begins.
    pub fn write_pictures(&self, out: &OutDir) -> Result<()> {
        let shots = self.shots();
        let normals = NormalTable::new();
        let placements = 1 + self.settings.spheres.len() as u64;
        let views: Vec<(u64, Side)> = (0..placements).flat_map(|p| Side::BOTH.map(|side| (p, side))).collect();
        let backdrops: Vec<Backdrop> = views.into_par_iter().map(|(p, side)| self.backdrop(p, side)).collect();
        let bar = progress::bar("rendering", 2 * shots.len() as u64);
        let jobs: Vec<(&Shot, Side)> = shots.iter().flat_map(|shot| Side::BOTH.map(|side| (shot, side))).collect();
        let done = jobs.par_iter().try_for_each(|&(shot, side)| {
            let backdrop = &backdrops[of_side(shot.placement, side) as usize];
            let holder = self.holder(shot);
            let scene = self.scene(shot, side, backdrop, &holder);
            let picture = Renderer::new(&scene).picture(&normals);
            out.write(&format!("{}/{}/{}.png", shot.folder, side.name(), shot.stem), &png(&picture)?)?;
            bar.inc(1);
            Ok(())
        });
        bar.finish_and_clear();
        done
    }

    /// The target's true mark point at a pose, left camera's frame, mm, and its rotation vector.
    pub fn mark_point(pose: &TruePose) -> (Point3<f64>, Vector3<f64>) {
        (pose.left_from_target * Point3::origin(), pose.left_from_target.rotation.scaled_axis())
    }
}

/// Left and right of a pair, numbered one after the other.
fn of_side(pair: u64, side: Side) -> u64 {
    2 * pair + u64::from(side == Side::Right)
}

/// The light of one side of a pair: the two cameras see it from two sides, and each pair a little differently.
pub fn lighting(settings: &Settings, pair: u64, side: Side) -> Lighting {
    let mut lighting = settings.lighting;
    let mut draws = Draws::new(settings.seed, Purpose::Lighting, of_side(pair, side));
    lighting.gradient.0 += draws.uniform(-0.05, 0.05);
    lighting.gradient.1 += draws.uniform(-0.05, 0.05);
    lighting.exposure *= draws.uniform(0.93, 1.05);
    lighting
}

/// A picture as PNG. Noise does not compress: the fast way is as small as the slow one within a few percent.
pub fn png(picture: &Picture) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Up);
    let (width, height) = (picture.width as u32, picture.height as u32);
    if picture.file_bits == 8 {
        let samples: Vec<u8> = picture.samples.iter().map(|&v| v as u8).collect();
        encoder.write_image(&samples, width, height, ExtendedColorType::L8)?;
    } else {
        let samples: Vec<u8> = picture.samples.iter().flat_map(|v| v.to_ne_bytes()).collect();
        encoder.write_image(&samples, width, height, ExtendedColorType::L16)?;
    }
    Ok(bytes)
}
