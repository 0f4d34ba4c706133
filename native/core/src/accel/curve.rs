//! Triangles along a Morton curve that are divided where the highest bit of their codes changes, into nodes of up to
//! eight parts.

use std::ops::Range;

use super::{
    draft::{Draft, Root},
    morton::Key,
    structure::NodeRef,
};
use crate::{
    ray::MISS,
    simd::{Arithmetic, Kernel, Simd, read_alone},
    triangle::LANES,
};

/// The highest bit in which codes of sorted keys differ.
#[inline(always)]
pub fn highest_change(keys: &[Key]) -> Option<u32> {
    (keys[0].code() ^ keys[keys.len() - 1].code()).checked_ilog2()
}

/// Up to eight parts of a range, to stand side by side in a node.
#[derive(Debug, Clone, Copy)]
pub struct Parts {
    start: [usize; LANES],
    /// How many triangles each has, over how many parts are behind it if there are eight.
    size: [usize; LANES],
    count: usize,
}

impl Parts {
    /// All of it.
    #[inline(always)]
    pub fn of(range: Range<usize>) -> Self {
        let mut parts = Self { start: [range.start; LANES], size: [0; LANES], count: 1 };
        parts.set_len(0, range.len());
        parts
    }

    /// Which part is to be divided next: that with most triangles, the first of several, if these are more than a leaf has,
    /// until there are eight. By the highest bit that changes, which tells how large a part is, camera rays took 0.96 to
    /// 1.02 of the time. Read together, as compilers do, the numbers of triangles have to wait for the last one that was
    /// written: a whole build took 1.05 times as long.
    #[inline(always)]
    pub fn largest(&self, leaf_size: usize) -> Option<usize> {
        let mut largest = self.size[0];
        for part in 1..self.count.min(LANES) {
            largest = largest.max(read_alone(&self.size[part]));
        }
        (self.count < LANES && largest / LANES > leaf_size).then_some(LANES - 1 - largest % LANES)
    }

    /// Divide a part.
    #[inline(always)]
    pub fn cut(&mut self, part: usize, middle: usize) {
        let Range { start, end } = self.range(part);
        self.start[self.count] = middle;
        self.set_len(self.count, end - middle);
        self.set_len(part, middle - start);
        self.count += 1;
    }

    #[inline(always)]
    fn set_len(&mut self, part: usize, len: usize) {
        self.size[part] = len * LANES + LANES - 1 - part;
    }

    /// A part's keys.
    #[inline(always)]
    pub fn range(&self, part: usize) -> Range<usize> {
        self.start[part]..self.start[part] + self.size[part] / LANES
    }

    /// All parts, in the order in which they came to be.
    pub fn each(self) -> impl Iterator<Item = Range<usize>> {
        (0..self.count).map(move |part| self.range(part))
    }
}

/// Plans a subtree.
pub struct Subtree<'a> {
    /// Its triangles, sorted; at least one.
    pub keys: &'a [Key],
    /// Most triangles of a leaf.
    pub leaf_size: usize,
    /// Room to plan in.
    pub changes: &'a mut Vec<f32>,
    /// Gets nodes, leaves, and a root.
    pub draft: &'a mut Draft,
}

impl Kernel for Subtree<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { keys, leaf_size, changes, draft } = self;
        find_changes(keys, changes);
        let planner = Planner { simd, keys, changes, leaf_size };
        let (node, stack_size) = planner.node(0..keys.len(), draft);
        draft.roots.push(Root { node, stack_size });
    }
}

/// In which bits codes differ, as a float; of two such floats the greater is that of the greater number. None is a
/// denormal number, which a host may have told the processor to take for zero.
#[inline(always)]
fn change(bits: u64) -> f32 {
    f32::from_bits(f32::MIN_POSITIVE.to_bits() + bits as u32)
}

/// From each key to the next, and as many more as are looked at together.
#[inline(always)]
fn find_changes(keys: &[Key], changes: &mut Vec<f32>) {
    changes.clear();
    changes.resize(keys.len() + CHANGES, 0.0);
    for (to, pair) in changes.iter_mut().zip(keys.windows(2)) {
        *to = change(pair[0].code() ^ pair[1].code());
    }
}

/// Changes that are looked at together.
const CHANGES: usize = 2 * LANES;

