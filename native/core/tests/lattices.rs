//! Grids of the other kinds, and the methods that choose between grid and hierarchy: what they are made of.

mod common;

use std::sync::Arc;

use common::*;
use espalier_core::{
    Accelerator, Config, Job, Mesh, Method,
    accel::{
        check::assert_well_formed,
        decision::Verdict,
        structure::{NodeRef, Structure, Target},
    },
    traverse::probe::Counts,
};
use glam::Vec3;

fn mesh((vertices, triangles): (Vec<Vec3>, Vec<[u32; 3]>)) -> Arc<Mesh> {
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

fn build(mesh: &Arc<Mesh>, method: Method, config: &Config) -> Accelerator {
    let accelerator = Accelerator::build(mesh.clone(), method, config, 2, &Job::new()).unwrap();
    assert_well_formed(accelerator.structure(), mesh);
    accelerator
}

/// Steps of rays through a sphere's surroundings and inside.
fn steps(accelerator: &Accelerator) -> u64 {
    let mut rays = RayBatch::default();
    for index in 0..2000 {
        let angle = index as f32 * 0.7;
        let origin = Vec3::new(angle.cos(), angle.sin(), (angle * 0.31).sin()) * 1.5;
        let target = Vec3::new((angle * 0.17).sin(), (angle * 0.13).cos(), (angle * 0.11).sin());
        rays.push(origin, target - origin, 0.0, f32::INFINITY);
    }
    let mut counts = vec![Counts::default(); rays.len()];
    accelerator.counted(&rays.rays(), &mut counts, 1, &Job::new()).unwrap();
    counts.iter().map(|counts| u64::from(counts.steps)).sum()
}

#[test]
fn tetrahedra_are_as_many_as_cubes() {
    let mesh = mesh(soup(20_000, 0.03));
    let count = |method| build(&mesh, method, &Config::default()).census().cells as f64;
    let ratio = count(Method::GridTetrahedral) / count(Method::Grid);
    assert!((0.85..1.15).contains(&ratio), "{ratio}");
}

#[test]
fn merged_cells_are_few_and_crossed_fast() {
    let mesh = mesh(icosphere(5));
    let [grid, irregular] =
        [Method::Grid, Method::GridIrregular].map(|method| build(&mesh, method, &Config::default()));
    assert!(2 * irregular.census().cells < grid.census().cells);
    assert!(irregular.census().references <= grid.census().references);
    assert!(2 * steps(&irregular) < steps(&grid));
    let narrow = build(&mesh, Method::GridIrregular, &Config { expansions: 0, ..Config::default() });
    assert!(steps(&irregular) < steps(&narrow));
}

#[test]
fn a_two_level_grid_has_a_grid_in_every_occupied_cell() {
    let accelerator = build(&mesh(icosphere(5)), Method::GridTwoLevel, &Config::default());
    let lattices = &accelerator.structure().lattices;
    assert_eq!((lattices.nests.len(), accelerator.structure().root), (1, NodeRef::nest(0)));
    let occupied = lattices.children.iter().filter(|&&child| child != NodeRef::EMPTY);
    assert!(occupied.clone().all(|child| matches!(child.target(), Target::Grid(_))));
    assert_eq!(occupied.count(), accelerator.structure().grids.len());
}

/// The most nests in one another below a node.
fn nesting(structure: &Structure, node: NodeRef) -> usize {
    let (own, children) = match node.target() {
        Target::Branch(index) => (0, &structure.nodes[index as usize].child[..]),
        Target::Nest(index) => (1, structure.lattices.children(&structure.lattices.nests[index as usize])),
        Target::Grid(_) => return 1,
        _ => return 0,
    };
    own + children.iter().map(|&child| nesting(structure, child)).max().unwrap_or(0)
}

#[test]
fn grids_stand_in_hierarchies_and_hold_them_to_no_more_than_the_documented_depth() {
    let mesh = mesh(soup(3000, 0.2));
    for most in [0, 1, 2, 3] {
        let accelerator = build(&mesh, Method::Fellner, &Config { nesting: most, ..nested() });
        let structure = accelerator.structure();
        let found = nesting(structure, structure.root);
        assert!(found <= most && (found > 0) == (most > 0), "{found} of {most}");
        let grids = accelerator.decisions().iter().filter(|decision| decision.verdict == Verdict::Grid).count();
        assert_eq!(grids, accelerator.census().grids);
        for decision in accelerator.decisions().iter().filter(|decision| decision.cost_grid.is_finite()) {
            let gain = decision.cost_bvh * nested().grid_gain as f32;
            assert_eq!(decision.verdict == Verdict::Grid, decision.cost_grid < gain, "{decision:?}");
        }
    }
}

#[test]
fn a_tested_grid_stays_while_few_rays_come() {
    let mesh = mesh(icosphere(5));
    let of = |expected_rays| build(&mesh, Method::Hapala, &Config { expected_rays, ..Config::default() });
    let (few, many) = (of(100.0), of(1e9));
    assert_eq!((few.decisions()[0].verdict, few.census().grids), (Verdict::Grid, 1));
    assert_eq!((many.decisions()[0].verdict, many.census().grids), (Verdict::Split, 0));
    for accelerator in [few, many] {
        let decision = &accelerator.decisions()[0];
        assert_eq!(decision.verdict == Verdict::Grid, decision.cost_grid <= decision.cost_bvh);
        assert!(decision.sparseness > 0.8 && decision.sparseness < 1.0 && decision.spread > 0.0);
        assert!(decision.rays > 0 && decision.hits > 0 && decision.hits <= decision.rays);
    }
}
