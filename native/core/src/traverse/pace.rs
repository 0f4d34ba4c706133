//! Which traverser takes the rays that both could take: the one that was faster when last measured. Answers do not
//! depend on it.

use std::{
    sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed},
    time::{Duration, Instant},
};

/// Rays of a short stream, which a traverser of few rays is compared with.
const STREAM: usize = 1 << 10;

/// How two traversers are compared. Rays that keep together from one point or side by side make tiles, the tiles of
/// rays where any hit will do being packets.
#[derive(Debug)]
pub struct Terms {
    /// So many tiles are measured, one after another, and their mean counts.
    tiles: u32,
    /// Rays of the stream that they are compared with.
    stream: usize,
    /// Nanoseconds a ray below which tiles are not compared.
    cheap: f64,
    /// Nanoseconds a ray that are expected of a stream where none was compared.
    unknown: f64,
    /// A tile that takes so many times what a stream is expected to take ends the term: a verdict on the sky is none on
    /// everything else.
    slow: f64,
    /// After a measurement its verdict stands for at most this many rays.
    term: usize,
    /// One for streams stands for this many times the ratio of both times: the more rays, the less it costs to try again.
    retry: usize,
}

/// Camera rays. They see the sky here and a scan there, and tiles may take a tenth of the time of streams or three times
/// it: so both are measured over as many rays, and streams do not serve long. Against verdicts by the faster of two tiles
/// on a Xeon with AVX-512: the room in 1/1.3 to 1/1.6 of the time, reciprocating_saw 1/1.4, dragon 1/1.2, Sponza 1/1.1,
/// bunny2 and Sibenik equal, stadium and hair_straight 1.07 times. Tiles alone: hair 1.5 times.
const TILES: Terms =
    Terms { tiles: 4, stream: STREAM, cheap: 150.0, unknown: 150.0, slow: 4.0, term: 1 << 15, retry: 4 * STREAM };

/// The rays of a small picture. Its tiles cover more, may be slower than streams by ten times, and are soon all traced, so
/// few of them are to be tried, and what begins in the sky is not to be trusted. By the terms above, pictures of 65 to 260
/// thousand rays line by line took 1.25 to 1.5 times as long in the mean over 17 scenes, up to 4 times
/// (reciprocating_saw). With 40 nanoseconds expected instead, blocks of 8 by 8 in Sponza took 1.3 times as long; with 60,
/// ten thousand rays 1.1 times.
const FEW_TILES: Terms =
    Terms { tiles: 2, stream: STREAM, cheap: 30.0, unknown: 50.0, slow: 2.0, term: 1 << 15, retry: 4 * STREAM };

/// Pictures of fewer rays are small. Where all are taken to be, a million rays in blocks took 1.3 times as long in the room
/// and in Sponza, and 1/1.3 in hair_straight.
const FEW: usize = 1 << 18;

/// Fewer rays of which any hit is wanted go in streams. With a limit of [`FEW`], ambient occlusion of 100 to 230 thousand
/// rays took up to 1.9 times as long (hospital).
const LEAST_PACKED: usize = 1 << 16;

/// Where any hit will do: packets and streams differ by less than half, and a stream must be long to show what it can. To
/// gather and sort its rays takes as long as the cheapest packets, which are not compared: they see large triangles, and
/// ambient occlusion there (hospital, vianney, room) takes 1/1.05 to 1/1.09 of the time.
const PACKETS: Terms =
    Terms { tiles: 2, stream: 8 * STREAM, cheap: 20.0, unknown: 150.0, slow: 4.0, term: 1 << 17, retry: 1 << 17 };

/// What one query, on all its threads, has learned of its rays.
#[derive(Debug)]
pub struct Pace {
    terms: &'static Terms,
    streams_are_faster: AtomicBool,
    rays_left: AtomicU32,
    /// Nanoseconds a ray that are expected of a stream.
    stream: AtomicU32,
    is_large: bool,
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
    /// For so many rays of which the closest hits are wanted.
    pub fn closest(rays: usize) -> Self {
        let is_large = rays >= FEW;
        Self { is_large, ..Self::new(if is_large { &TILES } else { &FEW_TILES }) }
    }

    /// Whether the closest hits of so many rays are wanted that they fill the caches, four megabytes: they are then written
    /// past them. So a million camera rays take 1/1.03 to 1/1.1 of the time where they see large triangles,
    /// and as long where they see scans (Zen 5).
    pub fn is_large(&self) -> bool {
        self.is_large
    }

    /// For so many rays of which any hit is wanted. For few of them packets and streams are not compared: it takes some
    /// ten thousand rays.
    pub fn occluded(rays: usize) -> Self {
        if rays < LEAST_PACKED { Self::streams() } else { Self::new(&PACKETS) }
    }

    /// Streams, and nothing is compared.
    pub fn streams() -> Self {
        Self { streams_are_faster: true.into(), rays_left: u32::MAX.into(), ..Self::new(&PACKETS) }
    }

