//! Threads for one piece of work: started with it, joined before it returns.

use std::{num::NonZero, sync::Mutex};

use crate::{Error, Job};

/// How many threads to use; zero asks for all the machine has.
pub fn thread_count(threads: usize) -> usize {
    if threads > 0 { threads } else { std::thread::available_parallelism().map_or(1, NonZero::get) }
}

/// Run `work` where rayon's operations use that many threads.
///
/// # Errors
/// [`Error::OutOfMemory`] where the system refuses the threads.
pub fn install<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> Result<R, Error> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(thread_count(threads));
    builder
        .build_scoped(|thread| thread.run(), |pool| pool.install(work))
        .map_err(|_| Error::OutOfMemory { what: "starting threads", bytes: thread_count(threads) << 21 })
}

/// Hand every item to `work`, on that many threads, in order of their taking; the job may cancel between items.
///
/// # Errors
/// The error of the first item, in their order, that failed among those taken; [`Error::Cancelled`].
pub fn for_each<I: Send>(
    threads: usize,
    items: impl ExactSizeIterator<Item = I> + Send,
    job: &Job,
    work: impl Fn(I) -> Result<(), Error> + Sync,
) -> Result<(), Error> {
    // Asking how many threads there are takes 30 microseconds, ten times a small batch.
    let workers = if items.len() > 1 { thread_count(threads).min(items.len()) } else { 1 };
    let queue = Mutex::new((items.enumerate(), None::<(usize, Error)>));
    let take = || {
        let mut queue = queue.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if queue.1.is_some() { None } else { queue.0.next() }
    };
    let fail = |index: usize, error: Error| {
        let mut queue = queue.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if queue.1.as_ref().is_none_or(|(first, _)| index < *first) {
            queue.1 = Some((index, error));
        }
    };
    let worker = || {
        while let Some((index, item)) = take() {
            if let Err(error) = job.check().and_then(|()| work(item)) {
                fail(index, error);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..workers {
            scope.spawn(worker);
        }
        worker();
    });
    let (_, error) = queue.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    error.map_or(Ok(()), |(_, error)| Err(error))
}
