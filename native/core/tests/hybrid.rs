//! What the hybrids decide, and that they say so truly.

mod common;

use std::{
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
};

use common::*;
use espalier_core::{
    Accelerator, Config, Job, Mesh, Method,
    accel::{
        check::assert_well_formed,
        decision::{Decision, Verdict},
        lattice::Lattices,
    },
};

const HYBRIDS: [Method; 3] = [Method::HybridSampled, Method::HybridSequential, Method::Hybrid];

fn mesh((vertices, triangles): (Vec<glam::Vec3>, Vec<[u32; 3]>)) -> Arc<Mesh> {
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

fn build(mesh: &Arc<Mesh>, method: Method, config: &Config, threads: usize) -> Accelerator {
    let accelerator = Accelerator::build(mesh.clone(), method, config, threads, &Job::new()).unwrap();
    assert_well_formed(accelerator.structure(), mesh);
    accelerator
}

fn count(decisions: &[Decision], verdict: Verdict) -> usize {
    decisions.iter().filter(|decision| decision.verdict == verdict).count()
}

#[test]
fn uniform_content_becomes_grids() {
    let accelerator = build(&mesh(soup(20_000, 0.06)), Method::HybridSampled, &Config::default(), 2);
    assert_eq!(accelerator.decisions()[0].verdict, Verdict::Grid);
    assert_eq!((accelerator.census().grids, accelerator.census().nodes), (1, 0));
}

#[test]
fn a_hollow_sphere_is_divided_first() {
    let accelerator = build(&mesh(icosphere(5)), Method::HybridSampled, &Config::default(), 2);
    let decisions = accelerator.decisions();
    assert!(decisions.iter().filter(|decision| decision.depth < 3).all(|d| d.verdict == Verdict::Split));
}

#[test]
fn the_sampled_verdict_follows_from_its_evidence() {
    let config = Config { grid_least_triangles: 40, grid_most_triangles: 4000, ..Config::default() };
    for mesh in [mesh(soup(9000, 0.05)), mesh(soup(9000, 0.02)), mesh(icosphere(4))] {
        let [sampled, sequential] =
            [Method::HybridSampled, Method::HybridSequential].map(|method| build(&mesh, method, &config, 2));
        for decision in sampled.decisions().iter().chain(sequential.decisions()) {
            let window = (40..=4000).contains(&decision.primitives);
            assert_eq!(window, decision.rays > 0);
            let share = f64::from(decision.hits) / f64::from(decision.rays.max(1));
            let is_uniform = share >= config.hit_threshold && f64::from(decision.spread) <= config.spread_threshold;
            assert_eq!(window && is_uniform, decision.verdict == Verdict::Grid, "{decision:?}");
        }
    }
}

#[test]
fn the_expected_cost_decides() {
    let config = Config { grid_least_triangles: 40, grid_most_triangles: 4000, expected_rays: 1e12, ..eager() };
    for mesh in [mesh(soup(9000, 0.05)), mesh(icosphere(4))] {
        let accelerator = build(&mesh, Method::Hybrid, &config, 2);
        for decision in accelerator.decisions().iter().filter(|decision| decision.rays > 0) {
            let gain = decision.cost_bvh * config.grid_gain as f32;
            assert!(decision.cost_grid > 0.0 && decision.cost_bvh > 0.0);
            assert_eq!(decision.verdict == Verdict::Grid, decision.cost_grid < gain, "{decision:?}");
        }
    }
}

#[test]
fn no_grid_is_built_for_rays_that_never_come() {
    let config = Config { expected_rays: 0.0, ..eager() };
    let accelerator = build(&mesh(soup(2000, 0.1)), Method::Hybrid, &config, 2);
    assert_eq!(accelerator.census().grids, 0);
}

#[test]
fn every_grid_was_decided_on() {
    for method in HYBRIDS {
        for mesh in [mesh(soup(2000, 0.1)), mesh(icosphere(3))] {
            let accelerator = build(&mesh, method, &Config { expected_rays: 1e12, ..eager() }, 2);
            let grids = count(accelerator.decisions(), Verdict::Grid);
            assert!(grids > 0, "{method:?}");
            assert_eq!(grids, accelerator.census().grids);
        }
    }
}

#[test]
fn other_methods_decide_nothing_and_small_meshes_tell_why() {
    let mesh = mesh(icosphere(0));
    for accelerator in build_all(&mesh) {
        let decides = |method| matches!(method, Method::Hapala | Method::Fellner) || HYBRIDS.contains(&method);
        assert_eq!(accelerator.decisions().len(), usize::from(decides(accelerator.method())));
        let is_sampled = accelerator.method() == Method::Hapala;
        assert!(accelerator.decisions().iter().all(|decision| (decision.rays > 0) == is_sampled));
    }
}

/// Everything that a build decides, hashed.
fn fingerprint(accelerator: &Accelerator) -> u64 {
    let structure = accelerator.structure();
    let mut hasher = DefaultHasher::new();
    for node in structure.nodes.iter() {
        node.plane.as_flattened().iter().for_each(|plane| plane.to_bits().hash(&mut hasher));
        format!("{:?}", node.child).hash(&mut hasher);
    }
    for block in structure.blocks.iter() {
        block.primitive.hash(&mut hasher);
    }
    (&structure.starts, &structure.references, structure.stack_size).hash(&mut hasher);
    let Lattices { nests, children, tetrahedral, irregular, voxels, merged } = &structure.lattices;
    (voxels, merged).hash(&mut hasher);
    format!("{nests:?} {children:?} {tetrahedral:?} {irregular:?}").hash(&mut hasher);
    format!("{:?} {:?} {:?}", structure.root, structure.grids, accelerator.decisions()).hash(&mut hasher);
    hasher.finish()
}

#[test]
fn builds_do_not_depend_on_the_number_of_threads() {
    let mesh = mesh(soup(20_000, 0.03));
    for method in Method::ALL {
        for config in [Config::default(), eager(), nested()] {
            let one = fingerprint(&build(&mesh, method, &config, 1));
            for threads in [2, 3] {
                let same = one == fingerprint(&build(&mesh, method, &config, threads));
                assert!(same, "{method:?} differs on {threads} threads");
            }
        }
    }
}

#[test]
fn clear_nodes_take_few_rays_and_certainty_takes_more() {
    let mesh = mesh(icosphere(5));
    let rays = |confidence| -> Vec<u32> {
        let config = Config { confidence, grid_least_triangles: 64, ..Config::default() };
        let accelerator = build(&mesh, Method::HybridSequential, &config, 2);
        accelerator.decisions().iter().map(|decision| decision.rays).filter(|&rays| rays > 0).collect()
    };
    let (some, sure) = (rays(0.8), rays(0.9999));
    assert!(some.iter().chain(&sure).all(|&rays| (32..=4096).contains(&rays) && rays.is_power_of_two()));
    assert!(some.iter().min() < some.iter().max(), "{some:?}");
    let mean = |rays: &[u32]| rays.iter().sum::<u32>() as f64 / rays.len() as f64;
    assert!(mean(&some) < mean(&sure), "{} {}", mean(&some), mean(&sure));
}

#[test]
fn another_seed_takes_other_samples() {
    let mesh = mesh(icosphere(4));
    let hits = |seed| -> Vec<u32> {
        let config = Config { seed, ..Config::default() };
        build(&mesh, Method::HybridSampled, &config, 1).decisions().iter().map(|decision| decision.hits).collect()
    };
    assert_ne!(hits(1), hits(2));
    assert_eq!(hits(1), hits(1));
}
