//! The pairs of a source: whole pictures, or pictures that hold both views, beside or above each other, cut into two.
//!
//! In: folders of whole pictures, or pictures of even width or height. Out: pairs of pictures of half of it in the
//! pictures' own depth and colours, PNG, among the program's own files in the results folder. Goes wrong: an odd width
//! or height. A picture that cannot be decoded stays as it is, and its reader says why.

use camino::{Utf8Path, Utf8PathBuf};
use rayon::prelude::*;

use super::folders::the_pictures;
use super::listing::list;
use super::names::{natural_order, stem};
use super::{Halves, PairFiles, Pairing, Source};
use crate::diagnostic::count;
use crate::files::OutDir;
use crate::imaging::image::raster::{Raster, Samples};
use crate::imaging::image::{self, Claim};
use crate::imaging::{Error, Result, Side};

impl Source<'_> {
    /// Finds the pairs. At least one, else an error that says what was there. Halves of pictures are written among the
    /// program's own files in `out`.
    pub fn pairs(&self, out: &OutDir) -> Result<Pairing> {
        self.halves.map_or_else(|| self.whole_pictures(), |halves| split(self, halves, out))
    }
}

/// Cuts the pictures of the folder, or of the only one below that holds any.
fn split(source: &Source<'_>, halves: Halves, out: &OutDir) -> Result<Pairing> {
    let mut folder = the_pictures(source, list(source.images)?)?;
    folder.pictures.sort_by(|a, b| natural_order(stem(a), stem(b)));
    if let Some(two) = folder.pictures.windows(2).find(|two| stem(&two[0]) == stem(&two[1])) {
        let (pair, first, second) = (stem(&two[0]).to_owned(), two[0].clone(), two[1].clone());
        return Err(Error::SameName { pair, first, second });
    }
    let pairs = folder.pictures.par_iter().map(|path| one(path, halves, out)).collect::<Result<Vec<PairFiles>>>()?;
    let [left, right] = halves.words();
    let taken =
        format!("{}: the {left} and the {right} half of each picture in {}", count(pairs.len(), "pair"), folder.path);
    Ok(Pairing { place: source.images.to_owned(), pairs, taken, aside: folder.aside, ..Pairing::default() })
}

fn one(path: &Utf8PathBuf, halves: Halves, out: &OutDir) -> Result<PairFiles> {
    let pair = stem(path).to_owned();
    let Ok(whole) = read(path) else { return Ok(PairFiles { pair, left: path.clone(), right: path.clone() }) };
    let px = if halves == Halves::SideBySide { whole.width } else { whole.height };
    if px % 2 == 1 {
        return Err(Error::NoHalves { path: path.clone(), px, way: (halves.extent(), halves.flag()) });
    }
    let write = |side: Side| {
        let name = format!(".stereocal/halves/{}/{pair}.png", side.name());
        let png = half(&whole, halves, side).png();
        png.map_or(Ok(path.clone()), |png| out.write_scratch(&name, &png).map(|()| out.join(&name)))
    };
    Ok(PairFiles { left: write(Side::Left)?, right: write(Side::Right)?, pair })
}

fn read(path: &Utf8Path) -> std::result::Result<Raster, String> {
    let header = image::header(path)?;
    let _claim = Claim::wait(&header);
    Raster::read(path, &header, None)
}

/// One half of a picture whose extent there is even.
fn half(whole: &Raster, halves: Halves, side: Side) -> Raster {
    // Both views above each other are two runs of samples; beside each other, two runs in each row.
    let (width, height, lines) = match halves {
        Halves::SideBySide => (whole.width / 2, whole.height, 1),
        Halves::TopBottom => (whole.width, whole.height / 2, whole.height / 2),
    };
    let run = width * lines * whole.channels;
    let samples = match &whole.samples {
        Samples::Eight(v) => Samples::Eight(every_other(v, run, side)),
        Samples::Sixteen(v) => Samples::Sixteen(every_other(v, run, side)),
    };
    Raster { width, height, channels: whole.channels, samples }
}

fn every_other<T: Copy>(samples: &[T], run: usize, side: Side) -> Vec<T> {
    samples.chunks_exact(run).skip(side as usize).step_by(2).flatten().copied().collect()
}
