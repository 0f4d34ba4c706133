//! The paper's sampled rule with its open parameter, the number of rays per node, answered: rays are traced in rounds
//! until the verdict is certain, so that clear nodes take few and doubtful ones many. Sequential testing is Wald's
//! ("Sequential Tests of Statistical Hypotheses", Annals of Mathematical Statistics 16(2), 1945). In place of his two
//! fixed hypotheses, which would need a margin that somebody must choose, a round asks whether an interval around what
//! was seen leaves the threshold out; the error that is allowed is shared evenly by all rounds and by both quantities,
//! so that looking again and again does not add up to more than was asked for (Bonferroni).

use super::{
    config::Config,
    decision::Decision,
    grid::BuiltGrid,
    hybrid::{Inquiry, Judge},
    sample::{Evidence, Samples},
    subtree::Walker,
};
use crate::{Error, ray::MISS};

/// Rays of the first round; every later one doubles the rays so far.
const FIRST: usize = 32;

/// After this many rounds, 4,096 rays, the verdict is taken as it stands: a node that is still in doubt is so near to a
/// threshold that either verdict is as good.
const ROUNDS: u32 = 8;

/// Decides as [`Sampled`](super::hybrid::Sampled) does, on as many rays as certainty takes.
#[derive(Debug, Clone, Copy)]
pub struct Sequential;

impl Judge for Sequential {
    fn judge(&self, inquiry: &Inquiry<'_>, index: usize, decision: &mut Decision) -> Result<Option<BuiltGrid>, Error> {
        let z = normal_quantile((1.0 - inquiry.config.confidence) / f64::from(4 * ROUNDS));
        let mut walker = Walker::new(inquiry.tree, inquiry.mesh, &inquiry.domain);
        let mut evidence = Evidence::default();
        for round in 0..ROUNDS {
            inquiry.job.check()?;
            evidence = evidence.and(&inquiry.round(index, round, &mut walker)?);
            if is_certain(&evidence, inquiry.config, z) {
                break;
            }
        }
        inquiry.by_evidence(index, &evidence, decision)
    }
}

impl Inquiry<'_> {
    /// What the rays of one round tell, which are others in every round.
    fn round(&self, index: usize, round: u32, walker: &mut Walker<'_>) -> Result<Evidence, Error> {
        let count = FIRST << round.saturating_sub(1);
        let seed = self.config.seed ^ u64::from(round) << 56;
        let samples = Samples::new(&self.tree.nodes[index].bounds, count, seed, index);
        let frames = self.frames(&samples)?;
        let hits: Vec<bool> = frames.iter().map(|frame| walker.trace::<true>(index, frame).primitive != MISS).collect();
        Ok(samples.evidence(|ray| hits[ray]))
    }
}

/// Whether more rays would not change the verdict, but for chances `z` standard deviations out.
fn is_certain(evidence: &Evidence, config: &Config, z: f64) -> bool {
    let [least_share, most_share] = share_interval(evidence, z);
    let [least_spread, most_spread] = spread_interval(evidence, z);
    let is_uniform = least_share >= config.hit_threshold && most_spread <= config.spread_threshold;
    is_uniform || most_share < config.hit_threshold || least_spread > config.spread_threshold
}

/// Where the true share of hits lies: Wilson, "Probable Inference, the Law of Succession, and Statistical Inference",
/// Journal of the American Statistical Association 22(158), 1927.
fn share_interval(evidence: &Evidence, z: f64) -> [f64; 2] {
    let (rays, share) = (evidence.rays as f64, evidence.share());
    let (centre, weight) = (share + z * z / (2.0 * rays), 1.0 + z * z / rays);
    let reach = z * (share * (1.0 - share) / rays + z * z / (4.0 * rays * rays)).sqrt();
    [(centre - reach) / weight, (centre + reach) / weight]
}

/// Where the true index of dispersion lies, if what was seen is that index times chi-squared over its degrees of
/// freedom; its quantiles after Wilson and Hilferty, "The Distribution of Chi-Square", PNAS 17(12), 1931.
fn spread_interval(evidence: &Evidence, z: f64) -> [f64; 2] {
    let width = 2.0 / (9.0 * evidence.freedom.max(1) as f64);
    let quantile = |z: f64| (1.0 - width + z * width.sqrt()).max(0.0).powi(3);
    let most = if evidence.spread == 0.0 { 0.0 } else { evidence.spread / quantile(-z) };
    [evidence.spread / quantile(z), most]
}

/// How many standard deviations out a share of `tail` of a normal distribution lies, for tails below a half, within
/// 5e-4: Abramowitz and Stegun, "Handbook of Mathematical Functions", 26.2.23.
fn normal_quantile(tail: f64) -> f64 {
    let t = (-2.0 * tail.ln()).sqrt();
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let below = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    t - above / below
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evidence(rays: usize, hits: usize, spread: f64) -> Evidence {
        Evidence { rays, hits, spread, freedom: rays / 8 }
    }

    #[test]
    fn quantiles_are_those_of_tables() {
        for (tail, expected) in [(0.025, 1.959_964), (0.001, 3.090_232), (1e-5, 4.264_891)] {
            assert!((normal_quantile(tail) - expected).abs() < 5e-4, "{tail}");
        }
    }

    #[test]
    fn intervals_narrow_around_what_was_seen() {
        let mut widths = [f64::INFINITY; 2];
        for rays in [32, 128, 512, 4096] {
            let seen = evidence(rays, rays * 3 / 4, 1.5);
            for (interval, value, width) in
                [(share_interval(&seen, 3.0), 0.75, 0), (spread_interval(&seen, 3.0), 1.5, 1)]
            {
                assert!(interval[0] < value && value < interval[1]);
                assert!(interval[1] - interval[0] < widths[width]);
                widths[width] = interval[1] - interval[0];
            }
        }
    }

    #[test]
    fn clear_nodes_need_few_rays_and_doubtful_ones_many() {
        let config = Config::default();
        assert!(is_certain(&evidence(32, 5, 1.0), &config, 3.0));
        assert!(is_certain(&evidence(512, 490, 0.9), &config, 3.0));
        assert!(is_certain(&evidence(512, 490, 9.0), &config, 3.0));
        assert!(!is_certain(&evidence(32, 30, 1.0), &config, 3.0));
        assert!(!is_certain(&evidence(4096, 3277, 1.0), &config, 3.0));
        assert!(is_certain(&evidence(256, 256, 0.0), &config, 3.0));
    }
}
