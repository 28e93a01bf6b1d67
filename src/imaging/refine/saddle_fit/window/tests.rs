use super::*;

fn ramp() -> Image<u8> {
    Image::from_fn(100, 100, |x, y| (x + y) as u8)
}

fn collected(picture: &Image<u8>, start: Point2<f64>, halves: [Vector2<f64>; 2], band_px: f64) -> Window {
    let mut window = Window::default();
    window.collect(picture, 0.0, &Below(256.0), &Frame { start, halves, band_px, hidden: [None; 2], dark: None });
    window
}

/// Sums of all products of `(1, x, y, grey)` over the whole window.
fn total(window: &Window) -> Matrix4<f64> {
    let near = window.arms.iter().flatten().chain([&window.crossing]);
    let mut sum = window.flat[0] + window.flat[1];
    for group in near.flat_map(|groups| &groups.groups) {
        for l in 0..LANES {
            let v = Vector4::new(1.0, group.x[l], group.y[l], group.grey[l]).cast::<f64>();
            sum += v * v.transpose() * f64::from(group.weight[l]);
        }
    }
    sum
}

const START: Point2<f64> = Point2::new(49.3, 50.2);

/// The same sums, pixel by pixel of the ramp.
fn expected(halves: [Vector2<f64>; 2], is_hidden: impl Fn(Vector2<f64>) -> bool) -> Matrix4<f64> {
    let inverse = Matrix2::from_columns(&halves).try_inverse().unwrap();
    let mut sum = Matrix4::zeros();
    for (x, y) in (0..100 * 100).map(|k| (k % 100, k / 100)) {
        let d = Vector2::new(f64::from(x), f64::from(y)) - START.coords;
        if (inverse * d).amax() <= 1.0 && !is_hidden(d) {
            let v = Vector4::new(1.0, d.x, d.y, f64::from(x + y));
            sum += v * v.transpose();
        }
    }
    sum
}

#[test]
fn every_pixel_inside_is_counted_once() {
    for halves in [
        [Vector2::new(30.0, 8.0), Vector2::new(-8.0, 30.0)],
        [Vector2::new(30.0, 0.0), Vector2::new(0.0, 30.0)],
        [Vector2::new(-20.0, 20.0), Vector2::new(25.0, 14.0)],
    ] {
        let expected = expected(halves, |_| false);
        for band_px in [f64::MAX, 6.0, 0.4] {
            let window = collected(&ramp(), START, halves, band_px);
            // Sums of a few thousand products of numbers with seven digits.
            assert!((total(&window) - expected).amax() < 1e-7 * expected.amax(), "{halves:?} {band_px}");
            assert_eq!(window.count(), expected[(0, 0)] as usize);
        }
        let window = collected(&ramp(), START, halves, 0.4);
        assert!(window.near() < window.count() / 4);
    }
}

#[test]
fn what_is_hidden_is_left_out_and_nothing_else() {
    let (picture, mut window) = (ramp(), Window::default());
    let halves = [Vector2::new(30.0, 8.0), Vector2::new(-8.0, 30.0)];
    let corners = [(6.0, 9.0), (28.0, 12.0), (21.0, 33.0), (4.0, 27.0)].map(|(x, y)| Vector2::new(x, y));
    let inside = |d: Vector2<f64>| (0..4).all(|k| (corners[(k + 1) % 4] - corners[k]).perp(&(d - corners[k])) >= 0.0);
    let expected = expected(halves, inside);
    for band_px in [f64::MAX, 6.0] {
        let frame = Frame { start: START, halves, band_px, hidden: [None, Some(Quad(corners))], dark: None };
        window.collect(&picture, 0.0, &Below(256.0), &frame);
        assert!((total(&window) - expected).amax() < 1e-7 * expected.amax(), "{band_px}");
        assert_eq!((window.count(), window.left_out), (expected[(0, 0)] as usize, 0));
    }
}

