//! Time of one picture on one core, before encoding: `cargo bench --bench render`.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a benchmark times, prints its table, and ends where its input is not as it should be"
)]

use std::time::Instant;

use stereocal::imaging::corners::Side;
use stereocal::simulate::draws::NormalTable;
use stereocal::simulate::picture::render::Renderer;
use stereocal::simulate::settings::Settings;
use stereocal::simulate::world::{World, png};

fn main() {
    for (name, settings) in [("small", Settings::small()), ("paper", Settings::paper())] {
        let settings = Settings { check_pairs: 1, samples: 4, verify: 0, ..settings };
        let world = World::new(settings, None).expect("the presets are possible");
        let normals = NormalTable::new();
        for shot in world.shots().iter().take(2) {
            let (backdrop, holder) = (world.backdrop(shot.placement, Side::Left), world.holder(shot));
            let scene = world.scene(shot, Side::Left, &backdrop, &holder);
            let start = Instant::now();
            let picture = Renderer::new(&scene).picture(&normals);
            let rendered = start.elapsed();
            let bytes = png(&picture).expect("a PNG in memory");
            println!(
                "{name} {}/{}: {} px, {:.3} s, then PNG {:.3} s, {} kB",
                shot.folder,
                shot.stem,
                picture.width,
                rendered.as_secs_f64(),
                (start.elapsed() - rendered).as_secs_f64(),
                bytes.len() / 1000
            );
        }
    }
}
