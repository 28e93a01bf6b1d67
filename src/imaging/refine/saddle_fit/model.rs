//! The corner as a function of the pixel: two blurred edges that cross, under light with a gradient.
//!
//! With c the corner, p a pixel, u_k its distance from edge k, n_k and t_k the edge's normal and direction:
//!
//! ```text
//! I(p) = (1 + g.(p - p0)) (m + A/2 E(u_1 / s_1, u_2 / s_2))
//! u_k  = n_k.(p - c) + kappa_k/2 (t_k.(p - c))^2
//! E(a, b) = erf(a/sqrt2) erf(b/sqrt2) + 4 (bivariate - product of normal integrals, correlation n_1.n_2)
//! ```
//!
//! E is the sign pattern of two crossing lines under a Gaussian blur: the normal integral's dependence on the
//! correlation is that of Drezner and Wesolowsky (1990). Where only the quadrant on the sides `d_1`, `d_2` of the edges
//! is dark, the corner of a tag that nothing dark touches, E is `(E + d_2 erf(a/sqrt2) + d_1 erf(b/sqrt2) - d_1 d_2) /
//! 2`: the same in that quadrant and on its edges, constant elsewhere.

use nalgebra::Vector2;

use super::special::{erf_from, exp_negative};
use super::window::{Group, LANES, Lanes};
use std::f32::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI};

/// Number of parameters: c (2), edge angles (2), blurs (2), m, A/2, g (2).
pub const N: usize = 10;
/// The parameters' derivatives and the residual.
pub const COLUMNS: usize = N + 1;
/// Least blur, px: that of the box of a pixel alone, 1/sqrt(12). Sharpened pictures would fit less, with a slope that
/// no pixel sees.
pub const LEAST_BLUR_PX: f64 = 0.3;

/// The corner; places relative to the window's start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// The corner, px.
    pub corner: Vector2<f64>,
    /// Directions of the two edges, rad.
    pub angles_rad: [f64; 2],
    /// Blur across the two edges (standard deviation), px.
    pub blur_px: [f64; 2],
    /// Mean of light and dark at the start.
    pub level: f64,
    /// Half of light minus dark at the start; negative where the quadrant between both normals is the dark one.
    pub half_contrast: f64,
    /// Change of the light, as a share per px.
    pub light_slope: Vector2<f64>,
    /// Bend of the two edges, 1/px.
    pub bend: [f64; 2],
    /// The signs of both normals' products in the only dark quadrant; `None` where two are dark.
    pub dark: Option<[f64; 2]>,
}

/// An edge as the loops over pixels take it.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    corner: [f32; 2],
    /// Sine and cosine of its direction.
    pub sin: f32,
    pub cos: f32,
    /// 1 / s, 1/px.
    per_blur: f32,
    /// Bend, 1/px.
    pub bend: f32,
}

/// Grey levels and light as the loops over pixels take them.
#[derive(Debug, Clone, Copy)]
pub struct Light {
    /// Mean of light and dark at the start.
    pub level: f32,
    /// Half of light minus dark at the start.
    pub half_contrast: f32,
    /// Change of the light, as a share per px.
    pub slope: [f32; 2],
}

impl Light {
    pub fn of(model: &Model) -> Light {
        let Model { level, half_contrast, light_slope, .. } = *model;
        let slope = [light_slope.x as f32, light_slope.y as f32];
        Light { level: level as f32, half_contrast: half_contrast as f32, slope }
    }
}

/// One edge and a group of pixels: distance in blurs, place along the edge, and the change of erf per px.
pub struct Across {
    /// u / s.
    pub z: Lanes,
    /// t.(p - c), px.
    pub along: Lanes,
    /// erf(z / sqrt2).
    pub value: Lanes,
    /// Its derivative by u, 1/px.
    pub slope: Lanes,
}

impl Edge {
    pub fn of(model: &Model, k: usize) -> Edge {
        let (sin, cos) = model.angles_rad[k].sin_cos();
        Edge {
            corner: [model.corner.x as f32, model.corner.y as f32],
            sin: sin as f32,
            cos: cos as f32,
            per_blur: (1.0 / model.blur_px[k]) as f32,
            bend: model.bend[k] as f32,
        }
    }

    /// A group of pixels and the edge.
    #[inline(always)]
    pub fn across(&self, group: &Group) -> Across {
        let Edge { corner, sin, cos, per_blur, bend } = *self;
        let zero = [0.0; LANES];
        let mut across = Across { z: zero, along: zero, value: zero, slope: zero };
        for l in 0..LANES {
            let (dx, dy) = (group.x[l] - corner[0], group.y[l] - corner[1]);
            let v = cos * dx + sin * dy;
            across.along[l] = v;
            across.z[l] = (cos * dy - sin * dx + 0.5 * bend * v * v) * per_blur;
        }
        for l in 0..LANES {
            across.slope[l] = exp_negative(-0.5 * across.z[l] * across.z[l]);
        }
        for l in 0..LANES {
            across.value[l] = erf_from(across.z[l] * FRAC_1_SQRT_2, across.slope[l]);
            across.slope[l] *= per_blur * (FRAC_2_SQRT_PI * FRAC_1_SQRT_2);
        }
        across
    }
}

#[cfg(test)]
impl Model {
    /// A corner between unequal edges that are not upright, under uneven light.
    pub fn example() -> Model {
        Model {
            corner: Vector2::new(0.3, -0.2),
            angles_rad: [0.1, 1.3],
            blur_px: [0.9, 1.3],
            level: 120.0,
            half_contrast: 70.0,
            light_slope: Vector2::new(-2e-3, 1.5e-3),
            bend: [1e-3, -2e-3],
            dark: None,
        }
    }
}
