//! `measurements.csv` and `measure.json`: what was measured at every robot pose, as files.

use std::fmt::Write as _;

use nalgebra::{Point3, Vector3};
use serde::Serialize;
use serde_json::{Value, json};

use crate::geometry::rotation_vector;
use crate::imaging::{Board, Corners};
use crate::linear_algebra::rows;
use crate::measurements::{pose_fields, pose_header, quoted};
use crate::statistics::median;
use crate::stereo::board_pose::rig_change::cause::Explanation;
use crate::stereo::board_pose::rig_change::judgement::Judgement;
use crate::stereo::board_pose::{Knowledge, MeasuredPose, Series, Shape, Shared, TargetPose};
use crate::stereo::pairs::flip::Flip;
use crate::stereo::volume::Volume;

/// Columns behind the joints.
const COLUMNS: &str = "x_mm,y_mm,z_mm,sxx_mm2,sxy_mm2,sxz_mm2,syy_mm2,syz_mm2,szz_mm2,rx_rad,ry_rad,rz_rad,fit_rms_mm,corners,status,\
srxrx_rad2,srxry_rad2,srxrz_rad2,sryry_rad2,sryrz_rad2,srzrz_rad2";

/// Upper triangle of a 3x3 matrix, row by row.
const UPPER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Order of the rows of a sensitivity, as in `measurements.csv`.
const ORDER: [&str; 6] = ["x_mm", "y_mm", "z_mm", "rx_rad", "ry_rad", "rz_rad"];

/// Corners that scatter this many times as far as at the calibration are worth a warning.
const UNUSUAL_NOISE: f64 = 2.0;

/// Poses that disagree with one rig by this many times chance are worth a warning.
const UNUSUAL_EXCESS: f64 = 2.25;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasureFile {
    /// Crossings of the target in a row.
    #[serde(skip)]
    pub columns: usize,
    board: String,
    square_mm: f64,
    /// Poses in the list, and poses measured.
    pub poses: usize,
    /// See `poses`.
    pub measured: usize,
    rig: Value,
    /// Chi-square a number over all poses, against the calibration's noise where that is known.
    chi_square: Option<f64>,
    /// Standard deviation of a corner's coordinate, px.
    pub corner_noise_px: Option<f64>,
    /// Up to how far the calibration and the target's print let expect, px.
    pub calibration_noise_px: Option<f64>,
    /// Root mean square over the poses of the corners' distance from the fitted board, mm.
    pub fit_rms_mm: Option<f64>,
    /// Root mean square over the poses of the 2-D residuals, px.
    pub reprojection_rms_px: Option<f64>,
    /// Median standard deviation of the mark point along x, y, z, mm.
    pub sigma_mm: Option<[f64; 3]>,
    results: Vec<Value>,
    missing: Vec<Value>,
    /// What a person should look at.
    pub warnings: Vec<String>,
    target_shape: Option<Value>,
    shared: Option<Value>,
    /// True where neither the corners' scatter nor the poses' disagreement is beyond what was known before.
    #[serde(skip)]
    pub chi_square_is_usual: bool,
}

impl MeasureFile {
    pub fn new(series: &Series, corners: &Corners, known: &Knowledge) -> MeasureFile {
        let (board, rig) = (&known.board, &known.rig);
        let targets: Vec<&TargetPose> = series.poses.iter().filter_map(|m| m.target.as_ref().ok()).collect();
        let rms = |of: fn(&TargetPose) -> Option<f64>| {
            let squares = targets.iter().filter_map(|t| of(t)).map(|value| value * value);
            crate::stereo::data::residuals::root_mean_square(squares)
        };
        let sigma = |axis: usize| median(targets.iter().map(|t| t.covariance[(3 + axis, 3 + axis)].sqrt()));
        let missing = |m: &MeasuredPose| Some(json!({"pose": m.at.pose, "reason": m.target.as_ref().err()?.reason}));
        let mut warnings = corners.notes.clone();
        warnings.extend(series.notes.iter().cloned());
        warnings.extend(series.judgement.describe(rig, board));
        warnings.extend(outside(series, known));
        warnings.extend(scatter(series));
        warnings.extend(grown(series));
        MeasureFile {
            columns: board.columns(),
            board: board.squares.to_string(),
            square_mm: board.square_mm,
            poses: series.poses.len(),
            measured: targets.len(),
            rig: rig_record(series, known),
            chi_square: series.chi_square,
            corner_noise_px: series.noise_px,
            calibration_noise_px: series.usual_px,
            fit_rms_mm: rms(|t| t.fit_rms_mm),
            reprojection_rms_px: rms(|t| Some(t.rms_px)),
            sigma_mm: sigma(0).zip(sigma(1)).zip(sigma(2)).map(|((x, y), z)| [x, y, z]),
            results: series.poses.iter().map(row).collect(),
            missing: series.poses.iter().filter_map(missing).collect(),
            warnings,
            target_shape: series.shape.as_ref().map(|shape| shape_record(shape, board)),
            shared: series.shared.as_ref().map(|shared| shared_record(shared, &series.poses)),
            chi_square_is_usual: series.chi_square.is_some_and(|chi| chi <= UNUSUAL_NOISE * UNUSUAL_NOISE)
                && series.excess <= UNUSUAL_EXCESS * series.usual_excess,
        }
    }
}

