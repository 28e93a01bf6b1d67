//! Faults that are planted in pictures do what their names say.

use crate::planted_faults::matrix::picture_faults::{PictureFault, Shares};

fn ramp() -> Shares {
    Shares { width: 3, height: 2, values: vec![0.0, 0.1, 0.2, 0.3, 0.4, 0.5] }
}

#[test]
fn four_quarter_turns_and_two_mirrors_change_nothing() {
    let mut turned = ramp();
    turned.suffer(&PictureFault::QuarterTurns(1), 1, 0);
    assert_eq!((turned.width, turned.height, &turned.values[..2]), (2, 3, &[0.3, 0.0][..]));
    turned.suffer(&PictureFault::QuarterTurns(3), 1, 0);
    assert_eq!(turned, ramp());
    (0..2).for_each(|_| turned.suffer(&PictureFault::Mirrored, 1, 0));
    assert_eq!(turned, ramp());
}

#[test]
fn a_picture_of_two_moments_has_every_second_row_of_each() {
    let mut picture = ramp();
    picture.interlace(&Shares { values: vec![1.0; 6], ..ramp() });
    assert_eq!(picture.values, [0.0, 0.1, 0.2, 1.0, 1.0, 1.0]);
}

#[test]
fn sharpening_leaves_even_grey_and_overshoots_at_an_edge() {
    let values: Vec<f32> = (0..40 * 9).map(|k| if k % 40 < 20 { 0.3 } else { 0.6 }).collect();
    let mut picture = Shares { width: 40, height: 9, values };
    picture.suffer(&PictureFault::Sharpened { amount: 1.0, radius_px: 1.0 }, 1, 0);
    let row = &picture.values[160..200];
    assert!((row[5] - 0.3).abs() < 1e-6 && (row[35] - 0.6).abs() < 1e-6);
    // The first pixel beyond the edge keeps what a Gaussian of one px has beyond half a px of it: three tenths of the
    // step.
    assert!((row[20] - 0.6 - 0.09).abs() < 0.02 && (row[19] + row[20] - 0.9).abs() < 1e-6, "{row:?}");
}

#[test]
fn a_hot_column_is_one_column() {
    let mut picture = ramp();
    picture.suffer(&PictureFault::HotColumn { at: 0.5, add: 0.25 }, 1, 0);
    assert_eq!(picture.values, [0.0, 0.35, 0.2, 0.3, 0.65, 0.5]);
}
