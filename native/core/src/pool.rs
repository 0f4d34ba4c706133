//! Threads. Rayon's are kept from one piece of work to the next: to start one and to fault in what it needs takes 0.1
//! milliseconds, half of the time that a thousand triangles take to build. Work that is cancelled or fails leaves none.

use std::{num::NonZero, sync::Mutex};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;

/// How many threads to use; zero asks for all the machine has.
pub fn thread_count(threads: usize) -> usize {
    if threads > 0 { threads } else { std::thread::available_parallelism().map_or(1, NonZero::get) }
}

/// Threads that have nothing to do.
struct Idle {
    pool: ThreadPool,
    /// Those that were there when the threads were started.
    processors: Vec<usize>,
    /// Threads do not survive a fork.
    process: u32,
}

/// The threads that worked last.
static IDLE: Mutex<Option<Idle>> = Mutex::new(None);

thread_local! {
    /// The calling thread alone, unless it is one of rayon's already. To hand work to another and to wait for it takes 5
    /// to 11 microseconds, a tenth of what a thousand triangles take. Rayon does not give back what it notes about a
    /// thread that it takes in, a few kilobytes.
    static ALONE: Option<ThreadPool> = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().ok();
}

/// Run `work` where rayon's operations use that many threads. One is the calling thread itself; whoever comes while the
/// idle ones are at work gets others.
///
/// # Errors
/// [`Error::OutOfMemory`] where the system refuses the threads, and those of `work`.
pub fn install<R: Send>(threads: usize, work: impl FnOnce() -> Result<R, Error> + Send) -> Result<R, Error> {
    match thread_count(threads) {
        1 => ALONE.with(|alone| match alone {
            Some(pool) => pool.install(work),
            None => install_elsewhere(1, work),
        }),
        count => install_elsewhere(count, work),
    }
}

fn install_elsewhere<R: Send>(count: usize, work: impl FnOnce() -> Result<R, Error> + Send) -> Result<R, Error> {
    let (process, processors) = (std::process::id(), processors());
    // Nobody waits for the lock: a fork may have copied it while it was held.
    let swap = |idle: Option<Idle>| IDLE.try_lock().ok().and_then(|mut kept| std::mem::replace(&mut *kept, idle));
    let pool = match swap(None) {
        // To drop it would be to wake threads that are not there.
        Some(idle) if idle.process != process => {
            std::mem::forget(idle);
            None
        }
        Some(idle) if idle.processors == processors => {
            Some(idle.pool).filter(|pool| pool.current_num_threads() == count)
        }
        _ => None,
    };
    let pool = pool.map_or_else(|| start(count, &processors), Ok)?;
    let result = pool.install(work)?;
    swap(Some(Idle { pool, processors, process }));
    Ok(result)
}

/// New threads. Where there is a processor for each, each is kept to its own: on a virtual machine Linux let two of them
/// share one for milliseconds, which was most or all of a build (`bvh-clusters` over 57 thousand triangles took 6.0 ms on
/// two threads, 5.8 on one, and 3.4 on two that are kept apart). Fewer threads than processors are not kept anywhere: who
/// else is at work may need just those.
fn start(count: usize, processors: &[usize]) -> Result<ThreadPool, Error> {
    let mut builder = ThreadPoolBuilder::new().num_threads(count);
    if processors.len() == count {
        let processors = processors.to_vec();
        builder = builder.start_handler(move |thread| keep_to(processors[thread]));
    }
    builder.build().map_err(|_| Error::OutOfMemory { what: "starting threads", bytes: count << 21 })
}

/// The processors that the calling thread may use; none where the system is not asked.
#[cfg(target_os = "linux")]
fn processors() -> Vec<usize> {
    use rustix::thread::{CpuSet, sched_getaffinity};
    sched_getaffinity(None).map_or_else(
        |_| Vec::new(),
        |allowed| (0..CpuSet::MAX_CPU).filter(|&processor| allowed.is_set(processor)).collect(),
    )
}

/// Keep the calling thread to one processor. Only a hint: a system that refuses lets it run where it did.
#[cfg(target_os = "linux")]
fn keep_to(processor: usize) {
    let mut only = rustix::thread::CpuSet::new();
    only.set(processor);
    let _ = rustix::thread::sched_setaffinity(None, &only);
}

#[cfg(not(target_os = "linux"))]
fn processors() -> Vec<usize> {
    Vec::new()
}

#[cfg(not(target_os = "linux"))]
fn keep_to(_: usize) {}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    fn count() -> Result<usize, Error> {
        Ok(rayon::current_num_threads())
    }

    #[test]
    fn work_gets_the_threads_it_asks_for() {
        for threads in [1, 3, 3, 2, 1] {
            assert_eq!(install(threads, count).unwrap(), threads);
        }
        assert_eq!(install(2, || Ok((install(1, count)?, count()?))).unwrap(), (1, 2));
    }

    #[test]
    fn work_that_comes_together_is_done_side_by_side() {
        let both = std::sync::Barrier::new(2);
        let meet = || install(1, || Ok(both.wait().is_leader())).unwrap();
        std::thread::scope(|scope| {
            let other = scope.spawn(meet);
            assert_ne!(meet(), other.join().unwrap());
        });
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn threads_are_kept_apart_where_each_has_a_processor() {
        let (all, threads) = (processors(), processors().len().max(2));
        let apart = start(threads, &(0..threads).map(|thread| all[thread % all.len()]).collect::<Vec<_>>()).unwrap();
        let kept = apart.broadcast(|context| processors() == [all[context.index() % all.len()]]);
        assert!(kept.into_iter().all(|kept| kept));
        let free = start(threads + 1, &all).unwrap();
        assert!(free.broadcast(|_| processors() == all).into_iter().all(|free| free));
    }

    #[test]
    fn threads_work_after_an_error_and_a_panic() {
        assert!(matches!(install(2, || Err::<(), _>(Error::Cancelled)), Err(Error::Cancelled)));
        let panics = || {
            install(2, || {
                Ok((0..10).into_par_iter().map(|item| 4 - item).filter(|&left| left >= 0 || panic!()).count())
            })
        };
        assert!(std::panic::catch_unwind(panics).is_err());
        assert_eq!(install(2, || Ok((0..10).into_par_iter().sum::<i32>())).unwrap(), 45);
    }
}
