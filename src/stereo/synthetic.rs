//! A rig, boards and corners whose truth is known, for the tests of this stage, and what is asked of a calibration
//! there.

use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3};

use crate::geometry::{Transform, transform};
use crate::imaging::{Board, Corner, Corners, PairCorners, Squares};
use crate::simulate::draws::{Draws, Purpose};
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::{Observation, View};
use crate::stereo::findings::Finding;
use crate::stereo::judge::assessment::{Demand, Judged};
use crate::stereo::judge::ledger::{LensPairs, Standards};
use crate::stereo::judge::lengths::held_out;
use crate::stereo::select::options::Options;
use crate::stereo::triangulate::{common, triangulate};
use crate::stereo::volume::Extent;
use crate::stereo::{Camera, Lens, Rig};

/// The simplest lens that the worlds have, and a flat board.
pub(crate) const BROWN4: Options = Options { lens: Some(Lens::Brown4), shape: Some(false), known: None };

/// A calibration judged by its held-out lengths.
pub(crate) fn judged(found: &Calibration, findings: Vec<Finding>, standards: Standards, tolerance_mm: f64) -> Judged {
    let accuracy = held_out::hold_out(found, None).unwrap();
    let demand = Demand {
        tolerance_mm,
        board_uncertainty_mm: None,
        extent: Extent::Boards,
        lens_pairs: LensPairs::default(),
        size_assumed: None,
    };
    Judged::new(found, findings, accuracy, standards, &demand)
}

/// A known world.
#[derive(Debug, Clone)]
pub(crate) struct World {
    pub rig: Rig,
    pub board: Board,
    /// Height of the board's paraboloids in its middle, mm.
    pub bow_mm: [f64; 2],
    /// Height of its twist at the first and the last corner, mm.
    pub twist_mm: f64,
    /// How far the board's corners lie from their places, mm, the same in every picture.
    pub print_mm: f64,
    /// Which print it is.
    pub print_seed: u64,
    /// How far the windows reach along the edges, which run straight from crossing to crossing, as a share of a square;
    /// 0 sees the crossings themselves.
    pub reach: f64,
    pub poses: Vec<Transform>,
    /// Standard deviation of a corner's coordinate, px.
    pub sigma_px: f64,
}

impl World {
    /// Two cameras 20 degrees towards each other, a board of 12x9 squares, as many pairs as asked for.
    pub fn new(pairs: usize, seed: u64) -> World {
        let mut left = Camera::pinhole(1280, 1024, 2000.0);
        left.lens = Lens::Brown4;
        left.distortion[..4].copy_from_slice(&[-0.1, 0.12, 4e-4, -3e-4]);
        let mut right = left;
        right.fx = 2015.0;
        right.fy = 2013.0;
        right.cx += 8.0;
        right.distortion[..4].copy_from_slice(&[-0.08, 0.05, -2e-4, 5e-4]);
        let right_from_left = transform(Vector3::new(0.01, 0.35, -0.005), Vector3::new(-190.0, 2.0, 30.0));
        let rig = Rig { left, right, right_from_left, covariance: None };
        let board = Board::checker(Squares { columns: 12, rows: 9 }, 15.0);
        let mut draws = Draws::new(seed, Purpose::CheckPoses, 0);
        let mut between = |low: f64, high: f64| draws.uniform(low, high);
        let poses = (0..pairs)
            .map(|_| {
                let turn = Vector3::new(between(-0.6, 0.6), 0.17 + between(-0.6, 0.6), between(-0.4, 0.4));
                transform(turn, Vector3::new(between(-55.0, 55.0), between(-45.0, 45.0), between(480.0, 640.0)))
            })
            .collect();
        World {
            rig,
            board,
            bow_mm: [0.0; 2],
            twist_mm: 0.0,
            print_mm: 0.0,
            print_seed: 0,
            reach: 0.0,
            poses,
            sigma_px: 0.05,
        }
    }

    /// The paper's rig and ceramic board: 5120 px, 25 mm lens, 20x20 squares of 10 mm, corners measured to 0.005 px.
    pub fn paper(pairs: usize, seed: u64) -> World {
        let mut world = World::new(pairs, seed);
        let mut camera = Camera::pinhole(5120, 5120, 10_000.0);
        camera.lens = Lens::Brown4;
        camera.distortion[..4].copy_from_slice(&[-0.08, 0.12, 2e-4, -3e-4]);
        world.rig = Rig {
            left: camera,
            right: Camera { fx: 9_970.0, fy: 9_972.0, cx: 2_540.0, ..camera },
            right_from_left: transform(Vector3::new(0.002, 0.41, 0.005), Vector3::new(-213.0, -2.5, 45.0)),
            covariance: None,
        };
        world.board = Board::checker(Squares { columns: 20, rows: 20 }, 10.0);
        world.sigma_px = 0.005;
        let mut draws = Draws::new(seed, Purpose::CheckPoses, 1);
        let mut between = |low: f64, high: f64| draws.uniform(low, high);
        for pose in &mut world.poses {
            let turn = Vector3::new(between(-0.5, 0.5), 0.2 + between(-0.5, 0.5), between(-0.3, 0.3));
            *pose = transform(turn, Vector3::new(between(-20.0, 20.0), between(-20.0, 20.0), between(500.0, 550.0)));
        }
        world
    }

