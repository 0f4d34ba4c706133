//! Rays of a packet that are few enough for one vector, and go on below a node as a packet of their own. A packet of four
//! vectors has seven to twenty-six rays left before a leaf, in whatever lanes, and tests all of its lanes.
//!
//! Against packets without (Zen 5, ambient occlusion) vianney, hospital and the room took 1/1.05 to 1/1.2 of the time;
//! where streams are faster than packets, nothing changed. To find the box around the segments anew, for it may be smaller:
//! as long (1/1.06 and 1/1.07 against before).

use super::{
    alone::Alone,
    rays::{Packet, RAYS},
    walk::{Few, Walk},
};
use crate::{
    accel::structure::{NodeRef, View},
    simd::Simd,
};

/// In one vector, and where that would be almost empty, one by one. For instruction sets that have sixteen lanes in one
/// register; others have nothing to pick lanes from four vectors with.
pub struct Narrow;

impl Few for Narrow {
    const FEW: u32 = RAYS as u32 + 1;

    #[inline(always)]
    fn below<S: Simd, const GRIDS: bool, const PARTS: usize>(
        walk: &mut Walk<'_, S>,
        packet: &Packet<S, PARTS>,
        (here, node): (View<'_>, NodeRef),
        going: u64,
    ) -> u64 {
        // More of them have come to a grid.
        if !(Alone::FEW..Self::FEW).contains(&going.count_ones()) {
            return Alone::below::<S, GRIDS, PARTS>(walk, packet, (here, node), going);
        }
        let narrow = packet.narrow(walk.simd, going);
        let all = (1 << going.count_ones()) - 1;
        let (mut found, mut hit) = (walk.below::<GRIDS, 1, Alone>(&narrow, (here, node), all), 0);
        while found != 0 {
            hit |= 1 << narrow.place(found.trailing_zeros() as usize);
            found &= found - 1;
        }
        hit
    }
}

#[cfg(test)]
mod tests {
    use crate::simd::{Kernel, Level, Simd};

    /// The places of a set, and what stands there in a table of the numbers from 100 on.
    struct Picked(u64);

    impl Kernel for Picked {
        type Output = ([u32; 16], [f32; 16]);
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let table: [[f32; 16]; 4] = bytemuck::cast(std::array::from_fn::<f32, 64, _>(|place| 100.0 + place as f32));
            let places = simd.places(self.0);
            let picked = simd.pick(table.each_ref().map(|row| simd.load_wide(row)), &places);
            (places, simd.store_wide(picked))
        }
    }

    #[test]
    fn the_places_of_a_set_are_picked_in_order() {
        for level in Level::available() {
            for set in [1, 1 << 63, 0xffff, 0xffff << 48, 0x8000_4000_2000_1001, 0x1111_1111_1111_1111, u64::MAX] {
                let expected: Vec<u32> = (0..64).filter(|place| set >> place & 1 == 1).take(16).collect();
                let (places, picked) = level.run(Picked(set));
                assert_eq!(places[..expected.len()], expected, "{} {set:x}", level.name());
                let numbers: Vec<f32> = places.iter().map(|&place| 100.0 + place as f32).collect();
                assert_eq!(picked[..], numbers, "{} {set:x}", level.name());
            }
        }
    }
}
