//! The Cramer-Rao bound of a corner beside markers: of the pixels that are nearer to its edges than to anything else.
//!
//! In: a picture's case and a corner. Out: the least covariance that any unbiased fit has of a place whose edges'
//! directions and blurs, grey levels and gradient of the light are not known (how the edges bend is), from pixels three
//! blurs away from the next edges and from the markers, as far on either side as the nearer neighbour. Photon noise,
//! read noise and rounding as the renderer makes them.

use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};
use statrs::function::erf::erf;
use stereocal::imaging::Board;
use stereocal::imaging::board::{Kind, Layout};

use super::case::{Case, LIGHTING, PRINT, SIZE};

/// How far what a square holds stays from its edges, in sides of a square or tag.
pub fn margin(case: &Case) -> f64 {
    match case.board.kind {
        Kind::Checker => panic!("a board with markers"),
        Kind::Charuco { marker_mm, .. } => (1.0 - marker_mm / case.board.square_mm) / 2.0,
        Kind::Tags { family, .. } if case.board.is_grid() => 1.0 / (family.bits() + 2) as f64,
        Kind::Tags { family, .. } => 2.0 / (family.bits() + 4) as f64,
    }
}

/// Where a place of the board's plane near a corner lies in the picture, sides of a square or tag from it.
pub fn beside(case: &Case, (col, row): (usize, usize), x: f64, y: f64) -> Point2<f64> {
    let mut at = case.board.corner_mm(col, row);
    at.x += x * case.board.square_mm;
    at.y += y * case.board.square_mm;
    case.camera.project(&(case.camera_from_board * at))
}

/// Px a side of a square, along its columns and its rows, at a place near a corner.
fn along(case: &Case, corner: (usize, usize), x: f64, y: f64) -> Matrix2<f64> {
    let h = 1e-3;
    let step =
        |dx: f64, dy: f64| (beside(case, corner, x + dx, y + dy) - beside(case, corner, x - dx, y - dy)) / (2.0 * h);
    Matrix2::from_columns(&[step(h, 0.0), step(0.0, h)])
}

/// How far apart lines of the board that lie one side apart are in the picture, px: across x, and across y.
fn across(along: &Matrix2<f64>) -> [f64; 2] {
    let area = along.determinant().abs();
    [area / along.column(1).norm(), area / along.column(0).norm()]
}

/// The least distance of a corner's edges from what is beside them, as it is seen, px.
pub fn margin_px(case: &Case, (col, row): (usize, usize)) -> f64 {
    let [x, y] = across(&along(case, (col, row), 0.0, 0.0));
    margin(case).min(case.board.pitch().least()) * x.min(y)
}

