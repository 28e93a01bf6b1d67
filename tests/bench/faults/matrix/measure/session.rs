//! Pictures of a target at the poses of a robot, the rig's calibration, and a run of `measure` on both.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::super::series::{ExposedPair, series};
use nalgebra::{Matrix3, Point3, Vector3};
use serde_json::Value;
use stereocal::simulate::check_poses::Holding;
use stereocal::simulate::settings::Settings;

use super::super::set::{Plan, Studio};

/// Poses of a session: a centre and samples round it.
const POSES: usize = 14;

/// Spoils files behind the renderer's back.
pub type Spoil = fn(&Path);

/// What is measured, and with what.
pub struct Session {
    /// The rig and the light; the check board is what it is calibrated with.
    pub plan: Plan,
    pub pairs: Vec<ExposedPair>,
    /// Side of the target's squares as typed, mm.
    pub typed_mm: f64,
    /// What somebody did to `calibration.json`.
    pub edit: Option<fn(&mut Value)>,
    /// Files that are spoilt: the pair's place, the side and how.
    pub spoilt: Vec<(usize, usize, Spoil)>,
}

/// A rig calibrated from its own pictures.
pub struct Calibrated {
    json: Value,
}

/// One row of `measurements.csv`.
#[derive(Debug, Clone)]
pub struct Row {
    pub pose: String,
    pub status: String,
    /// The mark point and its covariance, where it was measured.
    pub point: Option<(Vector3<f64>, Matrix3<f64>)>,
}

/// What a run said.
pub struct Measured {
    pub status: Option<i32>,
    pub rows: Vec<Row>,
    /// Warnings, the reasons of poses without a measurement, the message of a run that ended early.
    pub words: Vec<String>,
}

impl Calibrated {
    /// Renders check pictures and runs `camera-check`.
    pub fn new(studio: &Studio, program: &Path, plan: &Plan) -> Calibrated {
        let folder = studio.folder(&format!("rig-{}", plan.settings.seed), &plan.set());
        let typed = plan.settings.check_board;
        let output = Command::new(program)
            .current_dir(&folder)
            .args(["camera-check", "check", "--out", "out", "--squares", &typed.squares.to_string()])
            .args(["--square-mm", &typed.square_mm.to_string()])
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(folder.join("out/calibration.json")).expect("a calibration");
        Calibrated { json: serde_json::from_str(&text).expect("a calibration") }
    }
}

impl Session {
    /// The preset's target before the preset's rig.
    pub fn usual(seed: u64, px: u32) -> Session {
        let plan = Plan::usual(seed, px).pairs(16);
        let small = Settings::small();
        let settings = Settings {
            check_board: small.target_board,
            check_workmanship: small.target_workmanship,
            check_pairs: POSES,
            seed: seed.wrapping_add(31),
            ..plan.settings.clone()
        };
        let holding = Holding {
            tilt_deg: (0.0, 25.0),
            turn_deg: 25.0,
            sideways_mm: 70.0,
            depth_mm: (-50.0, 50.0),
            ..Holding::USUAL
        };
        let mut pairs = series(&settings, &plan.drawing, &holding).expect("the target fits into the field");
        // Names that no count in a message is mistaken for.
        pairs.iter_mut().for_each(|pair| pair.name.insert_str(0, "pose"));
        Session { plan, pairs, typed_mm: settings.check_board.square_mm, edit: None, spoilt: Vec::new() }
    }

    /// The true mark point of a pose, left camera's frame: the mean of the crossings, to which a fit refers the print.
    pub fn mark_point(&self, k: usize) -> Point3<f64> {
        let exposure = &self.pairs[k].sides[0];
        let drawing = exposure.board.drawing;
        let corners = (0..drawing.rows()).flat_map(|row| (0..drawing.columns()).map(move |col| (col, row)));
        let sum: Vector3<f64> = corners.map(|(col, row)| exposure.board.corner_mm(col, row).coords).sum();
        exposure.camera_from_board * Point3::from(sum / drawing.corner_count() as f64)
    }

