//! Which lights a point is lit by.

use super::{light::Emitter, scene::Scene};

/// Up to this many lights each get a shadow ray per lit point; of more, as many are chosen by their power.
pub const MOST_LIGHTS: usize = 16;

/// The lights of a scene, and how to choose among them.
#[derive(Debug)]
pub struct Choice<'a> {
    emitters: &'a [Emitter],
    /// Sums of importance up to each light, the last 1; empty where every light is taken.
    cumulative: Vec<f32>,
}

impl<'a> Choice<'a> {
    /// Weigh the lights of a scene.
    pub fn new(scene: &'a Scene) -> Self {
        let emitters = scene.emitters();
        let cumulative = if emitters.len() > MOST_LIGHTS { cumulative(scene) } else { Vec::new() };
        Self { emitters, cumulative }
    }

    /// How many lights a point is lit by.
    pub fn count(&self) -> usize {
        self.emitters.len().min(MOST_LIGHTS)
    }

    /// The `number`th light of a point, and the weight of what it gives. Choices are stratified: one random number in 0
    /// to 1 serves all numbers of a point; it is asked for where there is a choice.
    #[inline]
    pub fn pick(&self, number: usize, random: impl FnOnce() -> f32) -> (&'a Emitter, f32) {
        if self.cumulative.is_empty() {
            return (&self.emitters[number], 1.0);
        }
        let place = (number as f32 + random()) / MOST_LIGHTS as f32;
        let index = self.cumulative.partition_point(|&sum| sum <= place).min(self.emitters.len() - 1);
        let below = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        let share = self.cumulative[index] - below;
        (&self.emitters[index], if share > 0.0 { 1.0 / (share * MOST_LIGHTS as f32) } else { 0.0 })
    }
}

fn cumulative(scene: &Scene) -> Vec<f32> {
    let radius = 0.5 * scene.mesh().bounds().extent().length();
    let importance = || scene.emitters().iter().map(|emitter| f64::from(emitter.importance(radius)));
    let total: f64 = importance().sum();
    let sums = importance().scan(0.0, |sum, value| {
        *sum += value / total;
        Some(*sum as f32)
    });
    sums.collect()
}
