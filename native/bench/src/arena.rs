//! Where a class is measured: who races over what, and whether their answers agree.

use std::{cell::RefCell, num::NonZero, time::Duration};

use espalier_core::{Accelerator, Hits, Job, Method, Rays, traverse::probe::Counts, work};

use crate::{
    embree::Device,
    error::Error,
    plan::{Class, Kind, Quality, Query},
    race::{Contender, Length, Run, Side, fastest, race, timed},
    rays::RayColumns,
    rivals::{Answer, Rivals, Way, trace},
    row::{Row, Turn, Unit},
    scene::{Built, Scene, new_mesh},
    verify::{self, Comparison},
};

/// Rounds of Embree's builds that are only shown.
const ROUNDS_BESIDE: usize = 3;

/// Rays whose steps and tests are counted.
const SAMPLE: usize = 256;

/// Both sides over one scene.
pub struct Arena<'a> {
    scene: &'a Scene<'a>,
    rivals: Rivals<'a>,
    built: Built<'a>,
}

/// A class with its rays, and room for answers.
struct Course<'c> {
    class: &'c Class,
    rays: RayColumns,
    answer: RefCell<Answer>,
}

impl<'a> Arena<'a> {
    /// An arena for a scene.
    pub fn new(scene: &'a Scene<'a>, devices: &'a [Device<'a>]) -> Self {
        Self { scene, rivals: Rivals::new(scene, devices), built: Built::new(scene) }
    }

    /// Measure a class: a row for each of our methods.
    ///
    /// # Errors
    /// Those of either side.
    pub fn measure(&self, class: &Class) -> Result<Vec<Row>, Error> {
        let course = self.course(class)?;
        let methods = class.methods.iter().map(|name| Method::from_name(name));
        let methods = methods.collect::<Result<Vec<_>, _>>()?;
        let ours = methods.iter().map(|&method| (Side::Ours(method), self.our_run(&course, method)));
        let theirs = self.rivals.ways(&class.rival, class.kind).into_iter();
        let theirs = theirs.map(|way| (Side::Rival(way), self.rival_run(&course, way)));
        let field = race(ours.chain(theirs).collect(), self.length(class))?;
        let rival = fastest(&field).ok_or_else(|| Error::Plan(format!("class {} has no rival", class.name)))?;
        let beside = self.beside(&course, rival.0)?;
        let row = |method| -> Result<Row, Error> {
            let ours = field.iter().find(|contender| contender.side == Side::Ours(method)).map(|ours| ours.best);
            Ok(Row {
                scene: self.scene.plan.scene.name.clone(),
                class: class.name.clone(),
                method: method.name(),
                isa: self.scene.level().name(),
                embree_call: self.rivals.name(rival.0, class.kind),
                rays: course.rays.len(),
                triangles: self.scene.mesh.triangles().len(),
                comparison: self.compare(&course, method, rival.0)?,
                ..Row::of(Unit::new(class.kind, course.rays.len()), ours.unwrap_or(Duration::MAX), rival.1, &beside)
            })
        };
        methods.iter().map(|&method| row(method)).collect()
    }

    /// Measure a class without Embree: a row for each of our methods, whose hits are those of its last round.
    ///
    /// # Errors
    /// Those of our side.
    pub fn turns(&self, class: &Class) -> Result<Vec<Turn>, Error> {
        let methods = class.methods.iter().map(|name| Method::from_name(name)).collect::<Result<Vec<_>, _>>()?;
        let courses = methods.iter().map(|_| self.course(class)).collect::<Result<Vec<_>, _>>()?;
        let field = methods.iter().zip(&courses);
        let field = field.map(|(&method, course)| (Side::Ours(method), self.our_run(course, method)));
        let field = race(field.collect(), self.length(class))?;
        let turn = |((&method, course), contender): ((&Method, &Course<'_>), &Contender<'_>)| -> Result<Turn, Error> {
            let (first, own) = (courses[0].answer.borrow(), course.answer.borrow());
            let comparison = verify::closest(&self.scene.mesh, &course.rays, &own.hits, &first.hits);
            let (steps, tests) = self.work(course, method)?;
            Ok(Turn {
                scene: self.scene.plan.scene.name.clone(),
                class: class.name.clone(),
                method: method.name(),
                isa: self.scene.level().name(),
                seconds: contender.best.as_secs_f64(),
                rays: course.rays.len(),
                hits: comparison.hits,
                mismatches: comparison.mismatches,
                steps,
                tests,
            })
        };
        methods.iter().zip(&courses).zip(&field).map(turn).collect()
    }

    /// Steps and tests of the first rays of a course, in the mean; none of no rays.
    fn work(&self, course: &Course<'_>, method: Method) -> Result<(f64, f64), Error> {
        let mut counts = vec![Counts::default(); course.rays.len().min(SAMPLE)];
        if counts.is_empty() {
            return Ok((0.0, 0.0));
        }
        let sample = course.rays.rays().part(0, SAMPLE);
        self.built.get(method)?.counted(&sample, &mut counts, self.scene.plan.threads, &Job::new())?;
        let mean = |count: fn(&Counts) -> u32| {
            counts.iter().map(|counts| f64::from(count(counts))).sum::<f64>() / counts.len() as f64
        };
        Ok((mean(|counts| counts.steps), mean(|counts| counts.tests)))
    }

    fn length(&self, class: &Class) -> Length {
        let plan = self.scene.plan;
        // Bytes are the same every time.
        let rounds = if class.kind == Kind::Memory { 1 } else { plan.rounds };
        Length { rounds, time: Duration::from_secs_f64(plan.seconds), ours_hopeless: plan.hopeless }
    }

    fn course<'c>(&self, class: &'c Class) -> Result<Course<'c>, Error> {
        let rays = match class.kind {
            Kind::Build | Kind::Memory => RayColumns::default(),
            _ => self.scene.rays(class.rays, &self.built)?,
        };
        let answer = RefCell::new(Answer::new(rays.len()));
        Ok(Course { class, rays, answer })
    }

    /// Embree's other builds, by the way that is best otherwise.
    fn beside(&self, course: &Course<'_>, best: Way) -> Result<Vec<(&'static str, Duration)>, Error> {
        let length = Length { rounds: ROUNDS_BESIDE, ..self.length(course.class) };
        let time = |&quality: &Quality| {
            let way = Way { quality, ..best };
            let field = race(vec![(Side::Rival(way), self.rival_run(course, way))], length)?;
            Ok((quality.name(), fastest(&field).map_or(Duration::MAX, |(_, time)| time)))
        };
        course.class.beside.iter().map(time).collect()
    }

    fn our_run<'r>(&'r self, course: &'r Course<'_>, method: Method) -> Run<'r> {
        let (scene, threads) = (self.scene, self.scene.plan.threads);
        let trace = move |accelerator: &Accelerator| -> Result<(), Error> {
            trace_ours(accelerator, &course.rays, course.class, threads, &mut course.answer.borrow_mut())
        };
        Box::new(move || match course.class.kind {
            Kind::Batch | Kind::Single => {
                let accelerator = self.built.get(method)?;
                done(timed(threads, || trace(&accelerator)))
            }
            Kind::Build => done(timed(threads, || scene.build(scene.mesh.clone(), method))),
            Kind::Image => done(timed(threads, || {
                let accelerator = scene.build(new_mesh(&scene.arrays)?, method)?;
                trace(&accelerator).map(|()| accelerator)
            })),
            Kind::Memory => Ok(Unit::weigh(self.built.get(method)?.structure().bytes())),
        })
    }

    fn rival_run<'r>(&'r self, course: &'r Course<'_>, way: Way) -> Run<'r> {
        let (rivals, threads, query) = (&self.rivals, self.scene.plan.threads, course.class.query);
        let trace = move |scene: &_| -> Result<(), Error> {
            trace(scene, &course.rays, query, way.call, threads, &mut course.answer.borrow_mut())
        };
        Box::new(move || match course.class.kind {
            Kind::Batch | Kind::Single => {
                let scene = rivals.get(way.device, way.quality)?;
                done(timed(threads, || trace(&scene)))
            }
            Kind::Build => done(timed(threads, || rivals.build(way.device, way.quality))),
            Kind::Image => done(timed(threads, || {
                let scene = rivals.build(way.device, way.quality)?;
                trace(&scene).map(|()| scene)
            })),
            Kind::Memory => Ok(Unit::weigh(rivals.bytes(way.device, way.quality)?)),
        })
    }

    fn compare(&self, course: &Course<'_>, method: Method, way: Way) -> Result<Comparison, Error> {
        let (rays, class, threads) = (&course.rays, course.class, self.scene.plan.threads);
        if rays.len() == 0 {
            return Ok(Comparison::default());
        }
        let (ours, theirs) = (self.built.get(method)?, self.rivals.get(way.device, way.quality)?);
        let answers = |query| -> Result<[Answer; 2], Error> {
            let mut answers = [Answer::new(rays.len()), Answer::new(rays.len())];
            trace_ours(&ours, rays, &Class { query, ..class.clone() }, threads, &mut answers[0])?;
            trace(&theirs, rays, query, way.call, threads, &mut answers[1])?;
            Ok(answers)
        };
        let [mine, their] = answers(Query::Closest)?;
        if class.query == Query::Closest {
            return Ok(verify::closest(&self.scene.mesh, rays, &mine.hits, &their.hits));
        }
        let nearest = [&mine.hits, &their.hits];
        let [mine, their] = answers(Query::Any)?;
        Ok(verify::any(&self.scene.mesh, rays, &mine.blocked, &their.blocked, nearest))
    }
}

