//! Embree's side of a race: its devices, its scenes, each built once, and its calls over whole batches.

use std::{cell::RefCell, collections::HashMap, rc::Rc};

use espalier_core::{Hits, Job, work};

use crate::{
    embree::{Call, Device, Embree, Scene},
    error::Error,
    plan::{Kind, Plan, Quality, Query},
    rays::RayColumns,
    scene::Scene as BenchScene,
};

/// Rays that a thread takes at once where there are several.
const PART: usize = 8192;

/// One way to use Embree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Way {
    /// Index of the device.
    pub device: usize,
    /// How it builds.
    pub quality: Quality,
    /// How it traces.
    pub call: Call,
}

/// See the module's text.
pub struct Rivals<'a> {
    scene: &'a BenchScene<'a>,
    devices: &'a [Device<'a>],
    built: RefCell<HashMap<(usize, Quality), Rc<Scene<'a>>>>,
}

/// The devices of a plan: of the instruction set it asks for, or of all that this processor has.
///
/// # Errors
/// [`Error::Embree`].
pub fn devices<'a>(embree: &'a Embree, plan: &Plan) -> Result<Vec<Device<'a>>, Error> {
    let all = ["avx512", "avx2"].map(|isa| (isa, embree.device(plan.threads, isa)));
    match plan.isa.as_deref() {
        Some(wanted) => all.into_iter().filter(|(isa, _)| *isa == wanted).map(|(_, device)| device).collect(),
        None => {
            let (devices, mut errors): (Vec<_>, Vec<_>) =
                all.into_iter().map(|(_, device)| device).partition(Result::is_ok);
            if devices.is_empty() {
                errors.swap_remove(0).map(|device| vec![device])
            } else {
                devices.into_iter().collect()
            }
        }
    }
}

impl<'a> Rivals<'a> {
    /// No scene yet.
    pub fn new(scene: &'a BenchScene<'a>, devices: &'a [Device<'a>]) -> Self {
        Self { scene, devices, built: RefCell::default() }
    }

    /// As results name it: `avx512 medium 16c`, or `avx512 medium` where nothing is traced.
    pub fn name(&self, way: Way, kind: Kind) -> String {
        let build = format!("{} {}", self.devices[way.device].isa, way.quality.name());
        if matches!(kind, Kind::Build | Kind::Memory) { build } else { format!("{build} {}", way.call.name()) }
    }

    /// Every way to trace with these builds.
    pub fn ways(&self, qualities: &[Quality], kind: Kind) -> Vec<Way> {
        let calls: &[Call] = match kind {
            Kind::Single | Kind::Build | Kind::Memory => &Call::ALL[..1],
            Kind::Batch | Kind::Image => &Call::ALL,
        };
        let devices = 0..self.devices.len();
        let builds = devices.flat_map(|device| qualities.iter().map(move |&quality| (device, quality)));
        builds.flat_map(|(device, quality)| calls.iter().map(move |&call| Way { device, quality, call })).collect()
    }

    /// A new scene.
    ///
    /// # Errors
    /// [`Error::Embree`].
    pub fn build(&self, device: usize, quality: Quality) -> Result<Scene<'a>, Error> {
        self.devices[device].build(&self.scene.arrays, quality)
    }

    /// Bytes that Embree allocates for a new scene and keeps.
    ///
    /// # Errors
    /// [`Error::Embree`].
    pub fn bytes(&self, device: usize, quality: Quality) -> Result<usize, Error> {
        let before = self.devices[device].bytes();
        let _scene = self.build(device, quality)?;
        Ok((self.devices[device].bytes() - before).unsigned_abs())
    }

    /// The scene of a device and quality.
    ///
    /// # Errors
    /// [`Error::Embree`].
    pub fn get(&self, device: usize, quality: Quality) -> Result<Rc<Scene<'a>>, Error> {
        if let Some(scene) = self.built.borrow().get(&(device, quality)) {
            return Ok(scene.clone());
        }
        let scene = Rc::new(self.build(device, quality)?);
        self.built.borrow_mut().insert((device, quality), scene.clone());
        Ok(scene)
    }
}

/// Trace a batch.
///
/// # Errors
/// None of Embree's; [`Error::Core`] never.
pub fn trace(
    scene: &Scene<'_>,
    rays: &RayColumns,
    query: Query,
    call: Call,
    threads: usize,
    answer: &mut Answer,
) -> Result<(), Error> {
    let job = Job::new();
    match query {
        Query::Closest => {
            work::for_each(threads, answer.hits.as_mut().parts(PART).enumerate(), &job, |(part, mut hits)| {
                scene.closest(rays, part * PART, &mut hits, call);
                Ok(())
            })?
        }
        Query::Any => work::for_each(threads, answer.blocked.chunks_mut(PART).enumerate(), &job, |(part, blocked)| {
            scene.occluded(rays, part * PART, blocked, call);
            Ok(())
        })?,
    }
    Ok(())
}

/// Room for the answers to a batch, either query's.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Closest hits.
    pub hits: Hits,
    /// Whether anything was in the way.
    pub blocked: Vec<bool>,
}

impl Answer {
    /// For `count` rays.
    pub fn new(count: usize) -> Self {
        Self { hits: Hits::misses(count), blocked: vec![false; count] }
    }
}