    fn new(terms: &'static Terms) -> Self {
        let (streams_are_faster, rays_left, stream, is_large) = Default::default();
        Self { terms, streams_are_faster, rays_left, stream, is_large }
    }

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

    /// A verdict on the next rays, from the nanoseconds a ray that tiles take and streams are expected to.
    fn decide(&self, tiles: f64, stream: f64) {
        let Terms { term, retry, .. } = *self.terms;
        let retry = (retry as f64 * tiles / stream) as usize;
        let term = if stream < tiles { term.min(retry) } else { term };
        self.streams_are_faster.store(stream < tiles, Relaxed);
        self.stream.store(stream as u32, Relaxed);
        self.rays_left.store(term as u32, Relaxed);
    }

    /// Whether a tile was so slow, in nanoseconds a ray, that its verdict is not to stand.
    fn is_refuted(&self, tile: f64) -> bool {
        tile > self.terms.slow * f64::from(self.stream.load(Relaxed))
    }
}

/// The part that one batch has in a query's [`Pace`].
pub struct Trial<'p> {
    pace: &'p Pace,
    stage: Stage,
    /// When the clock was last looked at, and the rays of the tiles since then, if nothing else was done.
    watch: Option<(Instant, usize)>,
}

/// While a verdict stands, the clock is not looked at behind a tile of fewer visits than this, which is not slow. It takes
/// some thirty nanoseconds, and two looks a tile took 1/20 of the time where tiles see one large thing. A slow tile behind
/// fast ones is timed with them, so the next one may be the first to tell.
const MANY_VISITS: usize = 32;

#[derive(Debug, Clone, Copy)]
enum Stage {
    /// A verdict stands.
    Serving,
    /// So many tiles have been measured; nanoseconds a ray, summed up.
    Tiles { count: u32, nanoseconds: f64 },
    /// Tiles took this long a ray, and the stream began then and has taken so many rays.
    Stream { tiles: f64, start: Instant, rays: usize },
}

impl<'p> Trial<'p> {
    /// For a new batch.
    pub fn new(pace: &'p Pace) -> Self {
        Self { pace, stage: Stage::Serving, watch: None }
    }

    /// Whether the next rays should make a tile, if they can. A measurement begins where no rays wait, `idle`.
    #[inline]
    pub fn wants_tiles(&mut self, idle: bool) -> bool {
        let wanted = match (self.stage, self.pace.turn()) {
            (Stage::Serving, Turn::Both) if !idle => false,
            (Stage::Serving, Turn::Both) => {
                self.stage = Stage::Tiles { count: 0, nanoseconds: 0.0 };
                self.watch = None;
                true
            }
            (Stage::Serving, turn) => turn == Turn::Tile,
            (Stage::Tiles { .. }, _) => true,
            (Stage::Stream { .. }, _) => false,
        };
        if !wanted {
            self.watch = None;
        }
        wanted
    }

    /// A tile begins.
    #[inline]
    pub fn begin_tile(&mut self) {
        if self.watch.is_none() {
            self.watch = Some((Instant::now(), 0));
        }
    }

    /// A tile of so many rays is done, which took so many visits.
    #[inline]
    pub fn traced_tile(&mut self, rays: usize, visits: usize) {
        let Some((start, before)) = self.watch else { return };
        let rays = before + rays;
        if matches!(self.stage, Stage::Serving) && visits < MANY_VISITS {
            self.watch = Some((start, rays));
            return;
        }
        let now = Instant::now();
        self.watch = Some((now, 0));
        let took = per_ray(now - start, rays);
        match self.stage {
            Stage::Tiles { count, nanoseconds } => {
                self.stage = Stage::Tiles { count: count + 1, nanoseconds: nanoseconds + took };
            }
            Stage::Serving if self.pace.is_refuted(took) => {
                self.stage = Stage::Tiles { count: 1, nanoseconds: took };
            }
            _ => {}
        }
    }

    /// A tile made too many visits and was given up: whatever its rays take otherwise, it is a verdict for streams.
    #[inline]
    pub fn gave_up(&mut self) {
        self.watch = None;
        self.stage = Stage::Tiles { count: 1, nanoseconds: f64::INFINITY };
    }

    /// Rays were taken, by a tile or a bin; true where all bins are to be traced now.
    #[inline]
    pub fn took(&mut self, count: usize) -> bool {
        let terms = self.pace.terms;
        match &mut self.stage {
            Stage::Serving => {
                self.pace.took(count);
                false
            }
            // A small picture has no time to measure more of what is as slow as that.
            Stage::Tiles { count, nanoseconds }
                if *count == terms.tiles || *nanoseconds > terms.slow * terms.unknown =>
            {
                let tiles = *nanoseconds / f64::from(*count);
                if tiles > terms.cheap {
                    self.stage = Stage::Stream { tiles, start: Instant::now(), rays: 0 };
                    return true;
                }
                self.decide(tiles, terms.unknown);
                false
            }
            Stage::Tiles { .. } => false,
            Stage::Stream { rays, .. } => {
                *rays += count;
                *rays >= terms.stream
            }
        }
    }

