//! Numbers that choose among what is there.

use std::collections::{BTreeMap, BTreeSet};

pub(super) fn choose<T: Ord + Copy>(from: &BTreeSet<T>, which: usize) -> Option<T> {
    (!from.is_empty()).then(|| *from.iter().nth(which % from.len()).expect("within the length"))
}

pub(super) fn pick<K: Ord, V>(from: &BTreeMap<K, V>, which: usize) -> Option<(&K, &V)> {
    (!from.is_empty()).then(|| from.iter().nth(which % from.len()).expect("within the length"))
}
