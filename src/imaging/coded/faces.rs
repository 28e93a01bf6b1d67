//! What is printed in the squares of a board with markers: for the renderer and for paper.

use super::marker::{Fields, fields};
use super::numbering::code_in;
use crate::imaging::board::{Board, Layout};

/// A rectangle in one square of the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Column and row of the square.
    pub square: (usize, usize),
    /// Its upper left corner, in sides of the square from that one's upper left corner.
    pub from: [f64; 2],
    /// Its lower right corner.
    pub to: [f64; 2],
}

/// The faces of a board's markers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faces {
    /// The markers whole, black: one a marker.
    pub markers: Vec<Face>,
    /// What is white on them; no two overlap.
    pub bits: Vec<Face>,
}

/// The faces of a board's markers; none of a plain board.
pub fn faces(board: &Board, layout: Layout) -> Faces {
    let mut faces = Faces::default();
    // OpenCV's tags have a border of one bit, Kalibr's of two.
    let all = fields(board);
    let first = if layout == Layout::Grid { all.last() } else { all.first() };
    let Some(fields) = first.copied() else { return faces };
    let Fields { share, bits, border, .. } = fields;
    let (margin, side) = ((1.0 - share) / 2.0, share / (bits + 2 * border) as f64);
    let squares = (0..board.squares.rows).flat_map(|y| (0..board.squares.columns).map(move |x| (x, y)));
    for square in squares.filter(|(x, y)| layout.holds_marker(*x as isize, *y as isize)) {
        let Some(code) = code_in(board, layout, (square.0 as isize, square.1 as isize)) else { continue };
        // A tag is a dark square itself.
        if !layout.is_of_tags() {
            faces.markers.push(Face { square, from: [margin; 2], to: [1.0 - margin; 2] });
        }
        for row in 0..bits {
            let is_white = |col: usize| code >> (row * bits + col) & 1 == 0;
            let place = |at: usize| margin + (at + border) as f64 * side;
            // White neighbours are one face.
            let mut col = 0;
            while col < bits {
                let run = (col..bits).take_while(|at| is_white(*at)).count();
                if run > 0 {
                    let (from, to) = ([place(col), place(row)], [place(col + run), place(row + 1)]);
                    faces.bits.push(Face { square, from, to });
                }
                col += run + 1;
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::board::Kind;

    #[test]
    fn a_marker_has_the_white_of_its_code() {
        let board: Board = "charuco:4x5:54:40.5:DICT_4X4_1000".parse().unwrap();
        let Kind::Charuco { dictionary, .. } = board.kind else { panic!("a board with markers") };
        let faces = faces(&board, Layout::New);
        assert_eq!(faces.markers.len(), 10);
        let area = |face: &Face| (face.to[0] - face.from[0]) * (face.to[1] - face.from[1]);
        for (id, marker) in faces.markers.iter().enumerate() {
            let white: f64 = faces.bits.iter().filter(|bit| bit.square == marker.square).map(area).sum();
            let bits = 16 - dictionary.code(id).unwrap().count_ones();
            assert!((white / area(marker) * 36.0 - f64::from(bits)).abs() < 1e-9, "{id}");
        }
    }
}
