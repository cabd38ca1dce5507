use super::*;

#[test]
fn fit_shows_a_backlit_face_and_is_nearest_to_the_truth() {
    let shoot = Shoot::new(41);
    let subjects = stage::subjects(&shoot, 32, &[(21, 0)], 1);
    let named = ["side-light", "low-sun", "nave", "overcast"];
    let environments: Vec<Environment> =
        (named.iter()).map(|name| (*built_in::named(name).unwrap().environment()).clone()).collect();
    let cases = cases(&shoot, &subjects, &environments, 4);
    for case in &cases {
        println!("{}: {:.2?}", named[case.environment], case.decibels);
        assert_eq!(case.black, 0.0);
    }
    for (environment, name) in named.iter().enumerate() {
        let own = cases.iter().filter(|case| case.environment == environment);
        let gains: Vec<f64> = own.map(Case::gain).collect();
        let mean = gains.iter().sum::<f64>() / gains.len() as f64;
        assert!(mean > -0.3, "{name}: {mean}");
    }
    assert!(median(cases.iter().map(Case::gain)) > 0.5);
}

#[test]
fn no_part_of_a_face_is_black_before_a_bright_window() {
    let Some(folder) = test_support::shared("data/hdri") else { return };
    let files = ["probulator_ennis.hdr", "polyhaven_sunny_vondelpark_1k.hdr"];
    let environments = files.map(|file| panorama::load(&folder.join(file)).unwrap());
    let shoot = Shoot::new(41);
    let subjects = stage::subjects(&shoot, 32, &[(22, 6)], 1);
    for case in cases(&shoot, &subjects, &environments, 6) {
        println!("{}: {:.2?}", files[case.environment], case.decibels);
        assert_eq!(case.black, 0.0, "{}", files[case.environment]);
    }
}
