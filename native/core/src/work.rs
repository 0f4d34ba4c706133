//! Work that threads take from a queue, item by item, each as it gets done with the last: no item holds up others.

use std::{
    cmp::Reverse,
    sync::{Mutex, MutexGuard, PoisonError},
};

use crate::{Error, Job, pool};

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
    let workers = if items.len() > 1 { pool::thread_count(threads).min(items.len()) } else { 1 };
    let queue = Queue::new(items.enumerate(), job);
    let worker = || queue.drain(|_, item| work(item));
    std::thread::scope(|scope| {
        for _ in 1..workers {
            scope.spawn(worker);
        }
        worker();
    });
    queue.end()
}

/// What `work` makes of every item, in their order, on rayon's threads, each with a room of its own. Several threads take
/// the largest items first, so that none begins with a large one when the others are done; the job may cancel between
/// items.
///
/// # Errors
/// The error of the first item, in their order, that failed among those taken; [`Error::Cancelled`].
pub fn largest_first<I: Send, W: Default, R: Send>(
    items: impl Iterator<Item = I>,
    size: impl Fn(&I) -> usize,
    job: &Job,
    work: impl Fn(&mut W, I) -> Result<R, Error> + Sync,
) -> Result<Vec<R>, Error> {
    let mut items: Vec<(usize, I)> = items.enumerate().collect();
    let workers = rayon::current_num_threads().min(items.len());
    if workers > 1 {
        items.sort_by_key(|(_, item)| Reverse(size(item)));
    }
    let made = Mutex::new(Vec::with_capacity(items.len()));
    let queue = Queue::new(items.into_iter(), job);
    let worker = || {
        let mut room = W::default();
        queue.drain(|index, item| {
            let result = work(&mut room, item)?;
            locked(&made).push((index, result));
            Ok(())
        });
    };
    rayon::scope(|scope| {
        for _ in 1..workers {
            scope.spawn(|_| worker());
        }
        worker();
    });
    queue.end()?;
    let mut made = made.into_inner().unwrap_or_else(PoisonError::into_inner);
    made.sort_unstable_by_key(|&(index, _)| index);
    Ok(made.into_iter().map(|(_, result)| result).collect())
}

/// Numbered items that are left, and the error of that with the lowest number.
struct Queue<'a, I> {
    state: Mutex<(I, Option<(usize, Error)>)>,
    job: &'a Job,
}

impl<'a, T, I: Iterator<Item = (usize, T)>> Queue<'a, I> {
    fn new(items: I, job: &'a Job) -> Self {
        Self { state: Mutex::new((items, None)), job }
    }

    /// Work on items until none is left or one has failed.
    fn drain(&self, mut work: impl FnMut(usize, T) -> Result<(), Error>) {
        while let Some((index, item)) = self.take() {
            if let Err(error) = self.job.check().and_then(|()| work(index, item)) {
                self.fail(index, error);
            }
        }
    }

    fn take(&self) -> Option<(usize, T)> {
        let (items, error) = &mut *locked(&self.state);
        if error.is_some() { None } else { items.next() }
    }

    fn fail(&self, index: usize, error: Error) {
        let (_, first) = &mut *locked(&self.state);
        if first.as_ref().is_none_or(|(first, _)| index < *first) {
            *first = Some((index, error));
        }
    }

    fn end(self) -> Result<(), Error> {
        let (_, error) = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        error.map_or(Ok(()), |(_, error)| Err(error))
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

    use super::*;

    const SIZES: [usize; 5] = [3, 1, 4, 1, 5];

    #[test]
    fn what_is_made_stands_in_the_order_of_the_items() {
        for threads in [1, 2, 7] {
            let taken = AtomicUsize::new(0);
            let work = |room: &mut Vec<usize>, size: usize| {
                room.push(size);
                Ok((size, taken.fetch_add(1, Relaxed), room.len()))
            };
            let make = || largest_first(SIZES.into_iter(), |&size| size, &Job::new(), work);
            let made = pool::install(threads, make).unwrap();
            assert!(made.iter().map(|&(size, ..)| size).eq(SIZES));
            // Alone, a thread takes them as they come, and has one room for all.
            assert!(
                threads > 1 || made.iter().enumerate().all(|(index, made)| *made == (SIZES[index], index, index + 1))
            );
        }
    }

    #[test]
    fn the_largest_are_taken_first() {
        // Whoever has the largest waits until somebody else has taken the rest.
        let left = AtomicUsize::new(SIZES.len() - 1);
        let work = |_: &mut (), size| {
            while size == 5 && left.load(Relaxed) > 0 {
                std::thread::yield_now();
            }
            left.fetch_sub(1, Relaxed);
            Ok(())
        };
        assert_eq!(pool::install(2, || largest_first(SIZES.into_iter(), |&s| s, &Job::new(), work)).unwrap().len(), 5);
    }

    #[test]
    fn errors_and_cancelled_jobs_end_it() {
        let (going, cancelled) = (Job::new(), Job::new());
        cancelled.cancel();
        let fail = |&size: &usize| if size == 4 { Err(Error::Config("four".into())) } else { Ok(()) };
        for threads in [1, 3] {
            let run = |job| pool::install(threads, || largest_first(SIZES.iter(), |&&s| s, job, |(), size| fail(size)));
            assert!(matches!(run(&going), Err(Error::Config(_))));
            assert!(matches!(run(&cancelled), Err(Error::Cancelled)));
            assert!(matches!(for_each(threads, SIZES.iter(), &going, fail), Err(Error::Config(_))));
            assert!(matches!(for_each(threads, SIZES.iter(), &cancelled, fail), Err(Error::Cancelled)));
        }
    }
}
