//! Blur over the field: how sharp each part of both pictures is, from the corners' own fits.

use maud::{Markup, html};

use super::page;
use super::table::number;
use crate::imaging::{Corner, Corners, Side};
use crate::statistics::median;

/// Cells a side of a picture.
const CELLS: usize = 5;

/// Ratio of the most to the least blurred cell above which the picture is called uneven.
const UNEVEN: f64 = 1.5;

/// Blur (px) below which the pixels' own width limits a corner, and not the lens.
const SHARP_PX: f64 = 1.0;

/// Blur (px) above which a fine edge is lost and sharper pictures would measure better: the fit's scatter grows with
/// its root.
const SOFT_PX: f64 = 1.5;

/// Blur (px) above which pictures are better taken again.
const BLURRED_PX: f64 = 2.5;

/// The section: a table a picture, and what to conclude. Nothing where the corners came without blur.
pub fn section(corners: &Corners) -> Markup {
    let left = medians(corners.pairs.iter().flat_map(|p| &p.left), corners.left_size);
    let right = medians(corners.pairs.iter().flat_map(|p| &p.right), corners.right_size);
    if [&left, &right].iter().all(|cells| cells.iter().all(Option::is_none)) {
        return html! {};
    }
    html! {
        h2 { "Blur over the field" }
        p { "Standard deviation of the edges' blur, px: the median of the corners in each part of the picture, as one looks at it." }
        div.side {
            div { p { (format!("Left picture. {}", conclusion(&left))) } (grid(&left)) }
            div { p { (format!("Right picture. {}", conclusion(&right))) } (grid(&right)) }
        }
    }
}

/// That the pictures are blurred, where most of their edges are.
pub fn warning(corners: &Corners) -> Option<String> {
    let of = |side: Side| {
        let all = corners.pairs.iter().flat_map(|pair| if side == Side::Left { &pair.left } else { &pair.right });
        let blur_px = median(all.filter_map(|corner| corner.blur_px).collect::<Vec<f64>>())?;
        (blur_px > BLURRED_PX).then(|| (side.name(), format!("{blur_px:.1}")))
    };
    let (names, blurs): (Vec<&str>, Vec<String>) = Side::BOTH.into_iter().filter_map(of).unzip();
    (!names.is_empty()).then(|| {
        format!(
            "the {} pictures are blurred: edges by {} px (standard deviation, median), and up to {BLURRED_PX} px is measured well; focus, \
             close the aperture, hold the board still, and photograph again",
            names.join(" and "),
            blurs.join(" and ")
        )
    })
}

/// Median blur of each cell, row by row; `None` where no corner was seen.
fn medians<'a>(corners: impl Iterator<Item = &'a Corner>, (width, height): (u32, u32)) -> Vec<Option<f64>> {
    let mut cells = vec![Vec::<f64>::new(); CELLS * CELLS];
    let index = |at: f64, size: u32| (((at + 0.5) / f64::from(size) * CELLS as f64).max(0.0) as usize).min(CELLS - 1);
    for corner in corners {
        if let Some(blur) = corner.blur_px {
            cells[index(corner.px.y, height) * CELLS + index(corner.px.x, width)].push(blur);
        }
    }
    cells.into_iter().map(median).collect()
}

fn grid(cells: &[Option<f64>]) -> Markup {
    let header: Vec<String> = (1..=CELLS).map(|c| c.to_string()).collect();
    let header: Vec<&str> = std::iter::once("").chain(header.iter().map(String::as_str)).collect();
    let rows = cells.chunks(CELLS).enumerate().map(|(r, cells)| {
        let name = match r {
            0 => "top".to_owned(),
            r if r + 1 == CELLS => "bottom".to_owned(),
            r => format!("row {}", r + 1),
        };
        std::iter::once(name).chain(cells.iter().map(|blur| number(*blur, 2)))
    });
    page::table(&header, rows)
}

fn conclusion(cells: &[Option<f64>]) -> String {
    let known: Vec<f64> = cells.iter().flatten().copied().collect();
    let (least, most) = known.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &v| (a.min(v), b.max(v)));
    if known.is_empty() {
        "No corner was measured in it.".to_owned()
    } else if most > (UNEVEN * least).max(SHARP_PX) {
        format!(
            "From {least:.2} to {most:.2} px: uneven. Blur that grows to one side is a tilted focal plane, to all sides a lens that is \
             open too far or boards beyond its depth of field: stop down or refocus."
        )
    } else if most > SOFT_PX {
        format!(
            "Up to {most:.2} px everywhere: soft. Refocus, stop down or hold the board still, and corners will scatter less."
        )
    } else {
        format!("Even, {least:.2} to {most:.2} px: nothing to do.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::PairCorners;
    use nalgebra::Point2;

    fn corner(x: f64, y: f64, blur_px: Option<f64>) -> Corner {
        Corner { blur_px, ..Corner::at(0, 0, Point2::new(x, y)) }
    }

    #[test]
    fn each_cell_has_its_own_median() {
        let list = [corner(-0.5, -0.5, Some(1.0)), corner(99.4, 49.4, Some(2.0)), corner(50.0, 25.0, None)];
        let cells = medians(list.iter(), (100, 50));
        assert_eq!((cells[0], cells[CELLS * CELLS - 1]), (Some(1.0), Some(2.0)));
        assert_eq!(cells.iter().flatten().count(), 2);
        assert!(conclusion(&cells).contains("uneven"));
        assert!(conclusion(&[Some(0.3), Some(0.9)]).contains("nothing to do"));
    }

    #[test]
    fn a_blurred_camera_is_named_and_a_sharp_one_is_not() {
        let of = |left: f64, right: f64| {
            let side = |blur: f64| (0..9).map(|k| corner(10.0 * f64::from(k), 5.0, Some(blur))).collect();
            let pair = PairCorners { pair: "1".to_owned(), left: side(left), right: side(right) };
            let board = "checker:9x7:20".parse().unwrap();
            let (left_size, right_size) = ((100, 50), (100, 50));
            let (skipped, blind, open, notes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
            warning(&Corners { board, left_size, right_size, pairs: vec![pair], skipped, blind, open, notes })
        };
        for (left, right) in [(0.7, 0.7), (2.4, 1.4)] {
            assert_eq!(of(left, right), None);
        }
        for blur in [2.6, 4.0, 6.0] {
            let said = of(0.7, blur).unwrap();
            assert!(said.starts_with(&format!("the right pictures are blurred: edges by {blur:.1} px")), "{said}");
        }
        assert!(of(3.0, 4.0).unwrap().starts_with("the left and right pictures are blurred: edges by 3.0 and 4.0 px"));
    }

    #[test]
    fn even_soft_and_empty_pictures_are_told_apart() {
        assert!(conclusion(&[Some(0.7), Some(0.8)]).contains("nothing to do"));
        assert!(conclusion(&[Some(2.7), Some(2.8), None]).contains("soft"));
        assert!(conclusion(&[None]).contains("No corner"));
    }
}
