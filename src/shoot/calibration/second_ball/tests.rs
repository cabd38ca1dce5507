use super::super::highlight::real_balls;
use super::*;

fn lamp(direction: Vec3, confidence: f32) -> Lamp {
    Lamp { spread_deg: 3.0, confidence, ..Lamp::new("lamp", direction) }
}

/// Lamps at given places as seen on two balls, with errors of `error_deg` that differ in sign.
fn seen(places: &[Vec3], positions: [Vec3; 2], error_deg: f32) -> (Rig, Vec<Lamp>) {
    let camera = Vec3::new(0.0, 0.0, 4.0);
    let views = [(positions[0], 1.0), (positions[1], -1.0)].map(|(ball, sign)| {
        let back = glam::Quat::from_rotation_arc((camera - ball).normalize(), Vec3::Z);
        let lamps = places.iter().map(|place| {
            let error = glam::Quat::from_rotation_x(sign * error_deg.to_radians());
            lamp(error * (back * (*place - ball).normalize()), 0.95)
        });
        lamps.collect::<Vec<_>>()
    });
    let [first, second] = views;
    (Rig { lamps: first }, second)
}

#[test]
fn two_balls_tell_where_near_lamps_are() {
    let positions = [Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.3, 0.05, 0.0)];
    let places = [Vec3::new(0.5, 1.2, 1.4), Vec3::new(-1.0, 0.4, 0.8), Vec3::new(0.2, -0.5, 2.0)];
    let (mut rig, second) = seen(&places, positions, 0.2);
    let two = join(&mut rig, &second, Some(positions), 4.0);
    assert_eq!(two.near.len(), 3, "{two:?}");
    for ((near, lamp), place) in two.near.iter().zip(&rig.lamps).zip(places) {
        let off = near.position_m.distance(place);
        assert!(off < 3.0 * near.deviation_m && off < 0.15, "{near:?} is not {place}");
        // Seen from the subject, between the balls, it is in neither ball's direction.
        assert!(lamp.direction.angle_between(place).to_degrees() < 0.5);
        assert!(lamp.confidence > 0.95);
    }
    assert!(two.worst_deg < 0.5 && two.sentence().contains("distance of 3"));
}

#[test]
fn far_lamps_have_a_direction_and_no_distance() {
    let positions = [Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.0)];
    let places = [Vec3::new(30.0, 40.0, 20.0), Vec3::new(-20.0, 10.0, 60.0)];
    let (mut rig, second) = seen(&places, positions, 0.3);
    let two = join(&mut rig, &second, Some(positions), 4.0);
    assert!(two.near.is_empty(), "{two:?}");
    for (lamp, place) in rig.lamps.iter().zip(places) {
        assert!(lamp.direction.angle_between(place).to_degrees() < 1.0);
    }
}

#[test]
fn balls_that_disagree_are_not_trusted_and_one_that_sees_is_enough() {
    let up = Vec3::new(0.0, 0.6, 0.8);
    let turned = |degrees: f32| glam::Quat::from_rotation_y(degrees.to_radians()) * up;
    let mut rig = Rig { lamps: vec![lamp(up, 0.9), lamp(up, 0.9), lamp(Vec3::Z, 0.0), lamp(up, 0.6)] };
    let second = [lamp(turned(10.0), 0.95), lamp(turned(1.0), 0.9), lamp(up, 0.8), lamp(Vec3::Z, 0.0)];
    let two = join(&mut rig, &second, None, 4.0);
    let [apart, together, second_only, first_only] = &rig.lamps[..] else {
        panic!("four lamps");
    };
    assert!(apart.confidence < 0.5);
    assert!(together.confidence > 0.97);
    assert!(together.direction.angle_between(turned(0.5)).to_degrees() < 0.05);
    assert!(second_only.direction == up && second_only.confidence == 0.8);
    assert!(first_only.direction == up && first_only.confidence == 0.6);
    assert_eq!(two.lamps, 2);
}

#[test]
fn two_real_balls_together_are_nearer_to_what_was_published() {
    let Some([first, second]) = real_balls() else { return };
    let mut rig = Rig { lamps: first.0 };
    let two = join(&mut rig, &second.0, None, 1e5);
    println!("{}", two.sentence());
    assert!(two.lamps == 12 && two.near.is_empty());
    let mut worst = 0.0f32;
    for (i, lamp) in rig.lamps.iter().enumerate() {
        let published = (first.1[i] + second.1[i]).normalize();
        let off = lamp.direction.angle_between(published).to_degrees();
        println!("lamp {:2}: {off:.2}° off, confidence {:.2}", i + 1, lamp.confidence);
        worst = worst.max(off);
        assert!(lamp.confidence > 0.8);
    }
    println!("worst {worst:.2}°");
    assert!(worst <= 1.0);
}

/// A small project with a second ball whose photographs are copies of the first's.
fn two_equal_balls(folder: &std::path::Path) -> Project {
    let response = imaging::DualGamma::new(2.2, 2.2).unwrap();
    let mut project = crate::tests::small_shoot(folder, &response);
    let second = SecondBall { folder: "probes_2".into(), ball: project.settings.shoot.ball, positions_m: None };
    std::fs::create_dir(project.shoot_path("probes_2")).unwrap();
    for lamp in 0..project.settings.shoot.lamps.len() {
        let copy = project.second_probe_picture(&second, lamp);
        std::fs::copy(project.lamp_probe_picture(lamp), copy).unwrap();
    }
    project.settings.shoot.second_ball = Some(second);
    project
}

#[test]
fn a_lamp_that_one_of_two_balls_shows_can_be_learnt() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = two_equal_balls(folder.path());
    let count = project.settings.shoot.lamps.len();
    // The first ball's photograph under one lamp becomes one without a lamp.
    let black = imaging::Encoded(imaging::Raster::filled(96, 96, [0.0; 3]));
    imaging::file::write_png(project.lamp_probe_picture(3).file(), &black).unwrap();
    let silent = Progress::silent();
    let mut alone = project.clone();
    alone.settings.shoot.second_ball = None;
    assert!(crate::keep_lamps(&mut alone, count, &silent).is_err());
    let kept = crate::keep_lamps(&mut project, count, &silent).unwrap();
    assert_eq!(kept.indices.len(), count);
}

#[test]
fn a_second_ball_that_is_too_small_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = two_equal_balls(folder.path());
    if let Some(second) = &mut project.settings.shoot.second_ball {
        second.ball.radius_px = 6.0;
    }
    let refusal = crate::keep_lamps(&mut project, 4, &Progress::silent()).unwrap_err();
    let sentence = refusal.to_string();
    assert!(sentence.contains("probes_2") && sentence.contains("radius of 10 pixels"), "{sentence}");
}
