//! Blur over the field: how sharp each part of both pictures is, from the corners' own fits.

use maud::{Markup, html};

use super::page;
use super::table::number;
use crate::imaging::{Corner, Corners};
use crate::statistics::median;

/// Cells a side of a picture.
const CELLS: usize = 5;

/// Ratio of the most to the least blurred cell above which the picture is called uneven.
const UNEVEN: f64 = 1.5;

/// Blur (px) above which a fine edge is lost and sharper pictures would measure better: the fit's scatter grows with its root.
const SOFT_PX: f64 = 1.5;

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
    let row = |(r, cells): (usize, &[Option<f64>])| {
        let name = match r {
            0 => "top".to_owned(),
            r if r + 1 == CELLS => "bottom".to_owned(),
            r => format!("row {}", r + 1),
        };
        std::iter::once(name).chain(cells.iter().map(|blur| number(*blur, 2))).collect()
    };
    let rows: Vec<Vec<String>> = cells.chunks(CELLS).enumerate().map(row).collect();
    page::table(&header, &rows)
}

fn conclusion(cells: &[Option<f64>]) -> String {
    let known: Vec<f64> = cells.iter().flatten().copied().collect();
    let (least, most) = known.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &v| (a.min(v), b.max(v)));
    if known.is_empty() {
        "No corner was measured in it.".to_owned()
    } else if most > UNEVEN * least {
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
    use nalgebra::Point2;

    fn corner(x: f64, y: f64, blur_px: Option<f64>) -> Corner {
        Corner { col: 0, row: 0, px: Point2::new(x, y), covariance_px2: None, blur_px, reach: None, used: true }
    }

    #[test]
    fn each_cell_has_its_own_median() {
        let list = [corner(-0.5, -0.5, Some(1.0)), corner(99.4, 49.4, Some(2.0)), corner(50.0, 25.0, None)];
        let cells = medians(list.iter(), (100, 50));
        assert_eq!((cells[0], cells[CELLS * CELLS - 1]), (Some(1.0), Some(2.0)));
        assert_eq!(cells.iter().flatten().count(), 2);
        assert!(conclusion(&cells).contains("uneven"));
    }

    #[test]
    fn even_soft_and_empty_pictures_are_told_apart() {
        assert!(conclusion(&[Some(0.7), Some(0.8)]).contains("nothing to do"));
        assert!(conclusion(&[Some(2.7), Some(2.8), None]).contains("soft"));
        assert!(conclusion(&[None]).contains("No corner"));
    }
}
