//! How joints stand at many poses, eight of them at a time, and where the target is there: a swarm takes millions of
//! poses.
//!
//! In: sines and cosines of the joints at eight poses, their ways. Out: the flange's rotation and the target's point at
//! each, base frame, the same to the bit as [`super::jacobian::Screws`] has them one pose at a time with its
//! derivatives; or that point alone, carried back from the target, which differs by rounding. Poses lie side by side in
//! arrays, which the compiler works on together (see `crate::widest`); what is not inlined there would be slower.

use nalgebra::{Matrix3, Vector3};

use super::jacobian::{Small, Stance, Turn};

/// Poses that are computed together.
pub const LANES: usize = 8;

/// One number at each of the poses.
pub type Lane = [f64; LANES];

/// Turns at each of the poses with their sines and cosines, from which those of turns near them follow.
#[derive(Debug, Clone)]
pub struct Turns {
    rad: Lane,
    sine: Lane,
    cosine: Lane,
}

impl Turns {
    /// Of one turn a pose.
    pub fn new(turns: [Turn; LANES]) -> Turns {
        Turns { rad: turns.map(|t| t.rad), sine: turns.map(|t| t.sine), cosine: turns.map(|t| t.cosine) }
    }

    /// Of one turn for all poses.
    #[inline(always)]
    pub fn of_one(turn: Turn) -> Turns {
        Turns { rad: [turn.rad; LANES], sine: [turn.sine; LANES], cosine: [turn.cosine; LANES] }
    }

    /// Their sines and cosines.
    #[inline(always)]
    pub fn both(&self) -> [Lane; 2] {
        [self.sine, self.cosine]
    }

    /// Sine and cosine of turns that are all so much further.
    #[inline(always)]
    pub fn further(&self, by: Small) -> [Lane; 2] {
        let (mut sine, mut cosine) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            let turn = Turn { rad: self.rad[l], sine: self.sine[l], cosine: self.cosine[l] };
            (sine[l], cosine[l]) = turn.further(by);
        }
        [sine, cosine]
    }

    /// Sine and cosine of other turns, rad (see [`Turn::sin_cos`]).
    #[inline(always)]
    pub fn sin_cos(&self, rad: &Lane) -> [Lane; 2] {
        let turn = |l: usize| Turn { rad: self.rad[l], sine: self.sine[l], cosine: self.cosine[l] };
        let (mut sine, mut cosine) = ([0.0; LANES], [0.0; LANES]);
        // Asked of all at once: a loop that may call the library's sine is not worked on together.
        let mut all_near = true;
        for (l, rad) in rad.iter().enumerate() {
            all_near &= turn(l).is_near(*rad);
        }
        if all_near {
            for l in 0..LANES {
                (sine[l], cosine[l]) = turn(l).near(rad[l]);
            }
        } else {
            for l in 0..LANES {
                (sine[l], cosine[l]) = turn(l).sin_cos(rad[l]);
            }
        }
        [sine, cosine]
    }
}

/// How a joint stands at each of the poses.
pub type Stances = Stance<Lane>;

impl Stances {
    /// At one of the poses.
    pub fn at(&self, pose: usize) -> Stance {
        let [alpha, beta, turn] = [&self.alpha, &self.beta, &self.turn].map(|both| both.map(|lane| lane[pose]));
        Stance { alpha, beta, turn, shift_mm: self.shift_mm[pose] }
    }
}

/// Carries points back over a joint of this length, mm: from the joint's frame at each of the poses to the one before
/// it. Where a target is takes a third of the work so, without the frame that it stands in.
#[inline(always)]
pub fn back_over(a_mm: f64, joint: &Stances, points_mm: &mut [Lane; 3]) {
    let Stances { alpha: [sa, ca], beta: [sb, cb], turn: [st, ct], shift_mm } = joint;
    let [xs, ys, zs] = points_mm;
    for l in 0..LANES {
        let (x, y, z) = (ct[l] * xs[l] - st[l] * ys[l], st[l] * xs[l] + ct[l] * ys[l], zs[l] + shift_mm[l]);
        let (x, z) = (a_mm + cb[l] * x + sb[l] * z, cb[l] * z - sb[l] * x);
        (xs[l], ys[l], zs[l]) = (x, ca[l] * y - sa[l] * z, sa[l] * y + ca[l] * z);
    }
}

/// The frames that the chain has reached at each of the poses, base frame.
pub struct Frames {
    /// Columns of the rotations, each by its components.
    columns: [[Lane; 3]; 3],
    origin_mm: [Lane; 3],
}

impl Frames {
    /// The base itself.
    pub fn base() -> Frames {
        let column = |axis: usize| std::array::from_fn(|i| [if i == axis { 1.0 } else { 0.0 }; LANES]);
        Frames { columns: std::array::from_fn(column), origin_mm: [[0.0; LANES]; 3] }
    }

    /// Goes on over a joint of this length, mm.
    #[inline(always)]
    pub fn over(&mut self, a_mm: f64, joint: &Stances) {
        let Stances { alpha: [sa, ca], beta: [sb, cb], turn: [st, ct], shift_mm } = joint;
        let [xs, ys, zs] = &mut self.columns;
        for (((xs, ys), zs), origin) in xs.iter_mut().zip(ys).zip(zs).zip(&mut self.origin_mm) {
            for l in 0..LANES {
                let (x, y0, z0) = (xs[l], ys[l], zs[l]);
                let y = ca[l] * y0 + sa[l] * z0;
                let z1 = ca[l] * z0 - sa[l] * y0;
                let x1 = cb[l] * x - sb[l] * z1;
                let z = sb[l] * x + cb[l] * z1;
                origin[l] = (origin[l] + a_mm * x) + shift_mm[l] * z;
                (xs[l], ys[l], zs[l]) = (ct[l] * x1 + st[l] * y, ct[l] * y - st[l] * x1, z);
            }
        }
    }

    /// The target's point at each of the poses, with the target at `tool_mm` in the frame, mm, axis by axis.
    #[inline(always)]
    pub fn target_mm(&self, tool_mm: &Vector3<f64>) -> [Lane; 3] {
        let [x, y, z] = &self.columns;
        let mut target_mm = self.origin_mm;
        for (i, target) in target_mm.iter_mut().enumerate() {
            for l in 0..LANES {
                target[l] += x[i][l] * tool_mm.x + y[i][l] * tool_mm.y + z[i][l] * tool_mm.z;
            }
        }
        target_mm
    }

    /// The rotation at one of the poses.
    #[inline(always)]
    pub fn rotation(&self, pose: usize) -> Matrix3<f64> {
        let [x, y, z] = &self.columns;
        Matrix3::from_fn(|i, j| [x[i][pose], y[i][pose], z[i][pose]][j])
    }
}
