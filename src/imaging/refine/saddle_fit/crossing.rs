//! Where both edges are near: their blurs overlap.

use std::f32::consts::FRAC_1_SQRT_2;
use std::f64::consts::TAU;

use super::model::{COLUMNS, Edge, Light, Model, N};
use super::special::{erf_from, exp_negative};
use super::window::{Group, LANES, Lanes};

/// Beyond this many blurs from the crossing the two edges know nothing of each other: exp(-4.5^2/2) is 4e-5.
const CROSSING_BLURS: f32 = 4.5;

/// What all pixels share in one evaluation.
pub struct Crossing {
    edges: [Edge; 2],
    light: Light,
    /// n_1.n_2 and its change by the first angle (the second's is the opposite).
    correlation: f32,
    correlation_slope: f32,
    /// 1 / sqrt(1 - correlation^2).
    stretch: f32,
    /// sin of each node of the integral over the correlation, -1 / (2 cos^2) of it, and the node's weight times 4
    /// arcsin(correlation) / tau.
    nodes: [(f32, f32, f32); 6],
    /// The same for the correlation itself, with 4 / (tau cos).
    top: (f32, f32, f32),
    /// The sides of both edges where the only dark quadrant is.
    dark: Option<[f32; 2]>,
}

impl Crossing {
    pub fn new(model: &Model) -> Crossing {
        // Gauss-Legendre on [0, 1], six points: good to 1e-5 down to edges 45 degrees apart.
        const NODES: [(f64, f64); 6] = [
            (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
            (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
            (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
            (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
            (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
            (0.966_234_757_101_576, 0.085_662_246_189_585_17),
        ];
        let turn = model.angles_rad[0] - model.angles_rad[1];
        // Edges that nearly coincide are no corner; the bound only keeps the numbers finite until that is noticed.
        let correlation = turn.cos().clamp(-0.99, 0.99);
        let angle = correlation.asin();
        let at = |sin: f64, weight: f64| (sin as f32, (-0.5 / (1.0 - sin * sin)) as f32, weight as f32);
        Crossing {
            edges: [0, 1].map(|k| Edge::of(model, k)),
            light: Light::of(model),
            correlation: correlation as f32,
            correlation_slope: -turn.sin() as f32,
            stretch: (1.0 / (1.0 - correlation * correlation).sqrt()) as f32,
            nodes: NODES.map(|(node, weight)| at((node * angle).sin(), weight * angle * 4.0 / TAU)),
            top: at(correlation, 4.0 / (TAU * angle.cos())),
            dark: model.dark.map(|sides| sides.map(|side| side as f32)),
        }
    }

    /// The parameters' derivatives and the residual for a group of pixels.
    #[inline(always)]
    pub fn columns(&self, group: &Group, columns: &mut [Lanes; COLUMNS]) {
        let edges = [self.edges[0].across(group), self.edges[1].across(group)];
        let Light { level, half_contrast, slope } = self.light;
        let mut other = [edges[1].value, edges[0].value];
        let (mut pattern, mut by_correlation) = ([0.0; LANES], [0.0; LANES]);
        for ((pattern, a), b) in pattern.iter_mut().zip(&edges[0].value).zip(&edges[1].value) {
            *pattern = a * b;
        }
        self.overlap([&edges[0].z, &edges[1].z], &mut pattern, &mut by_correlation, &mut other);
        if let Some([first, second]) = self.dark {
            // Half a crossing, and half of what takes the edges away from the other quadrants.
            for l in 0..LANES {
                let edges = second * edges[0].value[l] + first * edges[1].value[l];
                pattern[l] = 0.5 * (pattern[l] + edges - first * second);
                by_correlation[l] *= 0.5;
                (other[0][l], other[1][l]) = (0.5 * (other[0][l] + second), 0.5 * (other[1][l] + first));
            }
        }
        let mut half = [0.0; LANES];
        for l in 0..LANES {
            let (x, y, weight) = (group.x[l], group.y[l], group.weight[l]);
            let light = weight * (1.0 + slope[0] * x + slope[1] * y);
            let reflected = level + half_contrast * pattern[l];
            half[l] = light * half_contrast;
            columns[6][l] = light;
            columns[7][l] = light * pattern[l];
            columns[8][l] = weight * x * reflected;
            columns[9][l] = weight * y * reflected;
            columns[N][l] = weight * group.grey[l] - light * reflected;
        }
        (columns[0], columns[1]) = ([0.0; LANES], [0.0; LANES]);
        for (k, edge) in edges.iter().enumerate() {
            let turn = if k == 0 { self.correlation_slope } else { -self.correlation_slope };
            let Edge { sin, cos, bend, .. } = self.edges[k];
            for l in 0..LANES {
                let by_u = half[l] * edge.slope[l] * other[k][l];
                let bent = bend * edge.along[l];
                columns[0][l] += by_u * (sin - bent * cos);
                columns[1][l] += by_u * (-cos - bent * sin);
                columns[2 + k][l] = half[l] * by_correlation[l] * turn - by_u * edge.along[l];
                columns[4 + k][l] = -by_u * edge.z[l];
            }
        }
    }

    /// What the edges' correlation changes at places `z` (in blurs from each edge): adds to the product of two
    /// error functions the integral of 4 phi_2(a, b; r) over r from 0 to the correlation, with r = sin t; gives its
    /// derivative by the correlation, and for each edge the integral across the other.
    #[inline(always)]
    fn overlap(&self, z: [&Lanes; 2], pattern: &mut Lanes, by_correlation: &mut Lanes, other: &mut [Lanes; 2]) {
        let near = |l: usize| z[0][l].abs().max(z[1][l].abs()) < CROSSING_BLURS;
        if !(0..LANES).any(near) {
            return;
        }
        let (mut squares, mut product) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            (squares[l], product[l]) = (z[0][l] * z[0][l] + z[1][l] * z[1][l], 2.0 * z[0][l] * z[1][l]);
        }
        for (sin, scale, weight) in self.nodes {
            for l in 0..LANES {
                pattern[l] += weight * exp_negative((squares[l] - product[l] * sin) * scale);
            }
        }
        let (sin, scale, weight) = self.top;
        for l in 0..LANES {
            by_correlation[l] = weight * exp_negative((squares[l] - product[l] * sin) * scale);
        }
        for k in 0..2 {
            for l in 0..LANES {
                let b = (z[1 - k][l] - self.correlation * z[k][l]) * self.stretch;
                other[k][l] = erf_from(b * FRAC_1_SQRT_2, exp_negative(-0.5 * b * b));
            }
        }
    }
}