#[test]
fn pixels_are_sorted_by_the_edges_they_see() {
    let halves = [Vector2::new(30.0, 3.0), Vector2::new(-9.0, 28.0)];
    let window = collected(&ramp(), Point2::new(50.0, 50.0), halves, 5.0);
    let normals = halves.map(|v| Vector2::new(-v.y, v.x).normalize());
    let across = |group: &Group, l: usize| normals.map(|n| n.dot(&Vector2::new(group.x[l], group.y[l]).cast()));
    let each = |groups: &Groups, holds: &dyn Fn([f64; 2]) -> bool| {
        assert!(groups.count > 50);
        groups.groups.iter().all(|g| (0..LANES).all(|l| g.weight[l] == 0.0 || holds(across(g, l))))
    };
    assert!(each(&window.crossing, &|u| u.iter().all(|u| u.abs() <= 5.0)));
    for (k, arms) in window.arms.iter().enumerate() {
        assert!(each(&arms[0], &|u| u[k].abs() <= 5.0 && u[1 - k] < -5.0));
        assert!(each(&arms[1], &|u| u[k].abs() <= 5.0 && u[1 - k] > 5.0));
    }
    let middle = |sums: &Matrix4<f64>| Vector2::new(sums[(0, 1)], sums[(0, 2)]) / sums[(0, 0)];
    assert!(window.flat.iter().all(|sums| middle(sums).norm() < 1.0 && sums[(0, 0)] > 100.0));
}

#[test]
fn a_large_window_takes_all_of_its_edges_and_a_third_of_its_rows_elsewhere() {
    let (side, half) = (401, 180.0);
    let picture = Image { width: side, height: side, pixels: vec![100u8; side * side] };
    let halves = [Vector2::new(half, 0.0), Vector2::new(0.0, half)];
    let window = collected(&picture, Point2::new(200.0, 200.0), halves, 5.0);
    // Bands of 11 px along 361; of the 350 rows outside the band across, those that 3 divides.
    assert_eq!(window.near(), 2 * 11 * 361 - 11 * 11);
    let rows = (20..=380).filter(|y: &usize| y.abs_diff(200) > 5 && y.is_multiple_of(3)).count();
    assert_eq!(window.count() - window.near(), rows * 350);
}

#[test]
fn a_window_over_the_border_keeps_what_is_there() {
    let picture = Image { width: 10, height: 10, pixels: vec![255u8; 100] };
    let frame = Frame {
        start: Point2::new(0.0, 0.0),
        halves: [Vector2::new(5.0, 0.0), Vector2::new(0.0, 5.0)],
        band_px: f64::MAX,
        hidden: [None; 2],
        dark: None,
    };
    let mut window = Window::default();
    window.collect(&picture, 0.0, &Below(256.0), &frame);
    assert_eq!((window.count(), window.left_out), (36, 0));
    window.collect(&picture, 0.0, &Below(255.0), &frame);
    assert_eq!((window.count(), window.left_out), (0, 36));
    window.collect(&picture, 0.0, &Below(255.0), &Frame { band_px: 1.5, ..frame });
    assert_eq!((window.count(), window.left_out), (0, 36));
    for start in [Point2::new(-50.0, 1e6), Point2::new(f64::NAN, f64::NAN), Point2::new(f64::INFINITY, 0.0)] {
        window.collect(&picture, 0.0, &Below(256.0), &Frame { start, ..frame });
        assert_eq!(window.count(), 0);
    }
}

#[test]
fn beside_a_single_dark_quadrant_every_pixel_is_counted_once_and_only_its_own_edges_have_arms() {
    let halves = [Vector2::new(30.0, 8.0), Vector2::new(-8.0, 30.0)];
    let expected = expected(halves, |_| false);
    for dark in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
        let mut window = Window::default();
        let frame = Frame { start: START, halves, band_px: 4.0, hidden: [None; 2], dark: Some(dark) };
        window.collect(&ramp(), 0.0, &Below(256.0), &frame);
        assert!((total(&window) - expected).amax() < 1e-7 * expected.amax(), "{dark:?}");
        let has_arm = window.arms.each_ref().map(|sides| sides.each_ref().map(|arm| arm.count > 0));
        let on = |side: f64| [side < 0.0, side > 0.0];
        assert_eq!(has_arm, [on(dark[1]), on(dark[0])], "{dark:?}");
    }
}