/// The least covariance, px^2. `None` where hardly a pixel is left.
pub fn bound(case: &Case, (col, row): (usize, usize)) -> Option<Matrix2<f64>> {
    let board = &case.board;
    let blur_px = case.blur_px.hypot(0.29);
    let corner = beside(case, (col, row), 0.0, 0.0);
    let here = along(case, (col, row), 0.0, 0.0);
    let light = LIGHTING.at(&corner, &case.camera);
    let normals = [1, 0].map(|k| {
        let edge = here.column(k).normalize();
        let normal = Vector2::new(-edge.y, edge.x);
        normal * normal.dot(&here.column(1 - k)).signum()
    });
    // The window reaches as far as the nearer of a corner's neighbours.
    let half = |line: usize| board.pitch().after(line as isize).min(board.pitch().after(line as isize - 1));
    let (half_x, half_y) = (half(col), half(row));
    let layout = board.layouts().first().copied().unwrap_or(Layout::New);
    let holds_marker = |x: f64, y: f64| {
        let square = |line: usize, at: f64| line as isize + isize::from(at > 0.0);
        layout.holds_marker(square(col, x), square(row, y))
    };
    let is_free = |x: f64, y: f64| {
        let [across_x, across_y] = across(&along(case, (col, row), x, y));
        let (halo_x, halo_y) = (3.0 * blur_px / across_x, 3.0 * blur_px / across_y);
        let beside_marker = |at: f64, halo: f64| at.abs() < margin(case) - halo;
        let is_inside = x.abs() < half_x - halo_x && y.abs() < half_y - halo_y;
        is_inside && (!holds_marker(x, y) || beside_marker(x, halo_x) || beside_marker(y, halo_y))
    };
    // On which sides of the edges the only dark quadrant is; the normals point along the columns and the rows.
    let dark = board.is_grid().then(|| Board::outwards(col, row)).map(|[right, down]| [-right, -down]);
    let to_board = here.try_inverse()?;
    let sensor = case.sensor();
    let reach = (2.0 * here.norm()).ceil().min(250.0) as i32;
    let mut information = SMatrix::<f64, 10, 10>::zeros();
    for (i, j) in (-reach..=reach).flat_map(|j| (-reach..=reach).map(move |i| (i, j))) {
        let px = Point2::new(corner.x.round() + f64::from(i), corner.y.round() + f64::from(j));
        let off = px - corner;
        let u = normals.map(|normal| normal.dot(&off) / blur_px);
        let in_picture = px.iter().all(|v| (0.0..f64::from(SIZE)).contains(v));
        if !in_picture || u.iter().all(|u| u.abs() > 4.0) {
            continue;
        }
        // By the map at the corner first, then by what that misses.
        let mut at = to_board * off;
        for _ in 0..3 {
            at -= along(case, (col, row), at.x, at.y).try_inverse()? * (beside(case, (col, row), at.x, at.y) - px);
        }
        if !is_free(at.x, at.y) {
            continue;
        }
        let [e, f] = u.map(|u| erf(u / 2f64.sqrt()));
        let [de, df] = u.map(|u| (2.0 / std::f64::consts::PI).sqrt() * (-u * u / 2.0).exp() / blur_px);
        // Of a corner with one dark quadrant: the pattern, and what the other edge lets be seen of each.
        let (pattern, [by_e, by_f]) = match dark {
            None => (e * f, [f, e]),
            Some([a, b]) => (0.5 * (e * f + b * e + a * f - a * b), [0.5 * (f + b), 0.5 * (e + a)]),
        };
        let half_contrast = (PRINT.white - PRINT.black) / 2.0 * light;
        let scale = half_contrast * sensor.top();
        let slope = (normals[0] * de * by_e + normals[1] * by_f * df) * scale;
        // Turns move an edge by the place along it, blurs by the place across.
        let lengthwise = [0, 1].map(|k| Vector2::new(normals[k].y, -normals[k].x).dot(&off) / f64::from(reach));
        let turns = [de * by_e * lengthwise[0], by_f * df * lengthwise[1]].map(|turn| turn * scale);
        let blurs = [de * by_e * u[0], by_f * df * u[1]].map(|blur| blur * scale);
        let light_slope = off / f64::from(reach) * scale;
        let row = SVector::from([
            slope.x,
            slope.y,
            turns[0],
            turns[1],
            blurs[0],
            blurs[1],
            scale,
            pattern * scale,
            light_slope.x,
            light_slope.y,
        ]);
        let darker = match dark {
            Some([a, b]) => -a * b * pattern,
            None if holds_marker(1.0, 1.0) || holds_marker(-1.0, -1.0) => e * f,
            None => -e * f,
        };
        let value = (PRINT.white + PRINT.black) / 2.0 * light + half_contrast * darker.abs() * darker.signum();
        let shot = value * sensor.top().powi(2) / sensor.full_well_e;
        let variance = shot + case.noise.powi(2) + 1.0 / 12.0;
        information += row * row.transpose() / variance;
    }
    let covariance = information.cholesky()?.inverse();
    Some(covariance.fixed_view::<2, 2>(0, 0).into_owned())
}
