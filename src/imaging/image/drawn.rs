//! Pictures into which a program has drawn the corners that it found.
//!
//! Calibration scripts show what they found (OpenCV's `drawChessboardCorners`), and many save that picture in place of
//! the camera's. A mark covers the pixels that tell where its corner is, and lies where that program believed it to be.
//! In: red, green and blue of a picture. Out: why it is no use. OpenCV draws the first rows in pure red, orange and dark
//! yellow; no photograph has many pixels of just these three values. Goes wrong: marks in files that do not keep every
//! pixel (JPEG), marks that were scaled with the picture, and boards with fewer than three rows of corners.

/// What OpenCV draws the first three rows in, red first; the other way round where a script confused the two orders.
const MARKS: [[u8; 3]; 3] = [[255, 0, 0], [255, 128, 0], [200, 200, 0]];
/// Pixels of each: a row of three marks has some fifty.
const FEWEST: usize = 30;

/// The reason not to measure a picture of samples of `channels` values a pixel, red, green and blue first.
pub(super) fn check(samples: &[u8], channels: usize) -> Result<(), String> {
    let mut counts = [[0usize; 3]; 2];
    for p in samples.chunks_exact(channels) {
        // One of red and blue is zero in all of them, which photographs seldom have.
        if p[0] != 0 && p[2] != 0 {
            continue;
        }
        for (count, mark) in counts[0].iter_mut().zip(MARKS) {
            *count += usize::from([p[0], p[1], p[2]] == mark);
        }
        for (count, mark) in counts[1].iter_mut().zip(MARKS) {
            *count += usize::from([p[2], p[1], p[0]] == mark);
        }
    }
    let are_drawn = counts.iter().any(|counts| counts.iter().all(|count| *count >= FEWEST));
    if are_drawn { Err(DRAWN.to_owned()) } else { Ok(()) }
}

/// Why it is not measured.
pub const DRAWN: &str = "has the corners drawn into it that a program found (in the colours of OpenCV's drawChessboardCorners): the marks cover \
                         what is measured";

#[cfg(test)]
mod tests {
    use super::*;

    /// A grey gradient in red light with so many pixels of each of some colours in it.
    fn picture(colours: &[[u8; 3]], each: usize) -> Vec<u8> {
        let mut samples: Vec<u8> =
            (0..20_000u32).flat_map(|k| [(k % 256) as u8, (k % 199) as u8, (k % 181) as u8]).collect();
        for (k, colour) in colours.iter().enumerate() {
            for i in 0..each {
                samples[3 * (400 * k + i)..][..3].copy_from_slice(colour);
            }
        }
        samples
    }

    #[test]
    fn marks_are_told_in_both_orders_of_colours_and_few_pixels_are_none() {
        let swapped = MARKS.map(|[r, g, b]| [b, g, r]);
        for colours in [MARKS, swapped] {
            assert_eq!(check(&picture(&colours, FEWEST), 3), Err(DRAWN.to_owned()));
            assert_eq!(check(&picture(&colours, FEWEST - 1), 3), Ok(()));
            // Two of the colours are a lamp, a screen.
            assert_eq!(check(&picture(&colours[..2], 300), 3), Ok(()));
        }
        let other = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 0, 255], [255, 255, 0], [0, 255, 255]];
        assert_eq!(check(&picture(&other, 300), 3), Ok(()));
    }

    #[test]
    fn a_fourth_value_a_pixel_is_passed_over() {
        let with_alpha: Vec<u8> = picture(&MARKS, 100).chunks(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
        assert!(check(&with_alpha, 4).is_err());
    }
}
