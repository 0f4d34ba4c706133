//! Lanes that the processor is to guess.

/// The same lane, below 8, but found by a jump. Where it comes from tests that take long, the processor guesses it and
/// goes on with what lies in that lane, a subtree to visit say, before they are done; a number it would wait for. Rays
/// one after another mostly go the same way: single camera rays take 1/1.14 of the time, up to 1/1.3.
///
/// The way to each lane is as long as that to the others, so no table is read: against the one that a compiler makes of a
/// choice, 1/1.03 of the time (up to 1/1.1; a Xeon, seven scenes).
///
/// This pays where one thing waits for another all the way. Where a packet tests its children one by one, and a tile its
/// triangles, there is enough else to do (0.92 to 1.0).
#[inline(always)]
pub fn guessed(lane: u32) -> usize {
    let lane = (lane & 7) as usize;
    #[cfg(target_arch = "x86_64")]
    let lane = {
        let guess;
        // SAFETY: jumps to the lane's pair of instructions, each of which is padded to eight bytes, and from there to the end.
        unsafe {
            std::arch::asm!(
                "lea {to}, [rip + 2f]",
                "lea {to}, [{to} + 8 * {lane}]",
                "jmp {to}",
                ".p2align 3",
                "2:\n mov {guess:e}, 0\n jmp 3f\n .p2align 3",
                "mov {guess:e}, 1\n jmp 3f\n .p2align 3",
                "mov {guess:e}, 2\n jmp 3f\n .p2align 3",
                "mov {guess:e}, 3\n jmp 3f\n .p2align 3",
                "mov {guess:e}, 4\n jmp 3f\n .p2align 3",
                "mov {guess:e}, 5\n jmp 3f\n .p2align 3",
                "mov {guess:e}, 6\n jmp 3f\n .p2align 3",
                "mov {guess:e}, 7",
                "3:",
                lane = in(reg) lane,
                to = out(reg) _,
                guess = lateout(reg) guess,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        guess
    };
    #[cfg(target_arch = "aarch64")]
    let lane = {
        let guess;
        // SAFETY: jumps to the lane's pair of instructions, each of which has four bytes, and from there to the end.
        unsafe {
            std::arch::asm!(
                "adr {to}, 2f",
                "add {to}, {to}, {lane}, lsl #3",
                "br {to}",
                "2:\n mov {guess}, #0\n b 3f",
                "mov {guess}, #1\n b 3f",
                "mov {guess}, #2\n b 3f",
                "mov {guess}, #3\n b 3f",
                "mov {guess}, #4\n b 3f",
                "mov {guess}, #5\n b 3f",
                "mov {guess}, #6\n b 3f",
                "mov {guess}, #7\n b 3f",
                "3:",
                lane = in(reg) lane,
                to = out(reg) _,
                guess = lateout(reg) guess,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        guess
    };
    lane
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
