use super::super::weights::tests::{kinds, lattice, rig, rigs};
use super::*;
use crate::Rig;
use imaging::Image;
use proptest::prelude::*;

/// A panorama of random light with suns of a million in a few texels.
fn day(width: usize, seed: u64, suns: &[(usize, usize)]) -> Environment {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut image = Image::from_fn(width, width / 2, |_, _| {
        [0, 1, 2].map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1u64 << 24) as f32
        })
    });
    for (x, y) in suns {
        image.pixels[(y % (width / 2)) * width + x % width] = [1e6, 7e5, 3e5];
    }
    Environment::from_radiance("day", image)
}

/// Compares weights within `relative`, plus a rounding floor for lamps with almost no light.
fn assert_same(name: &str, table: &LightWeights, direct: &LightWeights, rig: &Rig, total: [f64; 3]) {
    for ((table, direct), lamp) in table.per_lamp.iter().zip(&direct.per_lamp).zip(&rig.lamps) {
        for c in 0..3 {
            let (a, b) = (f64::from(table[c]), f64::from(direct[c]));
            let floor = 1e-12 * total[c] / f64::from(lamp.energy[c]);
            assert!(a >= 0.0 && (a - b).abs() <= 1e-5 * b + floor, "{name}: {a} is not {b}");
        }
    }
    assert!((table.uncovered - direct.uncovered).abs() <= 1e-5, "{name}");
}

#[test]
fn a_table_reads_what_a_turn_computes_in_every_rig() {
    for (name, rig) in rigs() {
        for kind in kinds() {
            let partition = kind(&rig, 32);
            let environment = day(32, 7, &[(5, 3), (20, 0)]);
            let table = YawTable::new(&partition, &environment);
            for yaw in [0.0, 11.25, 45.0, 100.3, 359.9, -7.7, 1000.0] {
                let direct = partition.weights(&environment, yaw);
                assert_same(name, &table.at(yaw), &direct, &rig, environment.energy());
            }
        }
    }
}

proptest! {
    #[test]
    fn a_table_reads_what_a_turn_computes(
        seed in 1u64..10_000, yaw in -720.0f32..720.0, half_width in 4usize..40,
        suns in proptest::collection::vec((0usize..100, 0usize..100), 0..4),
    ) {
        let rig = rig(&lattice(41));
        let environment = day(2 * half_width, seed, &suns);
        for kind in kinds() {
            let partition = kind(&rig, 2 * half_width);
            let table = YawTable::new(&partition, &environment);
            assert_same("any", &table.at(yaw), &partition.weights(&environment, yaw), &rig, environment.energy());
        }
    }

    #[test]
    fn a_whole_turn_reads_the_same_bits(quarters in -2880i32..2880) {
        let partition = Partition::smooth(&rig(&lattice(12)), 32);
        let table = YawTable::new(&partition, &day(32, 1, &[(3, 3)]));
        let yaw = quarters as f32 / 4.0;
        prop_assert_eq!(table.at(yaw), table.at(yaw + 360.0));
        prop_assert_eq!(table.at(0.0), table.at(360.0));
    }
}

#[test]
fn a_sun_alone_lights_no_lamp_on_the_other_side() {
    let rig = rig(&lattice(41));
    let mut image = Image::filled(256, 128, [0.0; 3]);
    image.pixels[60 * 256 + 17] = [1e6; 3];
    let sun = Environment::from_radiance("sun", image);
    let partition = Partition::smooth(&rig, 256);
    let table = YawTable::new(&partition, &sun);
    for yaw in [0.0, 90.0, 201.5] {
        let lit = |weights: LightWeights| weights.per_lamp.iter().filter(|w| w[0] > 0.0).count();
        assert_eq!(lit(table.at(yaw)), lit(partition.weights(&sun, yaw)));
    }
}

#[test]
fn no_lamps_and_no_light_make_a_table_of_zeros() {
    let black = Environment::from_radiance("black", Image::filled(32, 16, [0.0; 3]));
    let table = YawTable::new(&Partition::smooth(&rig(&lattice(5)), 32), &black);
    assert_eq!(table.at(33.3), LightWeights { per_lamp: vec![[0.0; 3]; 5], uncovered: 0.0 });
    let table = YawTable::new(&Partition::smooth(&Rig::default(), 32), &day(32, 1, &[]));
    assert_eq!(table.at(f32::NAN), LightWeights { per_lamp: vec![], uncovered: 1.0 });
}
