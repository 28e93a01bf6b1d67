//! Benign pictures: dim, noisy, blurred, with another scale of grey.

use super::picture_faults::{FileForm, PictureFault};
use stereocal::simulate::picture::scene::Print;

use super::set::Plan;
use super::{Case, Right, case};

fn benign(name: &'static str, size: &'static str, change: fn(&mut Plan)) -> Case {
    case("benign", name, size, Right::Pass, move |seed, px| {
        let mut plan = Plan::usual(seed, px);
        change(&mut plan);
        plan.set()
    })
}

fn touched(name: &'static str, size: &'static str, fault: PictureFault) -> Case {
    case("benign", name, size, Right::Pass, move |seed, px| {
        Plan::usual(seed, px).set().each(|picture| picture.faults.push(fault))
    })
}

fn written(name: &'static str, size: &'static str, form: FileForm) -> Case {
    case("benign", name, size, Right::Pass, move |seed, px| {
        Plan::usual(seed, px).set().each(|picture| picture.form = form)
    })
}

pub fn cases() -> Vec<Case> {
    let grey = |levels: f32| PictureFault::Levels { black: 0.3, white: 0.3 + levels / 255.0 / 0.78 };
    vec![
        benign("blur", "2 px", |plan| plan.settings.optics.gaussian_px = 2.0).also_large(),
        benign("blur", "4 px", |plan| plan.settings.optics.gaussian_px = 4.0),
        touched("noise", "10 of 255", PictureFault::Noise(10.0 / 255.0)).also_large(),
        touched("noise", "25 of 255", PictureFault::Noise(25.0 / 255.0)),
        touched("contrast", "30 of 255", grey(30.0)).also_large(),
        touched("contrast", "12 of 255", grey(12.0)),
        touched("gamma", "0.45", PictureFault::Gamma(0.45)),
        touched("gamma", "2.2", PictureFault::Gamma(2.2)),
        written("12 bits in 16", "high", FileForm::Png { bits: 12, low: false }).also_large(),
        written("12 bits in 16", "low", FileForm::Png { bits: 12, low: true }),
        written("16 bits", "", FileForm::Png { bits: 16, low: false }),
        benign("vignette", "0.6", |plan| plan.settings.lighting.vignetting = 0.6),
        benign("uneven light", "0.5", |plan| plan.settings.lighting.gradient = (0.5, -0.3)),
        benign("dim", "0.15", |plan| plan.settings.lighting.exposure = 0.15),
        benign("white saturated", "", |plan| plan.settings.lighting.exposure = 1.15),
        benign("inverted colours", "", |plan| {
            plan.settings.print = Print { white: 0.07, black: 1.0, rim: 0.45, rim_mm: 1.0 };
        })
        .also_large(),
        benign("board upside down", "20x20", |plan| {
            plan.settings.check_board.squares = "20x20".parse().expect("a board");
            plan.settings.check_board.square_mm = 10.0;
            plan.holding.upright_deg = 180.0;
        }),
        benign("board upside down", "12x9", |plan| {
            plan.settings.check_board.squares = "12x9".parse().expect("a board");
            plan.settings.check_board.square_mm = 16.0;
            plan.holding.upright_deg = 180.0;
        }),
        benign("boards turned any way", "12x9", |plan| {
            plan.settings.check_board.squares = "12x9".parse().expect("a board");
            plan.settings.check_board.square_mm = 12.0;
            plan.holding.turn_deg = 180.0;
        }),
        benign("boards turned any way", "20x20", |plan| {
            plan.settings.check_board.squares = "20x20".parse().expect("a board");
            plan.settings.check_board.square_mm = 8.0;
            plan.holding.turn_deg = 180.0;
        }),
        benign("defocus", "", |plan| {
            plan.settings.optics.defocus =
                Some(stereocal::simulate::picture::psf::Defocus { pupil_mm: 25.0 / 8.0, focus_mm: 525.0 });
        }),
    ]
}
