//! Interleaved timing: every round runs every contender once, so that whatever disturbs the machine disturbs all.

use std::time::{Duration, Instant};

use espalier_core::Method;

use crate::{error::Error, rivals::Way};

/// Who it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// A method of ours.
    Ours(Method),
    /// A way to use Embree.
    Rival(Way),
}

/// Does its work once and says how long the part that counts took.
pub type Run<'a> = Box<dyn FnMut() -> Result<Duration, Error> + 'a>;

/// Something to be timed again and again.
pub struct Contender<'a> {
    /// Who it is.
    pub side: Side,
    /// Least time so far.
    pub best: Duration,
    run: Run<'a>,
    is_out: bool,
}

/// How long a race lasts.
#[derive(Debug, Clone, Copy)]
pub struct Length {
    /// How many rounds; if several, more of them until [`Length::SHORT`] is over.
    pub rounds: usize,
    /// It ends after the round in which this much time has passed, but not before round [`Length::LEAST`].
    pub time: Duration,
    /// After the first two rounds, those of ours that take this many times as long as the fastest of all take no more
    /// part; their times stay. Without it all of ours run to the end.
    pub ours_hopeless: Option<f64>,
}

impl Length {
    const LEAST: usize = 3;

    /// What takes less than a millisecond needs many rounds until its code and its memory are where they will be, on
    /// either side.
    const SHORT: Duration = Duration::from_secs(1);

    fn is_over(&self, rounds: usize, time: Duration) -> bool {
        let is_short = self.rounds > 1 && time < Self::SHORT;
        (rounds >= self.rounds && !is_short) || (rounds >= Self::LEAST && time > self.time)
    }
}

/// After the first two rounds, ways of Embree this much slower than the fastest leave the race.
const HOPELESS: f64 = 1.15;

/// Run the field in turns; ways of Embree that cannot win leave early.
///
/// # Errors
/// The first error of any contender.
pub fn race(field: Vec<(Side, Run<'_>)>, length: Length) -> Result<Vec<Contender<'_>>, Error> {
    let contender = |(side, run)| Contender { side, best: Duration::MAX, run, is_out: false };
    let mut field: Vec<_> = field.into_iter().map(contender).collect();
    let start = Instant::now();
    for round in 0.. {
        if length.is_over(round, start.elapsed()) {
            break;
        }
        for contender in field.iter_mut().filter(|contender| !contender.is_out) {
            contender.best = contender.best.min((contender.run)()?);
        }
        if round == 1 {
            let limit = fastest(&field).map_or(Duration::MAX, |(_, best)| best.mul_f64(HOPELESS));
            field.retain(|contender| matches!(contender.side, Side::Ours(_)) || contender.best <= limit);
            let least = field.iter().map(|contender| contender.best).min().unwrap_or(Duration::MAX);
            let slow = length.ours_hopeless.map_or(Duration::MAX, |times| least.mul_f64(times));
            field.iter_mut().for_each(|contender| contender.is_out = contender.best > slow);
        }
    }
    Ok(field)
}

/// The fastest way of Embree, and its time.
pub fn fastest(field: &[Contender<'_>]) -> Option<(Way, Duration)> {
    let ways = field.iter().filter_map(|contender| match contender.side {
        Side::Rival(way) => Some((way, contender.best)),
        Side::Ours(_) => None,
    });
    ways.min_by_key(|&(_, best)| best)
}

/// How long `work` takes, and what it gives.
///
/// On one thread that is the time the process spent on a processor: what other processes take on a shared machine does
/// not count. On several threads it is the time on the clock.
pub fn timed<T>(threads: usize, work: impl FnOnce() -> T) -> (Duration, T) {
    if threads > 1 {
        let start = Instant::now();
        let result = work();
        return (start.elapsed(), result);
    }
    let start = processor_time();
    let result = work();
    (processor_time().saturating_sub(start), result)
}

#[cfg(unix)]
fn processor_time() -> Duration {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec.unsigned_abs(), now.tv_nsec.unsigned_abs() as u32)
}

#[cfg(not(unix))]
fn processor_time() -> Duration {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}
