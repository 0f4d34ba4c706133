//! A parallel radix sort, whose result does not depend on the number of threads: keys are dealt out into a part for each
//! thread, and each part is sorted digit by digit, the least significant first. Threads wait for each other twice. Where
//! every digit was dealt out by all threads together, they did so five times, and two of them took 1.5 times as long over
//! 60 to 900 thousand triangles.

use rayon::prelude::*;

use super::morton::Key;
use crate::{Error, Job, arena::Arena, error};

/// Bits of a coordinate, and of a digit: three coordinates are sorted in three passes. More buckets than a thousand leave
/// the cache nearest to the processor.
pub const DIGIT: u32 = 10;
/// How many digits there are.
pub const BUCKETS: usize = 1 << DIGIT;
const PASSES: usize = 3;

/// Most keys that a thread goes through between two looks at the job: some milliseconds.
pub const STEP: usize = 1 << 20;

/// How many keys have which digits.
#[derive(Debug, Clone)]
pub struct Counts([[u32; BUCKETS]; PASSES]);

impl Counts {
    /// No keys.
    pub const NONE: Self = Self([[0; BUCKETS]; PASSES]);

    /// One more.
    #[inline(always)]
    pub fn add(&mut self, key: Key) {
        for (pass, digits) in self.0.iter_mut().enumerate() {
            digits[key.digit(pass as u32)] += 1;
        }
    }

    /// All keys.
    fn sum(&self) -> usize {
        self.0[0].iter().map(|&count| count as usize).sum()
    }

    fn merge(&mut self, other: &Self) {
        let (all, others) = (self.0.as_flattened_mut(), other.0.as_flattened());
        all.iter_mut().zip(others).for_each(|(count, other)| *count += other);
    }
}

/// The first key of each part but the first.
#[derive(Debug)]
pub struct Splitters(pub Vec<Key>);

impl Splitters {
    /// Which part a key belongs to.
    #[inline(always)]
    pub fn part(&self, key: Key) -> usize {
        self.0.partition_point(|&splitter| splitter <= key)
    }
}

/// Sort keys that stand in chunks of equal length but for the last, given the counts of each chunk by part.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::OutOfMemory`].
pub fn sort(
    mut keys: Arena<Key>,
    mut spare: Arena<Key>,
    splitters: &Splitters,
    counts: &[Vec<Counts>],
    job: &Job,
) -> Result<Arena<Key>, Error> {
    let lengths = counts.iter().map(|parts| parts.iter().map(Counts::sum).collect()).collect::<Vec<Vec<usize>>>();
    if !splitters.0.is_empty() {
        deal(&keys, &mut spare, splitters, &lengths, job)?;
        std::mem::swap(&mut keys, &mut spare);
    }
    let mut parts = error::reserve(splitters.0.len() + 1, "sorting")?;
    let (mut rest, mut room) = (keys.as_mut_slice(), spare.as_mut_slice());
    for part in 0..=splitters.0.len() {
        let length = lengths.iter().map(|lengths| lengths[part]).sum();
        let (mine, others) = rest.split_at_mut(length);
        let (to, left) = room.split_at_mut(length);
        parts.push((mine, to));
        (rest, room) = (others, left);
    }
    parts.into_par_iter().enumerate().try_for_each(|(part, (mut from, mut to))| {
        let mut all = Counts::NONE;
        counts.iter().for_each(|parts| all.merge(&parts[part]));
        for (pass, digits) in all.0.iter().enumerate() {
            scatter(from, to, pass as u32, digits, job)?;
            std::mem::swap(&mut from, &mut to);
        }
        Ok(())
    })?;
    // An odd number of passes.
    Ok(spare)
}

/// Deal the keys of every chunk out into parts; within a part they stay in order.
fn deal(
    from: &[Key],
    mut to: &mut [Key],
    splitters: &Splitters,
    lengths: &[Vec<usize>],
    job: &Job,
) -> Result<(), Error> {
    let mut places: Vec<Vec<&mut [Key]>> = lengths.iter().map(|_| Vec::new()).collect();
    for part in 0..=splitters.0.len() {
        for (places, lengths) in places.iter_mut().zip(lengths) {
            let (place, behind) = to.split_at_mut(lengths[part]);
            places.push(place);
            to = behind;
        }
    }
    let chunk = lengths[0].iter().sum();
    from.par_chunks(chunk).zip(places).try_for_each(|(keys, mut places)| {
        let mut filled = vec![0; places.len()];
        for keys in keys.chunks(STEP) {
            job.check()?;
            // To know how many are in a part takes as long as to have written it. Of two keys at a time, only one waits.
            let mut pairs = keys.chunks_exact(2);
            for pair in pairs.by_ref() {
                let [one, other] = [splitters.part(pair[0]), splitters.part(pair[1])];
                let [first, next] = [filled[one], filled[other] + usize::from(one == other)];
                places[one][first] = pair[0];
                places[other][next] = pair[1];
                filled[one] = first + 1;
                filled[other] = next + 1;
            }
            for &key in pairs.remainder() {
                let part = splitters.part(key);
                places[part][filled[part]] = key;
                filled[part] += 1;
            }
        }
        Ok(())
    })
}

/// Sort by one digit; keys of equal digits stay in order.
fn scatter(from: &[Key], to: &mut [Key], pass: u32, digits: &[u32; BUCKETS], job: &Job) -> Result<(), Error> {
    let mut place = 0;
    let mut places = digits.map(|count| {
        place += count;
        place - count
    });
    for keys in from.chunks(STEP) {
        job.check()?;
        for key in keys {
            let place = &mut places[key.digit(pass)];
            to[*place as usize] = *key;
            *place += 1;
        }
    }
    Ok(())
}
