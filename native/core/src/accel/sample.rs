//! Sample rays through a box, as the paper's hybrid asks a node with: from its surface to its surface, stratified, the
//! same for the same seed and node on any number of threads.

use glam::DVec3;

use super::config::Config;
use crate::{
    Error,
    bounds::Bounds,
    ray::{Column, Rays},
};

/// A box is sampled as if no edge were shorter than this share of its longest, so that flat ones have a surface to aim
/// at on both sides.
const FLATTEST: f64 = 1.0 / 1024.0;

/// Rays per stratum: enough for a share of hits to be told from chance, and always about as many, so that the index of
/// dispersion means the same for nodes of all sizes.
const RAYS_PER_STRATUM: f64 = 8.0;

/// How many rays a node is sampled with: in proportion to its share of the scene's volume, within bounds.
pub fn ray_count(node: &Bounds, scene: &Bounds, config: &Config) -> usize {
    let thickness = scene.extent().as_dvec3().max_element() * FLATTEST;
    let volume = |bounds: &Bounds| bounds.extent().as_dvec3().max(DVec3::splat(thickness)).element_product();
    let wanted = (config.sample_rays * volume(node) / volume(scene)).round();
    // A share that is not a number (a scene of one point) falls to the least as well.
    let (least, most) = (f64::from(config.sample_least), f64::from(config.sample_most));
    wanted.max(least).min(most) as usize
}

/// A counter-based generator: value `i` of a stream is a hash of key and `i` (SplitMix64: Steele, Lea and Flood, "Fast
/// Splittable Pseudorandom Number Generators", OOPSLA 2014).
pub(super) struct Generator {
    key: u64,
    counter: u64,
}

