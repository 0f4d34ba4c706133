//! Lanes that the processor is to guess.

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! arms {
    ($lane:ident: $($number:literal)*, $last:literal) => {
        match $lane {
            $($number => constant!($number),)*
            _ => constant!($last),
        }
    };
}

/// A number of which the compiler does not know that it is constant; every one by another text, so that it does not
/// join what only differs in it.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! constant {
    ($number:literal) => {{
        let number: usize;
        // SAFETY: nothing but a comment.
        unsafe {
            std::arch::asm!(
                concat!("/* lane ", $number, " is {0} */"),
                inout(reg) $number as usize => number,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        number
    }};
}

/// The same lane, below 8, but found by a branch. Where it comes from tests that take long, the processor guesses it and
/// goes on with what lies in that lane, a subtree to visit say, before they are done; a number it would wait for. Rays
/// one after another mostly go the same way: single camera rays take 1/1.14 of the time, up to 1/1.3.
///
/// This pays where one thing waits for another all the way. Where a packet tests its children one by one, and a tile its
/// triangles, there is enough else to do (0.92 to 1.0).
#[inline(always)]
pub fn guessed(lane: u32) -> usize {
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    return arms!(lane: 0 1 2 3 4 5 6, 7);
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    return lane as usize;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guess_is_right_in_the_end() {
        for lane in 0..8 {
            assert_eq!(guessed(lane), lane as usize);
        }
    }
}
