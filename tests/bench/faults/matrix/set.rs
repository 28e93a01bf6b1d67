//! A set of check pictures with its truth, and how it becomes a folder.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use super::series::{ExposedPair, Exposure, series};
use nalgebra::Point2;
use rayon::prelude::*;
use stereocal::geometry::Transform;
use stereocal::imaging::Board;
use stereocal::simulate::check_poses::Holding;
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::physical_board::PhysicalBoard;
use stereocal::simulate::rig::RigDrawing;
use stereocal::simulate::settings::Settings;
use stereocal::stereo::Rig;

/// What a set is drawn from.
#[derive(Debug, Clone)]
pub struct Plan {
    pub settings: Settings,
    pub drawing: RigDrawing,
    pub holding: Holding,
}

/// Where a point of the sensor is in the picture that was written, for pictures of a width and height.
pub type PixelMap = fn(Point2<f64>, f64, f64) -> Point2<f64>;

/// A set and what is true of it.
#[derive(Clone)]
pub struct Set {
    pub plan: Plan,
    pub pairs: Vec<ExposedPair>,
    /// A second board.
    pub second: Option<Second>,
    /// The rig that stands at the end of the series.
    pub rig: Rig,
    /// Where fresh boards are held, left camera's frame; `None` where the drawing says.
    pub field: Option<Transform>,
    /// True mm for each mm that the command line says.
    pub scale: f64,
    /// Turned or mirrored pictures, left and right.
    pub maps: [PixelMap; 2],
    /// True where the written rig's frame is no picture of the true one, so that points cannot be compared.
    pub lengths_only: bool,
    /// The board as typed.
    pub typed: Board,
    pub arguments: Vec<String>,
}

/// Pictures of another board for `--check-images`.
#[derive(Clone)]
pub struct Second {
    pub pairs: Vec<ExposedPair>,
    pub typed: Board,
}

/// The pixel as the sensor has it.
pub fn as_taken(px: Point2<f64>, _: f64, _: f64) -> Point2<f64> {
    px
}

impl Plan {
    /// The presets' rig and twelve pairs of a board of 210 corners, which is measured in a moment.
    pub fn usual(seed: u64, size_px: u32) -> Plan {
        Plan::ceramic(seed, size_px).board("16x15", 12.7)
    }

    /// The presets' rig and board, twelve pairs.
    pub fn ceramic(seed: u64, size_px: u32) -> Plan {
        let settings = Settings { size_px, seed, check_pairs: 12, ..Settings::small() };
        Plan { settings, drawing: RigDrawing::paper(size_px), holding: Holding::USUAL }
    }

    /// Another board, its squares such that it is about as large as the usual one.
    pub fn board(mut self, squares: &str, square_mm: f64) -> Plan {
        self.settings.check_board = Board::checker(squares.parse().expect("a board"), square_mm);
        self
    }

    /// So many pairs.
    pub fn pairs(mut self, count: usize) -> Plan {
        self.settings.check_pairs = count;
        self
    }

    /// The faultless set.
    pub fn set(&self) -> Set {
        let pairs = series(&self.settings, &self.drawing, &self.holding).expect("the board fits into the field");
        Set {
            plan: self.clone(),
            pairs,
            second: None,
            rig: self.drawing.rig(),
            field: None,
            scale: 1.0,
            maps: [as_taken; 2],
            lengths_only: false,
            typed: self.settings.check_board,
            arguments: Vec::new(),
        }
    }
}

impl Set {
    /// Changes all pictures.
    pub fn each(mut self, mut change: impl FnMut(&mut Exposure)) -> Set {
        self.pairs.iter_mut().flat_map(|pair| &mut pair.sides).for_each(&mut change);
        self
    }

    /// Changes the pairs of a range of places in the series.
    pub fn pairs_in(mut self, range: std::ops::Range<usize>, mut change: impl FnMut(usize, &mut ExposedPair)) -> Set {
        for k in range {
            change(k, &mut self.pairs[k]);
        }
        self
    }

    /// Gives pairs another board.
    pub fn reboard(self, range: std::ops::Range<usize>, make: impl Fn(usize, &PhysicalBoard) -> PhysicalBoard) -> Set {
        self.pairs_in(range, |k, pair| {
            let board = std::sync::Arc::new(make(k, &pair.sides[0].board));
            pair.sides.iter_mut().for_each(|side| side.board = board.clone());
        })
    }

    /// The right camera stands elsewhere from a pair on; the rig that stands at the end is the new one.
    pub fn right_moves(mut self, range: std::ops::Range<usize>, moved_from_right: Transform) -> Set {
        if range.end == self.pairs.len() {
            self.rig.right_from_left = moved_from_right * self.rig.right_from_left;
        }
        self.pairs_in(range, |_, pair| {
            let side = &mut pair.sides[1];
            side.camera_from_board = moved_from_right * side.camera_from_board;
        })
    }
}

/// A place for folders of a run. Pictures that sets have in common are rendered once.
pub struct Studio {
    root: tempfile::TempDir,
    pool: PathBuf,
    normals: NormalTable,
}

impl Studio {
    /// Rendered pictures stay in `keep`, where one is given, for the next run. Both must be on one file system.
    pub fn new(keep: Option<&Path>) -> Studio {
        let root = match keep {
            Some(folder) => std::fs::create_dir_all(folder).and_then(|()| tempfile::tempdir_in(folder)),
            None => tempfile::tempdir(),
        };
        let root = root.expect("a folder for pictures");
        let pool = keep.unwrap_or(root.path()).join("pool");
        std::fs::create_dir_all(&pool).expect("a folder");
        Studio { root, pool, normals: NormalTable::new() }
    }

    /// A new folder with the set's pictures in `check`, and in `second` where there is a second board.
    pub fn folder(&self, name: &str, set: &Set) -> PathBuf {
        let folder = self.root.path().join(name);
        self.write(&folder.join("check"), &set.pairs);
        if let Some(second) = &set.second {
            self.write(&folder.join("second"), &second.pairs);
        }
        folder
    }

    /// A new folder with pictures in a folder of it.
    pub fn pairs_folder(&self, name: &str, inner: &str, pairs: &[ExposedPair]) -> PathBuf {
        let folder = self.root.path().join(name);
        self.write(&folder.join(inner), pairs);
        folder
    }

    fn write(&self, folder: &Path, pairs: &[ExposedPair]) {
        for side in ["left", "right"] {
            std::fs::create_dir_all(folder.join(side)).expect("a folder");
        }
        let jobs: Vec<(&ExposedPair, usize)> = pairs.iter().flat_map(|pair| [(pair, 0), (pair, 1)]).collect();
        jobs.par_iter().for_each(|&(pair, side)| {
            let exposure = &pair.sides[side];
            let name = format!("{}/{}.{}", ["left", "right"][side], pair.name, exposure.form.extension());
            std::fs::hard_link(self.pooled(exposure), folder.join(name)).expect("a link");
        });
    }

    fn pooled(&self, exposure: &Exposure) -> PathBuf {
        let mut hasher = DefaultHasher::new();
        exposure.describe().hash(&mut hasher);
        let path = self.pool.join(format!("{:016x}", hasher.finish()));
        if !path.exists() {
            // Written elsewhere and renamed: a run that is cut off leaves no half picture for the next.
            let written = tempfile::NamedTempFile::new_in(self.root.path()).expect("a file");
            std::fs::write(written.path(), exposure.file(&self.normals).expect("a picture")).expect("a file");
            written.persist(&path).expect("a file");
        }
        path
    }
}