    /// All bins were traced.
    #[inline]
    pub fn emptied(&mut self) {
        self.watch = None;
        if let Stage::Stream { tiles, start, rays } = &mut self.stage {
            if *rays == 0 {
                *start = Instant::now();
            } else {
                let (tiles, stream) = (*tiles, per_ray(start.elapsed(), *rays));
                self.decide(tiles, stream);
            }
        }
    }

    fn decide(&mut self, tiles: f64, stream: f64) {
        self.pace.decide(tiles, stream);
        self.stage = Stage::Serving;
    }
}

/// Nanoseconds for each of some rays.
fn per_ray(duration: Duration, rays: usize) -> f64 {
    duration.as_secs_f64() * 1e9 / rays as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_serves_its_term() {
        let pace = Pace::new(&TILES);
        for (tiles, term, turn) in
            [(200.0, 2 * TILES.retry, Turn::Stream), (1e6, TILES.term, Turn::Stream), (50.0, TILES.term, Turn::Tile)]
        {
            assert_eq!(pace.turn(), Turn::Both);
            pace.decide(tiles, 100.0);
            assert_eq!(pace.turn(), turn);
            pace.took(term - 1);
            assert_eq!(pace.turn(), turn);
            pace.took(2);
        }
    }

    #[test]
    fn slow_tiles_are_compared_with_a_stream() {
        let pace = Pace::new(&TILES);
        streams_win(&pace, &mut Trial::new(&pace));
    }

    #[test]
    fn one_slow_tile_ends_the_term_of_those_before() {
        let pace = Pace::new(&TILES);
        pace.decide(20.0, TILES.unknown);
        let mut trial = Trial::new(&pace);
        trace_tile(&mut trial, Instant::now(), 1 << 40);
        assert!(!trial.took(8));
        streams_win(&pace, &mut trial);
    }

    #[test]
    fn a_slow_tile_among_fast_ones_changes_nothing() {
        let pace = Pace::new(&TILES);
        pace.decide(20.0, 50.0);
        let mut trial = Trial::new(&pace);
        trace_tile(&mut trial, a_millisecond_ago(), 2500); // 400 nanoseconds a ray
        for _ in 0..TILES.tiles {
            assert!(trial.wants_tiles(true) && !trial.took(8));
            trace_tile(&mut trial, Instant::now(), 1 << 40);
        }
        assert_eq!(pace.turn(), Turn::Tile);
    }

    /// A very slow tile, and a stream that is faster.
    fn streams_win(pace: &Pace, trial: &mut Trial<'_>) {
        assert!(trial.wants_tiles(true));
        trace_tile(trial, a_millisecond_ago(), 8);
        assert!(trial.took(8));
        trial.emptied();
        assert!(!trial.wants_tiles(true) && trial.took(TILES.stream));
        trial.emptied();
        assert_eq!(pace.turn(), Turn::Stream);
        assert!(!trial.wants_tiles(true));
    }

    #[test]
    fn a_tile_that_was_given_up_is_compared_with_a_stream() {
        let pace = Pace::new(&TILES);
        pace.decide(20.0, 50.0);
        let mut trial = Trial::new(&pace);
        assert!(trial.wants_tiles(true));
        trial.begin_tile();
        trial.gave_up();
        assert!(trial.took(8));
        trial.emptied();
        assert!(!trial.wants_tiles(true) && trial.took(TILES.stream));
        trial.emptied();
        assert_eq!((pace.turn(), pace.rays_left.load(Relaxed)), (Turn::Stream, TILES.term as u32));
    }

    #[test]
    fn nothing_is_measured_while_rays_wait() {
        let pace = Pace::new(&TILES);
        let mut trial = Trial::new(&pace);
        assert!(!trial.wants_tiles(false));
        assert!(trial.wants_tiles(true));
        assert!(trial.wants_tiles(false));
    }

    #[test]
    fn tiles_of_few_visits_are_timed_together() {
        let pace = Pace::new(&TILES);
        pace.decide(20.0, 50.0);
        let mut trial = Trial::new(&pace);
        trial.watch = Some((a_millisecond_ago(), 0));
        trial.traced_tile(8, MANY_VISITS - 1);
        assert!(!trial.took(8) && trial.wants_tiles(true));
        assert!(matches!((trial.stage, trial.watch), (Stage::Serving, Some((_, 8)))));
        trial.traced_tile(8, MANY_VISITS);
        assert!(matches!((trial.stage, trial.watch), (Stage::Tiles { count: 1, .. }, Some((_, 0)))));
    }

    /// A tile of many visits that began then.
    fn trace_tile(trial: &mut Trial<'_>, start: Instant, rays: usize) {
        trial.watch = Some((start, 0));
        trial.traced_tile(rays, MANY_VISITS);
    }

    fn a_millisecond_ago() -> Instant {
        Instant::now().checked_sub(Duration::from_millis(1)).unwrap()
    }
}