/// The time of work that succeeded. What it made is freed here, after the time was taken.
fn done<T>((time, made): (Duration, Result<T, Error>)) -> Result<Duration, Error> {
    made.map(|_| time)
}

/// Trace a batch with our side, as its class asks.
///
/// # Errors
/// [`Error::Core`].
pub fn trace_ours(
    ours: &Accelerator,
    columns: &RayColumns,
    class: &Class,
    threads: usize,
    answer: &mut Answer,
) -> Result<(), Error> {
    let (job, rays) = (Job::new(), columns.rays());
    let batch = if class.kind == Kind::Single { Some(1) } else { class.batch.map(NonZero::get) };
    match (class.query, batch) {
        (Query::Closest, None) => ours.closest(&rays, answer.hits.as_mut(), threads, &job)?,
        (Query::Closest, Some(1)) => one_by_one(ours, columns, threads, &mut answer.hits)?,
        (Query::Closest, Some(size)) => in_calls(ours, &rays, size, threads, &mut answer.hits)?,
        (Query::Any, None) => ours.occluded(&rays, &mut answer.blocked, threads, &job)?,
        (Query::Any, Some(_)) => return Err(Error::Plan("rays in batches are closest-hit queries".into())),
    }
    Ok(())
}

/// All rays by calls of `size` each.
fn in_calls(
    ours: &Accelerator,
    rays: &Rays<'_>,
    size: usize,
    threads: usize,
    hits: &mut Hits,
) -> Result<(), espalier_core::Error> {
    for (call, hits) in hits.as_mut().parts(size).enumerate() {
        ours.closest(&rays.part(call * size, size), hits, threads, &Job::new())?;
    }
    Ok(())
}

/// Every ray by a call of its own.
fn one_by_one(
    ours: &Accelerator,
    rays: &RayColumns,
    threads: usize,
    hits: &mut Hits,
) -> Result<(), espalier_core::Error> {
    const PART: usize = 8192;
    let tracer = ours.tracer();
    work::for_each(threads, hits.as_mut().parts(PART).enumerate(), &Job::new(), |(part, mut hits)| {
        let mut walker = tracer.walker();
        for index in 0..hits.len() {
            hits.set(index, walker.first(&rays.get(part * PART + index))?);
        }
        Ok(())
    })
}
