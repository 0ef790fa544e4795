//! Wall seconds of an iteration by phase, as far as an integrator tells its phases apart.

use std::time::Instant;

/// Most phases that are told apart; further ones are counted with the last.
const MOST: usize = 12;

/// Names and seconds, in the order in which phases were first seen.
#[derive(Clone, Copy, Debug, Default)]
pub struct Phases {
    entries: [(&'static str, f64); MOST],
    len: usize,
}

impl Phases {
    /// Adds seconds to a phase.
    pub fn add(&mut self, name: &'static str, seconds: f64) {
        let known = self.entries[..self.len].iter().position(|e| e.0 == name);
        let i = known.unwrap_or_else(|| {
            if self.len < MOST {
                self.entries[self.len].0 = name;
                self.len += 1;
            }
            self.len - 1
        });
        self.entries[i].1 += seconds;
    }

    /// Runs `f` and counts its wall time; to be called by the thread that leads the iteration, not by its workers.
    pub fn time<T>(&mut self, name: &'static str, f: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let out = f();
        self.add(name, start.elapsed().as_secs_f64());
        out
    }

    /// Adds another iteration's.
    pub fn merge(&mut self, other: &Phases) {
        for (name, seconds) in other.iter() {
            self.add(name, seconds);
        }
    }

    /// Names and seconds.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.entries[..self.len].iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_add_up_by_name() {
        const NAMES: [&str; 14] = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m", "n"];
        let mut phases = Phases::default();
        for name in NAMES.into_iter().chain(["a"]) {
            phases.add(name, 1.0);
        }
        let mut twice = phases;
        twice.merge(&phases);
        let found: Vec<_> = twice.iter().collect();
        assert_eq!(found.len(), MOST);
        assert_eq!((found[0], found[1], found[11]), (("a", 4.0), ("b", 2.0), ("l", 6.0)));
    }
}
