//! A least-recently-used cache of runs, limited in bytes; a run that it does not hold is read back from the store.
//!
//! It does not know which runs exist: only the store does. Next file to read: [`crate::run_cache`].

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use starlings_study::store::RunKey;

use super::remembered::RememberedRun;

/// Runs by key; the least recently used one is dropped first.
pub(crate) struct LruCache {
    /// A run and the time of its last use, counted in uses.
    answers: HashMap<RunKey, (RememberedRun, u64)>,
    by_time: BTreeMap<u64, RunKey>,
    now: u64,
    bytes: usize,
    most: usize,
}

impl LruCache {
    /// An empty cache of at most so many bytes.
    pub(crate) fn new(most: usize) -> Self {
        Self { answers: HashMap::new(), by_time: BTreeMap::new(), now: 0, bytes: 0, most }
    }

    /// A run, where it is held; it becomes the most recently used.
    pub(crate) fn get(&mut self, key: &RunKey) -> Option<RememberedRun> {
        let (answer, asked) = self.answers.get_mut(key)?;
        self.now += 1;
        self.by_time.remove(asked);
        self.by_time.insert(self.now, *key);
        *asked = self.now;
        Some(answer.clone())
    }

    /// Holds a run, and drops others until the limit is kept.
    pub(crate) fn insert(&mut self, key: RunKey, run: RememberedRun) {
        self.remove(&key);
        self.now += 1;
        self.bytes += size(&run);
        self.by_time.insert(self.now, key);
        self.answers.insert(key, (run, self.now));
        while self.bytes > self.most {
            let Some((_, oldest)) = self.by_time.pop_first() else { break };
            self.remove(&oldest);
        }
    }

    fn remove(&mut self, key: &RunKey) {
        if let Some((answer, asked)) = self.answers.remove(key) {
            self.by_time.remove(&asked);
            self.bytes -= size(&answer);
        }
    }
}

/// Bytes of a run and its keys.
fn size(run: &RememberedRun) -> usize {
    let body = run.as_ref().map_or_else(String::len, |outputs: &Arc<Vec<f64>>| 8 * outputs.len());
    body + 4 * size_of::<RunKey>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_asked_for_longest_leaves_when_the_bytes_are_used_up() {
        let answer = |value: f64| -> RememberedRun { Ok(Arc::new(vec![value; 100])) };
        let mut recent = LruCache::new(3 * size(&answer(0.0)));
        for k in 0..3 {
            recent.insert([k; 32], answer(f64::from(k)));
        }
        assert_eq!(recent.get(&[0; 32]), Some(answer(0.0)));
        recent.insert([3; 32], answer(3.0));
        assert_eq!(recent.get(&[1; 32]), None, "the others were asked for later");
        assert_eq!(recent.get(&[0; 32]), Some(answer(0.0)));
        assert!(recent.bytes <= recent.most && recent.answers.len() == 3 && recent.by_time.len() == 3);
        recent.insert([0; 32], Err("none".to_owned()));
        assert_eq!(recent.get(&[0; 32]), Some(Err("none".to_owned())));
        recent.insert([9; 32], Ok(Arc::new(vec![0.0; 1000])));
        assert_eq!((recent.bytes, recent.answers.len()), (0, 0), "one that is too large is not held");
    }
}
