//! Between which pairs a move was.

use super::slide::{Places, Slide};
use super::stated::StatedMove;
use crate::stereo::Error;

/// Where no pairs are named: how far the length may be off, and how much farther or less than the middle a corner may move, as shares of the
/// length. Scales that can be mistaken are within it; boards that are placed anew by hand are not.
const NEAR: f64 = 0.1;

/// Of named pairs: a board whose corners moved by so much more or less than its middle, as a share of the length, turned and did not slide.
const NO_SLIDE: f64 = 0.5;

/// Moves that are listed where none fits.
const LISTED: usize = 4;

/// The pairs before and after a move, or, in the inner result, why one of them says nothing. Where they are not named, the only two pairs in a
/// row between which the board moved by such a length without turning.
pub(super) fn pairs(places: &Places, stated: &StatedMove) -> Result<Result<[usize; 2], String>, Error> {
    match &stated.between {
        Some(names) => named(places, stated, names),
        None => by_look(places, stated).map(Ok),
    }
}

fn named(places: &Places, stated: &StatedMove, names: &[String; 2]) -> Result<Result<[usize; 2], String>, Error> {
    let calibration = places.calibration;
    let mut ends = [0; 2];
    for (end, name) in ends.iter_mut().zip(names) {
        if let Some(at) = calibration.views.iter().position(|view| view.pair == *name) {
            *end = at;
        } else if let Some(skipped) = calibration.skipped.iter().find(|skipped| skipped.pair == *name) {
            return Ok(Err(format!(
                "the move of {} mm from pair {} to {} is not measured: pair {name} is not used, {}",
                stated.length_mm, names[0], names[1], skipped.reason
            )));
        } else {
            return Err(Error::NoSuchPair { pair: name.clone(), pairs: calibration.pair_names() });
        }
    }
    let slide = places.slide(ends);
    if slide.half_range_mm() > NO_SLIDE * stated.length_mm {
        let [least, most] = slide.corners_mm;
        return Ok(Err(format!(
            "the move of {} mm from pair {} to {} is not measured: the board turned by {:.1} deg between them, and its corners moved by {least:.1} \
             to {most:.1} mm; it must only slide",
            stated.length_mm,
            names[0],
            names[1],
            slide.turn_rad.to_degrees()
        )));
    }
    Ok(Ok(ends))
}

fn by_look(places: &Places, stated: &StatedMove) -> Result<[usize; 2], Error> {
    let length_mm = stated.length_mm;
    let misfit = |slide: &Slide| (slide.length_mm - length_mm).abs().max(slide.half_range_mm()) / length_mm;
    let count = places.calibration.views.len();
    let mut slides: Vec<Slide> = (1..count).map(|i| places.slide([i - 1, i])).collect();
    slides.sort_by(|a, b| misfit(a).total_cmp(&misfit(b)));
    let fits = slides.iter().take_while(|slide| misfit(slide) <= NEAR).count();
    if fits == 1 {
        return Ok(slides[0].ends);
    }
    slides.truncate(if fits == 0 { LISTED } else { fits });
    let listed = slides.iter().map(|slide| {
        let [a, b] = places.names(slide.ends);
        let turned = slide.turn_rad.to_degrees();
        (format!("{a},{b}"), format!("moved by {:.3} mm, turned by {turned:.3} deg", slide.length_mm))
    });
    Err(Error::MoveUnsettled { length_mm, fits, candidates: listed.collect() })
}
