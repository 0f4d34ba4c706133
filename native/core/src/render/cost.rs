//! What pixels cost: the traversal steps of their primary rays, counted apart from all timed work.

use std::sync::Mutex;

use super::{
    camera::Window,
    film::TILE,
    lock,
    path::{Context, primary_rays},
    queue::RayQueue,
};
use crate::{Error, error, traverse::probe::Counts, work};

/// Steps of every pixel, mean per sample.
pub fn steps(context: &Context<'_>) -> Result<Vec<f32>, Error> {
    let window = context.camera.window();
    let picture = Mutex::new(error::filled(window.count(), 0.0, "the cost of the picture")?);
    work::for_each(context.settings.threads, window.tiles(TILE).into_iter(), context.job, |tile| {
        let sums = tile_steps(context, tile)?;
        let mut picture = lock(&picture);
        for (index, sum) in sums.into_iter().enumerate() {
            picture[window.index(tile.pixel(index))] = sum as f32 / context.settings.samples as f32;
        }
        Ok(())
    })?;
    Ok(picture.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner))
}

fn tile_steps(context: &Context<'_>, tile: Window) -> Result<Vec<u64>, Error> {
    let mut sums = vec![0; tile.count()];
    let mut counts = vec![Counts::default(); tile.count()];
    let mut rays = RayQueue::default();
    for sample in 0..context.settings.samples {
        context.job.check()?;
        rays.clear();
        primary_rays(context, tile, sample).for_each(|ray| rays.push(&ray, ()));
        context.tracer.counted(&rays.rays()?, &mut counts)?;
        sums.iter_mut().zip(&counts).for_each(|(sum, count)| *sum += u64::from(count.steps));
        context.job.advance(tile.count() as u64);
    }
    Ok(sums)
}
