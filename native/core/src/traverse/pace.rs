//! Which traverser takes the rays that both could take: the one that was faster when last measured. Answers do not
//! depend on it.

use std::{
    sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed},
    time::Instant,
};

use super::stream;

/// After a measurement its verdict stands for this many rays.
const TERM: usize = 1 << 15;

/// Nanoseconds a ray below which a tile is not compared: no stream was ever that fast on rays that meet anything.
const CHEAP: f64 = 30.0;

/// What one query, on all its threads, has learned of its rays.
#[derive(Debug, Default)]
pub struct Pace {
    streams_are_faster: AtomicBool,
    rays_left: AtomicU32,
}

/// Who is to take the next rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Turn {
    /// A tile, if they make one.
    Tile,
    /// A stream.
    Stream,
    /// Both in turns, to be compared.
    Both,
}

impl Pace {
    /// Who is to take the next rays.
    #[inline]
    fn turn(&self) -> Turn {
        if self.rays_left.load(Relaxed) == 0 {
            Turn::Both
        } else if self.streams_are_faster.load(Relaxed) {
            Turn::Stream
        } else {
            Turn::Tile
        }
    }

    /// Count rays against the term of the last verdict.
    #[inline]
    fn took(&self, rays: usize) {
        let left = self.rays_left.load(Relaxed);
        self.rays_left.store(left.saturating_sub(rays as u32), Relaxed);
    }

    /// A verdict on the next rays.
    fn decide(&self, streams_are_faster: bool) {
        self.streams_are_faster.store(streams_are_faster, Relaxed);
        self.rays_left.store(TERM as u32, Relaxed);
    }
}

/// Tiles that are measured; the fastest counts, for what disturbs a measurement makes it longer.
const TILES: u32 = 2;

/// Rays of the stream that tiles are compared with.
const STREAM: usize = stream::BIN;

/// The part that one batch has in a query's [`Pace`].
pub struct Trial<'p> {
    pace: &'p Pace,
    stage: Stage,
}

#[derive(Debug, Clone, Copy)]
enum Stage {
    /// A verdict stands.
    Serving,
    /// So many tiles have been measured.
    Tiles { count: u32, nanoseconds: f64 },
    /// Tiles took this long a ray, and the stream began then and has taken so many rays.
    Stream { tiles: f64, start: Instant, rays: usize },
}

impl<'p> Trial<'p> {
    /// For a new batch.
    pub fn new(pace: &'p Pace) -> Self {
        Self { pace, stage: Stage::Serving }
    }

    /// Whether the next rays should make a tile, if they can.
    #[inline]
    pub fn wants_tiles(&mut self) -> bool {
        match (self.stage, self.pace.turn()) {
            (Stage::Serving, Turn::Both) => {
                self.stage = Stage::Tiles { count: 0, nanoseconds: f64::INFINITY };
                true
            }
            (Stage::Serving, turn) => turn == Turn::Tile,
            (Stage::Tiles { .. }, _) => true,
            (Stage::Stream { .. }, _) => false,
        }
    }

    /// When a tile begins, if that matters.
    #[inline]
    pub fn start(&self) -> Option<Instant> {
        matches!(self.stage, Stage::Tiles { .. }).then(Instant::now)
    }

    /// A tile of so many rays is done.
    #[inline]
    pub fn traced_tile(&mut self, start: Option<Instant>, rays: usize) {
        if let (Stage::Tiles { count, nanoseconds }, Some(start)) = (self.stage, start) {
            self.stage = Stage::Tiles { count: count + 1, nanoseconds: nanoseconds.min(per_ray(start, rays)) };
        }
    }

    /// Rays were taken, by a tile or a bin; true where all bins are to be traced now.
    #[inline]
    pub fn took(&mut self, count: usize) -> bool {
        match &mut self.stage {
            Stage::Serving => {
                self.pace.took(count);
                false
            }
            Stage::Tiles { count: TILES, nanoseconds } => {
                let tiles = *nanoseconds;
                if tiles > CHEAP {
                    self.stage = Stage::Stream { tiles, start: Instant::now(), rays: 0 };
                    return true;
                }
                self.decide(false);
                false
            }
            Stage::Tiles { .. } => false,
            Stage::Stream { rays, .. } => {
                *rays += count;
                *rays >= STREAM
            }
        }
    }

    /// All bins were traced.
    #[inline]
    pub fn emptied(&mut self) {
        if let Stage::Stream { tiles, start, rays } = &mut self.stage {
            if *rays == 0 {
                *start = Instant::now();
            } else {
                let streams_are_faster = per_ray(*start, *rays) < *tiles;
                self.decide(streams_are_faster);
            }
        }
    }

    fn decide(&mut self, streams_are_faster: bool) {
        self.pace.decide(streams_are_faster);
        self.stage = Stage::Serving;
    }
}

/// Nanoseconds since `start` for each of some rays.
fn per_ray(start: Instant, rays: usize) -> f64 {
    start.elapsed().as_secs_f64() * 1e9 / rays as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_serves_its_term() {
        let pace = Pace::default();
        for (streams_are_faster, turn) in [(true, Turn::Stream), (false, Turn::Tile)] {
            assert_eq!(pace.turn(), Turn::Both);
            pace.decide(streams_are_faster);
            assert_eq!(pace.turn(), turn);
            pace.took(TERM - 1);
            assert_eq!(pace.turn(), turn);
            pace.took(2);
        }
    }

    #[test]
    fn slow_tiles_are_compared_with_a_stream() {
        let pace = Pace::default();
        let mut trial = Trial::new(&pace);
        for count in 0..TILES {
            assert!(trial.wants_tiles() && count < TILES);
            let start = trial.start().and_then(|start| start.checked_sub(std::time::Duration::from_millis(1)));
            trial.traced_tile(start, 8);
            assert_eq!(trial.took(8), count + 1 == TILES);
        }
        trial.emptied();
        assert!(!trial.wants_tiles() && trial.took(STREAM));
        trial.emptied();
        assert_eq!(pace.turn(), Turn::Stream);
        assert!(!trial.wants_tiles());
    }
}