fn rig_record(series: &Series, known: &Knowledge) -> Value {
    let (board, rig) = (&known.board, &known.rig);
    let (state, changes, moved_before) = match &series.judgement {
        Judgement::Agrees => ("agrees", &[][..], None),
        Judgement::Allowed(changed) => ("allowed", &changed.explanations[..], None),
        Judgement::Contradicts(changed) => ("contradicts", &changed.explanations[..], None),
        Judgement::OtherWayRound(Flip::Exchanged) => ("exchanged", &[][..], None),
        Judgement::OtherWayRound(_) => ("mirrored", &[][..], None),
        // The first pose after the rig moved.
        Judgement::Moved { since, .. } => ("moved", &[][..], Some(since)),
        Judgement::Loose { .. } => ("loose", &[][..], None),
        Judgement::Unexplained { .. } => ("unexplained", &[][..], None),
    };
    let change = |e: &Explanation| json!({"what": e.describe(rig, board), "amount": e.amount, "unit": e.cause.unit(), "sigma": e.sigma});
    json!({
        "state": state,
        "statement": series.judgement.describe(rig, board),
        // What whoever uses the points has to know.
        "doubt": series.judgement.doubt(rig, board, known.tolerance_mm),
        // Of the calibration and of the target's size.
        "chi_square": series.prior_chi_square.map(|c| c[0]),
        "degrees_of_freedom": series.prior_chi_square.map(|c| c[1]),
        // How much larger the poses' disagreement with the common rig is than chance; and at the calibration, in units
        // of the noise here.
        "excess": series.excess,
        "usual_excess": series.usual_excess,
        "changes": changes.iter().map(change).collect::<Vec<_>>(),
        "moved_before": moved_before,
    })
}

fn row(m: &MeasuredPose) -> Value {
    let target = m.target.as_ref();
    json!({
        "pose": m.at.pose,
        "status": target.map_or_else(|refusal| refusal.status, |_| "ok"),
        "reason": target.err().map(|refusal| &refusal.reason),
        "chi_square": target.ok().map(|t| t.chi_square),
        "corners": target.map_or(0, |t| t.corners),
        "outliers": target.map_or(0, |t| t.outliers),
    })
}

fn shape_record(shape: &Shape, board: &Board) -> Value {
    let crossing = |(k, (d, s)): (usize, (&Vector3<f64>, &Vector3<f64>))| {
        let (col, row) = board.place(k);
        json!({
            "col": col, "row": row, "dx_mm": d.x, "dy_mm": d.y, "dz_mm": d.z,
            "sigma_x_mm": s.x, "sigma_y_mm": s.y, "sigma_z_mm": s.z,
        })
    };
    let crossings = shape.deviations_mm.iter().zip(&shape.sigma_mm).enumerate().map(crossing);
    let mut record = json!({
        // How far crossings scatter: a coordinate in the plane, and the height.
        "in_plane_mm": shape.in_plane_mm,
        "out_of_plane_mm": shape.out_of_plane_mm,
        // Size against the drawing, minus one.
        "scale_error": shape.stretch[0],
        "scale_error_sigma": shape.stretch[1],
        "crossings": crossings.collect::<Vec<_>>(),
    });
    if board.is_grid() {
        // By how much each side of a tag is printed farther out than it is drawn.
        let outwards = |(k, d): (usize, &Vector3<f64>)| {
            let (col, row) = board.place(k);
            let [right, down] = Board::outwards(col, row);
            (right * d.x + down * d.y) / 2.0
        };
        let own_mm = shape.deviations_mm.iter().enumerate().map(outwards).sum::<f64>() / board.corner_count() as f64;
        record["spread_mm"] = json!(board.spread_mm() + own_mm);
    }
    record
}

/// `covariance` is `order by order` of `parameters`; a pose's part of it is `sensitivity * covariance * sensitivity'`,
/// rows in the order of `rows`, columns in that of `parameters`.
fn shared_record(shared: &Shared, poses: &[MeasuredPose]) -> Value {
    let of = |m: &MeasuredPose| {
        let mut sensitivity = rows(&m.target.as_ref().ok()?.sensitivity);
        // Turns stand first inside, points in files.
        sensitivity.rotate_left(3);
        Some(json!({"pose": m.at.pose, "sensitivity": sensitivity}))
    };
    json!({
        "parameters": shared.parameters,
        // Found, minus calibrated or drawn.
        "change": shared.change,
        "covariance": rows(&shared.covariance),
        "rows": ORDER,
        "poses": poses.iter().filter_map(of).collect::<Vec<_>>(),
    })
}

