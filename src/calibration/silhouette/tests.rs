use super::*;
use crate::imaging::{Encoded, file};
use crate::progress::Progress;
use std::path::{Path, PathBuf};

fn data(folder: &str) -> Option<PathBuf> {
    let path = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap())
        .join("../shared/data")
        .join(folder);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("skipped: {} is not here", path.display());
    None
}

#[test]
fn explore() {
    for probes in ["probes", "probes_hot"] {
        let Some(folder) = data("stage").map(|f| f.join(probes)) else { return };
        let olat = |i: usize| folder.join(format!("olat_{i:02}.png"));
        let mut sets = vec![("interview", vec![folder.join("interview.png")])];
        for i in [0, 6, 20, 33] { sets.push(("olat", vec![olat(i)])); }
        sets.push(("olats", (0..41).map(olat).collect()));
        sets.push(("all", std::iter::once(folder.join("interview.png")).chain((0..41).map(olat)).collect()));
        for (name, paths) in sets {
            let photographs = Photographs::read(&paths, &Progress::silent()).unwrap();
            let start = std::time::Instant::now();
            match find(&photographs) {
                Ok(s) => println!("{probes} {name}: off {:+.3} {:+.3} {:+.3}; {s:.3?} {:?}", s.circle.center_px[0]-128.0, s.circle.center_px[1]-128.0, s.circle.radius_px-116.3636, start.elapsed()),
                Err(e) => println!("{probes} {name}: {e}"),
            }
        }
    }
    let Some(folder) = data("mirror_ball/images") else { return };
    for ball in ["chrome", "gray", "buddha", "cat"] {
        let mask = file::read_mask(&folder.join(format!("{ball}/{ball}.mask.png"))).unwrap();
        let points: Vec<[f64;2]> = (1..mask.height-1).flat_map(|y| (1..mask.width-1).map(move |x| (x,y))).filter(|&(x,y)| mask.at(x,y) > 0.5 && (mask.at(x-1,y) < 0.5 || mask.at(x+1,y) < 0.5 || mask.at(x,y-1)<0.5 || mask.at(x,y+1)<0.5)).map(|(x,y)| [x as f64 + 0.5, y as f64 + 0.5]).collect();
        println!("{ball} mask {:?}", Circle::fit(&points));
        let one = |i: usize| folder.join(format!("{ball}/{ball}.{i}.png"));
        let mut sets: Vec<Vec<PathBuf>> = (0..12).map(|i| vec![one(i)]).collect();
        sets.push((0..12).map(one).collect());
        for paths in sets {
            let photographs = Photographs::read(&paths, &Progress::silent()).unwrap();
            let start = std::time::Instant::now();
            match find(&photographs) {
                Ok(s) => println!("{} {ball}: {s:.3?} {:?}", paths.len(), start.elapsed()),
                Err(e) => println!("{} {ball}: {e}", paths.len()),
            }
        }
    }
    let _ = Encoded(Raster::filled(1,1,[0.0;3]));
}

use scene::{Around, Scene, random};

fn random_scene(seed: u64) -> Scene {
    let r = |k: u64| random(seed, k);
    let size = [(256, 256), (320, 200), (200, 300), (640, 427), (512, 512), (900, 600)][(r(1) * 6.0) as usize];
    let short = size.0.min(size.1) as f64;
    let radius = 12.0f64 * (0.48 * short / 12.0).powf(r(2));
    let reach = radius * (1.02 - 0.6 * if r(3) < 0.3 { r(4) } else { 0.0 });
    let place = |n: usize, u: f64| { let n = n as f64; if 2.0 * reach < n { reach + u * (n - 2.0 * reach) } else { 0.5 * n } };
    let around = [Around::Dark, Around::Room, Around::Clutter][(r(5) * 3.0) as usize];
    let z = 2.0 * r(6) - 1.0; let a = 6.3 * r(7);
    Scene {
        size,
        ball: Some(Circle::new([place(size.0, r(8)), place(size.1, r(9))], radius).unwrap()),
        around,
        pole: r(10) < 0.5,
        lamp: (r(11) < 0.5).then(|| glam::DVec3::new((1.0-z*z).sqrt()*a.cos(), (1.0-z*z).sqrt()*a.sin(), z)),
        ambient: if around == Around::Dark { 0.004 + 0.05 * r(12) } else { 0.0 },
        exposure: 0.25 + 1.5 * r(13),
        noise: 0.012 * r(14) * r(14),
        seed,
    }
}

#[test]
fn explore_scenes() {
    let save = std::env::var("SAVE").is_ok();
    let mut errors = vec![]; let mut missed = 0; let mut wrong = 0;
    for seed in 0..150u64 {
        let scene = random_scene(seed);
        let truth = scene.ball.unwrap();
        let photo = scene.photograph();
        let photographs = Photographs::one(format!("{seed}.png"), &photo).unwrap();
        let start = std::time::Instant::now();
        let found = find(&photographs);
        let t = start.elapsed();
        let about = format!("{seed} {:?} {:?} {:.0?} r{:.1} pole {} lamp {} exp {:.2} noise {:.4} {t:.0?}", scene.size, scene.around, truth.center_px, truth.radius_px, scene.pole, scene.lamp.is_some(), scene.exposure, scene.noise);
        let bad = match found {
            Ok(s) => {
                let e = s.circle.center().distance(truth.center()).max((s.circle.radius_px-truth.radius_px).abs());
                if e > 2.0 + 0.02*truth.radius_px { wrong += 1; println!("WRONG {about}: {s:.2?}"); true }
                else { errors.push(e); if e > 0.3 { println!("off {e:.2} {about}: {s:.2?}"); } false }
            }
            Err(e) => { missed += 1; println!("MISSED {about}: {:.2?} {}", anywhere(&pyramid(photographs.average())).iter().map(|r| (r, r.evidence())).take(3).collect::<Vec<_>>(),  e.to_string().split("found ").nth(1).unwrap().split(". Check").next().unwrap()); true }
        };
        if save && bad { file::write_png(Path::new(&format!("/tmp/scratch/finder/scenes/{seed}.png")), &photo).unwrap(); }
    }
    errors.sort_by(f64::total_cmp);
    println!("missed {missed} wrong {wrong} median {:.3} 90% {:.3} 97% {:.3}", errors[errors.len()/2], errors[errors.len()*9/10], errors[errors.len()*97/100]);
}

#[test]
fn explore_none() {
    let save = std::env::var("SAVE").is_ok();
    let mut falsely = 0;
    for seed in 0..100u64 {
        let scene = Scene { ball: None, pole: false, around: if seed % 2 == 0 { Around::Room } else { Around::Clutter }, ..random_scene(seed + 1000) };
        let photo = scene.photograph();
        let photographs = Photographs::one(format!("{seed}.png"), &photo).unwrap();
        if let Ok(s) = find(&photographs) { falsely += 1; println!("FALSE {seed} {:?} {s:.2?}", scene.around);
          if save { file::write_png(Path::new(&format!("/tmp/scratch/finder/scenes/none{seed}.png")), &photo).unwrap(); }
        }
    }
    println!("false {falsely}");
}