impl Generator {
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        Self { key: mix(mix(seed).wrapping_add(stream)), counter: 0 }
    }

    /// Uniform in [0, 1).
    pub(super) fn uniform(&mut self) -> f64 {
        self.counter += 1;
        let bits = mix(self.key.wrapping_add(self.counter.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The surface of a box: faces `2k` and `2k + 1` lie at its lower and upper side along axis k.
struct Surface {
    lower: DVec3,
    extent: DVec3,
}

impl Surface {
    fn new(bounds: &Bounds) -> Self {
        let extent = bounds.extent().as_dvec3();
        let thick = extent.max(DVec3::splat(extent.max_element() * FLATTEST));
        Self { lower: bounds.lower.as_dvec3() - (thick - extent) * 0.5, extent: thick }
    }

    fn sides(&self, face: usize) -> [f64; 2] {
        let axis = face / 2;
        [self.extent[(axis + 1) % 3], self.extent[(axis + 2) % 3]]
    }

    fn area(&self, face: usize) -> f64 {
        self.sides(face).iter().product()
    }

    fn total_area(&self) -> f64 {
        (0..6).map(|face| self.area(face)).sum()
    }

    /// The point of a face at `place`, each coordinate in [0, 1).
    fn point(&self, face: usize, place: [f64; 2]) -> DVec3 {
        let axis = face / 2;
        let mut share = DVec3::ZERO;
        share[axis] = (face % 2) as f64;
        share[(axis + 1) % 3] = place[0];
        share[(axis + 2) % 3] = place[1];
        self.lower + self.extent * share
    }

    /// A face other than `face`, each with its area as weight.
    fn other_face(&self, face: usize, uniform: f64) -> usize {
        let mut rest = uniform * (self.total_area() - self.area(face));
        let mut others = (0..6).filter(|&other| other != face);
        let last = face ^ 1;
        others
            .find(|&other| {
                rest -= self.area(other);
                rest < 0.0
            })
            .unwrap_or(last)
    }
}

/// Whole lines through a box, by stratum of their origins.
#[derive(Debug)]
pub struct Samples {
    columns: [Vec<f32>; 6],
    strata: Vec<usize>,
    /// Where rays begin: at their origins, or at the other end of their lines.
    begin: f32,
}

impl Samples {
    /// `count` rays through a box: their origins are spread over its surface by area and stratified, each is aimed at
    /// a point of another face. `node` tells the streams of random numbers of one seed apart.
    pub fn new(bounds: &Bounds, count: usize, seed: u64, node: usize) -> Self {
        let surface = Surface::new(bounds);
        let mut samples = Self { columns: Default::default(), strata: Vec::new(), begin: f32::NEG_INFINITY };
        let mut generator = Generator::new(seed, node as u64);
        let (mut area, total) = (0.0, surface.total_area());
        for face in 0..6 {
            let before = (area / total * count as f64).round();
            area += surface.area(face);
            let after = (area / total * count as f64).round();
            samples.add_face(&surface, face, (after - before) as usize, &mut generator);
        }
        samples
    }

    /// `count` rays between points anywhere in a box, from the first point of each pair on: also in what is closed,
    /// such as a hall, there are some that begin inside.
    pub fn within(bounds: &Bounds, count: usize, seed: u64) -> Self {
        let mut samples = Self { columns: Default::default(), strata: vec![count], begin: 0.0 };
        let mut generator = Generator::new(seed, 0);
        let (lower, extent) = (bounds.lower.as_dvec3(), bounds.extent().as_dvec3());
        for _ in 0..count {
            let mut point = || lower + extent * DVec3::from_array([(); 3].map(|()| generator.uniform()));
            let (origin, target) = (point(), point());
            samples.push(origin, target);
        }
        samples
    }

    /// Rays with origins on one face, in tiles as near to squares as whole numbers allow.
    fn add_face(&mut self, surface: &Surface, face: usize, count: usize, generator: &mut Generator) {
        if count == 0 {
            return;
        }
        let tiles = (count as f64 / RAYS_PER_STRATUM).round().max(1.0);
        let [width, height] = surface.sides(face);
        let columns = (tiles * width / height).sqrt().round().clamp(1.0, tiles);
        let rows = (tiles / columns).floor().max(1.0);
        let (columns, tiles) = (columns as usize, (columns * rows) as usize);
        for tile in 0..tiles {
            let rays = (tile + 1) * count / tiles - tile * count / tiles;
            self.strata.push(rays);
            for _ in 0..rays {
                let mut place = |index: usize, of: f64| (index as f64 + generator.uniform()) / of;
                let place = [place(tile % columns, columns as f64), place(tile / columns, rows)];
                self.add_ray(surface, face, place, generator);
            }
        }
    }

    fn add_ray(&mut self, surface: &Surface, face: usize, place: [f64; 2], generator: &mut Generator) {
        let origin = surface.point(face, place);
        let other = surface.other_face(face, generator.uniform());
        let target = surface.point(other, [generator.uniform(), generator.uniform()]);
        self.push(origin, target);
    }

    fn push(&mut self, origin: DVec3, target: DVec3) {
        // Of unit length, so that no box is too small for its directions.
        let direction = (target - origin).normalize_or(DVec3::X);
        let values = [origin.as_vec3(), direction.as_vec3()].map(|value| value.to_array());
        self.columns.iter_mut().zip(values.as_flattened()).for_each(|(column, &value)| column.push(value));
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rays; those through a whole box are followed to both ends: a triangle on the box's own surface counts
    /// however origins are rounded.
    ///
    /// # Errors
    /// None; the signature is that of [`Rays::new`].
    pub fn rays(&self) -> Result<Rays<'_>, Error> {
        let [ox, oy, oz, dx, dy, dz] = self.columns.each_ref().map(|column| Column::new(column));
        let ends = [&self.begin, &f32::INFINITY].map(Column::constant);
        Rays::new([ox, oy, oz], [dx, dy, dz], ends[0], ends[1], self.len())
    }

    /// What the rays tell, given which of them hit.
    pub fn evidence(&self, is_hit: impl Fn(usize) -> bool) -> Evidence {
        let mut first = 0;
        let hits: Vec<usize> = self
            .strata
            .iter()
            .map(|&rays| {
                first += rays;
                (first - rays..first).filter(|&ray| is_hit(ray)).count()
            })
            .collect();
        Evidence {
            rays: self.len(),
            hits: hits.iter().sum(),
            spread: index_of_dispersion(&self.strata, &hits),
            freedom: self.strata.len().saturating_sub(1),
        }
    }
}

/// What sample rays tell about a node.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Evidence {
    /// Rays traced.
    pub rays: usize,
    /// Rays that hit.
    pub hits: usize,
    /// How much more the hits vary over the strata than chance alone would make them.
    pub spread: f64,
    /// Degrees of freedom of the spread: over how many strata it was seen, less one for every set of rays.
    pub freedom: usize,
}

impl Evidence {
    /// Both together.
    pub fn and(&self, other: &Self) -> Self {
        let freedom = self.freedom + other.freedom;
        let sum = self.spread * self.freedom as f64 + other.spread * other.freedom as f64;
        let spread = sum / freedom.max(1) as f64;
        Self { rays: self.rays + other.rays, hits: self.hits + other.hits, spread, freedom }
    }

    /// The share of rays that hit.
    pub fn share(&self) -> f64 {
        self.hits as f64 / self.rays.max(1) as f64
    }
}

/// Pearson's chi-squared of the hits in strata of these numbers of rays against one common share, over its degrees of
/// freedom: about 1 where strata differ by chance, 0 where they agree fully, more the more they differ. (Fisher,
/// "Statistical Methods for Research Workers", 1925, section 19.)
fn index_of_dispersion(strata: &[usize], hits: &[usize]) -> f64 {
    let share = hits.iter().sum::<usize>() as f64 / strata.iter().sum::<usize>().max(1) as f64;
    let variance = share * (1.0 - share);
    if variance == 0.0 || strata.len() < 2 {
        return 0.0;
    }
    let terms = strata.iter().zip(hits).map(|(&rays, &hits)| {
        let (rays, hits) = (rays as f64, hits as f64);
        (hits - share * rays).powi(2) / (rays * variance)
    });
    terms.sum::<f64>() / (strata.len() - 1) as f64
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    const CUBE: Bounds = Bounds { lower: Vec3::ZERO, upper: Vec3::ONE };

    #[test]
    fn every_ray_runs_from_face_to_face() {
        let bounds = Bounds { lower: Vec3::new(-3.0, 5.0, 0.0), upper: Vec3::new(1.0, 6.0, 0.5) };
        let samples = Samples::new(&bounds, 500, 7, 3);
        let rays = samples.rays().unwrap();
        assert_eq!(rays.len(), 500);
        let inside = |point: Vec3| (point - point.clamp(bounds.lower, bounds.upper)).length() < 1e-6;
        for ray in (0..500).map(|i| rays.get(i)) {
            let sides = (ray.origin - bounds.lower).abs().min((ray.origin - bounds.upper).abs());
            assert!(sides.min_element() < 1e-6 && inside(ray.origin));
            assert!(inside(ray.origin + ray.direction * 1e-4) && ray.direction.is_normalized());
        }
    }

    #[test]
    fn origins_are_spread_by_area() {
        let bounds = Bounds { lower: Vec3::ZERO, upper: Vec3::new(1.0, 2.0, 3.0) };
        let samples = Samples::new(&bounds, 2200, 0, 0);
        let rays = samples.rays().unwrap();
        let bottom = (0..rays.len()).filter(|&i| rays.get(i).origin.z == 0.0).count();
        assert_eq!(bottom, 200);
    }

    #[test]
    fn flat_boxes_and_points_are_sampled() {
        for extent in [Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, 0.0, 0.0), Vec3::ZERO] {
            let samples = Samples::new(&Bounds { lower: Vec3::ZERO, upper: extent }, 64, 0, 0);
            assert!(samples.columns.iter().flatten().all(|value| value.is_finite()));
        }
    }

    #[test]
    fn seeds_and_nodes_differ_and_repeat() {
        let origins = |seed, node| Samples::new(&CUBE, 32, seed, node).columns;
        assert_eq!(origins(1, 2), origins(1, 2));
        assert_ne!(origins(1, 2), origins(2, 2));
        assert_ne!(origins(1, 2), origins(1, 3));
    }

    #[test]
    fn even_hits_have_low_spread_and_one_sided_hits_a_high_one() {
        let samples = Samples::new(&CUBE, 480, 0, 0);
        let rays = samples.rays().unwrap();
        let freedom = samples.strata.len() - 1;
        assert_eq!(samples.evidence(|_| true), Evidence { rays: 480, hits: 480, spread: 0.0, freedom });
        assert!(samples.evidence(|i| i % 2 == 0).spread < 0.5);
        let mut coin = Generator::new(5, 5);
        let tosses: Vec<bool> = (0..480).map(|_| coin.uniform() < 0.5).collect();
        let chance = samples.evidence(|i| tosses[i]).spread;
        assert!((0.5..1.7).contains(&chance), "{chance}");
        assert!(samples.evidence(|i| rays.get(i).origin.x < 0.5).spread > 4.0);
    }

    #[test]
    fn the_number_of_rays_follows_the_volume() {
        let config = Config { sample_rays: 1000.0, sample_least: 10, sample_most: 500, ..Config::default() };
        let cube = |edge: f32| Bounds { lower: Vec3::ZERO, upper: Vec3::splat(edge) };
        let count = |edge| ray_count(&cube(edge), &cube(1.0), &config);
        assert_eq!([count(1.0), count(0.5), count(0.1)], [500, 125, 10]);
        let flat = Bounds { lower: Vec3::ZERO, upper: Vec3::new(1.0, 1.0, 0.0) };
        assert_eq!(ray_count(&flat, &flat, &config), 500);
        assert_eq!(ray_count(&cube(0.0), &cube(0.0), &config), 10);
    }
}
