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
    /// See [`Techniques::regular`].
    regular: bool,
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
        Techniques { on: Box::new([!0; SIDES]), regular: true, light_paths: 1.0, connections: 1.0 }
    }

    /// None of them, with one light sub-path per iteration.
    pub fn none() -> Techniques {
        Techniques { on: Box::new([0; SIDES]), regular: true, light_paths: 1.0, connections: 1.0 }
    }

    /// Sets the number of light sub-paths per iteration.
    pub fn set_light_paths(&mut self, light_paths: f32) {
        self.light_paths = light_paths;
    }

    /// The light sub-paths of an iteration that are connected to the lens.
    pub fn light_paths(&self) -> f32 {
        self.light_paths
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
        self.note_regularity();
    }

    fn note_regularity(&mut self) {
        // t = 0 is not a technique, t = 1 one of its own, and lights as such are not told from others by what weights
        // ask: (0, 1) and (1, 1) stand apart.
        let alike = |words: &[u64], mask: u64| {
            words.iter().all(|w| w & mask == words[0] & mask && (w & mask == 0 || w & mask == mask))
        };
        let many = !0b11;
        self.regular = alike(&self.on[0..1], many)
            && alike(&self.on[1..2], many)
            && alike(&self.on[2..], many)
            && alike(&self.on[2..], 0b10);
    }

    /// Techniques of a kind are all used or none of them: hits of lights, next event (t ≥ 2 for both), connections,
    /// splats of surfaces (s ≥ 2 for both).
    #[inline]
    pub fn regular(&self) -> bool {
        self.regular
    }

    /// From text: items separated by commas, each taking effect on what stands before it. `all` and `none` set every
    /// technique; `s:t`, with numbers or `*`, switches on, and with a minus sign off. A list that begins with a
    /// technique to switch on starts from none, any other from all.
    ///
    /// # Errors
    /// If the text is something else.
    pub fn parse(text: &str) -> Result<Techniques, TechniquesError> {
        let mut set = Techniques::all();
        for (i, item) in text.split(',').map(str::trim).enumerate() {
            match item {
                "all" => set.switch(0..SIDES, 0..SIDES, true),
                "none" => set.switch(0..SIDES, 0..SIDES, false),
                _ => {
                    let (on, pair) = match item.strip_prefix('-') {
                        Some(rest) => (false, rest),
                        None => (true, item.strip_prefix('+').unwrap_or(item)),
                    };
                    let parsed = pair.split_once(':').and_then(|(s, t)| Some((range(s)?, range(t)?)));
                    let (s, t) = parsed.ok_or_else(|| TechniquesError(text.into()))?;
                    if i == 0 && on {
                        set.switch(0..SIDES, 0..SIDES, false);
                    }
                    set.switch(s, t, on);
                }
            }
        }
        Ok(set)
    }

    /// n_{s,t}, the samples that the technique takes of every pixel; 0 if it is switched off. Light sub-paths never hit
    /// a lens by chance: t = 0 is not a technique.
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
        for (list, regular) in [
            ("all", true),
            ("none", true),
            ("-1:1", true),
            ("*:1", true),
            ("-0:*", true),
            ("0:*,+1:*,-1:1", true),
            ("-2:2", false),
            ("-3:1", false),
            ("-0:5", false),
            ("none,+63:63", false),
            ("-2:2,+2:2", true),
        ] {
            assert_eq!(t(list).regular(), regular, "{list}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in ["", "some", "1", "1:", "-", "64:1", "1:2:3", "all;1:2"] {
            assert!(Techniques::parse(bad).is_err(), "{bad}");
        }
    }
}