/// What a subtree is planned from.
struct Planner<'a, S> {
    simd: S,
    keys: &'a [Key],
    /// See [`find_changes`].
    changes: &'a [f32],
    leaf_size: usize,
}

impl<S: Simd> Planner<'_, S> {
    /// Returns where it is, and the entries a traversal needs on its stack.
    fn node(&self, range: Range<usize>, draft: &mut Draft) -> (NodeRef, usize) {
        if range.len() <= self.leaf_size {
            return (self.leaf(range, draft), 0);
        }
        let slot = draft.nodes.len();
        draft.nodes.push([NodeRef::EMPTY; LANES]);
        let mut parts = Parts::of(range);
        self.simd.run(Open { planner: self, parts: &mut parts });
        let mut deepest = 0;
        for (lane, part) in parts.each().enumerate() {
            let (child, below) = self.node(part, draft);
            draft.nodes[slot][lane] = child;
            deepest = deepest.max(below);
        }
        (NodeRef::branch(slot), parts.count - 1 + deepest)
    }

    /// With as many reads whatever its number of triangles, as far as there are so many keys: nobody can guess it.
    fn leaf(&self, range: Range<usize>, draft: &mut Draft) -> NodeRef {
        let leaf = draft.leaf();
        match self.keys[range.start..].first_chunk::<LANES>() {
            Some(keys) => {
                for lane in 0..LANES {
                    leaf[lane] = if lane < range.len() { keys[lane].triangle() } else { MISS };
                }
            }
            None => leaf.iter_mut().zip(&self.keys[range.clone()]).for_each(|(to, key)| *to = key.triangle()),
        }
        draft.filled(range.len())
    }

    /// Where the highest bit changes that changes at all; in the middle where none does. Changes are looked at in order:
    /// most ranges are short, and no step of a bisection can be guessed.
    #[inline(always)]
    fn middle(&self, range: Range<usize>) -> usize {
        let Some(bit) = highest_change(&self.keys[range.clone()]) else { return range.start + range.len() / 2 };
        let wide = self.simd.wide();
        let (least, mut place) = (wide.splat(change(1 << bit)), range.start);
        loop {
            let changes = self.changes[place..].first_chunk().expect("there is a change before the last key");
            let found = wide.le(least, self.simd.load_wide(changes));
            if found != 0 {
                return place + found.trailing_zeros() as usize + 1;
            }
            place += CHANGES;
        }
    }
}

/// Divides parts until they are a node.
struct Open<'a, 'p, S> {
    planner: &'a Planner<'p, S>,
    parts: &'a mut Parts,
}

impl<S: Simd> Kernel for Open<'_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn run<T: Simd>(self, _: T) {
        let Self { planner, parts } = self;
        while let Some(part) = parts.largest(planner.leaf_size) {
            parts.cut(part, planner.middle(parts.range(part)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Level;

    fn keys(codes: impl Iterator<Item = u64>) -> Vec<Key> {
        let mut keys: Vec<Key> = (0..).zip(codes).map(|(number, code)| Key::new(code, number)).collect();
        keys.sort_unstable();
        keys
    }

    struct Middles<'a>(&'a [Key]);

    impl Kernel for Middles<'_> {
        type Output = ();

        fn run<S: Simd>(self, simd: S) {
            let Self(keys) = self;
            let mut changes = Vec::new();
            find_changes(keys, &mut changes);
            let planner = Planner { simd, keys, changes: &changes, leaf_size: 1 };
            for start in 0..keys.len() {
                for end in start + 2..=keys.len() {
                    let has_it = |key: &&Key| key.code() >> highest_change(&keys[start..end]).unwrap_or(0) & 1 == 1;
                    let behind = keys[start..end].iter().filter(has_it).count();
                    let is_one = keys[start].code() == keys[end - 1].code();
                    let middle = if is_one { start + (end - start) / 2 } else { end - behind };
                    assert_eq!(planner.middle(start..end), middle, "{start}..{end}");
                }
            }
        }
    }

    #[test]
    fn ranges_are_divided_where_their_highest_bit_changes() {
        let scattered = (0..90).map(|i: u64| i * i * i * 0x9e37_79b9 % (1 << 30));
        for keys in
            [keys(scattered), keys((0..70).map(|i| i / 3)), keys([0, (1 << 30) - 1].into_iter().cycle().take(40))]
        {
            Level::available().into_iter().for_each(|level| level.run(Middles(&keys)));
        }
    }
}