/// Pictures whose corners scatter more than the calibration's did.
fn scatter(series: &Series) -> Option<String> {
    let (here, usual) = (series.noise_px?, series.usual_px?);
    (here > UNUSUAL_NOISE * usual).then(|| {
        format!("the corners scatter by {here:.4} px, {:.1} times as far as at the calibration ({usual:.4} px): out of focus, badly lit, or in motion", here / usual)
    })
}

/// Poses outside of the volume that the calibration's verdict is for.
fn outside(series: &Series, known: &Knowledge) -> Option<String> {
    /// Share of the depth, and angle, by which a target may stand beyond the boards: what a lens does changes little
    /// over it.
    const BEYOND: f64 = 0.25;
    const BEYOND_DEG: f64 = 15.0;
    /// Poses that are named.
    const NAMED: usize = 5;
    let volume = known.volume.as_ref()?;
    let [near, far] = volume.depth_mm;
    let [x0, x1, y0, y1] = volume.tilt_deg;
    let wider = Volume { depth_mm: [near * (1.0 - BEYOND), far * (1.0 + BEYOND)], ..volume.clone() };
    let is_outside = |m: &&MeasuredPose| {
        let Ok(target) = &m.target else { return false };
        let pose = &target.cam_from_board;
        let normal = pose.rotation * Vector3::z();
        let [about_x, about_y] = [1, 0].map(|axis: usize| normal[axis].atan2(normal.z).to_degrees());
        let within = |angle: f64, low: f64, high: f64| (low - BEYOND_DEG..=high + BEYOND_DEG).contains(&angle);
        !wider.holds(&known.rig, &Point3::from(pose.translation.vector))
            || !within(about_x, x0, x1)
            || !within(about_y, y0, y1)
    };
    let poses: Vec<&str> = series.poses.iter().filter(is_outside).map(|m| m.at.pose.as_str()).collect();
    let named = poses.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ");
    let more = if poses.len() > NAMED { format!(" and {} more", poses.len() - NAMED) } else { String::new() };
    (!poses.is_empty()).then(|| {
        format!(
            "outside of where the boards were at the calibration ({near:.0} to {far:.0} mm away, tilted by {x0:.0} to {x1:.0} and {y0:.0} to {y1:.0} deg), \
             where the rig was not checked: {named}{more}; calibrate with the board where the target stands, and as it is tilted"
        )
    })
}

/// Poses that fit worse than chance allows.
fn grown(series: &Series) -> Vec<String> {
    /// Chi-square a number of some fifty: beyond chance, not beyond use.
    const NOTED: f64 = 2.0;
    let noted = |m: &MeasuredPose| {
        let t = m.target.as_ref().ok()?;
        (t.chi_square > NOTED).then(|| {
            let (pose, times) = (&m.at.pose, t.chi_square.sqrt());
            format!("pose {pose} fits {times:.1} times as badly as the others: its covariance is larger for it")
        })
    };
    let mut all: Vec<String> = series.poses.iter().filter_map(noted).collect();
    if series.excess > UNUSUAL_EXCESS * series.usual_excess {
        all.push(format!(
            "the poses disagree with one common rig {:.1} times as much as the corners' scatter allows: covariances are larger for it",
            series.excess.sqrt()
        ));
    }
    all
}

/// `measurements.csv`: one row a pose in the order of the list; numbers are empty where there is no measurement.
pub fn to_csv(measured: &[MeasuredPose]) -> String {
    let mut text = format!("{},{COLUMNS}\n", pose_header(measured.first().map(|m| &m.at)));
    for m in measured {
        text.push_str(&pose_fields(&m.at));
        match &m.target {
            Ok(t) => {
                let p = t.cam_from_board.translation.vector;
                let r = rotation_vector(&t.cam_from_board);
                let point = UPPER.map(|(i, j)| t.covariance[(3 + i, 3 + j)]);
                for number in [p.x, p.y, p.z].into_iter().chain(point).chain([r.x, r.y, r.z]) {
                    let _ = write!(text, ",{number}");
                }
                let fit_rms_mm = t.fit_rms_mm.map_or_else(String::new, |mm| mm.to_string());
                let _ = write!(text, ",{fit_rms_mm},{},ok", t.corners);
                for (i, j) in UPPER {
                    let _ = write!(text, ",{}", t.covariance[(i, j)]);
                }
                text.push('\n');
            }
            Err(refusal) => {
                let said = format!("{}: {}", refusal.status, refusal.reason);
                let _ = writeln!(text, "{},{}{}", ",".repeat(14), quoted(&said), ",".repeat(6));
            }
        }
    }
    text
}
