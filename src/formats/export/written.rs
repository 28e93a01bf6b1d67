//! What the formats share: files to be written, numbers and cameras in them.

use crate::formats::checked;
use crate::stereo::{Camera, Error, Lens};

/// Metres in a millimetre.
pub(in crate::formats) const METRE: f64 = 1e-3;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportedFile {
    /// Its name in the results folder.
    pub name: &'static str,
    pub text: String,
}

/// Numbers as text that reads back to the same bits.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    let all: Vec<String> = values.into_iter().map(|v| format!("{v:?}")).collect();
    all.join(", ")
}

/// A matrix as OpenCV's FileStorage has it in YAML, row by row: nalgebra's are transposed for that.
pub fn matrix(name: &str, rows: usize, columns: usize, data: &[f64]) -> String {
    let data = numbers(data.iter().copied());
    format!("{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n")
}

/// A camera whose format tells the lens by the number of its coefficients.
pub(super) fn camera(size: (f64, f64), pinhole: &[f64], distortion: &[f64]) -> Result<Camera, String> {
    checked::camera(size, pinhole, checked::lens_of_length(distortion.len())?, distortion)
}

/// Refuses a lens that a format has no terms for.
pub(super) fn within(format: &'static str, camera: &Camera, most: Lens) -> Result<(), Error> {
    let (lens, name) = (camera.lens, camera.lens.name());
    if lens > most { Err(Error::LensNotExportable { format, lens: name, most: most.name() }) } else { Ok(()) }
}
