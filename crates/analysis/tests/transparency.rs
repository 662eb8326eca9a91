//! scratch
mod common;
use common::{table_6_1, with_ratio};
use cotouch_analysis::transparency::*;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Architecture;

#[test]
fn numbers() {
    for n in 0..3 { for ratio in [2, 8] {
        for arch in [Architecture::Distributed, Architecture::Centralized] {
            let mut scene = with_ratio(table_6_1(arch), ratio);
            scene.link.delay_periods = n;
            for user in 0..2 {
                let d = added_damping(&scene, HostIndex(user)).unwrap();
                println!("{arch:?} N{ratio} n{n} u{user} {:?} {:?} mean {:?} drag {:?} -> {:?} {:?} {:?} {:?}", d.damping_n_s_per_m, d.simplified_damping_n_s_per_m, d.mean_damping_n_s_per_m, d.drag_pole, d.compensation_n_s_per_m, d.damping_if_compensated_n_s_per_m, d.drag_pole_if_compensated, d.stable_if_compensated);
            }
        }
    }}
    for n in 0..3 {
        let mut scene = table_6_1(Architecture::Distributed);
        scene.link.delay_periods = n;
        scene.object.damping_n_s_per_m = -3.0;
        let d = added_damping(&scene, HostIndex(0)).unwrap();
        println!("-3 n{n}: {d:?}");
        let a = admittance(&scene, &[0.01, 1.0, 10.0, 100.0]).unwrap();
        println!("{a:?}");
    }
    let scene = with_ratio(table_6_1(Architecture::Distributed), 2);
    println!("6.3 {} {}", closed_forms::simplified_damping(&scene), closed_forms::distributed_damping_as_printed(&scene));
    for kw in [300.0, 30000.0] {
        for arch in [Architecture::Distributed, Architecture::Centralized] {
        let mut scene = table_6_1(arch);
        scene.wall.stiffness_n_per_m = kw;
        scene.wall.damping_n_s_per_m = 20.0;
        println!("{:?} {} {}", equivalent_stiffness(&scene).unwrap(), closed_forms::distributed_stiffness(&scene), closed_forms::distributed_stiffness_as_printed(&scene));
        let a = admittance(&scene, &[0.001, 0.01, 1.0, 10.0, 100.0]).unwrap();
        println!("{a:?}");
        }
    }
    println!("{:?}", equivalent_stiffness(&table_6_1(Architecture::Distributed)).unwrap());
    for name in ["grasp", "sinusoid", "push-wall", "four-hands", "stack", "hand-over"] {
        let scene = cotouch_scene::load(name, &[]).unwrap();
        let t = std::time::SystemTime::now();
        println!("{name} {:?}\n {:?}", added_damping(&scene, HostIndex(0)), equivalent_stiffness(&scene));
        println!("{:?}", t.elapsed());
    }
}
