//! A board to print as PNG: for presses and services that take no PDF.
//!
//! In: a sheet and dots per inch. Out: a grey PNG that says its resolution, and the board's name as a text. Method: a
//! dot is as dark as the share of it that is printed, so that edges lie where they should between dots, too. Goes
//! wrong: a resolution at which the sheet has too many dots.

use png::{BitDepth, ColorType, Encoder, PixelDimensions, Unit};

use super::sheet::Sheet;

const INCH_MM: f64 = 25.4;
/// Most dots of a sheet: A0 at 300 per inch has 140 million.
const MOST_DOTS: f64 = 4e8;
/// Dots per inch of anything that prints.
const DPI: std::ops::RangeInclusive<f64> = 30.0..=4800.0;

impl Sheet {
    /// As PNG of so many dots per inch; why there can be none otherwise.
    pub fn png(&self, dpi: f64) -> Result<Vec<u8>, String> {
        if !DPI.contains(&dpi) {
            return Err(format!("--dpi {dpi} is no number from {} to {}", DPI.start(), DPI.end()));
        }
        let per_mm = dpi / INCH_MM;
        let [columns, rows] = [self.width_mm, self.height_mm].map(|mm| (mm * per_mm).round());
        if columns * rows > MOST_DOTS {
            return Err(format!(
                "{} at {dpi} dots per inch has {:.0} million dots, at most {:.0} are written",
                self.paper,
                columns * rows / 1e6,
                MOST_DOTS / 1e6
            ));
        }
        let (columns, rows) = (columns as usize, rows as usize);
        let dots: Vec<u8> = (0..rows).flat_map(|y| self.row(y, columns, per_mm)).collect();
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, columns as u32, rows as u32);
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Eight);
        let per_metre = (per_mm * 1000.0).round() as u32;
        encoder.set_pixel_dims(Some(PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter }));
        let text = encoder.add_text_chunk("Description".to_owned(), self.foot.clone());
        let written = text.and_then(|()| encoder.write_header()?.write_image_data(&dots));
        written.map_err(|error| error.to_string())?;
        Ok(bytes)
    }

    /// A row of dots. Patches of a colour do not overlap, and white ones lie on black ones.
    fn row(&self, y: usize, columns: usize, per_mm: f64) -> Vec<u8> {
        let mut light = vec![1.0_f64; columns];
        for patch in &self.patches {
            let high = share(y, patch.y * per_mm, (patch.y + patch.height) * per_mm);
            if high == 0.0 {
                continue;
            }
            let (from, to) = (patch.x * per_mm, (patch.x + patch.width) * per_mm);
            let last = (to.ceil().max(0.0) as usize).min(columns);
            for (x, light) in light.iter_mut().enumerate().take(last).skip(from.max(0.0) as usize) {
                *light += high * share(x, from, to) * if patch.is_black { -1.0 } else { 1.0 };
            }
        }
        light.into_iter().map(|light| (255.0 * light.clamp(0.0, 1.0)).round() as u8).collect()
    }
}

/// How much of dot `at` lies between two places.
fn share(at: usize, from: f64, to: f64) -> f64 {
    let at = at as f64;
    (to.min(at + 1.0) - from.max(at)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::Board;
    use crate::imaging::find::corners_in;
    use crate::imaging::image::Image;

    #[test]
    fn corners_of_the_print_are_where_the_board_has_them() {
        for (name, dpi) in
            [("charuco:8x11:20:14:DICT_5X5_100", 150.0), ("charuco:5x8:30.3:21:DICT_APRILTAG_36H11", 96.0)]
        {
            let board: Board = name.parse().unwrap();
            let bytes = Sheet::new(&board).unwrap().png(dpi).unwrap();
            // A camera's blur: edges without any are not what corners are measured by.
            let grey = image::imageops::blur(&image::load_from_memory(&bytes).unwrap().to_luma8(), 0.8);
            let (width, height) = (grey.width() as usize, grey.height() as usize);
            let corners = corners_in(&Image { width, height, pixels: grey.into_raw() }.into(), board).unwrap();
            let measured: Vec<_> = corners.iter().filter(|(_, _, corner)| corner.covariance_px2.is_some()).collect();
            assert!(2 * measured.len() > board.corner_count(), "{name}: {}", measured.len());
            let (first_col, first_row, first) = measured[0];
            for (col, row, corner) in measured {
                let should = (board.corner_mm(col, row) - board.corner_mm(first_col, first_row)) * dpi / INCH_MM;
                let off = (corner.px - first.px) - should.xy();
                // Lengths are true to a ten-thousandth.
                assert!(off.norm() < 1e-4 * board.diagonal_mm() * dpi / INCH_MM, "{name} {col} {row}: {off}");
            }
        }
    }

    #[test]
    fn too_many_dots_are_refused() {
        let sheet = Sheet::new(&"checker:20x20:10".parse().unwrap()).unwrap();
        assert!(sheet.png(2400.0).unwrap_err().contains("million dots"));
        assert!(sheet.png(f64::NAN).unwrap_err().contains("--dpi"));
    }
}
