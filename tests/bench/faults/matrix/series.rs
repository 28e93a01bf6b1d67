//! A series of check pictures of which every one can be changed: another rig, board, place or light, and faults of its
//! own.
//!
//! [`series`] draws a faultless one; a fault is planted by changing fields of the [`Exposure`]s concerned.

use std::sync::Arc;

use nalgebra::Point2;

use super::picture_faults::{FileForm, PictureFault, Shares};
use stereocal::geometry::Transform;
use stereocal::imaging::corners::Side;
use stereocal::simulate::check_poses::{self, Holding};
use stereocal::simulate::clutter;
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::PhysicalBoard;
use stereocal::simulate::picture::backdrop::Backdrop;
use stereocal::simulate::picture::patch::Patch;
use stereocal::simulate::picture::psf::Optics;
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::picture::scene::{Print, Scene};
use stereocal::simulate::picture::sensor::{Lighting, Sensor};
use stereocal::simulate::rig::RigDrawing;
use stereocal::simulate::settings::Settings;
use stereocal::simulate::{Error, world};
use stereocal::stereo::Camera;

/// One picture to be taken and what happens to it.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// The camera.
    pub camera: Camera,
    /// The lens's spread.
    pub optics: Optics,
    /// The board.
    pub board: Arc<PhysicalBoard>,
    /// Where it is.
    pub camera_from_board: Transform,
    /// Where it is when the odd rows are read, of a camera that reads them later.
    pub odd_rows: Option<Transform>,
    /// The board's print.
    pub print: Print,
    /// What carries it.
    pub holder: Vec<Patch>,
    /// What stands behind.
    pub backdrop: Arc<Backdrop>,
    /// The light.
    pub lighting: Lighting,
    /// The sensor. Its bits count for nothing here: the file has the last word.
    pub sensor: Sensor,
    /// Seed of the noise.
    pub seed: u64,
    /// Number of the picture.
    pub number: u64,
    /// What happens to it, in this order.
    pub faults: Vec<PictureFault>,
    /// How it is written.
    pub form: FileForm,
}

/// A pair of pictures.
#[derive(Debug, Clone)]
pub struct ExposedPair {
    /// The stem of both files.
    pub name: String,
    /// Left and right.
    pub sides: [Exposure; 2],
}

impl Exposure {
    fn scene(&self, camera_from_board: Transform) -> Scene<'_> {
        Scene {
            camera: self.camera,
            optics: self.optics,
            board: &self.board,
            camera_from_board,
            print: self.print,
            holder: &self.holder,
            backdrop: &self.backdrop,
            lighting: self.lighting,
            sensor: Sensor { bits: 16, ..self.sensor },
            seed: self.seed,
            picture: self.number,
        }
    }

    /// True places of the board's inner corners before anything happens to the picture, px.
    pub fn corners_px(&self) -> Vec<Point2<f64>> {
        self.scene(self.camera_from_board).corners_px()
    }

    /// The bytes of the file.
    pub fn file(&self, normals: &NormalTable) -> Result<Vec<u8>, Error> {
        let taken = |at: Transform| Shares::new(&Renderer::new(&self.scene(at)).picture(normals));
        let mut picture = taken(self.camera_from_board);
        if let Some(later) = self.odd_rows {
            picture.interlace(&taken(later));
        }
        for fault in &self.faults {
            picture.suffer(fault, self.seed, self.number);
        }
        picture.encode(&self.form)
    }

    /// Everything that the file depends on, but for what stands behind.
    pub fn describe(&self) -> String {
        let taking = (&self.camera, &self.optics, &self.camera_from_board, &self.odd_rows, &self.print, &self.holder);
        let light = (&self.lighting, &self.sensor, self.seed, self.number, &self.faults, &self.form);
        format!("{taking:?} {light:?} {:?}", self.board)
    }
}

impl ExposedPair {
    /// Moves the board, and with it what carries it, to a place before the left camera.
    pub fn place(&mut self, left_from_board: Transform, right_from_left: &Transform) {
        self.sides[0].camera_from_board = left_from_board;
        self.sides[1].camera_from_board = right_from_left * left_from_board;
    }
}

/// A faultless series: settings for the board, the light and the sensor, a rig, how the boards are held.
pub fn series(settings: &Settings, drawing: &RigDrawing, holding: &Holding) -> Result<Vec<ExposedPair>, Error> {
    let rig = drawing.rig();
    let board = PhysicalBoard::new(settings.check_board, settings.check_workmanship, settings.seed, 0);
    let field = drawing.left_from_field();
    let poses = check_poses::held(&rig, &field, &board, holding, settings.check_pairs, settings.seed)?;
    let board = Arc::new(board);
    let behind = clutter::behind(settings.seed, 0);
    let cameras = [(rig.left, Transform::identity()), (rig.right, rig.right_from_left)];
    let backdrops: Vec<Arc<Backdrop>> = cameras
        .iter()
        .zip(0..)
        .map(|((camera, from_left), side)| Arc::new(Backdrop::new(camera, from_left, &behind, settings.seed, side)))
        .collect();
    let exposure = |number: u64, side: Side, left_from_board: &Transform| {
        let k = usize::from(side == Side::Right);
        let (camera, camera_from_left) = cameras[k];
        Exposure {
            camera,
            optics: settings.optics,
            board: board.clone(),
            camera_from_board: camera_from_left * left_from_board,
            odd_rows: None,
            print: settings.print,
            holder: clutter::stand(&board),
            backdrop: backdrops[k].clone(),
            lighting: world::lighting(settings, number, side),
            sensor: settings.sensor,
            seed: settings.seed,
            number: 2 * number + k as u64,
            faults: Vec::new(),
            form: FileForm::PNG8,
        }
    };
    let pair = |(k, at): (usize, &Transform)| ExposedPair {
        name: format!("{:02}", k + 1),
        sides: [Side::Left, Side::Right].map(|side| exposure(k as u64, side, at)),
    };
    Ok(poses.iter().enumerate().map(pair).collect())
}
