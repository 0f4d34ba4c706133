//! Columns of the numbers of rays, read eight and sixteen at a time.

use crate::{
    simd::{Arithmetic, Simd},
    triangle::LANES,
};

/// A strided, read-only column of numbers: element `i` stands at `i * stride`. Stride 0 repeats one value.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    values: &'a [f32],
    stride: usize,
}

impl<'a> Column<'a> {
    /// A contiguous column.
    pub fn new(values: &'a [f32]) -> Self {
        Self { values, stride: 1 }
    }

    /// A column whose elements are `stride` apart in `values`.
    pub fn strided(values: &'a [f32], stride: usize) -> Self {
        Self { values, stride }
    }

    /// One value for every ray.
    pub fn constant(value: &'a f32) -> Self {
        Self { values: std::slice::from_ref(value), stride: 0 }
    }

    /// How many rays it can serve.
    pub(super) fn capacity(&self) -> usize {
        if self.stride == 0 { usize::MAX } else { self.values.len().div_ceil(self.stride) }
    }

    /// The values of rays `index` to `index + 7`.
    #[inline(always)]
    pub(super) fn eight<S: Simd>(&self, simd: S, index: usize) -> S::F32 {
        match self.stride {
            0 => simd.splat(self.values[0]),
            1 => simd.load(self.span(index)),
            stride => {
                let mut eight = [0.0; 8];
                for lane in 0..8 {
                    eight[lane] = self.values[(index + lane) * stride];
                }
                simd.load(&eight)
            }
        }
    }

    /// The values of rays `index` to `index + 15`.
    #[inline(always)]
    pub(super) fn sixteen<S: Simd>(&self, simd: S, index: usize) -> <S::Wide as Arithmetic>::F32 {
        match self.stride {
            0 => simd.wide().splat(self.values[0]),
            1 => simd.load_wide(self.span(index)),
            _ => simd.both([self.eight(simd, index), self.eight(simd, index + LANES)]),
        }
    }

    /// The values from one on.
    #[inline(always)]
    fn span<const N: usize>(&self, first: usize) -> &[f32; N] {
        self.values[first..].first_chunk().expect("every column has a value for every ray")
    }

    /// The value of ray `index`.
    #[inline(always)]
    pub fn get(&self, index: usize) -> f32 {
        self.values[index * self.stride]
    }
}

/// Columns of the three coordinates of points or directions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points<'a> {
    axes: [Column<'a>; 3],
    /// Whether they are those of rows of three, of which the first has all numbers.
    are_rows: bool,
}

impl<'a> Points<'a> {
    /// The columns of so many points.
    pub(super) fn new(axes: [Column<'a>; 3], count: usize) -> Self {
        let [x, y, z] = &axes;
        let first = x.values.as_ptr();
        let follow = y.values.as_ptr() == first.wrapping_add(1) && z.values.as_ptr() == first.wrapping_add(2);
        let are_rows = follow && axes.iter().all(|axis| axis.stride == 3) && x.values.len() >= 3 * count;
        Self { axes, are_rows }
    }

    /// Points `index` to `index + 7`.
    #[inline(always)]
    pub(super) fn eight<S: Simd>(&self, simd: S, index: usize) -> [S::F32; 3] {
        let [x, y, z] = &self.axes;
        if self.are_rows {
            return simd.load_points(x.span(3 * index));
        }
        [x.eight(simd, index), y.eight(simd, index), z.eight(simd, index)]
    }

    /// Points `index` to `index + 15`.
    #[inline(always)]
    pub(super) fn sixteen<S: Simd>(&self, simd: S, index: usize) -> [<S::Wide as Arithmetic>::F32; 3] {
        let [x, y, z] = &self.axes;
        if self.are_rows {
            return simd.load_points_wide(x.span(3 * index));
        }
        [x.sixteen(simd, index), y.sixteen(simd, index), z.sixteen(simd, index)]
    }

    /// One point.
    #[inline(always)]
    pub(super) fn get(&self, index: usize) -> [f32; 3] {
        let [x, y, z] = &self.axes;
        [x.get(index), y.get(index), z.get(index)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Kernel, Level};

    /// Sixteen points from one on: twice eight, and all at once.
    struct Read<'a>(Points<'a>, usize);

    impl Kernel for Read<'_> {
        type Output = [[[f32; 16]; 3]; 2];
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let Self(points, first) = self;
            let (low, high) = (points.eight(simd, first), points.eight(simd, first + LANES));
            let all = points.sixteen(simd, first);
            let mut read = [[[0.0; 16]; 3]; 2];
            for axis in 0..3 {
                read[0][axis] = bytemuck::cast([simd.store(low[axis]), simd.store(high[axis])]);
                read[1][axis] = simd.store_wide(all[axis]);
            }
            read
        }
    }

    #[test]
    fn points_are_read_by_any_stride_as_one_by_one() {
        const COUNT: usize = 23;
        let numbers: Vec<f32> = (0..5 * COUNT).map(|number| number as f32).collect();
        let layouts: [(&str, usize, [usize; 3]); 5] = [
            ("rows", 3, [0, 1, 2]),
            ("rows in another order", 3, [2, 1, 0]),
            ("rows with a gap", 5, [0, 1, 2]),
            ("columns", 1, [0, COUNT, 2 * COUNT]),
            ("one point", 0, [0, 1, 2]),
        ];
        for (layout, stride, axes) in layouts {
            let end = |first: usize| first + (COUNT - 1) * stride + 1;
            let points = Points::new(axes.map(|first| Column::strided(&numbers[first..end(first)], stride)), COUNT);
            let whole = Points::new(axes.map(|first| Column::strided(&numbers[first..], stride)), COUNT);
            assert_eq!(whole.are_rows, layout == "rows");
            assert!(!points.are_rows, "the first column ends before the last row does");
            for (points, level) in
                [points, whole].into_iter().flat_map(|p| Level::available().into_iter().map(move |level| (p, level)))
            {
                for first in 0..=COUNT - 16 {
                    let one_by_one: [[f32; 16]; 3] =
                        std::array::from_fn(|axis| std::array::from_fn(|lane| points.get(first + lane)[axis]));
                    let [eights, sixteen] = level.run(Read(points, first));
                    assert_eq!(eights, one_by_one, "{layout} from {first} on, {}", level.name());
                    assert_eq!(sixteen, one_by_one, "{layout} from {first} on, {}", level.name());
                }
            }
        }
    }
}