    /// Changes the pairs of a range of places.
    pub fn pairs_in(mut self, range: std::ops::Range<usize>, change: impl Fn(&mut ExposedPair)) -> Session {
        self.pairs[range].iter_mut().for_each(change);
        self
    }

    fn poses_csv(&self) -> String {
        let mut text = "pose,group,role,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n".to_owned();
        for (k, pair) in self.pairs.iter().enumerate() {
            let role = if k == 0 { "center" } else { "sample" };
            let _ = writeln!(text, "{},A,{role},{k},{},0,10,{},5", pair.name, 2 * k, 3 * k);
        }
        text
    }

    /// Writes the folder and runs `measure` in it.
    pub fn measure(&self, studio: &Studio, program: &Path, rig: &Calibrated, k: usize) -> Measured {
        let folder = self.folder(studio, rig, k);
        let output = Command::new(program)
            .current_dir(&folder)
            .args(["measure", "poses", "--calibration", "calibration.json", "--out", "out"])
            .args(["--square-mm", &self.typed_mm.to_string()])
            .output()
            .expect("the program starts");
        let rows = rows(&folder.join("out/measurements.csv"));
        let json: Option<Value> = std::fs::read_to_string(folder.join("out/measure.json"))
            .ok()
            .and_then(|text| serde_json::from_str(&text).ok());
        let mut words: Vec<String> =
            rows.iter().filter(|row| row.status != "ok").map(|row| format!("{}: {}", row.pose, row.status)).collect();
        let warnings = json.as_ref().and_then(|json| json["warnings"].as_array().cloned()).unwrap_or_default();
        words.extend(warnings.iter().filter_map(|w| w.as_str().map(str::to_owned)));
        if !matches!(output.status.code(), Some(0 | 1)) {
            let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
            words.extend(stderr.lines().filter(|line| !line.trim().is_empty()).map(str::to_owned));
        }
        std::fs::remove_dir_all(&folder).expect("the folder can be removed");
        Measured { status: output.status.code(), rows, words }
    }

    fn folder(&self, studio: &Studio, rig: &Calibrated, k: usize) -> PathBuf {
        let folder = studio.pairs_folder(&format!("measure-{k}"), "poses", &self.pairs);
        std::fs::write(folder.join("poses/poses.csv"), self.poses_csv()).expect("a file");
        let mut json = rig.json.clone();
        if let Some(edit) = self.edit {
            edit(&mut json);
        }
        std::fs::write(folder.join("calibration.json"), json.to_string()).expect("a file");
        for &(pair, side, spoil) in &self.spoilt {
            let exposed = &self.pairs[pair];
            let side_name = ["left", "right"][side];
            let name = format!("poses/{side_name}/{}.{}", exposed.name, exposed.sides[side].form.extension());
            spoil(&folder.join(name));
        }
        folder
    }
}

fn rows(path: &Path) -> Vec<Row> {
    let Ok(mut reader) = csv::Reader::from_path(path) else { return Vec::new() };
    let header = reader.headers().expect("a header").clone();
    let records: Vec<csv::StringRecord> = reader.records().map(|record| record.expect("a row")).collect();
    let row = |record: &csv::StringRecord| {
        let text = |name: &str| header.iter().position(|h| h == name).and_then(|k| record.get(k)).unwrap_or("");
        let number = |name: &str| text(name).parse::<f64>().ok();
        let point = || {
            let point = Vector3::new(number("x_mm")?, number("y_mm")?, number("z_mm")?);
            let s = |name: &str| number(&format!("s{name}_mm2"));
            let (xy, xz, yz) = (s("xy")?, s("xz")?, s("yz")?);
            Some((point, Matrix3::new(s("xx")?, xy, xz, xy, s("yy")?, yz, xz, yz, s("zz")?)))
        };
        Row { pose: text("pose").to_owned(), status: text("status").to_owned(), point: point() }
    };
    records.iter().map(row).collect()
}
