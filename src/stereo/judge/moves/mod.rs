//! Slides of the board by known lengths: the scale of the rig against something that is not the board.
//!
//! In: a calibration, and moves that are stated, each with its uncertainty and perhaps the pairs before and after. Out:
//! how far the board moved as the rig measures it, the scale error, and what explains it. Method: the displacement of
//! the board's middle between both poses, with the poses' own covariance and that of the rig which both share; the
//! print moves with the board and cancels. Goes wrong: a board that also turns moves each corner by another length; how
//! far these differ is part of the uncertainty.

mod judged;
mod slide;
mod stated;

#[cfg(test)]
mod tests;

pub use judged::{KnownMove, KnownMoves};
pub use stated::StatedMove;

use self::slide::{Places, Slide};
use crate::stereo::Error;
use crate::stereo::calibrate::Calibration;

/// Where no pairs are named: how far the length may be off, and how much farther or less than the middle a corner may
/// move, as shares of the length. Scales that can be mistaken are within it; boards that are placed anew by hand are
/// not.
const NEAR: f64 = 0.1;

/// Of named pairs: a board whose corners moved by so much more or less than its middle, as a share of the length,
/// turned and did not slide.
const NO_SLIDE: f64 = 0.5;

/// Moves that are listed where none fits.
const LISTED: usize = 4;

/// Refuses moves between pairs that are not there, before pictures are read.
pub fn check_names(stated: &[StatedMove], pairs: &[String]) -> Result<(), Error> {
    let named = stated.iter().filter_map(|stated| stated.between.as_ref()).flatten();
    match named.into_iter().find(|name| !pairs.contains(name)) {
        Some(name) => Err(Error::NoSuchPair { pair: name.clone(), pairs: pairs.to_vec() }),
        None => Ok(()),
    }
}

/// Measures moves that are stated. An error where it is not settled which pairs are meant, or a move is stated twice; a
/// pair that is there and was not used is said in the result.
pub fn measure(calibration: &Calibration, stated: &[StatedMove]) -> Result<KnownMoves, Error> {
    if stated.is_empty() {
        return Ok(KnownMoves::default());
    }
    let places = Places::new(calibration).ok_or_else(Error::undetermined)?;
    let mut moves = KnownMoves::default();
    let mut all: Vec<[usize; 2]> = Vec::new();
    for stated in stated {
        let ends = match &stated.between {
            Some(names) => named(&places, stated, names)?,
            None => Ok(by_look(&places, stated)?),
        };
        match ends {
            Ok(ends) => {
                if all.contains(&ends) || all.contains(&[ends[1], ends[0]]) {
                    return Err(Error::MoveTwice { pairs: places.names(ends) });
                }
                all.push(ends);
                moves.measured.push(KnownMove::new(stated, &places, &places.slide(ends)));
            }
            Err(reason) => moves.missing.push(reason),
        }
    }
    Ok(moves)
}

/// The pairs of these names before and after a move, or, in the inner result, why one of them says nothing.
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

/// The only two pairs in a row between which the board moved by such a length without turning.
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
