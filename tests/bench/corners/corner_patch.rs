//! A corner drawn by brute force: the ideal pattern on a grid eight times finer, spread by summing the point spread
//! function's samples, then averaged over pixels. No error function, on which the fit builds.

/// Fine cells a pixel side. Odd, so that a pixel's middle is a cell's middle.
const FINE: i32 = 9;

/// How the pattern is spread.
#[derive(Clone, Copy)]
pub enum Spread {
    /// Gaussian of this standard deviation, px.
    Gaussian(f64),
    /// Disc of this radius, px, and a Gaussian of 0.5 px.
    Disc(f64),
}

/// The patch's light at `side` x `side` pixels round (0, 0), in [-1, 1], for a corner at `corner`, with edges at
/// `angles`.
pub fn draw(side: i32, corner: (f64, f64), angles: [f64; 2], spread: Spread) -> Vec<f64> {
    let (sigma, disc) = match spread {
        Spread::Gaussian(sigma) => (sigma, 0.0),
        Spread::Disc(radius) => (0.5, radius),
    };
    let reach = ((4.0 * sigma + disc) * f64::from(FINE)).ceil() as i32 + 1;
    let wide = side * FINE + 2 * reach;
    let half = f64::from(side) / 2.0;
    let fine = 1.0 / f64::from(FINE);
    let normals = angles.map(|a| (-a.sin(), a.cos()));
    let place = |i: i32| (f64::from(i - reach) + 0.5) * fine - half;
    let mut cells = vec![0.0; (wide * wide) as usize];
    for j in 0..wide {
        for i in 0..wide {
            // Four points a cell soften the steps of the pattern itself.
            let mut sum = 0.0;
            for (a, b) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                let (x, y) = (place(i) + a * fine - corner.0, place(j) + b * fine - corner.1);
                let sign = |n: (f64, f64)| (n.0 * x + n.1 * y).signum();
                sum += sign(normals[0]) * sign(normals[1]) / 4.0;
            }
            cells[(j * wide + i) as usize] = sum;
        }
    }
    if disc > 0.0 {
        cells = spread_by_disc(&cells, wide, disc * f64::from(FINE));
    }
    let weights = pixel_weights(sigma * f64::from(FINE));
    let cells = rows_to_pixels(&cells, wide, wide, side, reach, &weights);
    transpose(&rows_to_pixels(&transpose(&cells, side, wide), wide, side, side, reach, &weights), side, side)
}

/// Gaussian times box of a pixel, by the offset from the pixel's middle cell.
fn pixel_weights(sigma: f64) -> Vec<(i32, f64)> {
    let reach = (4.0 * sigma).ceil() as i32 + FINE / 2;
    let gauss = |k: i32| (-0.5 * (f64::from(k) / sigma).powi(2)).exp();
    let mut weights: Vec<(i32, f64)> =
        (-reach..=reach).map(|k| (k, (k - FINE / 2..=k + FINE / 2).map(gauss).sum::<f64>())).collect();
    let sum: f64 = weights.iter().map(|w| w.1).sum();
    weights.iter_mut().for_each(|w| w.1 /= sum);
    weights
}

fn rows_to_pixels(cells: &[f64], wide: i32, rows: i32, side: i32, reach: i32, weights: &[(i32, f64)]) -> Vec<f64> {
    let mut out = Vec::with_capacity((side * rows) as usize);
    for j in 0..rows {
        let row = &cells[(j * wide) as usize..((j + 1) * wide) as usize];
        for i in 0..side {
            let middle = reach + i * FINE + FINE / 2;
            let at = |k: i32| row[(middle + k).clamp(0, wide - 1) as usize];
            out.push(weights.iter().map(|&(k, w)| w * at(k)).sum());
        }
    }
    out
}

fn transpose(values: &[f64], wide: i32, rows: i32) -> Vec<f64> {
    (0..wide).flat_map(|i| (0..rows).map(move |j| values[(j * wide + i) as usize])).collect()
}

fn spread_by_disc(cells: &[f64], wide: i32, radius: f64) -> Vec<f64> {
    // Row sums up to each cell make a disc a handful of differences.
    let mut sums = vec![0.0; ((wide + 1) * wide) as usize];
    for j in 0..wide {
        for i in 0..wide {
            sums[(j * (wide + 1) + i + 1) as usize] =
                sums[(j * (wide + 1) + i) as usize] + cells[(j * wide + i) as usize];
        }
    }
    let reach = radius.floor() as i32;
    let mut out = vec![0.0; cells.len()];
    for j in 0..wide {
        for i in 0..wide {
            let (mut sum, mut count) = (0.0, 0.0);
            for dj in -reach..=reach {
                let y = j + dj;
                if y < 0 || y >= wide {
                    continue;
                }
                let half = (radius * radius - f64::from(dj * dj)).sqrt().floor() as i32;
                let (a, b) = ((i - half).max(0), (i + half + 1).min(wide));
                sum += sums[(y * (wide + 1) + b) as usize] - sums[(y * (wide + 1) + a) as usize];
                count += f64::from(b - a);
            }
            out[(j * wide + i) as usize] = sum / count;
        }
    }
    out
}