    /// Two cameras side by side, 40 mm apart, and boards square to them but for the tilt of each.
    pub fn facing(pairs: usize, tilt: impl Fn(f64) -> Vector3<f64>) -> World {
        let mut world = World::new(pairs, 1);
        world.rig.right_from_left = transform(Vector3::zeros(), Vector3::new(-40.0, 0.0, 0.0));
        for (i, pose) in (0..pairs).map(|i| i as f64).zip(&mut world.poses) {
            *pose = transform(tilt(i), Vector3::new(i, -i, 550.0));
        }
        world
    }

    /// The same with another lens on both cameras.
    pub fn with_lens(mut self, lens: Lens, change: impl Fn(&mut [f64; 14])) -> World {
        for camera in [&mut self.rig.left, &mut self.rig.right] {
            camera.lens = lens;
            change(&mut camera.distortion);
        }
        self
    }

    /// The same with the right camera turned (a rotation vector, rad) and shifted in its own frame.
    pub fn with_camera_moved(&self, turn: Vector3<f64>, shift_mm: Vector3<f64>) -> World {
        let mut moved = self.clone();
        moved.rig.right_from_left = transform(turn, shift_mm) * self.rig.right_from_left;
        moved
    }

    /// The same where the right camera turns by so much at random between pairs, as a board in a hand before cameras
    /// that nobody triggers looks.
    pub fn corners_by_hand(&self, seed: u64, turn_deg: f64) -> Corners {
        let mut draws = Draws::new(seed, Purpose::Points, 17);
        self.corners_by(seed, || {
            let turn = Vector3::from_fn(|_, _| draws.normal()) * turn_deg.to_radians();
            self.with_camera_moved(turn, Vector3::zeros()).rig
        })
    }

    /// The corners as the cameras see them, with noise; corners outside of a picture are missing.
    pub fn corners(&self, seed: u64) -> Corners {
        self.corners_by(seed, || self.rig.clone())
    }

    /// The same where the next pair's rig is asked for pair by pair.
    fn corners_by(&self, seed: u64, mut rig: impl FnMut() -> Rig) -> Corners {
        let mut draws = Draws::new(seed, Purpose::Points, 0);
        let reach = (self.reach > 0.0).then_some([self.reach; 2]);
        let covariance_px2 = Some(Matrix2::identity() * self.sigma_px * self.sigma_px);
        let mut pairs = Vec::new();
        for (i, pose) in self.poses.iter().enumerate() {
            let mut pair = PairCorners { pair: format!("{i:02}"), ..PairCorners::default() };
            let rig = rig();
            for at in 0..self.board.corner_count() {
                let (col, row) = self.board.place(at);
                let (left, right) = rig.project(&(pose * self.corner_mm(col, row)));
                for (list, px, camera) in [(&mut pair.left, left, &rig.left), (&mut pair.right, right, &rig.right)] {
                    let px: Point2<f64> = px + Vector2::new(draws.normal(), draws.normal()) * self.sigma_px;
                    let [width, height] = [camera.width, camera.height].map(f64::from);
                    if px.x > 0.0 && px.y > 0.0 && px.x < width && px.y < height {
                        list.push(Corner { col, row, px, covariance_px2, blur_px: None, reach, used: true });
                    }
                }
            }
            pairs.push(pair);
        }
        Corners {
            board: self.board,
            left_size: (self.rig.left.width, self.rig.left.height),
            right_size: (self.rig.right.width, self.rig.right.height),
            pairs,
            skipped: Vec::new(),
            blind: Vec::new(),
            open: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// For every pair, where its corners are on a flat board, mm, and where a rig measures them in exact pixels.
    pub fn measured_exactly(&self, rig: &Rig) -> Vec<Vec<[Point3<f64>; 2]>> {
        let exact = World { sigma_px: 0.0, bow_mm: [0.0; 2], twist_mm: 0.0, ..self.clone() };
        let of_pair = |(pair, pose): (&PairCorners, &Transform)| {
            let view = View::new(&self.board, pair, 0);
            let of = |(left, right): (&Observation, &Observation)| {
                [pose * left.board_mm, triangulate(rig, left, right).unwrap().point_mm]
            };
            common(&view).into_iter().map(of).collect()
        };
        exact.corners(1).pairs.iter().zip(&self.poses).map(of_pair).collect()
    }

    fn corner_mm(&self, col: usize, row: usize) -> Point3<f64> {
        let mut at = self.board.corner_mm(col, row);
        let edge = self.board.corner_mm(self.board.columns() - 1, self.board.rows() - 1);
        let (c, r) = (col as f64, row as f64);
        let [own, before, after] = [1.0 - 0.5 * self.reach, 0.25 * self.reach, 0.25 * self.reach];
        at.x += own * self.print(c, r)[0] + before * self.print(c, r - 1.0)[0] + after * self.print(c, r + 1.0)[0];
        at.y += own * self.print(c, r)[1] + before * self.print(c - 1.0, r)[1] + after * self.print(c + 1.0, r)[1];
        at.z = self.bow_mm[0] * (1.0 - (at.x / edge.x).powi(2))
            + self.bow_mm[1] * (1.0 - (at.y / edge.y).powi(2))
            + self.twist_mm * at.x * at.y / (edge.x * edge.y);
        at
    }

    /// How far a crossing lies from its place, mm.
    fn print(&self, col: f64, row: f64) -> [f64; 2] {
        // Any two numbers that neither corners nor axes share.
        let place = row * self.board.columns() as f64 + col + 1000.0 * self.print_seed as f64;
        [self.print_mm * (1.7 + 12.9 * place).sin(), self.print_mm * (0.3 + 78.2 * place).sin()]
    }
}
