//! Where a function of one number that falls goes through zero.
//!
//! In: two ends, how near is near enough, and the function. Out: the place between them; an end where the function does
//! not change sign. Inverse quadratic interpolation where it can be trusted, halving elsewhere (Chandrupatla,
//! Advances in Engineering Software 28, 1997): halving alone takes forty looks where this takes ten.

/// Looks at the most; halvings alone reach the last digit in fewer.
const MOST: usize = 100;

/// The place where `value` goes from above zero to below, to `within` of it.
pub fn crossing(low: f64, high: f64, within: f64, mut value: impl FnMut(f64) -> f64) -> f64 {
    // The newest end, the one across from it, and the end that the newest took the place of.
    let (mut newest, mut across) = ((high, value(high)), (low, value(low)));
    if across.1 <= 0.0 || across.1.is_nan() {
        return low;
    }
    if newest.1 > 0.0 {
        return high;
    }
    let mut share = 0.5;
    for _ in 0..MOST {
        let at = newest.0 + share * (across.0 - newest.0);
        let here = (at, value(at));
        let before;
        if (here.1 > 0.0) == (newest.1 > 0.0) {
            before = newest;
        } else {
            (before, across) = (across, newest);
        }
        newest = here;
        let least = 0.5 * within / (across.0 - newest.0).abs();
        if newest.1 == 0.0 || least >= 0.5 {
            break;
        }
        share = interpolated(newest, across, before).unwrap_or(0.5).clamp(least, 1.0 - least);
    }
    if newest.1.abs() <= across.1.abs() { newest.0 } else { across.0 }
}

/// How far on the way from the newest end to the one across the function is zero, by the quadratic through three ends;
/// `None` where that is not to be trusted.
fn interpolated(newest: (f64, f64), across: (f64, f64), before: (f64, f64)) -> Option<f64> {
    let [(a, at_a), (b, at_b), (c, at_c)] = [newest, across, before];
    let (place, rise) = ((a - b) / (c - b), (at_a - at_b) / (at_c - at_b));
    if !(rise * rise < place && (1.0 - rise) * (1.0 - rise) < 1.0 - place) {
        return None;
    }
    let of_across = at_a / (at_b - at_a) * at_c / (at_b - at_c);
    let of_before = (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b);
    Some(of_across + of_before).filter(|share| share.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_to_its_last_digits_in_few_looks() {
        let functions: [(&dyn Fn(f64) -> f64, f64); 5] = [
            (&|x| 3.7 - x, 3.7),
            (&|x| 2.0f64.powi(-9) - x.powi(9), 0.5),
            (&|x: f64| 1.0 - x.ln(), std::f64::consts::E),
            // A step, as of a rank among few numbers.
            (&|x| if x < 7.25 { 1.0 } else { -1.0 }, 7.25),
            (&|x| (-x).exp() - 1e-4, 1e4f64.ln()),
        ];
        for (k, (function, place)) in functions.into_iter().enumerate() {
            let mut looks = 0;
            let found = crossing(1e-6, 1e3, 1e-12, |x| {
                looks += 1;
                function(x)
            });
            assert!((found - place).abs() <= 1e-12, "{k}: {found} for {place}");
            assert!(looks < 60, "{k}: {looks} looks");
        }
    }

    #[test]
    fn where_nothing_changes_sign_it_is_an_end() {
        assert_eq!(crossing(1.0, 2.0, 1e-9, |_| -1.0), 1.0);
        assert_eq!(crossing(1.0, 2.0, 1e-9, |_| 1.0), 2.0);
        assert_eq!([0.0, f64::NAN].map(|nothing| crossing(1.0, 2.0, 1e-9, |_| nothing)), [1.0, 1.0]);
    }
}
