//! Which techniques make paths, and how many samples each takes.
//!
//! A technique (s, t) joins s vertices of a light sub-path and t of an eye sub-path to a path of s + t − 1 edges.

use std::ops::Range;

/// Techniques with more vertices on a side than this share the switch of the last.
const SIDES: usize = 64;

/// A set of techniques.
#[derive(Clone, Debug, PartialEq)]
pub struct Techniques {
    /// Bit t of word s.
    on: Box<[u64; SIDES]>,
    /// Light sub-paths per iteration, the samples of each technique with t = 1.
    light_paths: f32,
    /// Samples of each technique with s ≥ 2 and t ≥ 2.
    connections: f32,
}

/// A list of techniques that cannot be understood.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "\"{0}\" is not a list of techniques: expected all, none, or items such as +2:3, -0:* or *:1 (light : eye vertices)"
)]
pub struct TechniquesError(String);

impl Techniques {
    /// All of them, with one light sub-path per iteration.
    pub fn all() -> Techniques {
        Techniques { on: Box::new([!0; SIDES]), light_paths: 1.0, connections: 1.0 }
    }

    /// None of them, with one light sub-path per iteration.
    pub fn none() -> Techniques {
        Techniques { on: Box::new([0; SIDES]), light_paths: 1.0, connections: 1.0 }
    }

    /// Sets the number of light sub-paths per iteration.
    pub fn set_light_paths(&mut self, light_paths: f32) {
        self.light_paths = light_paths;
    }

    /// Sets the number of samples that an eye vertex takes of each connection with s ≥ 2.
    pub fn set_connections(&mut self, connections: f32) {
        self.connections = connections;
    }

    /// Switches the techniques with these numbers of vertices on or off.
    pub fn switch(&mut self, s: Range<usize>, t: Range<usize>, on: bool) {
        let mask = (t.start..t.end.min(SIDES)).fold(0u64, |m, t| m | 1 << t);
        for word in &mut self.on[s.start.min(SIDES)..s.end.min(SIDES)] {
            if on { *word |= mask } else { *word &= !mask }
        }
    }

    /// From text: items separated by commas, each taking effect on what stands before it. `all` and `none` set every technique;
    /// `s:t`, with numbers or `*`, switches on, and with a minus sign off. A list that begins with a technique to switch on starts
    /// from none, any other from all.
    ///
    /// # Errors
    /// If the text is something else.
    pub fn parse(text: &str) -> Result<Techniques, TechniquesError> {
        let mut set = Techniques::all();
        for (i, item) in text.split(',').map(str::trim).enumerate() {
            match item {
                "all" => set.on.fill(!0),
                "none" => set.on.fill(0),
                _ => {
                    let (on, pair) = match item.strip_prefix('-') {
                        Some(rest) => (false, rest),
                        None => (true, item.strip_prefix('+').unwrap_or(item)),
                    };
                    let parsed = pair.split_once(':').and_then(|(s, t)| Some((range(s)?, range(t)?)));
                    let (s, t) = parsed.ok_or_else(|| TechniquesError(text.into()))?;
                    if i == 0 && on {
                        set.on.fill(0);
                    }
                    set.switch(s, t, on);
                }
            }
        }
        Ok(set)
    }

    /// n_{s,t}, the samples that the technique takes of every pixel; 0 if it is switched off. Light sub-paths never hit a lens by
    /// chance: t = 0 is not a technique.
    #[inline]
    pub fn count(&self, s: usize, t: usize) -> f32 {
        let bit = self.on[s.min(SIDES - 1)] >> t.min(SIDES - 1) & 1;
        match t {
            _ if bit == 0 => 0.0,
            0 => 0.0,
            1 => self.light_paths,
            _ if s >= 2 => self.connections,
            _ => 1.0,
        }
    }

    /// True if the technique is used.
    #[inline]
    pub fn uses(&self, s: usize, t: usize) -> bool {
        self.count(s, t) > 0.0
    }

    /// Most vertices that an eye sub-path of any technique has.
    pub fn most_eye_vertices(&self) -> usize {
        match self.on.iter().fold(0, |all, w| all | w) {
            0 => 0,
            all if all >> (SIDES - 1) & 1 == 1 => usize::MAX,
            all => all.ilog2() as usize,
        }
    }

    /// True if some technique with t = 1 is used: a light image is needed.
    pub fn uses_light_image(&self) -> bool {
        self.on[1..].iter().any(|w| w & 0b10 != 0)
    }

    /// True if some technique connects two sub-paths: s ≥ 2 and t ≥ 2.
    pub fn uses_connections(&self) -> bool {
        self.on[2..].iter().any(|w| w & !0b11 != 0)
    }

    /// True if some technique needs light sub-paths.
    pub fn uses_light_paths(&self) -> bool {
        self.uses_light_image() || self.uses_connections()
    }

    /// True if some technique needs eye sub-paths.
    pub fn uses_eye_paths(&self) -> bool {
        self.on.iter().any(|w| w & !0b11 != 0)
    }
}

/// Numbers of vertices that an item names.
fn range(text: &str) -> Option<Range<usize>> {
    if text == "*" {
        return Some(0..SIDES);
    }
    text.parse().ok().filter(|&n: &usize| n < SIDES).map(|n| n..n + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_switch_techniques() {
        let t = |text: &str| Techniques::parse(text).unwrap();
        assert_eq!(t("all"), Techniques::all());
        let mut all = t("all");
        all.set_light_paths(100.0);
        assert_eq!((all.count(3, 1), all.count(3, 2)), (100.0, 1.0));
        assert_eq!(t("all").count(3, 0), 0.0);
        assert!(t("*:1").uses(7, 1) && !t("*:1").uses(7, 2) && !t("*:1").uses_eye_paths());
        assert!(!t("-0:*").uses(0, 5) && t("-0:*").uses(1, 5));
        assert!(t("2:3").uses(2, 3) && !t("2:3").uses(2, 4) && !t("2:3").uses_light_image());
        assert!(t("none,+1:2").uses(1, 2) && !t("none,+1:2").uses_light_paths());
        assert!(t("all").uses(100, 100) && !t("-63:63").uses(100, 100));
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in ["", "some", "1", "1:", "-", "64:1", "1:2:3", "all;1:2"] {
            assert!(Techniques::parse(bad).is_err(), "{bad}");
        }
    }
}
